"""The railway vehicle on a circular track, and the comfort of its passengers."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.components.rails import ContactLaws, Pair, Segment, Track
from floatframe.errors import ModelError
from floatframe.machines.bogie.vehicle import RailVehicle, vehicle
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.rotations import euler_parameters
from floatframe.model.system import System

__all__ = ["WEIGHTINGS", "circle", "in_circle", "weighted_rms", "weighting"]


# circle ---------------------------------------------------------------------------------------------------------------


# ride comfort: accelerations with the frequency weighting of ISO 2631-1 -----------------------------------------------


#: corner frequencies [Hz] and quality factors of the filters of ISO 2631-1: f3, f4, Q4 of the transition, then f5, Q5,
#: f6, Q6 of the step, if there is one; all are limited to 0.4 to 100 Hz
WEIGHTINGS = {
    "vertical": (12.5, 12.5, 0.63, 2.37, 0.91, 3.35, 0.91),  # W_k
    "lateral": (2.0, 2.0, 0.63, None, None, None, None),  # W_d
}
BAND = (0.4, 100.0)


def weighting(f: Array, direction: str) -> Array:
    """Return |H| at frequencies f [Hz], (n,): band limits, transition from acceleration to velocity, step.

    Raises
    ------
    ModelError
        If the direction is unknown.
    """
    if direction not in WEIGHTINGS:
        raise ModelError(f"weighting: direction: expected one of {', '.join(WEIGHTINGS)}, got {direction!r}")
    f3, f4, q4, f5, q5, f6, q6 = WEIGHTINGS[direction]
    assert f3 is not None
    assert f4 is not None
    assert q4 is not None
    p = 2j * np.pi * np.asarray(f, dtype=float)
    low, high, w3, w4 = (2 * np.pi * each for each in (*BAND, f3, f4))
    root = np.sqrt(2.0)
    H = p**2 / (p**2 + root * low * p + low**2) * high**2 / (p**2 + root * high * p + high**2)
    H = H * (1 + p / w3) / (1 + p / (q4 * w4) + (p / w4) ** 2)
    if f5 is not None and f6 is not None and q5 is not None and q6 is not None:
        w5, w6 = 2 * np.pi * f5, 2 * np.pi * f6
        H = H * (1 + p / (q5 * w5) + (p / w5) ** 2) / (1 + p / (q6 * w6) + (p / w6) ** 2) * (w5 / w6) ** 2
    return np.abs(H)


def weighted_rms(t: Array, acceleration: Array, direction: str) -> float:
    """Return the frequency-weighted root mean square of an acceleration without its mean [m/s²].

    Parameters
    ----------
    t
        Times, equally spaced [s], (n,).
    acceleration
        Acceleration at these times, (n,) [m/s²].
    direction
        "vertical" or "lateral".
    """
    t, a = np.asarray(t, dtype=float), np.asarray(acceleration, dtype=float)
    steps = np.diff(t)
    if t.shape != a.shape or len(t) < 16 or np.ptp(steps) > 1e-6 * steps.mean():
        raise ModelError("weighted_rms: expected equally spaced times and as many accelerations, 16 or more")
    spectrum = np.fft.rfft(a - a.mean())
    f = np.fft.rfftfreq(len(a), steps.mean())
    weighted = np.fft.irfft(spectrum * weighting(f, direction), len(a))
    return float(np.sqrt(np.mean(weighted**2)))


# circle ---------------------------------------------------------------------------------------------------------------


LEAD = 50.0  #: track length behind the middle of the vehicle [m]
LENGTH = 1e5  #: length of the circular track [m]


def circle(radius: float, cant: float = 0.0) -> Track:
    """Return a track on a left-hand circle about (0, radius), along x at the origin; cant in metres."""
    if not radius >= 20.0:
        raise ModelError(f"circle: radius: expected 20 m or more, got {radius:g}")
    angle = LEAD / radius
    start = np.array([-radius * np.sin(angle), radius * (1 - np.cos(angle)), 0.0])
    return Track((Segment(LENGTH, (1 / radius, 1 / radius), (cant, cant)),), start=start, heading=-angle)


def in_circle(
    data: RailVehicle,
    speed: float,
    radius: float,
    *,
    cant: float = 0.0,
    pair: Pair | None = None,
    laws: ContactLaws | None = None,
    is_independent: bool = False,
    frames: Sequence[FlexibleBody] = (),
) -> System:
    """Return the vehicle on a circle; every body has the axes and the velocity of the track at its position.

    Parameters
    ----------
    data, speed, pair, laws, is_independent, frames
        As for `vehicle`.
    radius, cant
        Radius of the circle [m]; height of the outer rail above the inner one [m].
    """
    track = circle(radius, cant)
    straight = vehicle(data, speed, pair=pair, track=track, laws=laws, is_independent=is_independent, frames=frames)
    bodies = []
    for body in straight.bodies:
        x, y, z = body.drawn_position
        here = track.frame(LEAD + x)
        placed = here.origin + here.axes @ np.array([0.0, y, z])
        axes = euler_parameters(here.axes)
        bodies.append(replace(body, position=placed, orientation=axes, velocity=speed * here.axes[:, 0]))
    return replace(straight, bodies=bodies, name="rail vehicle in a circle")
