"""Functions of time from tables of positions, or of accelerations that are integrated twice exactly.

The acceleration of a cubic spline through samples of a position oscillates, and overshoots at every jump of the
original acceleration's slope. Measured accelerations should therefore be given as accelerations. `acceleration_table`
interpolates them linearly between the samples; the second integral is a cubic on every piece, exact to rounding.
"""

from collections.abc import Callable
from itertools import pairwise
from typing import Literal

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.words import nearest, quoted
from floatframe.errors import ModelError
from floatframe.model.checked_values import number
from floatframe.model.functions.time_functions import N_COEFFICIENTS, TimeFunction, table

__all__ = [
    "INTERPOLATIONS",
    "acceleration_table",
    "interpolated",
    "linear_table",
    "monotone_table",
    "overshoot",
    "quintic_table",
]


N_BETWEEN = 33  #: points of each piece at which an overshoot is sought


def checked_table(where: str, t: Array, values: Array, least: int) -> tuple[Array, Array]:
    """Return times and values as arrays; raise `ModelError` unless they are enough, finite and at increasing times."""
    t, values = np.array(t, dtype=float), np.array(values, dtype=float)
    if t.ndim != 1 or t.shape != values.shape or len(t) < least:
        raise ModelError(
            f"{where}: expected {least} or more times and as many values, got {t.shape} and {values.shape}"
        )
    if not np.isfinite(t).all() or not np.isfinite(values).all():
        k = int(np.flatnonzero(~np.isfinite(t) | ~np.isfinite(values))[0])
        raise ModelError(f"{where}: expected finite numbers, got t = {t[k]:g}, value {values[k]:g} at place {k}")
    fall = np.flatnonzero(np.diff(t) <= 0)
    if len(fall):
        k = int(fall[0])
        raise ModelError(f"{where}: expected rising times, got {t[k]:.9g} and then {t[k + 1]:.9g} at place {k + 1}")
    return t, values


def between(t: Array, coefficients: Array, first: tuple[float, ...], last: tuple[float, ...]) -> TimeFunction:
    """Return the piecewise function between times t, extended by polynomials before and after the table.

    coefficients: (n_t - 1, degree + 1), of 1, x, x², … from the start of each piece. `first` and `last` are polynomials
    about t[0], valid before it, and about t[-1], valid after it.
    """
    pieces = np.zeros((len(t) + 1, N_COEFFICIENTS))
    pieces[1:-1, : coefficients.shape[1]] = coefficients
    pieces[-1, : len(last)] = last
    # start of the first piece at t[0] - 1
    about = np.polynomial.Polynomial(first)(np.polynomial.Polynomial([-1.0, 1.0])).coef
    pieces[0, : len(about)] = about
    return TimeFunction(np.concatenate([[t[0] - 1.0], t]), pieces)


def linear_table(t: Array, values: Array) -> TimeFunction:
    """Return linear interpolation of a table, constant outside; only for forces, because motions must be smooth.

    Parameters
    ----------
    t
        Times, rising, (n,) [s].
    values
        Values at these times, (n,).
    """
    t, values = checked_table("linear table", t, values, 2)
    slopes = np.diff(values) / np.diff(t)
    return between(t, np.column_stack([values[:-1], slopes]), (values[0],), (values[-1],))


def monotone_table(t: Array, values: Array) -> TimeFunction:
    """Return the monotone cubic spline (PCHIP) of a table: no overshoot, smooth rate, acceleration jumps at points.

    Beyond its ends it continues along its tangents.

    Parameters
    ----------
    t
        Times, rising, (n,) [s].
    values
        Values at these times, (n,).
    """
    from scipy.interpolate import PchipInterpolator

    t, values = checked_table("monotone table", t, values, 2)
    curve = PchipInterpolator(t, values)
    rates = curve(t[[0, -1]], 1)
    return between(t, curve.c[::-1].T, (values[0], rates[0]), (values[-1], rates[1]))


def quintic_table(t: Array, values: Array) -> TimeFunction:
    """Return the quintic spline through a table, with four continuous derivatives.

    Beyond its ends it continues along its tangents, so its acceleration jumps there unless it ends at zero.

    Parameters
    ----------
    t
        Times, rising, (n,) [s].
    values
        Values at these times, (n,).
    """
    from scipy.interpolate import PPoly, make_interp_spline

    t, values = checked_table("quintic table", t, values, 6)
    spline = make_interp_spline(t, values, k=5)
    curve = PPoly.from_spline(spline)
    inside = (curve.x[:-1] >= t[0]) & (curve.x[1:] <= t[-1]) & (np.diff(curve.x) > 0)
    begins, c = curve.x[:-1][inside], curve.c[:, inside][::-1].T
    rates = [float(spline.derivative()(x)) for x in t[[0, -1]]]
    return between(np.append(begins, t[-1]), c, (values[0], rates[0]), (values[-1], rates[1]))


def acceleration_table(t: Array, values: Array, position: float = 0.0, velocity: float = 0.0) -> TimeFunction:
    """Return the position whose acceleration interpolates a table linearly, by exact double integration.

    With slope s of a piece and time x from its start: a = a0 + s x, v = v0 + a0 x + s x²/2, u = u0 + v0 x + a0 x²/2 + s
    x³/6. v and u at each start are those at the end of the previous piece. The acceleration is zero before and after
    the table; it jumps at an end where the table is not zero.

    Parameters
    ----------
    t
        Increasing times, (n_t,) [s].
    values
        Acceleration of the coordinate, (n_t,) [m/s² or rad/s²].
    position, velocity
        Values of the coordinate at t[0] [m, m/s or rad, rad/s].

    Raises
    ------
    ModelError
        If times do not increase, or numbers are not finite.
    """
    t, a = checked_table("acceleration table", t, values, 2)
    u0, v0 = number("acceleration table: position", position), number("acceleration table: velocity", velocity)
    x = np.diff(t)
    slope = np.diff(a) / x
    v = v0 + np.concatenate([[0.0], np.cumsum(a[:-1] * x + slope * x**2 / 2)])
    u = u0 + np.concatenate([[0.0], np.cumsum(v[:-1] * x + a[:-1] * x**2 / 2 + slope * x**3 / 6)])
    pieces = np.column_stack([u[:-1], v[:-1], a[:-1] / 2, slope / 6])
    return between(t, pieces, (u[0], v[0]), (u[-1], v[-1]))


INTERPOLATIONS: dict[str, Callable[[Array, Array], TimeFunction]] = {
    "cubic": table,
    "linear": linear_table,
    "monotone": monotone_table,
    "quintic": quintic_table,
}


def interpolated(
    t: Array, values: Array, interpolation: Literal["cubic", "linear", "monotone", "quintic"] = "cubic"
) -> TimeFunction:
    """Return the function through a table with a named interpolation.

    Parameters
    ----------
    t
        Rising times, (n_t,) [s].
    values
        A value for each time, (n_t,).
    interpolation
        Curve between the points: cubic, quintic or monotone splines, or lines.

    Raises
    ------
    ModelError
        If there is no interpolation of this name, or the numbers are no table.
    """
    if interpolation not in INTERPOLATIONS:
        raise ModelError(
            f"table: unknown interpolation {quoted(interpolation)}{nearest(interpolation, INTERPOLATIONS)}"
        )
    return INTERPOLATIONS[interpolation](t, values)


def overshoot(function: TimeFunction, t: Array, values: Array) -> tuple[float, float]:
    """Return how far a function through a table leaves the range of the values, over that range, and where.

    Cubic and quintic splines do so beside a jump, and far more where the distances of the points are uneven.
    """
    x = np.concatenate([np.linspace(a, b, N_BETWEEN) for a, b in pairwise(t)])
    y = function.at(x)
    beyond = np.maximum(y - np.max(values), np.min(values) - y)
    k = int(np.argmax(beyond))
    size = float(np.ptp(values))
    return (float(beyond[k]) / size if size > 0 else 0.0), float(x[k])
