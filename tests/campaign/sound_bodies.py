"""Random sound bodies with all that a modal file can hold: solids, shells, beams, both together, all mode sets.

MarkerShapes in SI units, with a size of about one, turned, moved off the origin, and put into the units of the case.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.spatial.transform import Rotation

import cms
import fe_models as fm
from cms.assessment.quality.of_reduction.contents import ReductionOptions
from cms.body.reduced_body import ReducedBody
from cms.modes.mode_set import ModeSet
from cms.modes.mode_sets import MODE_SETS
from cms.modes.mode_sets.extra_columns import with_load_cases
from cms.reduction.basis.damping import ModalDamping, PerModeDamping, RampDamping, RayleighDamping
from cms.reduction.recovery.request import RecoveryRequest, Rows
from fe_models.body.couplings.couplings import couple
from fe_models.body.fe_body import FEBody, Interface
from fe_models.body.kept_nodes import keep_nodes
from fe_models.body.load_cases import LoadCase
from fe_models.body.weld import weld
from fe_models.foundation.units import unit_system
from tests.bodies import box_mesh, distorted

__all__ = ["SoundBody", "sound_body"]

UNITS = ("m-kg-s", "mm-t-s", "mm-kg-ms", "in-slinch-s")
SETS = (
    "craig-bampton", "craig-bampton-ir", "rubin", "macneal", "craig-chang", "dual-craig-bampton", "herting", "krylov",
    "benfield-hruda", "attachment", "unrestrained-attachment", "guyan", "normal", "balanced-truncation",
)  # fmt: skip
NEWER_SETS = ("h2-optimal",)
NEWER = 400_000  #: first seed that draws from these sets too; earlier seeds keep the bodies that tests name
COUNTED = frozenset(MODE_SETS) - {"guyan"}  #: sets with a number of modes
CELLS = ("hexahedron", "tetra", "wedge", "hexahedron20", "tetra10")


@dataclass(frozen=True, eq=False)
class SoundBody:
    """A body that was reduced as it should be, and what it was asked to hold."""

    body: FEBody  #: coupled
    modes: ModeSet
    reduced: ReducedBody
    options: ReductionOptions
    words: str


@dataclass
class Draw:
    """The random generator of a case and its units."""

    rng: np.random.Generator
    units: Any

    def si(self, value: Any, mass: float = 0, length: float = 0, time: float = 0) -> Any:
        """Return a quantity in the units of the case."""
        return value / self.units.to_si(mass=mass, length=length, time=time)

    def chance(self, share: float) -> bool:
        return bool(self.rng.random() < share)

    def material(self) -> fm.Material:
        E, rho = 10 ** self.rng.uniform(9.5, 11.5), self.rng.uniform(900, 8000)
        return fm.Material(
            "stuff", E=self.si(E, 1, -1, -2), nu=float(self.rng.uniform(0, 0.42)), rho=self.si(rho, 1, -3)
        )


def sound_body(seed: int) -> SoundBody:
    """Return the body of a seed.

    Raises
    ------
    CmsError, FeModelsError
        If the reduction is refused.
    """
    rng = np.random.default_rng(seed)
    draw = Draw(rng, unit_system(str(rng.choice(UNITS))))
    kind = str(rng.choice(("solid", "solid", "shell", "beams", "mixed")))
    place = (
        Rotation.from_rotvec(rng.normal(size=3)),
        draw.si(rng.normal(size=3) * rng.choice([0.0, 1.0, 30.0]), length=1),
    )
    body = {"solid": solid, "shell": shell, "beams": beams, "mixed": mixed}[kind](draw, *place)
    if draw.chance(0.5):
        body = body.with_load_cases(*load_cases(draw, body))
    if draw.chance(0.3):
        alpha, beta = draw.si(5.0, time=-1), draw.si(1e-6, time=1)
        body = replace(body, D=sp.csc_array(alpha * body.M + beta * body.K))
    if draw.chance(0.5):
        wanted = rng.choice(np.arange(len(body.nodes)), size=min(3, len(body.nodes)), replace=False)
        body = keep_nodes(body, [body.nodes[k] for k in wanted])
    body = couple(body)
    if draw.chance(0.05):  # without elements: inertia and second order as far as matrices tell
        body = replace(body, element_model=None, stress_points=None)
    name = str(rng.choice(SETS if seed < NEWER else (*SETS, *NEWER_SETS)))
    n_modes = int(rng.choice([3, 8, 30]))
    n_modes = min(n_modes, max(1, (body.n_dof - len(body.b) - 12) // 2))
    options: dict[str, Any] = {"n_modes": n_modes} if name in COUNTED else {}
    if name == "benfield-hruda":
        options["loads"] = [cms.modes.point_load(body.interfaces[0].name, mass=draw.si(1.0, mass=1))]
    modes = MODE_SETS[name](body, **options)
    if body.load_cases and draw.chance(0.5):
        modes = with_load_cases(modes, body)
    damping = [None, ModalDamping(0.02), PerModeDamping((0.01, 0.03)), RampDamping(),
               RayleighDamping(draw.si(3.0, time=-1), draw.si(1e-6, time=1))][rng.integers(5)]  # fmt: skip
    frame = frame_of(draw, body)
    is_stiffened = bool(body.element_model is not None and draw.chance(0.7))
    geometric: bool | tuple[str, ...] = is_stiffened
    is_quadratic = is_stiffened and len(body.nodes) < 80 and modes.columns.shape[1] < 20 and draw.chance(0.5)
    recovery = (request(draw, body, name),) if draw.chance(0.5) else ()
    made = cms.reduce(
        body, modes, frame=frame, damping=damping, stress=draw.chance(0.8), geometric=is_stiffened,
        quadratic=is_quadratic, recovery=recovery,
    )  # fmt: skip
    words = f"{kind} of {body.n_dof} dofs in {body.units.name}, {name}, {made.n_q} modes, {made.frame.kind} frame"
    if draw.chance(0.25):
        try:
            made = cms.reduction.convert_frame(made, frame_of(draw, body) or cms.TisserandFrame())
            words += f" carried to {made.frame.kind}"
        except cms.errors.BodyError:
            pass
    stress = made.stress is not None or made.point_stress is not None
    asked = ReductionOptions(damping, frame, stress, geometric, is_quadratic, recovery)
    return SoundBody(body, modes, made, asked, words)


def frame_of(draw: Draw, body: FEBody) -> Any:
    """Return a frame, with axes of its own or not."""
    axes = tuple(map(tuple, Rotation.from_rotvec(draw.rng.normal(size=3)).as_matrix())) if draw.chance(0.4) else None
    kind = draw.rng.integers(4)
    if kind == 0:
        return None
    if kind == 1:
        return cms.TisserandFrame(axes=axes)
    if kind == 2:
        return cms.reduction.BuckensFrame(axes=axes)
    return cms.NodalFrame(body.interfaces[0].name, axes=axes)


def request(draw: Draw, body: FEBody, name: str) -> RecoveryRequest:
    """Return rows of all that a body of the kind knows."""
    first = body.interfaces[0].name
    rows = [Rows("acceleration", (first,)), Rows("displacement", (first,)), Rows("velocity", (first,))]
    model = body.element_model
    if model is not None and model.has_nodal_stress and len(body.surface):
        node = int(body.surface[draw.rng.integers(len(body.surface)), 0])
        if body.numbering.nodes.size == 0:
            rows.append(Rows("stress", (node,)))
    rows.append(Rows("net force", about=tuple(body.nodes[0].tolist())))
    if name in ("craig-bampton", "craig-bampton-ir", "rubin", "herting") and all(
        each.kind != "nodes" for each in body.interfaces
    ):
        rows.append(Rows("interface force"))
    return RecoveryRequest("all", tuple(rows))


def load_cases(draw: Draw, body: FEBody) -> list[LoadCase]:
    """Return a force at some nodes, and one that is spread as the mass is."""
    f = np.zeros(body.n_dof)
    chosen = draw.rng.choice(np.flatnonzero(body.dofs[:, 1] < 3), size=4)
    f[chosen] = draw.si(100 * draw.rng.normal(size=4), 1, 1, -2)
    along = (body.dofs[:, 1] == 2).astype(float)
    return [
        LoadCase("push", "force", f),
        LoadCase("weight", "gravity", draw.si(9.81, length=1, time=-2) * (body.M @ along)),
    ]


def interfaces_of(draw: Draw, nodes: np.ndarray, ends: list[np.ndarray], kinds: tuple[str, ...]) -> list[Interface]:
    """Return an interface at each end, with axes of its own."""
    made = []
    for name, own in zip(("left", "right"), ends, strict=True):
        kind = str(draw.rng.choice(kinds))
        triad = Rotation.from_rotvec(draw.rng.normal(size=3)).as_matrix()
        made.append(Interface(name, kind, own, nodes[own].mean(axis=0), triad=triad))
    return made


def solid(draw: Draw, turn: Rotation, offset: np.ndarray) -> FEBody:
    rng = draw.rng
    cells = str(rng.choice(CELLS))
    n = (int(rng.integers(3, 6)), int(rng.integers(1, 3)), int(rng.integers(1, 3)))
    size = draw.si(
        np.array([1.0, rng.uniform(0.1, 0.5), rng.uniform(0.1, 0.5)]) * 10 ** rng.uniform(-1.5, 0.5), length=1
    )
    mesh = distorted(box_mesh(*n, *size, kind=cells), 0.1, seed=int(rng.integers(100)))
    ends = [mesh.node_sets["left"], mesh.node_sets["right"]]
    mesh = replace(mesh, nodes=turn.apply(np.array(mesh.nodes)) + offset)
    joints = interfaces_of(draw, mesh.nodes, ends, ("rigid", "distributing", "rigid"))
    if cells in ("hexahedron",) and draw.chance(0.2):
        joints[1] = replace(joints[1], kind="nodes")
    return fm.solid_body(
        mesh, draw.material(), name="solid", units=draw.units, interfaces=joints,
        incompatible_modes=cells == "hexahedron" and draw.chance(0.5),
    )  # fmt: skip


def shell(draw: Draw, turn: Rotation, offset: np.ndarray) -> FEBody:
    rng = draw.rng
    length, width = draw.si(1.0, length=1), draw.si(rng.uniform(0.3, 1.0), length=1)
    mesh = fm.shells.flat_plate(length, width, 4, 3, kind=str(rng.choice(("quad", "triangle"))))
    x = mesh.nodes[:, 0] / length
    ends = [np.flatnonzero(x < x.min() + 0.26), np.flatnonzero(x > x.max() - 0.26)]  # two rows of nodes each
    bent = np.array(mesh.nodes)
    bent[:, 2] += 0.2 * bent[:, 0] ** 2 / length
    mesh = replace(mesh, nodes=turn.apply(bent) + offset)
    joints = interfaces_of(draw, mesh.nodes, ends, ("rigid", "distributing"))
    t = fm.shells.ShellProperty(draw.si(rng.uniform(0.003, 0.03), length=1), draw.material())
    return fm.shell_body(mesh, t, name="shell", units=draw.units, interfaces=joints)


def beams(draw: Draw, turn: Rotation, offset: np.ndarray) -> FEBody:
    rng = draw.rng
    size = draw.si(1.0, length=1)
    points = np.array([(0, 0, 0), (0.5, 0.1, 0), (1, 0, 0.1), (0.5, 0.1, 0.5), (1.2, 0.4, 0.4)]) * size
    nodes = turn.apply(points + 0.05 * size * rng.normal(size=points.shape)) + offset
    mesh = fm.beams.LineMesh(nodes, [(0, 1), (1, 2), (1, 3), (2, 4), (3, 4)])
    section = fm.beams.Rectangle(*(draw.si(rng.uniform(0.01, 0.06, 2), length=1)))
    joints = [
        fm.beams.line_interface(mesh, name, fm.beams.NodeIndices((k,))) for name, k in (("left", 0), ("right", 2))
    ]
    body = fm.beam_body(
        mesh, fm.beams.BeamProperty(section, draw.material()), name="frame", units=draw.units, interfaces=joints
    )
    return fm.beams.section_points(body, [0, 3]) if draw.chance(0.5) else body


def mixed(draw: Draw, turn: Rotation, offset: np.ndarray) -> FEBody:
    """A solid and a beam, welded at an end."""
    block = solid(draw, turn, offset)
    end = block.interface("right")
    along = turn.apply([1.0, 0.2, 0.0]) * (block.length or 1.0) / 2
    mesh = fm.beams.LineMesh([end.reference, end.reference + along / 2, end.reference + along], [(0, 1), (1, 2)])
    joints = [fm.beams.line_interface(mesh, name, fm.beams.NodeIndices((k,))) for name, k in (("root", 0), ("tip", 2))]
    side = (block.length or 1.0) * draw.rng.uniform(0.02, 0.06)
    stick = fm.beam_body(
        mesh,
        fm.beams.BeamProperty(fm.beams.Rectangle(side, side), draw.material()),
        name="stick",
        units=draw.units,
        interfaces=joints,
    )
    kind = "rigid" if end.kind == "nodes" else end.kind
    tied = replace(block, interfaces=(replace(end, kind=kind),))
    rooted = replace(stick, interfaces=stick.interfaces[:1])
    both = weld([couple(tied), couple(rooted)], [(("solid", "right"), ("stick", "root"))], name="both")
    free = stick.interface("tip")
    moved = replace(free, name="right", nodes=free.nodes + len(block.nodes) + 1)
    return both.with_interfaces(block.interface("left"), moved)
