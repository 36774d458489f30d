"""Rotations of a step, for stacks of vectors and complex numbers.

cay(theta) = (1 - tilde/2)⁻¹ (1 + tilde/2), the rotation by 2 atan(|theta|/2) about theta. With R_1 = R_0 cay(theta) and
theta_G = R_0 theta

    R_1 a_1 - R_0 a_0 = theta_G × (R_0 a_0 + R_1 a_1)/2 + R_m (a_1 - a_0),    R_m = R_0 (1 + tilde(theta)/2):

the change of a vector that turns with a body and changes in it, exact for a step of any size.
"""

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.start.newton_equations import product

__all__ = ["cayley", "cayley_parameters", "cross", "dot", "exponential", "left_jacobian", "relative_cayley", "turned"]

SERIES_BELOW = 0.25  #: of the squared angle
TERMS = 10


def cross(a: Array, b: Array) -> Array:
    """Return a × b along the last axis."""
    a0, a1, a2 = a[..., 0], a[..., 1], a[..., 2]
    b0, b1, b2 = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0], axis=-1)


def dot(a: Array, b: Array) -> Array:
    """Return a · b along the last axis, without conjugation."""
    return (a * b).sum(axis=-1)


def turned(R: Array, a: Array) -> Array:
    """Return R a for stacks of matrices and vectors."""
    return (R @ a[..., None])[..., 0]


def stack_tilde(a: Array) -> Array:
    """Return tilde(a), (..., 3, 3)."""
    zero = np.zeros_like(a[..., 0])
    rows = [[zero, -a[..., 2], a[..., 1]], [a[..., 2], zero, -a[..., 0]], [-a[..., 1], a[..., 0], zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def cayley(theta: Array) -> Array:
    """Return cay(theta), (..., 3, 3)."""
    S = stack_tilde(theta)
    return np.eye(3) + (S + 0.5 * S @ S) / (1 + 0.25 * dot(theta, theta))[..., None, None]


def cayley_parameters(p: Array, theta: Array) -> Array:
    """Return the Euler parameters of R(p) cay(theta), (4,)."""
    return product(p, np.array([1.0, *(0.5 * theta)]) / np.sqrt(1 + 0.25 * theta @ theta))


def series(x: Array, first: int) -> Array:
    """Return Σ (-x)^k / (2 k + first)!."""
    total, term = np.zeros_like(x), np.ones_like(x)
    for k in range(1, first + 1):
        term = term / k
    for k in range(TERMS):
        total = total + term
        term = -term * x / ((2 * k + first + 1) * (2 * k + first + 2))
    return total


def quotients(theta: Array) -> tuple[Array, Array, Array]:
    """Return sin t / t, (1 - cos t)/t², (t - sin t)/t³ of rotation vectors."""
    x = dot(theta, theta)
    is_small = np.abs(x) < SERIES_BELOW
    if np.all(is_small):
        return series(x, 1), series(x, 2), series(x, 3)
    t = np.sqrt(np.where(is_small, 1.0, x))
    return (
        np.where(is_small, series(x, 1), np.sin(t) / t),
        np.where(is_small, series(x, 2), (1 - np.cos(t)) / t**2),
        np.where(is_small, series(x, 3), (t - np.sin(t)) / t**3),
    )


def exponential(theta: Array) -> Array:
    """Return exp(theta), (..., 3, 3)."""
    s, a, _ = quotients(theta)
    S = stack_tilde(theta)
    return np.eye(3) + s[..., None, None] * S + a[..., None, None] * (S @ S)


def left_jacobian(theta: Array) -> Array:
    """Return the left Jacobian of exp, (..., 3, 3)."""
    _, a, b = quotients(theta)
    S = stack_tilde(theta)
    return np.eye(3) + a[..., None, None] * S + b[..., None, None] * (S @ S)


def relative_cayley(theta_0: Array, theta_1: Array) -> Array:
    """Return psi with exp(theta_1) = cay(psi) exp(theta_0), (..., 3)."""
    parameters = []
    for theta in (theta_0, theta_1):
        s, a, _ = quotients(0.5 * theta)
        x = 0.25 * dot(theta, theta)
        parameters.append((1 - a * x, 0.5 * s[..., None] * theta))
    (c0, b0), (c1, b1) = parameters
    w = c0 * c1 + dot(b0, b1)
    return 2 * (c0[..., None] * b1 - c1[..., None] * b0 - cross(b1, b0)) / w[..., None]
