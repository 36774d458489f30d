"""Shimmy of a nose gear: lateral oscillations of a gear that rolls straight, as a function of speed."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.analyses.linear.linearization import LinearSystem, linearize
from floatframe.analyses.linear.parameter_study import Locus, root_locus
from floatframe.analyses.linear.system_modes import system_modes
from floatframe.analyses.steady.steady_motion import steady_motion
from floatframe.errors import ModelError
from floatframe.model.state import State
from floatframe.model.system import System

__all__ = ["Retraction", "critical_speed", "growth", "retraction", "rolling", "rolling_state", "shimmy_locus"]


# closed forms ---------------------------------------------------------------------------------------------------------
# Retraction of a gear in its plane, by intersection of circles: knee of the brace, length and force of the jack.
#
# The leg rotates by theta about its hinge, the origin; a point (y, z) of the leg moves to (y cos theta - z sin theta,
# y sin theta + z cos theta). The brace connects its hinge on the airframe to a point of the leg by two links of equal
# length with a knee.


BRACE, FOOT, LINK = (0.55, 0.0), (0.05, -0.45), 0.34  #: hinge on the airframe, point of the leg, length of a link [m]
JACK, HORN = (0.5, 0.1), (0.06, 0.15)  #: ends of the jack on the airframe and on the leg [m]
LEG_MASS, LEG_CENTRE, LINK_MASS = 90.0, (0.0, -0.9), 4.0


@dataclass(frozen=True, eq=False)
class Retraction:
    """The mechanism at angles of the leg, each array (n,), or (n, 2) in its plane (y, z)."""

    knee: Array  #: position of the knee, (n, 2) [m]
    jack: Array  #: distance between the ends of the jack [m]
    #: potential energy of leg and links divided by g, zero if all centres of mass are at the height of the hinge [kg m]
    potential: Array


def rotated_point(theta: Array, point: tuple[float, float]) -> Array:
    """Return a point of the rotated leg, (n, 2)."""
    y, z = point
    return np.stack([y * np.cos(theta) - z * np.sin(theta), y * np.sin(theta) + z * np.cos(theta)], axis=1)


def retraction(theta: Array) -> Retraction:
    """Return the mechanism at the angles theta of the leg, (n,) [rad]; zero is the extended gear."""
    theta = np.atleast_1d(np.asarray(theta, dtype=float))
    hinge, foot = np.array(BRACE), rotated_point(theta, FOOT)
    between = foot - hinge
    d = np.linalg.norm(between, axis=1, keepdims=True)
    normal = np.stack([between[:, 1], -between[:, 0]], axis=1) / d  # unit vector away from the knee
    knee = hinge + between / 2 - np.sqrt(LINK**2 - (d / 2) ** 2) * normal
    jack = np.linalg.norm(rotated_point(theta, HORN) - np.array(JACK), axis=1)
    centre = rotated_point(theta, LEG_CENTRE)[:, 1]
    links = (hinge[1] + knee[:, 1]) / 2 + (knee[:, 1] + foot[:, 1]) / 2
    return Retraction(knee, jack, LEG_MASS * centre + LINK_MASS * links)


# an aircraft that rolls steadily before it meets an obstacle ----------------------------------------------------------


def rolling_state(system: System, speed: float, *, body: str = "fuselage") -> State:
    """Return the state of straight rolling at a speed [m/s], with wings, struts and tyres under static load.

    A motion that begins from it, `integrate(system, ..., state=...)`, shows only the effect of the obstacles.
    """
    return steady_motion(system, body, speed).equilibrium.state


# shimmy ---------------------------------------------------------------------------------------------------------------


BAND = 0.2, 100.0  #: range of natural frequencies in which shimmy is searched for [Hz]


def rolling(system: System, speed: float, *, body: str = "carriage") -> LinearSystem:
    """Return a gear linearised about straight rolling at a speed [m/s]; `body` keeps its direction.

    Forces that change with time (the lateral blow of shimmy.toml) have their initial value.
    """
    about = steady_motion(system, body, speed)
    return linearize(about.system, about.equilibrium, inputs=(), outputs=())


def growth(system: System, speed: float) -> complex:
    """Return the eigenvalue with the largest real part up to 100 Hz [1/s]; a positive real part means shimmy."""
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
        If the gear already shimmies at `low`, or does not shimmy at `high`.
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
