"""Functions of time through tables: of positions, or of accelerations that are integrated exactly twice.

A cubic spline through samples of a position swings about the acceleration they came from: it overshoots by a part of
every jump of its slope. What is known as an acceleration should stay one: `acceleration_table` takes it as straight
lines between its samples, whose second integral is a cubic on every piece, without any error but rounding.
"""

from collections.abc import Callable

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.words import nearest, quoted
from floatframe.checked_values import number
from floatframe.errors import ModelError
from floatframe.functions.time_functions import N_COEFFICIENTS, TimeFunction, table

__all__ = [
    "INTERPOLATIONS",
    "acceleration_table",
    "interpolated",
    "linear_table",
    "monotone_table",
    "quintic_table",
]


def checked_table(where: str, t: Array, values: Array, least: int) -> tuple[Array, Array]:
    """Return times and values as arrays; `ModelError` unless there are enough, finite, at rising times."""
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
    """Return the function of pieces between times t, with polynomials before and after them.

    coefficients: (n_t - 1, degree + 1), of 1, x, x², … from the beginning of each piece; `first` and `last`: of the
    polynomials about t[0], which holds before it, and about t[-1].
    """
    pieces = np.zeros((len(t) + 1, N_COEFFICIENTS))
    pieces[1:-1, : coefficients.shape[1]] = coefficients
    pieces[-1, : len(last)] = last
    about = np.polynomial.Polynomial(first)(np.polynomial.Polynomial([-1.0, 1.0])).coef  # t[0] - 1, where it begins
    pieces[0, : len(about)] = about
    return TimeFunction(np.concatenate([[t[0] - 1.0], t]), pieces)


def linear_table(t: Array, values: Array) -> TimeFunction:
    """Return straight lines through a table, held beyond its ends: for forces; a motion may not have such corners."""
    t, values = checked_table("linear table", t, values, 2)
    slopes = np.diff(values) / np.diff(t)
    return between(t, np.column_stack([values[:-1], slopes]), (values[0],), (values[-1],))


def monotone_table(t: Array, values: Array) -> TimeFunction:
    """Return the monotone cubic through a table (PCHIP): no overshoot, smooth rate; its acceleration jumps at samples.

    Beyond its ends it goes on along its tangents.
    """
    from scipy.interpolate import PchipInterpolator

    t, values = checked_table("monotone table", t, values, 2)
    curve = PchipInterpolator(t, values)
    rates = curve(t[[0, -1]], 1)
    return between(t, curve.c[::-1].T, (values[0], rates[0]), (values[-1], rates[1]))


def quintic_table(t: Array, values: Array) -> TimeFunction:
    """Return the quintic spline through a table: position, rate, acceleration and their two next rates are continuous.

    Beyond its ends it goes on along its tangents, so that its acceleration jumps there unless it ends at zero.
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
    """Return the position whose acceleration is given by straight lines through a table, integrated exactly twice.

    With slope s of a piece and x the time from its beginning (0): a = a0 + s x, v = v0 + a0 x + s x²/2,
    u = u0 + v0 x + a0 x²/2 + s x³/6; v and u of each beginning are those of the end before. Before the table and after
    it the acceleration is zero; it jumps at an end where the table does not end at zero.

    Parameters
    ----------
    t
        Times, rising, (n_t,) [s].
    values
        Acceleration of the coordinate, (n_t,) [m/s² or rad/s²].
    position, velocity
        Of the coordinate at t[0] [m, m/s or rad, rad/s].

    Raises
    ------
    ModelError
        If times do not rise, or numbers are not finite.
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


def interpolated(t: Array, values: Array, interpolation: str = "cubic") -> TimeFunction:
    """Return the function through a table by the name of its interpolation; `ModelError` for an unknown name."""
    if interpolation not in INTERPOLATIONS:
        raise ModelError(
            f"table: unknown interpolation {quoted(interpolation)}{nearest(interpolation, INTERPOLATIONS)}"
        )
    return INTERPOLATIONS[interpolation](t, values)
