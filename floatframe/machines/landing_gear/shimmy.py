"""Shimmy of a nose gear: lateral oscillations of a gear that rolls straight, as a function of speed."""

from collections.abc import Sequence

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.analyses.linear.linearization import LinearSystem, linearize
from floatframe.analyses.linear.parameter_study import Locus, root_locus
from floatframe.analyses.linear.system_modes import system_modes
from floatframe.analyses.steady.steady_motion import steady_motion
from floatframe.errors import ModelError
from floatframe.model.system import System

__all__ = ["critical_speed", "growth", "rolling", "shimmy_locus"]

BAND = 0.2, 100.0  #: range of natural frequencies in which shimmy is sought [Hz]


def rolling(system: System, speed: float, *, body: str = "carriage") -> LinearSystem:
    """Return a gear linearised about straight rolling at a speed [m/s]; `body` keeps its direction.

    Forces that change with time (the blow of shimmy.toml) have their initial value.
    """
    about = steady_motion(system, body, speed)
    return linearize(about.system, about.equilibrium, inputs=(), outputs=())


def growth(system: System, speed: float) -> complex:
    """Return the eigenvalue of largest real part among oscillations up to 100 Hz [1/s]; above zero means shimmy."""
    modes = system_modes(rolling(system, speed))
    f = modes.natural_frequencies
    swinging = modes.eigenvalues[(modes.eigenvalues.imag > 0) & (f > BAND[0]) & (f < BAND[1])]
    return complex(swinging[np.argmax(swinging.real)])


def shimmy_locus(system: System, speeds: Sequence[float] | Array) -> Locus:
    """Return the modes of a gear as functions of its speed [m/s], each tracked by its shape."""
    return root_locus(lambda speed: rolling(system, speed), speeds, parameter="speed [m/s]")


def critical_speed(system: System, low: float, high: float, *, tolerance: float = 0.05) -> float:
    """Return the speed at which shimmy begins [m/s], by bisection.

    Raises
    ------
    ModelError
        If the gear shimmies already at `low`, or not at `high`.
    """
    ends = [growth(system, speed).real for speed in (low, high)]
    if not ends[0] < 0 < ends[1]:
        raise ModelError(
            f"critical_speed: expected decay at {low:g} m/s and growth at {high:g} m/s, got rates of {ends[0]:.3g} and "
            f"{ends[1]:.3g} 1/s; choose other ends"
        )
    while high - low > tolerance:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if growth(system, middle).real < 0 else (low, middle)
    return 0.5 * (low + high)
