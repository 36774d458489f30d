"""Kalker's coefficients of linear creep, interpolated in his table over a/b and Poisson's ratio.

Between rows, the coefficients are interpolated linearly in g = min(a/b, b/a). Between Poisson's ratios, their
reciprocals, which are nearly linear in nu, are interpolated by a parabola. Beyond the table, g < 0.1, Kalker's
asymptotes are used, scaled to be continuous at g = 0.1. C32 = -C23 (Kalker 1990, Table E3).
"""

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.errors import ModelError

__all__ = ["kalker_coefficients"]

G_ROWS = np.arange(1, 11) / 10
#: a <= b, rows g = a/b: C11, C22, C23, C33, each for nu = 0, 1/4, 1/2
NARROW = np.array([
    [2.51, 3.31, 4.85, 2.51, 2.52, 2.53, 0.334, 0.473, 0.731, 6.42, 8.28, 11.7],
    [2.59, 3.37, 4.81, 2.59, 2.63, 2.66, 0.483, 0.603, 0.809, 3.46, 4.27, 5.66],
    [2.68, 3.44, 4.80, 2.68, 2.75, 2.81, 0.607, 0.715, 0.889, 2.49, 2.96, 3.72],
    [2.78, 3.53, 4.82, 2.78, 2.88, 2.98, 0.720, 0.823, 0.977, 2.02, 2.32, 2.77],
    [2.88, 3.62, 4.83, 2.88, 3.01, 3.14, 0.827, 0.929, 1.07, 1.74, 1.93, 2.22],
    [2.98, 3.72, 4.91, 2.98, 3.14, 3.31, 0.930, 1.03, 1.18, 1.56, 1.68, 1.86],
    [3.09, 3.81, 4.97, 3.09, 3.28, 3.48, 1.03, 1.14, 1.29, 1.43, 1.50, 1.60],
    [3.19, 3.91, 5.05, 3.19, 3.41, 3.65, 1.13, 1.25, 1.40, 1.34, 1.37, 1.42],
    [3.29, 4.01, 5.12, 3.29, 3.54, 3.82, 1.23, 1.36, 1.51, 1.27, 1.27, 1.27],
    [3.40, 4.12, 5.20, 3.40, 3.67, 3.98, 1.33, 1.47, 1.63, 1.21, 1.19, 1.16],
]).reshape(10, 4, 3)  # fmt: skip
#: a >= b, rows g = b/a
LONG = np.array([
    [10.7, 11.7, 12.9, 10.7, 12.8, 16.0, 12.2, 14.6, 18.0, 0.795, 0.526, 0.228],
    [6.96, 7.78, 8.82, 6.96, 8.14, 9.79, 5.72, 6.63, 7.89, 0.828, 0.601, 0.341],
    [5.57, 6.34, 7.34, 5.57, 6.40, 7.51, 3.79, 4.32, 5.01, 0.868, 0.674, 0.446],
    [4.84, 5.57, 6.57, 4.84, 5.48, 6.31, 2.88, 3.24, 3.70, 0.912, 0.747, 0.549],
    [4.37, 5.10, 6.11, 4.37, 4.90, 5.56, 2.35, 2.62, 2.96, 0.958, 0.819, 0.650],
    [4.06, 4.78, 5.80, 4.06, 4.50, 5.04, 2.01, 2.23, 2.50, 1.01, 0.892, 0.751],
    [3.82, 4.54, 5.58, 3.82, 4.21, 4.67, 1.76, 1.95, 2.18, 1.05, 0.965, 0.852],
    [3.65, 4.36, 5.42, 3.65, 3.99, 4.39, 1.58, 1.75, 1.94, 1.10, 1.04, 0.954],
    [3.51, 4.22, 5.30, 3.51, 3.81, 4.16, 1.44, 1.59, 1.77, 1.16, 1.11, 1.06],
    [3.40, 4.12, 5.20, 3.40, 3.67, 3.98, 1.33, 1.47, 1.63, 1.21, 1.19, 1.16],
]).reshape(10, 4, 3)  # fmt: skip


def asymptotes(g: Array, nu: float, narrow: bool) -> Array:
    """Return C11, C22, C23, C33 of a very slender ellipse, (4, n), by their leading terms in g (Kalker 1990)."""
    if narrow:
        L = np.log(16 / g**2)
        c11 = np.full_like(g, np.pi**2 / 4 / (1 - nu))
        c22 = np.full_like(g, np.pi**2 / 4)
        c23 = np.pi * np.sqrt(g) / 3 / (1 - nu) * (1 + nu * (0.5 * L + np.log(4) - 5))
        c33 = np.pi**2 / 16 / (1 - nu) / g
    else:
        L = np.log(16 / g**2)
        more = 3 - np.log(4)
        c11 = 2 * np.pi / (L - 2 * nu) / g * (1 + more / (L - 2 * nu))
        d = (1 - nu) * L + 2 * nu
        c22 = 2 * np.pi / g * (1 + (1 - nu) * more / d) / d
        c23 = 2 * np.pi / 3 / g**1.5 / ((1 - nu) * L - 2 + 4 * nu)
        c33 = np.pi / 4 * (1 - nu * (L - 2) / ((1 - nu) * L - 2 + 4 * nu))
    return np.array([c11, c22, c23, c33])


def kalker_coefficients(ratio: Array, nu: float) -> Array:
    """Return C11, C22, C23, C33, (4, n), of ellipses with a/b = `ratio`, a in the rolling direction.

    F_x = -a b G C11 xi, F_y = -a b G (C22 eta + sqrt(a b) C23 phi), M = a b G sqrt(a b) (C23 eta - sqrt(a b) C33 phi),
    for two bodies of the same material with shear modulus G.

    Parameters
    ----------
    ratio
        a/b, above zero, an array of any shape.
    nu
        Poisson's ratio, 0 to 1/2.

    Raises
    ------
    ModelError
        If nu is out of this range.
    """
    if not 0.0 <= nu <= 0.5:
        raise ModelError(f"kalker_coefficients: Poisson's ratio: expected 0 to 0.5, got {nu:g}")
    ratio = np.asarray(ratio, dtype=float)
    g = np.minimum(ratio, 1 / ratio)
    found = np.empty((4, *ratio.shape))
    weights = np.array([8 * (nu - 0.25) * (nu - 0.5), -16 * nu * (nu - 0.5), 8 * nu * (nu - 0.25)])
    for narrow, table in ((True, NARROW), (False, LONG)):
        here = (ratio <= 1) if narrow else (ratio > 1)
        inside = np.maximum(g[here], 0.1)
        at_nu = 1 / ((1 / table) @ weights)  # (10, 4)
        rows = np.array([np.interp(inside, G_ROWS, at_nu[:, c]) for c in range(4)])
        outside = g[here] < 0.1
        if outside.any():
            scale = at_nu[0] / asymptotes(np.array([0.1]), nu, narrow)[:, 0]
            rows[:, outside] = asymptotes(g[here][outside], nu, narrow) * scale[:, None]
        found[:, here] = rows
    return found
