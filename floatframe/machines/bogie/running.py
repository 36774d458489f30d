"""Vehicles in steady running: linearisation, hunting modes, their damping, and critical speed."""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.analyses.linear.linearization import LinearSystem, linearize
from floatframe.analyses.linear.system_modes import SystemModes, system_modes
from floatframe.analyses.steady.steady_motion import SteadyMotion, steady_motion
from floatframe.errors import ModelError
from floatframe.integrators.generalized_alpha import GeneralizedAlpha
from floatframe.model.bodies.markers import Marker
from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.model.forces import PointForce
from floatframe.model.system import System
from floatframe.simulation.integrate import integrate

__all__ = [
    "Hunting",
    "SpeedSweep",
    "critical_speed",
    "falling_speed",
    "hunting",
    "lateral_modes",
    "steady_motion_of",
    "steady_running",
]


def steady_motion_of(system: System, radius: float | None = None) -> SteadyMotion:
    """Return a vehicle in steady running, with a driving force on its body that balances the creep losses.

    Bodies that do not spin with the wheels (`spin_inertia` of the wheelsets) move along with the vehicle. Nothing
    depends on the position along the track.

    Parameters
    ----------
    system
        The vehicle from `vehicle`, on straight track, or from `in_circle`, on a circle.
    radius
        Radius of the circle [m]; None: straight track.

    Raises
    ------
    ConvergenceError
        If no steady running is found near this state.
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
    """Return the vehicle with a forward force on its body [N]."""
    force = PointForce("push", Marker("body"), force=np.array([push, 0.0, 0.0]), is_follower=True)
    return replace(system, forces=[*system.forces, force])


def steady_running(system: System, radius: float | None = None) -> LinearSystem:
    """Return a vehicle linearised about its steady running, see `steady_motion_of`."""
    motion = steady_motion_of(system, radius)
    return linearize(motion.system, motion.equilibrium, inputs=(), outputs=())


def lateral_modes(linear: LinearSystem, *, lowest: float = 0.1, highest: float = 15.0) -> tuple[Array, SystemModes]:
    """Return the eigenvalues of the lateral, roll and yaw oscillations, and all modes.

    Parameters
    ----------
    linear
        The linearised vehicle from `steady_running`.
    lowest, highest
        Range of natural frequencies to consider [Hz].
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

    damping: float  #: damping ratio; below 0 the oscillation grows
    frequency: float  #: frequency of the oscillation [Hz]


def hunting(system: System, radius: float | None = None) -> Hunting:
    """Return the least damped lateral oscillation of a vehicle in steady running, on straight track or a circle."""
    roots, _ = lateral_modes(steady_running(system, radius))
    if not len(roots):
        raise ModelError("hunting: expected a lateral oscillation between 0.1 and 15 Hz, got none")
    damping = -roots.real / np.abs(roots)
    k = int(np.argmin(damping))
    return Hunting(float(damping[k]), float(roots[k].imag / (2 * np.pi)))


def critical_speed(
    build: Callable[[float], System], low: float, high: float, *, damping: float = 0.0, tolerance: float = 0.2
) -> float:
    """Return the speed at which the least damping of lateral oscillations falls to a limit, by bisection [m/s].

    Parameters
    ----------
    build
        Function that returns the vehicle at a speed [m/s].
    low, high
        Speeds with more and with less damping than the limit [m/s].
    damping
        The limit: 0 for the critical speed; 0.1 is a usual requirement for a design.
    tolerance
        Tolerance of the speed [m/s].

    Raises
    ------
    ModelError
        If the damping at `high` is above the limit, or that at `low` below it.
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


def with_lateral_kick(system: System, kick: float) -> System:
    """Return a vehicle on straight track with an initial lateral velocity of all axles [m/s]."""
    bodies = [
        replace(each, velocity=np.array([float(np.asarray(each.velocity)[0]), kick, 0.0]))
        if each.name.startswith("axle")
        else each
        for each in system.bodies
    ]
    return replace(system, bodies=bodies)


class SpeedSweep(NamedTuple):
    """Hunting of a vehicle with decreasing speed."""

    speed: Array  #: running speeds, (n,) [m/s]
    amplitude: Array  #: half the range of the lateral displacement of an axle near each of these speeds, (n,) [m]
    offset: Array  #: mean lateral displacement [m]


def falling_speed(
    system: System,
    axle: str,
    *,
    deceleration: float,
    end: float,
    window: float = 1.0,
    h: float = 2e-3,
    kick: float = 0.02,
) -> SpeedSweep:
    """Return the amplitude of hunting with decreasing speed: the stable branch of limit cycles down to its end.

    All bodies are braked by forces equal to their mass times the deceleration, so that no creep force brakes; only the
    spin of the wheels is slowed down by creep.

    Parameters
    ----------
    system
        The vehicle from `vehicle`, at the highest speed, on straight track.
    axle
        Name of the body whose lateral displacement is evaluated.
    deceleration
        Deceleration [m/s²]; so small that the speed hardly changes within a wave.
    end
        Final speed [m/s].
    window
        Duration of the window in which the range is evaluated [s].
    h
        Step size [s].
    kick
        Lateral velocity of all axles at the start [m/s].
    """
    begin, bodies = float(np.asarray(system.bodies[0].velocity)[0]), with_lateral_kick(system, kick).bodies
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
    return SpeedSweep(
        np.array([begin - deceleration * float(t[row].mean()) for row in rows]),
        np.array([0.5 * float(np.ptp(y[row])) for row in rows]),
        np.array([float(y[row].mean()) for row in rows]),
    )
