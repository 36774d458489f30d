"""Random finite element bodies of every cell, with interfaces, mode set, frame, damping and units of their own."""

from dataclasses import dataclass, replace

import numpy as np

import cms
import fe_models as fm
from fe_models.body.fe_body import FEBody, Interface
from fe_models.body.loads import nodal_load
from fe_models.elements.beams.attachments import PointMass, Spring
from fe_models.foundation.units import UNIT_SYSTEMS, Units
from fe_models.meshes.line_mesh import LineMesh
from fe_models.meshes.mesh import Mesh
from tests.bodies import box_mesh

__all__ = ["BodyCase", "random_body"]

SOLIDS = (
    "tetra", "tetra10", "hexahedron", "hexahedron20", "hexahedron27", "wedge", "wedge15", "pyramid", "pyramid13",
)  # fmt: skip
SETS = (
    "guyan", "craig-bampton", "craig-bampton-ir", "herting", "rubin", "macneal", "craig-chang",
    "dual-craig-bampton", "attachment", "unrestrained-attachment", "normal",
)  # fmt: skip


@dataclass(frozen=True)
class BodyCase:
    """A body that is not coupled yet, and how it is reduced."""

    body: FEBody
    set_name: str
    n_modes: int
    frame: object
    damping: object
    mass: float | None  #: that the body has; None: not known here
    words: str


def random_body(seed: int) -> BodyCase:
    """Return the case of a seed."""
    rng = np.random.default_rng(seed)
    units = UNIT_SYSTEMS[str(rng.choice(sorted(UNIT_SYSTEMS)))]
    kind = str(rng.choice([*SOLIDS, *SOLIDS, "beams", "beams", "beams", "quad", "triangle"]))
    size = 10 ** rng.uniform(-3, 1.5) / units.length
    E, rho = 10 ** rng.uniform(6, 11.5), 10 ** rng.uniform(1.5, 4)
    stress, density = units.mass / (units.length * units.time**2), units.mass / units.length**3
    material = fm.Material("stuff", E / stress, float(rng.uniform(0, 0.45)), rho / density)
    turn, offset = np.linalg.qr(rng.normal(size=(3, 3)))[0], size * rng.normal(size=3) * 10 ** rng.uniform(-1, 1.5)
    turn *= np.sign(np.linalg.det(turn))

    def placed(points):
        bent = points + 0.08 * np.sin(2.1 * points[:, [1, 2, 0]] + rng_phase) * points[:, [2, 0, 1]]
        return size * bent @ turn.T + offset

    rng_phase = rng.uniform(0, 6, size=3)
    makers = {"beams": frame_of_beams, "quad": shell, "triangle": shell}
    body, mass = makers.get(kind, solid)(rng, kind, material, placed, size, units)
    loads = {int(node): rng.normal(size=3) for node in rng.choice(np.unique(body.dofs[:, 0]), 2, replace=False)}
    body = body.with_load_cases(nodal_load(body, "push", loads))
    name = str(rng.choice(SETS))
    if name == "guyan" and len(body.interfaces) == 1:  # its columns are the rigid motions
        name = "craig-bampton"
    ports = [each.name for each in body.interfaces if each.kind != "nodes"]
    frames = [None, cms.TisserandFrame(), cms.reduction.BuckensFrame(), *(cms.NodalFrame(port) for port in ports)]
    omega = float(np.sqrt(material.E / material.rho) / size)
    dampings = [None, cms.reduction.RayleighDamping(0.03 * omega, 0.01 / omega), cms.reduction.ModalDamping(0.02)]
    n_modes = 0 if name == "guyan" else int(rng.integers(1, 9))
    frame, damping = (each[int(rng.integers(len(each)))] for each in (frames, dampings))
    words = (
        f"{kind}, {body.n_dof} dofs, {units.name}, size {size:.3g}, "
        f"{', '.join(each.kind for each in body.interfaces)}, {name} {n_modes}, {type(frame).__name__}, "
        f"{type(damping).__name__}"
    )
    return BodyCase(body, name, n_modes, frame, damping, mass, words)


def interface_of(rng, name, kind, nodes, members, size) -> Interface:
    """Return an interface on some nodes, its reference point a little off their middle, its triad turned."""
    triad = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    triad *= np.sign(np.linalg.det(triad))
    if kind == "nodes":
        members = members[:1] if rng.random() < 0.3 else members[: int(rng.integers(3, 5))]
        return Interface(name, kind, members, nodes[members].mean(axis=0), triad)
    return Interface(name, kind, members, nodes[members].mean(axis=0) + 0.1 * size * rng.normal(size=3), triad)


def solid(rng, kind, material, placed, size, units: Units):
    """Return a bent box of solids; its volume is not known here."""
    is_fine = kind in ("tetra", "hexahedron", "wedge", "pyramid")
    n = rng.integers([2, 1, 1], 4) if is_fine else rng.integers(1, 3, size=3)
    mesh = box_mesh(*n, *rng.uniform(0.3, 1.2, size=3), kind)
    mesh = Mesh(placed(mesh.nodes), mesh.cells, node_sets=mesh.node_sets)
    sides = [("left", mesh.node_sets["left"]), ("right", mesh.node_sets["right"])]
    sides = sides[: int(rng.integers(1, 3))]
    kinds = rng.choice(["rigid", "distributing", "nodes"], size=len(sides), p=[0.45, 0.35, 0.2])
    ports = [
        interface_of(rng, name, str(k), mesh.nodes, members, size)
        for (name, members), k in zip(sides, kinds, strict=True)
    ]
    return fm.solid_body(mesh, material, name="solid", units=units, interfaces=ports), None


def shell(rng, kind, material, placed, size, units: Units):
    """Return a plate."""
    n, m = rng.integers(2, 5, size=2)
    mesh = fm.shells.mapped_shell(lambda u, v: np.stack([u, 0.7 * v, 0 * u], axis=1), int(n) + 1, int(m), kind=kind)
    edges = [np.flatnonzero(mesh.nodes[:, 0] == x) for x in (0.0, mesh.nodes[:, 0].max())]
    inner = np.flatnonzero((mesh.nodes[:, 0] > 0.1) & (mesh.nodes[:, 0] < 0.9))
    nodes = size * (mesh.nodes @ np.linalg.qr(rng.normal(size=(3, 3)))[0].T + rng.normal(size=3))
    mesh = replace(mesh, nodes=nodes)
    t = size * 10 ** rng.uniform(-2, -1)
    sides = {"rigid": edges[1], "distributing": inner}
    ports = [
        interface_of(rng, "left", "rigid", nodes, edges[0], size),
        interface_of(rng, "right", k := str(rng.choice(list(sides))), nodes, sides[k], size),
    ]
    body = fm.shell_body(
        mesh,
        fm.shells.ShellProperty(t, material),
        name="shell",
        units=units,
        interfaces=ports[: int(rng.integers(1, 3))],
    )
    return body, material.rho * t * 0.7 * size**2


def frame_of_beams(rng, kind, material, placed, size, units: Units):
    """Return a bent line of beams with a branch, point masses, and a spring with a dashpot."""
    n = int(rng.integers(4, 8))
    points = np.vstack([np.linspace([0, 0, 0], [1, 0.3, 0.2], n), [0.5, 1.0, 0.4], [0.6, 1.2, 1.0]])
    points[1 : n - 1] += 0.05 * rng.normal(size=(n - 2, 3))
    nodes = placed(points)
    lines = np.array([*([k, k + 1] for k in range(n - 1)), [n // 2, n], [n, n + 1]])
    d = size * 10 ** rng.uniform(-2, -1)
    section = fm.beams.Circle(d / 2) if rng.random() < 0.5 else fm.beams.Rectangle(d, 1.5 * d)
    area = np.pi * d**2 / 4 if isinstance(section, fm.beams.Circle) else 1.5 * d**2
    length = np.linalg.norm(np.diff(nodes[lines], axis=1)[:, 0], axis=1).sum()
    beams = material.rho * area * length
    heavy = [
        PointMass(int(node), float(beams * rng.uniform(0.1, 2)), tuple(beams * d**2 * rng.uniform(1, 3, size=3)))
        for node in rng.choice(n, int(rng.integers(0, 3)), replace=False)
    ]
    stiffness = material.E * area / size * 10 ** rng.uniform(-3, 0)
    springs = [
        Spring((0, n + 1), (stiffness,) * 3 + (stiffness * size**2,) * 3, damping=(1e-3 * stiffness * units.time,) * 6)
    ] if rng.random() < 0.4 else []  # fmt: skip
    ends = [Interface(name, "nodes", np.array([node]), nodes[node]) for name, node in (("left", 0), ("right", n - 1))]
    if rng.random() < 0.4:
        members = np.array([n, n + 1])
        ends[1] = Interface("right", "rigid", members, nodes[members].mean(axis=0) + 0.1 * size)
    body = fm.beam_body(
        LineMesh(nodes, lines), fm.beams.BeamProperty(section, material), name="frame", units=units,
        interfaces=ends[: int(rng.integers(1, 3))], point_masses=heavy, springs=springs,
    )  # fmt: skip
    return body, beams + sum(each.mass for each in heavy)
