"""Motions of several coordinates through many values, by splines, as fast as limits of speed and acceleration allow.

A spline through the same values in s times the time has 1/s of the speed and 1/s² of the acceleration everywhere: where
only the values are given, the least s at which no coordinate exceeds a limit is known at once, and one coordinate is
at one of its limits somewhere. How the time is shared between the values is a choice; here each part takes what the
slowest coordinate needs at its largest speed, or by its acceleration from rest to rest, whichever is longer.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.checked_values import number
from floatframe.errors import ModelError
from floatframe.functions.tables import between, checked_table
from floatframe.functions.time_functions import TimeFunction

__all__ = ["PathMotion", "largest_size", "limit_of", "path_motion", "rest_to_rest_spline"]

#: by degree: what is zero at both ends, in the form of scipy.interpolate.make_interp_spline
ENDS = {3: [(1, 0.0)], 5: [(1, 0.0), (2, 0.0)]}


def rest_to_rest_spline(t: Array, values: Array, degree: int = 3) -> TimeFunction:
    """Return the spline through a table that begins and ends at rest, and holds its ends before and after.

    Parameters
    ----------
    t
        Times, rising, (n_t,) [s], two or more.
    values
        Of the coordinate, (n_t,) [m or rad].
    degree
        3: continuous acceleration, which jumps to zero at both ends; 5: it is zero there, and two more rates are
        continuous.

    Raises
    ------
    ModelError
        If times do not rise, numbers are not finite, or the degree is another.
    """
    from scipy.interpolate import PPoly, make_interp_spline

    t, values = checked_table("rest-to-rest spline", t, values, 2)
    if degree not in ENDS:
        raise ModelError(f"rest-to-rest spline: expected a degree of 3 or 5, got {degree!r}")
    spline = make_interp_spline(t, values, k=degree, bc_type=(ENDS[degree], ENDS[degree]))
    curve = PPoly.from_spline(spline)
    inside = np.diff(curve.x) > 0
    begins, c = curve.x[:-1][inside], curve.c[:, inside][::-1].T
    c[0, : len(ENDS[degree]) + 1] = values[0], *[0.0] * len(ENDS[degree])  # rounding would be a jump from rest
    return between(np.append(begins, t[-1]), c, (values[0],), (values[-1],))


def largest_size(function: TimeFunction, order: int) -> float:
    """Return the largest size of a derivative of a function without sines, between its first and last beginning.

    Found at ends of pieces and where the next derivative is zero within one.
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
    """Drives of several coordinates along one path."""

    motions: dict[str, TimeFunction]  #: by name of the coordinate
    t: Array  #: when each of the values is passed, (n,) [s]


def path_motion(
    values: Mapping[str, Sequence[float] | Array],
    *,
    speed: float | Mapping[str, float],
    acceleration: float | Mapping[str, float],
    degree: int = 5,
    t_start: float = 0.0,
) -> PathMotion:
    """Return the splines from rest to rest through values of several coordinates, as fast as the limits allow.

    (1) the time of each part: that of the slowest coordinate, max(|h|/v, √(4 |h|/a)) for a way h
    (2) splines through the values at these times
    (3) times multiplied by s, the largest of |rate|/v and √(|second rate|/a) of all coordinates

    Parameters
    ----------
    values
        By name of a coordinate: its values in order, two or more, as many for each [m or rad].
    speed, acceleration
        Limits, above zero: one number for all, or by name.
    degree
        Of the splines, 3 or 5, see `rest_to_rest_spline`.
    t_start
        When the motion begins [s].

    Raises
    ------
    ModelError
        If there is nothing to move, numbers of values differ, all coordinates stay between two values, or a limit is
        missing or not above zero.
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
        raise ModelError(f"{where}: no coordinate moves between values {k} and {k + 1}; leave one of them out")
    t = np.concatenate([[0.0], np.cumsum(lengths)])
    splines = {name: rest_to_rest_spline(t, each, degree) for name, each in points.items()}
    s = max(
        max(largest_size(spline, 1) / v[name], np.sqrt(largest_size(spline, 2) / a[name]))
        for name, spline in splines.items()
    )
    t = number(f"{where}: t_start", t_start) + s * t
    return PathMotion({name: rest_to_rest_spline(t, each, degree) for name, each in points.items()}, t)


def limit_of(where: str, what: str, name: str, given: float | Mapping[str, float]) -> float:
    """Return the limit of one coordinate, above zero; `ModelError` if it has none."""
    if isinstance(given, Mapping):
        if name not in given:
            raise ModelError(f"{where}: {what}: there is none of {name!r}; got {', '.join(map(repr, given)) or 'none'}")
        given = given[name]
    return number(f"{where}: {what} of {name!r}", given, above=0.0)
