"""Spline motions of several coordinates through given values, as fast as limits of speed and acceleration allow.

If all times of a spline are multiplied by s, its speed is multiplied by 1/s and its acceleration by 1/s² everywhere.
The smallest s for which no coordinate exceeds a limit follows directly, and some coordinate then reaches a limit. The
distribution of time between the values is a choice: here each part takes the time that the slowest coordinate needs at
its largest speed, or from rest to rest with its largest acceleration, whichever is longer.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.errors import ModelError
from floatframe.model.checked_values import number
from floatframe.model.functions.tables import between, checked_table
from floatframe.model.functions.time_functions import TimeFunction

__all__ = ["PathMotion", "largest_size", "limit_of", "path_motion", "rest_to_rest_spline"]

#: end conditions of zero derivatives for each degree, as in scipy.interpolate.make_interp_spline
ENDS = {3: [(1, 0.0)], 5: [(1, 0.0), (2, 0.0)]}


def rest_to_rest_spline(t: Array, values: Array, degree: int = 3) -> TimeFunction:
    """Return the spline through a table that starts and ends at rest, and is constant outside the table.

    Parameters
    ----------
    t
        Increasing times, (n_t,) [s], two or more.
    values
        Values of the coordinate, (n_t,) [m or rad].
    degree
        3: continuous acceleration inside, with jumps to zero at both ends. 5: the acceleration is zero there, and two
        more derivatives are continuous.

    Raises
    ------
    ModelError
        If times do not increase, numbers are not finite, or the degree is not 3 or 5.
    """
    from scipy.interpolate import PPoly, make_interp_spline

    t, values = checked_table("rest-to-rest spline", t, values, 2)
    if degree not in ENDS:
        raise ModelError(f"rest-to-rest spline: expected a degree of 3 or 5, got {degree!r}")
    spline = make_interp_spline(t, values, k=degree, bc_type=(ENDS[degree], ENDS[degree]))
    curve = PPoly.from_spline(spline)
    inside = np.diff(curve.x) > 0
    begins, c = curve.x[:-1][inside], curve.c[:, inside][::-1].T
    c[0, : len(ENDS[degree]) + 1] = values[0], *[0.0] * len(ENDS[degree])  # rounding would be a jump at rest
    return between(np.append(begins, t[-1]), c, (values[0],), (values[-1],))


def largest_size(function: TimeFunction, order: int) -> float:
    """Return the largest absolute derivative of a function without sines, from its first to its last knot.

    It is found at the ends of pieces, and where the next derivative is zero within a piece.
    """
    if function.pieces[:, 6].any():
        raise ModelError("largest_size: expected a function of polynomials, got one with a sine")
    sizes = [0.0]
    for row, length in zip(function.pieces[:-1], np.diff(function.begins), strict=True):
        curve = np.polynomial.Polynomial(row[:6]).deriv(order)
        roots = curve.deriv().roots()
        places = roots.real[(np.abs(roots.imag) < 1e-9 * length) & (roots.real > 0) & (roots.real < length)]
        sizes.append(float(np.abs(curve(np.concatenate([places, [0.0, length]]))).max()))
    return max(sizes)


class PathMotion(NamedTuple):
    """Prescribed motions of several coordinates along one path."""

    motions: dict[str, TimeFunction]  #: motion of each coordinate, by name
    t: Array  #: time at which each value is reached, (n,) [s]


def path_motion(
    values: Mapping[str, Sequence[float] | Array],
    *,
    speed: float | Mapping[str, float],
    acceleration: float | Mapping[str, float],
    degree: int = 5,
    t_start: float = 0.0,
) -> PathMotion:
    """Return splines from rest to rest through values of several coordinates, as fast as the limits allow.

    (1) the time of each part is that of the slowest coordinate, max(|h|/v, √(4 |h|/a)) for a distance h
    (2) splines are put through the values at these times
    (3) times are multiplied by s, the largest of |rate|/v and √(|second rate|/a) over all coordinates

    Parameters
    ----------
    values
        Values of each coordinate in order, by name; two or more, equally many for all [m or rad].
    speed, acceleration
        Limits above zero: one number for all coordinates, or by name.
    degree
        Degree of the splines, 3 or 5, see `rest_to_rest_spline`.
    t_start
        Time at which the motion starts [s].

    Raises
    ------
    ModelError
        If there is no coordinate, numbers of values differ, all coordinates have the same value twice in sequence, or a
        limit is missing or not positive.
    """
    where = "path_motion"
    points = {name: np.array(each, dtype=float) for name, each in values.items()}
    if not points:
        raise ModelError(f"{where}: expected at least one coordinate, got none")
    n = len(next(iter(points.values())))
    for name, each in points.items():
        if each.ndim != 1 or len(each) != n or n < 2 or not np.isfinite(each).all():
            raise ModelError(
                f"{where}: {name!r}: expected two or more finite values, as many for every coordinate ({n} of "
                f"{next(iter(points))!r}), got shape {each.shape}"
            )
    v = {name: limit_of(where, "speed", name, speed) for name in points}
    a = {name: limit_of(where, "acceleration", name, acceleration) for name in points}
    ways = {name: np.abs(np.diff(each)) for name, each in points.items()}
    lengths = np.max([np.maximum(ways[name] / v[name], np.sqrt(4 * ways[name] / a[name])) for name in points], axis=0)
    if not lengths.all():
        k = int(np.flatnonzero(lengths == 0)[0])
        raise ModelError(f"{where}: no coordinate moves between values {k} and {k + 1}; remove one of them")
    t = np.concatenate([[0.0], np.cumsum(lengths)])
    splines = {name: rest_to_rest_spline(t, each, degree) for name, each in points.items()}
    s = max(
        max(largest_size(spline, 1) / v[name], np.sqrt(largest_size(spline, 2) / a[name]))
        for name, spline in splines.items()
    )
    t = number(f"{where}: t_start", t_start) + s * t
    return PathMotion({name: rest_to_rest_spline(t, each, degree) for name, each in points.items()}, t)


def limit_of(where: str, what: str, name: str, given: float | Mapping[str, float]) -> float:
    """Return the positive limit of one coordinate; raise `ModelError` if it has none."""
    if isinstance(given, Mapping):
        if name not in given:
            raise ModelError(
                f"{where}: {what}: expected a limit of {name!r}, got {', '.join(map(repr, given)) or 'none'}"
            )
        given = given[name]
    return number(f"{where}: {what} of {name!r}", given, above=0.0)
