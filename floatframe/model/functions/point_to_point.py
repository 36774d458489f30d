"""Prescribed motions from one value to another: a polynomial of degree five, and a trapezoidal speed profile.

For several coordinates through many values, see floatframe.model.functions.path_motions.
"""

import math
from collections.abc import Mapping

import numpy as np

from floatframe.errors import ModelError
from floatframe.model.checked_values import number
from floatframe.model.functions.path_motions import limit_of
from floatframe.model.functions.time_functions import N_COEFFICIENTS, TimeFunction

__all__ = ["quintic", "trapezoid", "trapezoids_together"]

LEAST_EXCESS = 1e-9  #: relative amount by which a duration may be below the minimum, because of rounding


def quintic(
    t_start: float,
    t_end: float,
    first: float,
    last: float,
    *,
    first_velocity: float = 0.0,
    last_velocity: float = 0.0,
    first_acceleration: float = 0.0,
    last_acceleration: float = 0.0,
) -> TimeFunction:
    """Return the polynomial of degree five with given values, velocities and accelerations at both ends.

    With x the time from the start, T the duration, and h, v0, v1, a0, a1 the remaining end conditions:

        c = [first, v0, a0/2, (20 h - (8 v1 + 12 v0) T - (3 a0 - a1) T²)/(2 T³),
             (-30 h + (14 v1 + 16 v0) T + (3 a0 - 2 a1) T²)/(2 T⁴), (12 h - 6 (v1 + v0) T + (a1 - a0) T²)/(2 T⁵)]

    Before and after, it continues along its tangents, so it rests there if the velocities are zero.

    Parameters
    ----------
    t_start, t_end
        Times at which the motion begins and ends [s].
    first, last
        Values at the beginning and at the end [m or rad].
    first_velocity, last_velocity
        Velocities at the beginning and at the end [m/s or rad/s].
    first_acceleration, last_acceleration
        Accelerations at the beginning and at the end [m/s² or rad/s²].

    Raises
    ------
    ModelError
        If the end is not after the start, or a number is not finite.
    """
    where = "quintic"
    t0, t1 = number(f"{where}: t_start", t_start), number(f"{where}: t_end", t_end)
    if t1 <= t0:
        raise ModelError(f"{where}: expected t_end above t_start = {t0:g}, got {t1:g}")
    x0, x1 = number(f"{where}: first", first), number(f"{where}: last", last)
    v0 = number(f"{where}: first_velocity", first_velocity)
    v1 = number(f"{where}: last_velocity", last_velocity)
    a0 = number(f"{where}: first_acceleration", first_acceleration)
    a1 = number(f"{where}: last_acceleration", last_acceleration)
    T, h = t1 - t0, x1 - x0
    pieces = np.zeros((3, N_COEFFICIENTS))
    pieces[0, :2] = x0 - v0, v0  # starts one unit of time earlier
    pieces[1, :6] = [
        x0,
        v0,
        a0 / 2,
        (20 * h - (8 * v1 + 12 * v0) * T - (3 * a0 - a1) * T**2) / (2 * T**3),
        (-30 * h + (14 * v1 + 16 * v0) * T + (3 * a0 - 2 * a1) * T**2) / (2 * T**4),
        (12 * h - 6 * (v1 + v0) * T + (a1 - a0) * T**2) / (2 * T**5),
    ]
    pieces[2, :2] = x1, v1
    return TimeFunction(np.array([t0 - 1.0, t0, t1]), pieces)


def trapezoid(
    first: float,
    last: float,
    *,
    speed: float,
    acceleration: float,
    deceleration: float | None = None,
    t_start: float = 0.0,
    duration: float | None = None,
) -> TimeFunction:
    """Return the rest-to-rest motion with constant acceleration, constant speed and constant deceleration.

    A short distance has no part with constant speed: the speed profile is a triangle. If the duration is longer than
    the minimum, the speed is the lower of the two that take this time.

    Parameters
    ----------
    first, last
        Values of the coordinate at the start and at the end [m or rad].
    speed
        Largest speed, above zero [m/s or rad/s].
    acceleration, deceleration
        Largest magnitudes, above zero [m/s² or rad/s²]; deceleration defaults to the acceleration.
    t_start
        Time at which the motion starts [s].
    duration
        Duration [s]; None: as short as the limits allow.

    Raises
    ------
    ModelError
        If a limit is not positive, or the duration is too short for the limits; the message gives the minimum.
    """
    where = "trapezoid"
    x0, x1 = number(f"{where}: first", first), number(f"{where}: last", last)
    t0 = number(f"{where}: t_start", t_start)
    v = number(f"{where}: speed", speed, above=0.0)
    a = number(f"{where}: acceleration", acceleration, above=0.0)
    d = a if deceleration is None else number(f"{where}: deceleration", deceleration, above=0.0)
    way = x1 - x0
    h = abs(way)
    if h == 0.0:
        if duration is not None:
            number(f"{where}: duration", duration, above=0.0)
        return TimeFunction(np.array([t0]), np.array([[x0, *[0.0] * (N_COEFFICIENTS - 1)]]))
    shortest = shortest_time(h, v, a, d)
    T = shortest if duration is None else number(f"{where}: duration", duration, above=0.0)
    if shortest * (1 - LEAST_EXCESS) > T:
        raise ModelError(
            f"{where}: {x0:g} to {x1:g} takes at least {shortest:.6g} with speed {v:g}, acceleration {a:g} and "
            f"deceleration {d:g}, but the duration is {T:g}; give more time, or higher limits"
        )
    inverse = 1 / a + 1 / d
    # h = v T - v²/2 (1/a + 1/d)
    peak = min(v, 2 * h / (T + math.sqrt(max(T * T - 2 * h * inverse, 0.0))))
    rise, fall = peak / a, peak / d
    even = (h - peak * (rise + fall) / 2) / peak
    sign = math.copysign(1.0, way)
    rows = [
        [x0],
        [x0, 0.0, sign * a / 2],
        [x0 + sign * peak * rise / 2, sign * peak],
        [x1 - sign * peak * fall / 2, sign * peak, -sign * d / 2],
        [x1],
    ]
    begins = [t0 - 1.0, t0, t0 + rise, t0 + rise + even, t0 + rise + even + fall]
    if even <= LEAST_EXCESS * T:  # the profile is a triangle
        del rows[2], begins[2]
        begins[2] = t0 + rise
    pieces = np.zeros((len(rows), N_COEFFICIENTS))
    for k, row in enumerate(rows):
        pieces[k, : len(row)] = row
    return TimeFunction(np.array(begins), pieces)


def shortest_time(h: float, v: float, a: float, d: float) -> float:
    """Return the shortest time for a distance h with limits v, a, d > 0 of speed, acceleration and deceleration."""
    inverse = 1 / a + 1 / d
    return h / v + v * inverse / 2 if v * v * inverse < 2 * h else math.sqrt(2 * h * inverse)


def trapezoids_together(
    ways: Mapping[str, tuple[float, float]],
    *,
    speed: float | Mapping[str, float],
    acceleration: float | Mapping[str, float],
    t_start: float = 0.0,
) -> dict[str, TimeFunction]:
    """Return trapezoidal motions that start and end together, as fast as the slowest coordinate allows.

    Parameters
    ----------
    ways
        Values of each coordinate at the start and at the end, by name.
    speed, acceleration
        Limits above zero: one number for all coordinates, or by name.
    t_start
        Time at which the motions start [s].

    Raises
    ------
    ModelError
        If there is no coordinate, or one has no limit.
    """
    if not ways:
        raise ModelError("trapezoids_together: expected at least one coordinate, got none")
    limits = {
        name: tuple(
            limit_of("trapezoids_together", what, name, given)
            for what, given in (("speed", speed), ("acceleration", acceleration))
        )
        for name in ways
    }
    T = max(
        shortest_time(abs(last - first), limits[name][0], limits[name][1], limits[name][1]) if last != first else 0.0
        for name, (first, last) in ways.items()
    )
    return {
        name: trapezoid(
            first, last, speed=limits[name][0], acceleration=limits[name][1], t_start=t_start, duration=T or None
        )
        for name, (first, last) in ways.items()
    }
