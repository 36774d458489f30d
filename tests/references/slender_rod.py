"""The flexible slider-crank of Jahnke and Popp by a geometrically exact beam, and the same rod in every description.

Crank 0.15 m, steel rod 0.3 m long and 6 mm thick, slider of half its mass, 150 rad/s: at once, or after a soft start.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import scipy.sparse as sp

import cms
import fe_models as fm
from floatframe import GeneralizedAlpha, integrate
from floatframe.components import corotational, finite_segments
from floatframe.components.flexible_parts import FlexiblePart
from floatframe.components.mechanisms import slider_crank
from floatframe.model.functions.time_functions import TimeFunction, cycloidal_spin_up, polynomial_of_time
from floatframe.results.place_motion import interface_motion, point_motion
from tests.bodies import box_mesh
from tests.references.exact_beam import ExactBeam
from tests.references.planar_dynamics import Problem, rotation
from tests.references.planar_dynamics import integrate as integrate_exact

CRANK, ROD, DIAMETER, SPEED = 0.15, 0.3, 0.006, 150.0
TURN = 2 * np.pi / SPEED
STEEL = fm.Material("steel", E=2.0e11, nu=0.3, rho=7870.0)
SECTION = fm.beams.Circle(DIAMETER / 2)
AREA, INERTIA = np.pi * DIAMETER**2 / 4, np.pi * DIAMETER**4 / 64
MASS = STEEL.rho * AREA * ROD
UNITS = cms.unit_system("m-kg-s")
STATIONS = {"start": 0.0, "middle": ROD / 2, "end": ROD}


@dataclass(frozen=True, eq=False)
class Bending:
    """What is compared: deflection of the middle from the chord and lengthening of the chord, (n_t,) each [m]."""

    t: np.ndarray
    deflection: np.ndarray
    lengthening: np.ndarray

    def errors(self, exact: "Bending", *, window: float = 0.0) -> tuple[float, float]:
        """Largest differences over the largest value; both averaged over a window of time where there is ringing."""
        of = partial(averaged, n=max(1, round(window / (self.t[1] - self.t[0]))))
        pairs = ((self.deflection, exact.deflection), (of(self.lengthening), of(exact.lengthening)))
        return tuple(float(np.abs(a - b).max() / np.abs(b).max()) for a, b in pairs)  # type: ignore[return-value]


def averaged(x: np.ndarray, n: int) -> np.ndarray:
    """Moving average over n values."""
    return np.convolve(x, np.full(n, 1 / n), mode="valid")


def drive_at_once() -> tuple[TimeFunction, float]:
    """Constant speed from rest deformation on: angle over time, and the end of two turns."""
    return polynomial_of_time([0.0, SPEED]), 2 * TURN


def soft_start(duration: float = 0.1) -> tuple[TimeFunction, float]:
    """Cycloidal run-up and two turns more."""
    return cycloidal_spin_up(SPEED, duration), duration + 2 * TURN


def bending_of(t: np.ndarray, start: np.ndarray, middle: np.ndarray, end: np.ndarray) -> Bending:
    """Deflection and lengthening from the motion of three points, (n_t, 2 or more)."""
    chord, arm = (end - start)[:, :2], (middle - start)[:, :2]
    length = np.linalg.norm(chord, axis=1)
    return Bending(t, (chord[:, 0] * arm[:, 1] - chord[:, 1] * arm[:, 0]) / length, length - ROD)


def exact(drive: TimeFunction, t_end: float, n_steps: int, *, n: int = 4, every: int = 1) -> Bending:
    """The rod as n three-node elements of the exact beam; the crank pin is prescribed."""
    GA = STEEL.E / (2 * (1 + STEEL.nu)) * SECTION.properties(STEEL.nu).A_sy
    beam = ExactBeam(
        (CRANK, 0), (CRANK + ROD, 0), n, STEEL.E * AREA, GA, STEEL.E * INERTIA, STEEL.rho * AREA, STEEL.rho * INERTIA
    )
    x, y = rotation(lambda t: (drive(t), drive(t, 1), drive(t, 2)), CRANK)
    first, last = beam.node(0), beam.node(-1)
    slider = sp.csc_array(([MASS / 2], ([last[0]], [last[0]])), shape=(beam.n_dof,) * 2)
    prescribed = {int(first[0]): x, int(first[1]): y, int(last[1]): lambda t: (0.0, 0.0, 0.0)}
    v0, speed = np.zeros(beam.n_dof), drive(0.0, 1) * CRANK
    v0[1::3], v0[2::3] = speed * (1 - np.linspace(0, 1, 2 * n + 1)), -speed / ROD
    problem = Problem(beam.mass() + slider, beam.force, beam.x0, prescribed, v0=v0)
    motion = integrate_exact(problem, t_end, t_end / n_steps, rho_inf=0.8)
    return bending_of(motion.t[::every], *(motion.x[::every, beam.node(k)[:2]] for k in (0, n, -1)))


def beam_rod(frame: str = "tisserand", *, geometric: bool = True):
    """Beam elements, Craig-Bampton with six modes."""
    n = 16
    mesh = fm.beams.straight_line((0, 0, 0), (ROD, 0, 0), n)
    kept = [
        fm.beams.line_interface(mesh, p, fm.beams.NodeIndices((k,)))
        for p, k in zip(STATIONS, (0, n // 2, n), strict=True)
    ]
    body = cms.couple(
        fm.beam_body(mesh, fm.beams.BeamProperty(SECTION, STEEL), name="rod", units=UNITS, interfaces=kept)
    )
    chord = cms.NodalFrame(dofs=((0, 0), (0, 1), (0, 2), (0, 3), (n, 1), (n, 2)))
    frames = {"tisserand": cms.TisserandFrame(), "secant": chord, "tangent": cms.NodalFrame("start")}
    return cms.reduce(body, cms.craig_bampton(body, n_modes=6), frame=frames[frame], geometric=geometric)


def assumed_rod(*, geometric: bool = True):
    """Legendre polynomials: three of tension, six of bending along each axis."""
    line = fm.beams.beam_line(ROD, fm.beams.BeamProperty(SECTION, STEEL, shear=False))
    return cms.reduction.beam_from_assumed_modes(
        line, name="rod", units=UNITS, n_axial=3, n_bending=6, n_torsion=1, stations=STATIONS, geometric=geometric
    )


def solid_rod(*, geometric: bool = True):
    """Bricks of 20 nodes: a square bar of the same EI and mass (its EA is 2.3 % less)."""
    side = (12 * INERTIA) ** 0.25
    mesh = box_mesh(30, 1, 1, ROD, side, side, "hexahedron20")
    mesh = type(mesh)(
        mesh.nodes - np.array([0, side / 2, side / 2]), mesh.cells, node_sets=mesh.node_sets, cell_sets=mesh.cell_sets
    )
    material = fm.Material("steel", E=STEEL.E, nu=STEEL.nu, rho=STEEL.rho * AREA / side**2)
    ends = {place: STATIONS[place] for place in ("start", "end")}
    kept = [fm.rigid_interface(mesh, place, fm.selections.Plane((x, 0, 0), (1, 0, 0))) for place, x in ends.items()]
    body = cms.couple(fm.solid_body(mesh, material, name="rod", units=UNITS, interfaces=kept))
    return with_middle(cms.reduce(body, cms.craig_bampton(body, n_modes=6), geometric=geometric))


def with_middle(body: cms.ReducedBody) -> cms.ReducedBody:
    """Add the mean of the surface nodes in the middle as a place to look at; a rigid section there would stiffen."""
    members = np.flatnonzero(np.abs(body.nodes[:, 0]) < 1e-9)
    Psi = np.vstack([body.Phi[members].mean(axis=0), np.zeros((3, body.n_q))])
    middle = cms.body.ReducedInterface("middle", "nodes", np.zeros(3), np.eye(3), Psi, members, has_rotation=False)
    geometric = body.geometric
    if geometric is not None:
        geometric = replace(geometric, is_loaded=(*geometric.is_loaded, False))
    return replace(body, interfaces=(*body.interfaces, middle), geometric=geometric)


def rod_of_segments(n: int):
    """Finite segments; n odd, so that one lies in the middle."""
    line = fm.beams.beam_line(ROD, fm.beams.BeamProperty(SECTION, STEEL))
    return partial(finite_segments, line=line, n=n, stations=STATIONS)


def corotational_rod(n: int):
    """Superelements in a row, each of Legendre polynomials; n even, so that a node lies in the middle."""
    line = fm.beams.beam_line(ROD / n, fm.beams.BeamProperty(SECTION, STEEL))
    element = cms.reduction.beam_from_assumed_modes(
        line, name="element", units=UNITS, n_axial=1, n_bending=2, n_torsion=1
    )

    def make(name, *, position, orientation):
        part = corotational(name, [element] * n, position=position, orientation=orientation)
        markers = {**part.markers, "middle": part.marker(f"node {n // 2 + 1}")}
        return FlexiblePart(name, part.bodies, part.joints, part.forces, markers)

    return make


def moved(rod, drive: TimeFunction, t_end: float, n_steps: int, *, every: int = 1) -> Bending:
    """The mechanism with the rod in one of the descriptions above."""
    system = slider_crank(crank=CRANK, rod=ROD, slider_mass=MASS / 2, drive=drive, flexible_rod=rod)
    motion = integrate(system, GeneralizedAlpha(0.8), t_end, t_end / n_steps, output_every=every)
    if isinstance(rod, cms.ReducedBody):
        points = [interface_motion(motion, "rod", rod, place).position for place in STATIONS]
    else:
        part = rod("rod", position=np.zeros(3), orientation=np.eye(4)[0])
        markers = [part.marker(place) for place in STATIONS]
        points = [point_motion(motion, marker.body, marker.position).position for marker in markers]
    return bending_of(motion.t, *points)


Rod = Callable[[], object]
DESCRIPTIONS: dict[str, Rod] = {
    "beam elements, mean axes, not stiffened": lambda: beam_rod(geometric=False),
    "beam elements, secant frame, not stiffened": lambda: beam_rod("secant", geometric=False),
    "beam elements, tangent frame, not stiffened": lambda: beam_rod("tangent", geometric=False),
    "beam elements, mean axes, stiffened": beam_rod,
    "assumed modes, mean axes, stiffened": assumed_rod,
    "solid, mean axes, stiffened": solid_rod,
    "9 finite segments": lambda: rod_of_segments(9),
    "17 finite segments": lambda: rod_of_segments(17),
    "33 finite segments": lambda: rod_of_segments(33),
    "8 corotational superelements": lambda: corotational_rod(8),
    "16 corotational superelements": lambda: corotational_rod(16),
    "32 corotational superelements": lambda: corotational_rod(32),
}
