"""The kart in a steady turn: its curvature for a steer angle and a speed, and its stability."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.analyses.linear.linearization import linearize
from floatframe.analyses.linear.system_modes import system_modes
from floatframe.analyses.steady.steady_motion import SteadyMotion, steady_motion
from floatframe.components.drives.speed_control import SpeedControl
from floatframe.errors import ConvergenceError, ModelError
from floatframe.model.functions.time_functions import constant
from floatframe.model.system import System

__all__ = ["critical_speed_in_turn", "steady_turn", "turn_eigenvalues"]

LONG_AFTER = 100.0  #: time of evaluation, so that the steering step is complete [s]
NEUTRAL = 1e-6  #: distance within which an eigenvalue belongs to position, heading or wheel rotation [1/s]


def steady_turn(system: System, speed: float, *, near: SteadyMotion | None = None) -> SteadyMotion:
    """Return the steady turn of a kart after its steering step, with its curvature and the speed of the rear axle.

    Parameters
    ----------
    system
        The system of `kart.toml`, with a flexible or a rigid chassis.
    speed
        Speed of the chassis [m/s].
    near
        A turn of the same kart at a similar speed, as initial guess.
    """
    held = [each for each in system.elements if isinstance(each, SpeedControl)]
    if len(held) != 1:
        raise ModelError(f"steady_turn: expected one speed control, got {len(held)}")

    def at(axle: float) -> System:
        elements = [replace(each, target=constant(axle)) if each is held[0] else each for each in system.elements]
        return replace(system, elements=elements)

    return steady_motion(
        at,
        "chassis",
        speed,
        curvature=None,
        unknown={"axle": held[0].speed if near is None else near.found["axle"] * speed / near.speed},
        state=None if near is None else near.equilibrium.state,
        t=LONG_AFTER,
    )


def turn_eigenvalues(motion: SteadyMotion) -> Array:
    """Return the eigenvalues of a steady turn without 0 and ± i times the yaw rate, which every turn has [1/s]."""
    values = system_modes(linearize(motion.system, motion.equilibrium, inputs=(), outputs=())).eigenvalues
    rate = abs(motion.curvature) * motion.speed
    away = (np.abs(values) > NEUTRAL * max(rate, 1.0)) & (np.abs(values - 1j * rate) > NEUTRAL * max(rate, 1.0))
    return np.asarray(values[away])


def critical_speed_in_turn(
    build: Callable[[float], System], low: float, high: float, *, tolerance: float = 0.05
) -> tuple[float, float]:
    """Return two speeds between which the steady turn of a kart loses its stability or ceases to exist [m/s].

    Parameters
    ----------
    build
        Function that returns the kart, with its steer angle, at a speed.
    low, high
        Speeds with and without a stable turn [m/s].
    tolerance
        Tolerance of the bisection [m/s].
    """
    last: list[SteadyMotion] = []

    def is_stable(speed: float) -> bool:
        try:
            motion = steady_turn(build(speed), speed, near=last[0] if last else None)
        except ConvergenceError:
            return False
        if not turn_eigenvalues(motion).real.max() < 0:
            return False
        last[:] = [motion]
        return True

    if not is_stable(low) or is_stable(high):
        raise ModelError(f"critical_speed_in_turn: expected a stable turn at {low:g} m/s and none at {high:g} m/s")
    while high - low > tolerance:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if is_stable(middle) else (low, middle)
    return low, high
