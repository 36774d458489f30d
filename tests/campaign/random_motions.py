"""Random systems and how each is run: trees and loops of all joints, rigid and flexible, with all kinds of forces.

Everything is drawn in SI units with lengths, masses and times of about one, and turned into the units of the case. A
case has a fast part (a stiff spring, a flexible body) of 0.1 to 100 periods a step, or none.
"""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

import cms
import fe_models
import floatframe as ff
from fe_models.foundation.units import Units, unit_system
from floatframe.integrators.integrator import Integrator
from floatframe.model.functions.time_functions import constant, cycloidal_spin_up, harmonic, piecewise
from floatframe.model.rotations import euler_parameters, rotation_exp

__all__ = ["MotionCase", "random_motion"]

UNITS = ("m-kg-s", "mm-t-s", "mm-kg-ms", "in-slinch-s")
KINDS = (
    "revolute", "prismatic", "cylindrical", "screw", "universal", "planar", "spherical", "fixed", "constant-velocity",
    "distance", "point-on-line", "point-on-plane", "free",
)  # fmt: skip
WEIGHTS = np.array([6, 3, 2, 1, 2, 1, 3, 1, 1, 1, 1, 1, 1], dtype=float)
COORDINATES = {"revolute": ("angle",), "prismatic": ("distance",), "cylindrical": ("distance", "angle"),
               "universal": ("angle", "angle_b"), "planar": ("first",)}  # fmt: skip
MOST_PERIODS = 3.0  #: of the fast part in a step, which steps by their error would resolve
CHUNKS = (1, 3, 10)  #: steps between restarts


@dataclass(frozen=True)
class MotionCase:
    """A system and a run of it."""

    system: ff.System
    method: Integrator
    h: float
    n_steps: int
    chunk: int  #: steps between restarts from the last state; 0: one run
    formulation: str
    words: str  #: what it is


@dataclass
class Builder:
    """What a case is made of, as it grows; lengths, masses and times by `of`."""

    rng: np.random.Generator
    units: Units
    h: float  #: step [s]
    periods: float  #: of the fast part in a step
    origin: np.ndarray  #: [m]
    bodies: list[Any] = field(default_factory=list)
    joints: list[Any] = field(default_factory=list)
    forces: list[Any] = field(default_factory=list)
    elements: list[Any] = field(default_factory=list)
    poses: list[tuple[np.ndarray, np.ndarray]] = field(default_factory=list)  #: of the bodies, in SI
    sprung: list[tuple[str, str]] = field(default_factory=list)  #: free coordinates of joints
    words: list[str] = field(default_factory=list)

    def of(self, value: Any, length: int = 0, mass: int = 0, time: int = 0) -> Any:
        """Return a value in SI in the units of the case."""
        made = np.asarray(value) / self.units.to_si(length=length, mass=mass, time=time)
        return float(made) if made.ndim == 0 else made

    def place(self, body: int, point: np.ndarray, triad: np.ndarray) -> ff.Marker:
        """Return a marker at a point of a body (-1: the ground, from the origin) with a triad."""
        if body < 0:
            return ff.Marker("ground", position=self.of(self.origin + point, length=1), triad=triad)
        made = self.bodies[body]
        if isinstance(made, ff.FlexibleBody):
            return ff.Marker(made.name, "start" if point[0] < 0.5 else "end", triad=triad)
        return ff.Marker(made.name, position=self.of(point, length=1), triad=triad)

    def point(self, body: int) -> np.ndarray:
        """Return a point of a body where something may be attached."""
        if body >= 0 and isinstance(self.bodies[body], ff.FlexibleBody):
            return np.array([1.0, 0.0, 0.0])
        return 0.4 * self.rng.normal(size=3)

    def at(self, body: int, point: np.ndarray) -> np.ndarray:
        """Return the place of a point of a body [m]."""
        R, r = (np.eye(3), self.origin) if body < 0 else self.poses[body]
        return r + R @ point


def random_motion(seed: int) -> MotionCase:
    """Return the case of a seed."""
    rng = np.random.default_rng([12, seed])
    units = unit_system(str(rng.choice(UNITS)))
    n_in_second = 10.0 ** rng.uniform(1.2, 2.4)  # steps in a second, in which motions change
    h = 1.0 / n_in_second
    direction = rng.normal(size=3)
    offset = float(rng.choice([0.0, 0.0, 100.0, 1e4]))
    build = Builder(rng, units, h, 10.0 ** rng.uniform(-1, 2), offset * direction / np.linalg.norm(direction))
    n = int(rng.integers(1, 4))
    for k in range(n):
        add_link(build, k)
    add_forces(build)
    loop = rng.random()
    if loop < 0.25 and n > 1:
        close_loop(build)
    events = add_events(build)
    gravity = [ff.Gravity(build.of(np.array([0.3, -0.4, -9.81]), length=1, time=-2))] if rng.random() < 0.8 else []
    if not (gravity or build.forces or build.elements):
        gravity = [ff.Gravity(build.of(np.array([0.3, -0.4, -9.81]), length=1, time=-2))]
    system = ff.System(
        build.bodies, build.joints, [*gravity, *build.forces], units, elements=build.elements, events=events,
    )  # fmt: skip
    method, formulation, name = random_method(rng, has_events=bool(events), periods=build.periods)
    chunk = int(rng.choice(CHUNKS)) if rng.random() < 0.25 and not events and n_in_second < 100 else 0
    n_steps = max(5, round(float(rng.uniform(0.5, 2.0)) * n_in_second))
    words = (
        f"{', '.join(build.words)}; {name} {formulation}, {n_steps} steps of {h:.3g} s, {build.periods:.2g} periods a "
        f"step, {units.name}, {offset:g} m away" + (f", restarts every {chunk} steps" if chunk else "")
    )
    return MotionCase(system, method, build.of(h, time=1), n_steps, chunk, formulation, words)


def add_link(build: Builder, k: int) -> None:
    """Add a body and the joint that carries it."""
    rng = build.rng
    parent = k - 1 if k == 0 or rng.random() < 0.75 else int(rng.integers(-1, k))
    kind = str(rng.choice(KINDS, p=WEIGHTS / WEIGHTS.sum()))
    is_flexible = rng.random() < 0.25
    A, B = rotation_exp(rng.normal(size=3)), rotation_exp(rng.normal(size=3))
    a = build.point(parent) if parent >= 0 else np.zeros(3)
    b = np.zeros(3) if is_flexible else 0.3 * rng.normal(size=3)
    R_p, _ = (np.eye(3), build.origin) if parent < 0 else build.poses[parent]
    R = R_p @ A @ B.T
    r = build.at(parent, a) - R @ b
    if kind == "distance":
        r = r + R_p @ A @ np.array([0.5, 0.2, 0.1])
    build.poses.append((R, r))
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    other = np.cross(axis, rng.normal(size=3))
    other /= np.linalg.norm(other)
    omega = 0.7 * rng.normal(size=3)
    spin = 0.0
    if rng.random() < 0.2:
        spin = float(10.0 ** rng.uniform(-1, 0.7)) / build.h  # radians a step over the step
        omega = omega + spin * (B @ axis)
        build.words.append(f"spin of {spin * build.h:.2g} rad a step")
    start = {
        "position": build.of(r, length=1), "orientation": euler_parameters(R),
        "velocity": build.of(0.5 * rng.normal(size=3), length=1, time=-1),
        "omega_B": build.of(omega, time=-1),
    }  # fmt: skip
    if is_flexible:
        build.bodies.append(ff.FlexibleBody(f"b{k}", beam(build, k), stiffening=bool(rng.random() < 0.5), **start))
    else:
        mass, points = float(rng.uniform(0.5, 2.0)), 0.2 * rng.normal(size=(3, 6))
        c = points - points.mean(axis=1, keepdims=True)
        J = mass * (np.einsum("ak,ak->", c, c) * np.eye(3) - c @ c.T) / 6
        if spin and rng.random() < 0.7:  # symmetric about its axis of spin
            e, s = B @ axis, 0.02 * mass
            J = s * (1.5 * np.outer(e, e) + 1.0 * (np.eye(3) - np.outer(e, e)))
        center = b if spin else 0.3 * rng.normal(size=3)
        build.bodies.append(
            ff.RigidBody(
                f"b{k}", build.of(mass, mass=1), build.of(J, mass=1, length=2), build.of(center, length=1), **start
            )
        )
    build.words.append(f"{'flexible' if is_flexible else 'rigid'} on {kind}")
    near, far = build.place(parent, a, A), build.place(k, b, B)
    name = f"j{k}"
    motions = {}
    if kind in ("revolute", "prismatic") and rng.random() < 0.15:
        if kind == "revolute" and rng.random() < 0.5:
            drive = cycloidal_spin_up(build.of(6.0, time=-1), build.of(0.5, time=1))
        else:
            drive = harmonic(0.3 if kind == "revolute" else build.of(0.2, length=1), build.of(5.0, time=-1))
        motions = {COORDINATES[kind][0]: drive}
        build.words.append("driven")
    joint = joint_of(build, kind, name, near, far, axis, other, motions)
    if joint is not None:
        build.joints.append(joint)
    if not motions:
        build.sprung += [(name, key) for key in COORDINATES.get(kind, ())]


def joint_of(build, kind, name, near, far, axis, other, motions):
    """Return the joint of a kind; None: the body is free."""
    match kind:
        case "revolute":
            return ff.RevoluteJoint(name, near, far, axis=axis, motions=motions)
        case "prismatic":
            return ff.PrismaticJoint(name, near, far, axis=axis, motions=motions)
        case "cylindrical":
            return ff.joints.CylindricalJoint(name, near, far, axis=axis)
        case "screw":
            return ff.joints.ScrewJoint(name, near, far, axis=axis, lead=build.of(0.7, length=1))
        case "universal":
            return ff.joints.UniversalJoint(name, near, far, axis=axis, axis_b=other)
        case "planar":
            return ff.joints.PlanarJoint(name, near, far, axis=axis)
        case "spherical":
            return ff.SphericalJoint(name, near, far)
        case "constant-velocity":
            return ff.joints.ConstantVelocityJoint(name, near, far, axis=axis)
        case "distance":
            return ff.joints.DistanceJoint(name, near, far)
        case "point-on-line":
            return ff.joints.PointOnLine(name, near, far, axis=axis)
        case "point-on-plane":
            return ff.joints.PointOnPlane(name, near, far, axis=axis)
        case "fixed":
            return ff.FixedJoint(name, near, far)
    return None


def beam(build: Builder, k: int) -> cms.ReducedBody:
    """Return a beam of 1 m and about 1 kg whose first bending mode, clamped, has the periods of the case in a step."""
    first = 2 * np.pi * min(build.periods, 10.0) / build.h
    EI = (first / 3.516) ** 2  # of 1 kg/m and 1 m
    EI = max(EI, 40.0)  # does not bend under its weight
    line = fe_models.beams.BeamLine(
        build.of(1.0, length=1), build.of(1.0, mass=1, length=-1), build.of(1e3 * EI, mass=1, length=1, time=-2),
        build.of(EI, mass=1, length=3, time=-2), build.of(1.5 * EI, mass=1, length=3, time=-2),
        build.of(EI, mass=1, length=3, time=-2), build.of(1e-3, mass=1, length=1), build.of(1e-3, mass=1, length=1),
    )  # fmt: skip
    damping = cms.reduction.ModalDamping(0.02) if build.rng.random() < 0.5 else None
    frame = cms.NodalFrame("start") if build.rng.random() < 0.3 else None
    return cms.reduction.beam_from_assumed_modes(
        line, name=f"b{k}", units=build.units, n_axial=1, n_bending=2, n_torsion=1, frame=frame, damping=damping
    )


def add_forces(build: Builder) -> None:
    """Add springs, bushings, loads and elements."""
    rng, n = build.rng, len(build.bodies)
    fast = 2 * np.pi * build.periods / build.h
    for joint, key in build.sprung:
        if rng.random() < 0.5:
            is_angle = key.startswith("angle")
            omega = fast if rng.random() < 0.4 else float(rng.uniform(2.0, 6.0))
            m = 0.2 if is_angle else 1.0
            ratio = float(rng.choice([0.0, 0.01, 0.3]))
            of = {"mass": 1, "length": 2 * is_angle}
            build.forces.append(
                ff.JointForce(
                    f"{joint}.{key}", joint, key, stiffness=build.of(m * omega**2, time=-2, **of),
                    damping=build.of(2 * ratio * m * omega, time=-1, **of),
                )
            )  # fmt: skip
            build.words.append(f"{'stiff' if omega == fast else 'soft'} spring in {joint}")
    b = n - 1
    place = build.place(b, build.point(b), np.eye(3))
    kind = rng.random()
    if kind < 0.15:
        omega = fast if rng.random() < 0.5 else 4.0
        point = np.array([1.0, 0, 0]) if isinstance(build.bodies[b], ff.FlexibleBody) else np.zeros(3)
        far = build.at(b, point) - build.origin
        K = np.diag([1.0, 1.0, 1.0, 0.1, 0.1, 0.1]) * omega**2
        scale = np.diag([build.of(1.0)] * 3 + [build.of(1.0, length=1)] * 3)
        K = scale @ build.of(K, mass=1, time=-2) @ scale
        triad = build.poses[b][0]
        build.forces.append(
            ff.forces.Bushing(
                "mount", build.place(-1, far, triad), build.place(b, point, np.eye(3)), K,
                damping=0.1 / build.of(omega, time=-1) * K,
            )
        )  # fmt: skip
        build.words.append(f"{'stiff' if omega == fast else 'soft'} bushing")
    elif kind < 0.3:
        far = build.place(-1, np.array([1.0, 1.5, 0.5]), np.eye(3))
        build.forces.append(
            ff.SpringDamper(
                "rope", far, place, build.of(20.0, mass=1, time=-2), build.of(1.0, mass=1, time=-1),
                free_length=build.of(0.5, length=1),
            )
        )  # fmt: skip
        build.words.append("rope")
    elif kind < 0.45:
        build.forces.append(
            ff.PointForce(
                "push", place, force=build.of(np.array([3.0, -2.0, 1.0]), mass=1, length=1, time=-2),
                amplitude=harmonic(1.0, build.of(float(rng.uniform(2.0, 9.0)), time=-1), 0.3),
            )
        )  # fmt: skip
        build.words.append("harmonic push")
    elif kind < 0.6:
        times = np.arange(0.0, 3.0, 7.3 * build.h)
        square = piecewise(list(build.of(times, time=1)), [constant((-1.0) ** k) for k in range(len(times))])
        build.forces.append(
            ff.PointForce(
                "jumps", place, force=build.of(np.array([1.0, 2.0, -1.0]), mass=1, length=1, time=-2), amplitude=square
            )
        )
        build.words.append("push that jumps")
    elif kind < 0.7 and build.sprung:
        joint, key = build.sprung[-1]
        of = {"mass": 1, "length": 1 + key.startswith("angle"), "time": -2}
        x = 1.0 if key.startswith("angle") else build.of(1.0, length=1)
        build.forces.append(
            ff.UserForce(
                "control", {"x": ff.joints.JointCoordinate(joint, key)}, {"x": "-F*(x/L) - F*0.2*x_dot/L*T - F*e"},
                {"e": "(x/L - e)/(0.1*T)"}, {"e": 0.0},
                {"F": build.of(5.0, **of), "L": x, "T": build.of(1.0, time=1)},
            )
        )  # fmt: skip
        build.words.append("controlled")


def close_loop(build: Builder) -> None:
    """Join the last body with the ground."""
    b = len(build.bodies) - 1
    point = build.point(b)
    here = build.at(b, point) - build.origin
    if build.rng.random() < 0.5:
        build.joints.append(
            ff.joints.DistanceJoint(
                "loop", build.place(-1, here + np.array([0.4, 0.5, 0.3]), np.eye(3)), build.place(b, point, np.eye(3))
            )
        )
    else:
        axis = build.rng.normal(size=3)
        build.joints.append(
            ff.joints.PointOnPlane(
                "loop", build.place(-1, here, np.eye(3)), build.place(b, point, np.eye(3)), axis=axis
            )
        )
    build.words.append("loop")


def add_events(build: Builder) -> list[ff.simulation.Event]:
    """Return events that switch a force off and on, or none."""
    names = [force.name for force in build.forces if isinstance(force, ff.PointForce | ff.SpringDamper | ff.JointForce)]
    if not names or build.rng.random() < 0.75:
        return []
    name = str(build.rng.choice(names))
    build.words.append(f"events switch {name}")
    off = float(build.rng.uniform(0.1, 0.5))
    return [
        ff.simulation.Event("off", at=build.of(off, time=1), switch_off=(name,)),
        ff.simulation.Event("on", at=build.of(off + 5.5 * build.h, time=1), switch_on=(name,)),
    ]


def random_method(rng: np.random.Generator, *, has_events: bool, periods: float) -> tuple[Integrator, str, str]:
    """Return a method, the formulation, and both in words; steps by their error only where they need not be many."""
    formulation = "relative" if rng.random() < 0.4 else "absolute"
    rho = float(rng.choice([0.0, 0.5, 0.8, 0.8, 0.9, 1.0]))
    kind = rng.random()
    if kind < 0.6:
        return ff.GeneralizedAlpha(rho), formulation, f"generalized-alpha {rho:g}"
    if kind < 0.7:
        return ff.integrators.hht(-0.1), formulation, "hht"
    if kind < 0.75 and periods < MOST_PERIODS:
        return ff.GeneralizedAlpha(rho, error_tolerance=1e-5), formulation, f"generalized-alpha {rho:g} with error 1e-5"
    if kind < 0.9 or has_events:
        return ff.integrators.EnergyMomentum(), "absolute", "energy-momentum"
    return ff.integrators.EnergyDecaying(rho), "absolute", f"energy-decaying {rho:g}"


def finer(case: MotionCase, formulation: str) -> MotionCase:
    """Return the case by generalized-alpha in a formulation, as one run."""
    return replace(case, method=ff.GeneralizedAlpha(0.8), chunk=0, formulation=formulation)
