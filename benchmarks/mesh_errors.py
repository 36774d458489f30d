"""Estimated errors of free frequencies by the mesh against those of a much finer mesh of the same geometry; and cost.

python -m benchmarks.mesh_errors                  # 60 bodies: some minutes
python -m benchmarks.mesh_errors --cost 12        # a bar of 48 x 12 x 12 bricks of tet10, 50 modes
python -m benchmarks.mesh_errors --shell 150      # a panel of 150 x 105 quads
"""

import argparse
import itertools
import logging
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np
from scipy.spatial import cKDTree

import fe_models as fm
from cms.modes.families.families import Families
from cms.modes.mode_sets import MODE_SETS
from cms.reduction.basis.free_basis import free_basis
from cms.reduction.mesh_error import frequency_errors, loaded_nodes
from cms.reduction.reduction import reduce
from fe_models.body.fe_body import FEBody, Interface
from fe_models.elements.recovery.mesh_error import energy_errors
from fe_models.foundation.arrays import Array
from fe_models.meshes.mesh import Mesh, drop_unused_nodes
from tests.bodies import STEEL, bar, box_mesh
from tests.mindlin_plate import free_plate_eigenvalues

N_MODES = 8  #: judged modes of each body
LEAST, LARGE, MOST = 1e-5, 1e-3, 0.5  #: true errors that are counted: below, the reference is not exact enough
SAME = 0.8  #: modal assurance criterion, above which two shapes are those of one mode
SI = fm.unit_system("m-kg-s")


@dataclass(frozen=True)
class Case:
    """A geometry that can be meshed at several sizes."""

    name: str
    body: Callable[[], FEBody]  #: the judged mesh
    fine: Callable[[], FEBody] | Array  #: a much finer mesh, or exact eigenvalues


def solid(mesh: Mesh, **options: object) -> FEBody:
    """Return a free body of steel."""
    return fm.solid_body(mesh, STEEL, name="solid", units=SI, **options)


def skewed(mesh: Mesh) -> Mesh:
    """Return the mesh sheared and tapered, in general position; straight edges stay straight."""
    x, y, z = mesh.nodes.T
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    nodes = np.stack([x + 0.3 * y, y, z + 0.2 * x], axis=1) @ turn.T + [3.0, -2.0, 1.0]
    return replace(mesh, nodes=nodes)


def angle(n: int, kind: str) -> Mesh:
    """Return an L with a re-entrant edge, n bricks across each leg."""
    mesh = box_mesh(3 * n, 3 * n, n, 0.3, 0.3, 0.1, kind)
    cells = mesh.cells[kind]
    center = mesh.nodes[cells].mean(axis=1)
    stays = (center[:, 0] < 0.1) | (center[:, 1] < 0.1)
    return drop_unused_nodes(Mesh(mesh.nodes, {kind: cells[stays]}))


def clamped(n: int, kind: str) -> FEBody:
    """Return a bar with rigid ends, whose rims are singular."""
    return fm.couple(bar(nx=4 * n, ny=n, nz=n, length=0.4, width=0.1, height=0.1, kind=kind))


def plate(n: int, kind: str, bend: float = 0.0, fold: float = 0.0, thickness: float = 0.02) -> FEBody:
    """Return a plate, a cylindrical panel or a plate with a fold, of shells in general position; n a multiple of 10."""

    def place(u: Array, v: Array) -> Array:
        return np.stack([u, 0.7 * v, bend * u * (1 - u) + fold * np.minimum(u, 1 - u)], axis=1)

    mesh = fm.shells.mapped_shell(place, n, (7 * n) // 10, kind=kind)
    turn = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
    return fm.shell_body(
        replace(mesh, nodes=mesh.nodes @ turn.T), fm.shells.ShellProperty(thickness, STEEL), name="plate", units=SI
    )


def cases() -> Iterator[Case]:
    """Yield the bodies."""
    shapes: dict[str, Callable[[int, str], Mesh]] = {
        "beam": lambda n, kind: box_mesh(8 * n, n, n, 0.8, 0.1, 0.08, kind),
        "skew block": lambda n, kind: skewed(box_mesh(2 * n, 2 * n, n, 0.2, 0.24, 0.1, kind)),
        "plate": lambda n, kind: box_mesh(5 * n, 4 * n, 1, 0.5, 0.4, 0.01, kind),
        "angle": angle,
    }
    fine = {"beam": 4, "skew block": 6, "plate": 4, "angle": 6}
    second = {"beam": 1, "skew block": 2, "plate": 1, "angle": 2}
    first = {"beam": 2, "skew block": 3, "plate": 2, "angle": 2}
    for name, shape in shapes.items():
        kinds = ["tetra", "hexahedron", "wedge", "tetra10", "hexahedron20", "wedge15"]
        if name in ("beam", "skew block"):
            kinds += ["pyramid", "hexahedron27", "pyramid13"]
        for kind in kinds:
            is_first = kind in ("tetra", "hexahedron", "wedge", "pyramid")
            n = first[name] if is_first else second[name]
            yield Case(
                f"{name} {kind}",
                lambda shape=shape, n=n, kind=kind: solid(shape(n, kind)),
                lambda shape=shape, n=fine[name]: solid(shape(n, "hexahedron20")),
            )
        yield Case(
            f"{name} incompatible",
            lambda shape=shape, n=first[name]: solid(shape(n, "hexahedron"), incompatible_modes=True),
            lambda shape=shape, n=fine[name]: solid(shape(n, "hexahedron20")),
        )
        yield Case(
            f"{name} reduced",
            lambda shape=shape, n=2 * second[name]: solid(shape(n, "hexahedron20"), integration="reduced"),
            lambda shape=shape, n=fine[name]: solid(shape(n, "hexahedron20")),
        )
    for kind in ("tetra10", "hexahedron20"):
        yield Case(f"rigid ends {kind}", lambda kind=kind: clamped(2, kind), lambda: clamped(6, "hexahedron20"))
    shells: dict[str, dict[str, float]] = {
        "shell": {}, "panel": {"bend": 0.6}, "fold": {"fold": 0.8}, "thin shell": {"thickness": 0.004},
        "thick shell": {"thickness": 0.06},
    }  # fmt: skip
    for kind, (name, options) in itertools.product(("quad", "triangle"), shells.items()):
        fine: Callable[[], FEBody] | Array = cache(lambda kind=kind, options=options: plate(120, kind, **options))
        if not {"bend", "fold"} & set(options):
            fine = free_plate_eigenvalues((1.0, 0.7), options.get("thickness", 0.02), STEEL, N_MODES)
        for n in (10, 20):
            coarse = partial(plate, n, kind, **options)
            yield Case(f"{name} {kind} {n}", coarse, fine)


def free_modes(body: FEBody, n: int) -> tuple[Array, Array]:
    """Return omega² and shapes of the lowest n elastic free modes."""
    with Families(body, announce=False) as families:
        found = families.free_modes(n)
    return found.omega2[:n], found.Phi[:, :n]


def judged(case: Case) -> tuple[Array, Array, str]:
    """Return true and estimated errors of frequencies, and "shells" or why their sign is not known ("": it is).

    Modes whose shapes the fine mesh does not have are left out.
    """
    body = case.body()
    omega2, Phi = free_modes(body, N_MODES)
    found = energy_errors(body.element_model, body.mesh_displacement(Phi), omega2, loaded_nodes(body))
    kind = "shells" if found.is_signed else found.nonconforming
    if not callable(case.fine):
        return np.sqrt(omega2 / case.fine) - 1, frequency_errors(found, omega2), kind
    fine = case.fine()
    exact, shapes = free_modes(fine, 2 * N_MODES)
    away, near = cKDTree(fine.nodes).query(body.nodes)
    same = np.flatnonzero(away < 1e-6 * body.length)
    own, other = (
        each.translations(u)[rows].reshape(3 * len(rows), -1)
        for each, u, rows in ((body, Phi, same), (fine, shapes, near[same]))
    )
    own, other = own / np.linalg.norm(own, axis=0), other / np.linalg.norm(other, axis=0)
    mac = (own.T @ other) ** 2
    best = mac.argmax(axis=1)
    is_same = mac.max(axis=1) > SAME
    true = np.sqrt(omega2 / exact[best]) - 1
    return true[is_same], frequency_errors(found, omega2)[is_same], kind


def print_judged() -> None:
    """Print the effectivity, estimate over true error, of every body and of each kind of elements."""
    found: dict[str, list[Array]] = {}
    large: dict[str, list[Array]] = {}
    print(f"{'body':26s}{'true %':>20s}{'ratio':>16s}{'counted':>9s}")
    for case in cases():
        true, estimate, kind = judged(case)
        is_counted = (np.abs(true) > LEAST) & (np.abs(true) < MOST)
        ratio = estimate[is_counted] / (true if kind == "shells" else np.abs(true))[is_counted]
        spans = [f"{span.min():.2g} .. {span.max():.2g}" if len(span) else "" for span in (100 * true, ratio)]
        print(f"{case.name:26s}{spans[0]:>20s}{spans[1]:>16s}{len(ratio):9d}", flush=True)
        if len(ratio):
            found.setdefault(kind or "conforming solids", []).append(ratio)
            large.setdefault(kind or "conforming solids", []).append(ratio[np.abs(true[is_counted]) > LARGE])
    for kind, ratios in found.items():
        every, medians = np.concatenate(ratios), np.array([np.median(ratio) for ratio in ratios])
        shares = [
            f"{100 * np.mean((x >= 0.5) & (x <= 2)):.0f} % of {len(x)}"
            for x in (every, medians, np.concatenate(large[kind]))
        ]
        print(
            f"{kind}: in [0.5, 2] {shares[0]} frequencies, from {every.min():.2g} to {every.max():.2g}; medians of "
            f"{shares[1]} bodies, from {medians.min():.2g} to {medians.max():.2g}; "
            f"of errors above {LARGE:g}: {shares[2]}"
        )


def print_cost(body: FEBody, n_modes: int) -> None:
    """Print the processor time of the estimates beside that of the reduction."""
    seconds = {}
    with Families(body) as families:
        began = time.process_time()
        modes = MODE_SETS["craig-bampton"](families, n_modes=n_modes)
        reduce(families, modes, errors=False)
        seconds["set and reduction"] = time.process_time() - began
        basis = free_basis(body, modes, families)
    from cms.reduction.mesh_error import mesh_errors

    mesh_errors(body, basis, 1)  # compiles
    began = time.process_time()
    found = mesh_errors(body, basis, min(n_modes, len(basis.frequencies())))
    seconds["mesh errors"] = time.process_time() - began
    print(f"{body.n_dof} dofs, {len(found.frequency)} modes judged")
    for name, processor in seconds.items():
        print(f"{name:20s}{processor:8.1f} s of the processors")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cost", type=int, help="elements across the bar whose estimates are timed")
    parser.add_argument("--shell", type=int, help="elements along the panel of shells whose estimates are timed")
    parser.add_argument("--modes", type=int, default=50, help="number of modes of the timed set")
    asked = parser.parse_args()
    logging.disable(logging.WARNING)
    warnings.simplefilter("ignore")
    if asked.cost:
        n = asked.cost
        print_cost(fm.couple(bar(nx=4 * n, ny=n, nz=n, width=0.25, height=0.25, kind="tetra10")), asked.modes)
    elif asked.shell:
        panel = plate(asked.shell, "quad", bend=0.6)
        corners = [Interface(f"node {k}", "rigid", np.array([k]), panel.nodes[k]) for k in (0, asked.shell)]
        print_cost(fm.couple(replace(panel, interfaces=tuple(corners))), asked.modes)
    else:
        print_judged()
