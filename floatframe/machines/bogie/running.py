"""Vehicles about steady running: linearised, their hunting, its damping and critical speed."""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.analyses.linear.linearization import LinearSystem, linearize
from floatframe.analyses.linear.system_modes import SystemModes, system_modes
from floatframe.analyses.steady.steady_motion import SteadyMotion, steady_motion
from floatframe.bodies.markers import Marker
from floatframe.bodies.rigid_body import RigidBody
from floatframe.errors import ModelError
from floatframe.forces import PointForce
from floatframe.integrators import GeneralizedAlpha
from floatframe.motion.integration import integrate
from floatframe.system import System

__all__ = [
    "Falling",
    "Hunting",
    "critical_speed",
    "falling_speed",
    "hunting",
    "lateral_modes",
    "steady_motion_of",
    "steady_running",
]


def steady_motion_of(system: System, radius: float | None = None) -> SteadyMotion:
    """Return a vehicle in steady running, pushed ahead at its body against what creep takes.

    Bodies that do not turn with the wheels (`spin_inertia` of the wheelsets) go along, and nothing depends on where it
    is along the track.

    Parameters
    ----------
    system
        As `vehicle` places it on straight track, or `in_circle` on a circle.
    radius
        Of the circle [m]; None: straight on.

    Raises
    ------
    ConvergenceError
        If it does not run steadily near there.
    """
    center = None if radius is None else np.array([0.0, radius, 0.0])
    return steady_motion(
        lambda push: pushed(system, push),
        "body",
        curvature=0.0 if radius is None else 1 / radius,
        center=center,
        unknown={"push": 0.0},
        guided=True,
    )


def pushed(system: System, push: float) -> System:
    """Return the vehicle with a force ahead on its body [N]."""
    force = PointForce("push", Marker("body"), force=np.array([push, 0.0, 0.0]), is_follower=True)
    return replace(system, forces=[*system.forces, force])


def steady_running(system: System, radius: float | None = None) -> LinearSystem:
    """Return a vehicle linearised about its steady running, see `steady_motion_of`."""
    motion = steady_motion_of(system, radius)
    return linearize(motion.system, motion.equilibrium, inputs=(), outputs=())


def lateral_modes(linear: LinearSystem, *, lowest: float = 0.1, highest: float = 15.0) -> tuple[Array, SystemModes]:
    """Return the eigenvalues of oscillations to the side, in roll and in yaw, and all modes.

    Parameters
    ----------
    linear
        Of `steady_running`.
    lowest, highest
        Natural frequencies that are looked at [Hz].
    """
    modes = system_modes(linear)
    sizes = [len(mass) for mass in linear.body_masses]
    first = np.concatenate([[0], np.cumsum(sizes)[:-1]])
    shapes = np.abs(modes.shapes) ** 2
    aside = sum(shapes[i + k] for i in first for k in (1, 3, 5))
    along = sum(shapes[i + k] for i in first for k in (0, 2, 4))
    f = modes.natural_frequencies
    use = (aside > along) & (f > lowest) & (f < highest) & (modes.eigenvalues.imag > 0)
    return modes.eigenvalues[use], modes


class Hunting(NamedTuple):
    """The lateral oscillation with the least damping."""

    damping: float  #: ratio; below 0: it grows
    frequency: float  #: [Hz]


def hunting(system: System, radius: float | None = None) -> Hunting:
    """Return the least damped lateral oscillation of a vehicle in steady running, straight on or in a circle."""
    roots, _ = lateral_modes(steady_running(system, radius))
    if not len(roots):
        raise ModelError("hunting: no oscillation to the side between 0.1 and 15 Hz")
    damping = -roots.real / np.abs(roots)
    k = int(np.argmin(damping))
    return Hunting(float(damping[k]), float(roots[k].imag / (2 * np.pi)))


def critical_speed(
    build: Callable[[float], System], low: float, high: float, *, damping: float = 0.0, tolerance: float = 0.2
) -> float:
    """Return the speed at which the least damping of lateral oscillations falls to a limit [m/s]: bisection.

    Parameters
    ----------
    build
        From a speed [m/s] to the vehicle.
    low, high
        Speeds with more and with less damping.
    damping
        The limit: 0 for the critical speed, 0.1 for the one that is asked of a design.
    tolerance
        Of the speed [m/s].

    Raises
    ------
    ModelError
        If there is more damping than the limit at `high`, or less at `low`.
    """
    ends = [hunting(build(V)).damping - damping for V in (low, high)]
    if not ends[0] > 0 > ends[1]:
        raise ModelError(
            f"critical_speed: expected more damping than {damping:g} at {low:g} m/s and less at {high:g} m/s, got "
            f"{ends[0] + damping:.3g} and {ends[1] + damping:.3g}"
        )
    while high - low > tolerance:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if hunting(build(middle)).damping > damping else (low, middle)
    return 0.5 * (low + high)


def blown(system: System, kick: float) -> System:
    """Return a vehicle on straight track whose axles all have a lateral velocity [m/s]."""
    bodies = [
        replace(each, velocity=np.array([float(np.asarray(each.velocity)[0]), kick, 0.0]))
        if each.name.startswith("axle")
        else each
        for each in system.bodies
    ]
    return replace(system, bodies=bodies)


class Falling(NamedTuple):
    """A vehicle that hunts while its speed falls."""

    speed: Array  #: (n,) [m/s]
    amplitude: Array  #: half the range of the lateral shift of an axle about each of these speeds, (n,) [m]
    offset: Array  #: its mean [m]


def falling_speed(
    system: System,
    axle: str,
    *,
    deceleration: float,
    end: float,
    window: float = 1.0,
    h: float = 2e-3,
    kick: float = 0.02,
) -> Falling:
    """Return the amplitude of hunting while the speed falls: the stable branch of limit cycles, to where it ends.

    All bodies are braked by forces of their mass times the deceleration, so that no creep force brakes; only the spin
    of the wheels follows by creep.

    Parameters
    ----------
    system
        As `vehicle` returns it, at the highest speed, on straight track.
    axle
        Name of the body that is looked at.
    deceleration
        [m/s²], small: the speed should hardly change within a wave.
    end
        Speed at which it ends [m/s].
    window
        Time over which the range is taken [s].
    h
        Step [s].
    kick
        Lateral velocity of all axles at the start [m/s].
    """
    begin, bodies = float(np.asarray(system.bodies[0].velocity)[0]), blown(system, kick).bodies
    brakes = [
        PointForce(f"brake_{each.name}", Marker(each.name), force=np.array([-deceleration * each.mass, 0.0, 0.0]))
        for each in system.bodies
        if isinstance(each, RigidBody)
    ]
    braked = replace(system, bodies=bodies, forces=[*system.forces, *brakes])
    motion = integrate(braked, GeneralizedAlpha(0.8, 1e-6), (begin - end) / deceleration, h, output_every=5)
    y, t = motion.body(axle).r[:, 1], motion.t
    n = max(2, round(window / float(t[1] - t[0])))
    rows = [slice(i, i + n) for i in range(0, len(t) - n + 1, n)]
    return Falling(
        np.array([begin - deceleration * float(t[row].mean()) for row in rows]),
        np.array([0.5 * float(np.ptp(y[row])) for row in rows]),
        np.array([float(y[row].mean()) for row in rows]),
    )
