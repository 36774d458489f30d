"""Hertz's contact of two smooth bodies: semi-axes of the ellipse, stiffness, pressure.

The distance of the unloaded surfaces is A x² + B y², with A in the direction of rolling. With E* = G/(1 - nu) of two
equal bodies and the complete elliptic integrals K and E of the eccentricity e of the ellipse, k = short/long semi-axis
(1 - k² = e²):

(1)  ratio of the curvatures along the long axis L and the short axis S:  C_L / C_S = (K - E) / (E/k² - K)
(2)  L = (3 N E(e) / (2 pi k² (C_L + C_S) E*))^(1/3),  S = k L
(3)  approach = 3 N K(e) / (2 pi L E*),  so that N = stiffness approach^(3/2)
"""

from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.special import ellipe, ellipk

from fe_models.foundation.arrays import Array

__all__ = ["Ellipse", "ellipse"]


class Ellipse(NamedTuple):
    """The contact ellipse for a unit load: semi-axes are a_1 N^(1/3), b_1 N^(1/3); N = stiffness approach^(3/2)."""

    a_1: Array  #: factor of the semi-axis in rolling direction [m/N^(1/3)]
    b_1: Array  #: factor of the lateral semi-axis [m/N^(1/3)]
    stiffness: Array  #: Hertz stiffness [N/m^(3/2)]
    ratio: Array  #: ratio a/b of the semi-axes


def curvature_ratio(k: Array) -> Array:
    """Return C_L/C_S of an ellipse with the axis ratio k = short/long, equation (1)."""
    m = 1 - np.asarray(k) ** 2
    K, E = ellipk(m), ellipe(m)
    near = m < 1e-6  # both differences vanish like m
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = (K - E) / (E / (1 - m) - K)
    return np.where(near, 1 - 0.75 * m, ratio)


@cache
def axis_ratios() -> tuple[Array, Array]:
    """Return logarithms of k and of the ratio of curvatures, both increasing: the curve to be inverted."""
    log_k = np.linspace(np.log(1e-6), 0.0, 4001)
    return log_k, np.log(curvature_ratio(np.exp(log_k)))


def ellipse(A: Array, B: Array, modulus: float) -> Ellipse:
    """Return the ellipse of contact.

    Parameters
    ----------
    A, B
        Half the relative curvatures in the direction of rolling and across [1/m], above zero, of any equal shapes.
    modulus
        E* [Pa]: G/(1 - nu) for two bodies of the same material.
    """
    A, B = np.broadcast_arrays(np.asarray(A, dtype=float), np.asarray(B, dtype=float))
    low, high = np.minimum(A, B), np.maximum(A, B)
    wanted = np.log(low / high)
    log_k, log_ratio = axis_ratios()
    x = np.interp(wanted, log_ratio, log_k)
    for _ in range(3):  # Newton's method on the exact curve, with the slope of the table
        step = 1e-4
        slope = (
            np.log(curvature_ratio(np.exp(np.minimum(x + step, 0)))) - np.log(curvature_ratio(np.exp(x - step)))
        ) / (np.minimum(x + step, 0) - (x - step))
        x = np.minimum(x - (np.log(curvature_ratio(np.exp(x))) - wanted) / slope, 0.0)
    k = np.exp(x)
    m = 1 - k**2
    long_1 = (3 * ellipe(m) / (2 * np.pi * k**2 * (low + high) * modulus)) ** (1 / 3)
    short_1 = k * long_1
    stiffness = (2 * np.pi * modulus * long_1 / (3 * ellipk(m))) ** 1.5
    rolling_is_short = A >= B  # the larger curvature has the shorter axis
    a_1, b_1 = np.where(rolling_is_short, short_1, long_1), np.where(rolling_is_short, long_1, short_1)
    return Ellipse(a_1, b_1, stiffness, a_1 / b_1)
