"""Uniform cubic B-splines: coefficients in NumPy, values in compiled code for float64 and complex128 arguments."""

import numpy as np
from scipy.linalg import solve_banded

from fe_models.foundation.arrays import Array
from fe_models.foundation.kernels.jit import jit

__all__ = [
    "basis",
    "basis_curvatures",
    "basis_slopes",
    "cell",
    "cell_slope",
    "coefficients",
    "even_coefficients",
]


def even_coefficients(values: Array, axis: int = 0) -> Array:
    """Return the coefficients for values at 0, h, 2 h, ... of an even function: c_(-1) = c_1 at the beginning."""
    y = np.moveaxis(np.asarray(values, dtype=float), axis, 0)
    both = coefficients(np.concatenate([y[:0:-1], y]))
    return np.moveaxis(both[len(y) - 1 :], 0, axis)


def coefficients(values: Array, axis: int = 0) -> Array:
    """Return the n + 2 coefficients, along an axis, of the cubic B-spline through n >= 3 equally spaced values.

    (c_(i-1) + 4 c_i + c_(i+1))/6 = y_i; the second derivative is zero at the ends: c_(-1) - 2 c_0 + c_1 = 0, so c_0 =
    y_0.
    """
    y = np.moveaxis(np.asarray(values, dtype=float), axis, 0)
    n, shape = len(y), y.shape[1:]
    y = y.reshape(n, -1)
    c = np.empty((n + 2, y.shape[1]))
    c[1], c[n] = y[0], y[-1]
    if n > 2:
        right = 6 * y[1:-1].copy()
        right[0] -= y[0]
        right[-1] -= y[-1]
        bands = np.ones((3, n - 2))
        bands[1] = 4.0
        c[2:n] = solve_banded((1, 1), bands, right)
    c[0], c[n + 1] = 2 * c[1] - c[2], 2 * c[n] - c[n - 1]
    return np.moveaxis(c.reshape(n + 2, *shape), 0, axis)


@jit
def cell(x, start, step, n):
    """Return the interval i of n points and the position t in it, 0 to 1; clamped beyond the ends."""
    place = (x - start) / step
    if place.real <= 0.0:
        return 0, 0 * place
    if place.real >= n - 1:
        return n - 2, 0 * place + 1
    i = int(place.real)
    return i, place - i


@jit
def cell_slope(x, start, step, n):
    """Return the derivative of the position t in `cell` by x, which is zero beyond the ends."""
    place = (x - start) / step
    return 1 / step if 0.0 < place < n - 1 else 0.0


@jit
def basis(t):
    """Return the four weights of the coefficients i, i + 1, i + 2, i + 3 at t."""
    s = 1 - t
    return s * s * s / 6, (3 * t * t * t - 6 * t * t + 4) / 6, (3 * s * s * s - 6 * s * s + 4) / 6, t * t * t / 6


@jit
def basis_slopes(t):
    """Return the derivatives of `basis` by t."""
    s = 1 - t
    return -s * s / 2, (3 * t * t - 4 * t) / 2, -(3 * s * s - 4 * s) / 2, t * t / 2


@jit
def basis_curvatures(t):
    """Return the second derivatives of `basis` by t."""
    s = 1 - t
    return s, 3 * t - 2, 3 * s - 2, t
