"""Rotations: Euler parameters, rotation vectors, matrices, and the Jacobians of the exponential map.

One convention is used throughout. R_GB maps components, v_G = R_GB @ v_B; p = (w, x, y, z) are its unit Euler
parameters (Hamilton product). A rotation vector theta rotates B by t = |theta| about theta. omega_B is the angular
velocity in body axes, so that R_dot = R tilde(omega_B). With S = tilde(theta)

    exp(theta) = 1 + s S + a S²,   left Jacobian L = 1 + a S + b S²,   right Jacobian T = Lᵀ = 1 - a S + b S²

    s = sin t / t,   a = (1 - cos t)/t²,   b = (t - sin t)/t³,   da = (da/dt)/t,   db = (db/dt)/t

Below t = 1/2 these quotients are computed by their series (the next term is below 1e-17). Vectors lie along the last
axis of stacks of any shape. Functions without a branch other than that of the series also accept complex numbers. The
kernels in kernels/rotation.py contain the same formulas for one vector, compiled; a test compares both.
"""

from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array, axial, tilde

__all__ = [
    "continued_rotation",
    "cross",
    "dot",
    "euler_parameter_product",
    "euler_parameter_rates",
    "euler_parameters",
    "euler_parameters_of_rotation_vector",
    "left_jacobian",
    "quotients",
    "right_jacobian",
    "rotated",
    "rotation_exp",
    "rotation_log",
    "rotation_matrix",
    "rotation_vector",
    "rotations_between",
    "spin_rate",
    "tilde",
]

SERIES_BELOW = 0.25  #: squared angle below which series are used
NEAR_FULL_TURN = 1e-6  #: distance of |theta| from full turns below which rounding destroys the direction of theta
TERMS = 10
CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])  #: factors on Euler parameters that give the inverse rotation


def cross(a: Array, b: Array) -> Array:
    """Return a × b along the last axis."""
    a0, a1, a2 = a[..., 0], a[..., 1], a[..., 2]
    b0, b1, b2 = b[..., 0], b[..., 1], b[..., 2]
    first = a1 * b2 - a2 * b1
    out = np.empty((*first.shape, 3), first.dtype)  # np.stack takes longer than the products of a few hundred vectors
    out[..., 0], out[..., 1], out[..., 2] = first, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0
    return out


def dot(a: Array, b: Array) -> Array:
    """Return a · b along the last axis, without conjugation."""
    return (a * b).sum(axis=-1)


def rotated(R: Array, a: Array) -> Array:
    """Return R a for stacks of matrices and vectors."""
    return (R @ a[..., None])[..., 0]


def rotation_matrix(p: Array) -> Array:
    """Return R_GB, (..., 3, 3), for Euler parameters p = (w, x, y, z), (..., 4): v_G = R_GB @ v_B.

    Parameters
    ----------
    p
        Euler parameters of length one, (..., 4).
    """
    p = np.asarray(p, dtype=float)
    # for a single rotation, Python numbers are four times as fast as arrays of length one
    w, x, y, z = p.tolist() if p.ndim == 1 else (p[..., k] for k in range(4))
    R = np.empty((*p.shape[:-1], 3, 3))
    R[..., 0, 0], R[..., 0, 1], R[..., 0, 2] = w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)
    R[..., 1, 0], R[..., 1, 1], R[..., 1, 2] = 2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)
    R[..., 2, 0], R[..., 2, 1], R[..., 2, 2] = 2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z
    return R


def euler_parameters(R: Array) -> Array:
    """Return p, (..., 4), with w >= 0, for rotation matrices, (..., 3, 3).

    It is computed from the row p_i p of the products p_j p_k with the largest p_i, so that no divisor is small.
    """
    R = np.asarray(R, dtype=float)
    trace = np.trace(R, axis1=-2, axis2=-1)[..., None]
    squares = np.concatenate([1 + trace, 1 + 2 * np.diagonal(R, axis1=-2, axis2=-1) - trace], axis=-1)
    products = np.zeros((*squares.shape, 4))  # 4 p_j p_k
    products[..., 0, 1:] = products[..., 1:, 0] = axial(R)
    products[..., 1:, 1:] = R + np.swapaxes(R, -1, -2)
    products[..., range(4), range(4)] = squares
    p = np.take_along_axis(products, squares.argmax(axis=-1)[..., None, None], axis=-2)[..., 0, :]
    p /= np.linalg.norm(p, axis=-1, keepdims=True)
    return np.where(p[..., :1] < 0.0, -p, p)


def euler_parameters_of_rotation_vector(theta: Array) -> Array:
    """Return p = (cos(|theta|/2), sin(|theta|/2) theta/|theta|), (..., 4), for a rotation vector, (..., 3) [rad].

    Complex numbers are accepted too.
    """
    theta = np.asarray(theta)
    x = 0.25 * dot(theta, theta)
    s, a, _ = quotients(x)
    return np.concatenate([(1 - a * x)[..., None], 0.5 * s[..., None] * theta], axis=-1)


def euler_parameter_product(p: Array, other: Array) -> Array:
    """Return the Euler parameters, (..., 4), of R(p) R(other)."""
    w, v, w_o, v_o = p[..., :1], p[..., 1:], other[..., :1], other[..., 1:]
    scalar = w * w_o - dot(v, v_o)[..., None]
    return np.concatenate([scalar, w * v_o + w_o * v + cross(v, v_o)], axis=-1)


def euler_parameter_rates(p: Array, omega_B: Array) -> Array:
    """Return p_dot = 1/2 p * (0, omega_B), (4,) [1/s], for omega_B, (3,) [rad/s], in body axes."""
    w, v = p[0], np.asarray(p[1:])
    return 0.5 * np.array([-(v @ omega_B), *(w * np.asarray(omega_B) + np.cross(v, omega_B))])


def series(x: Array, first: int) -> Array:
    """Return Σ (-x)^k / (2 k + first)!."""
    is_number = isinstance(x, float)  # for a single angle, Python numbers are five times as fast as NumPy's
    value: Any = float(x) if is_number else x
    total, term = (0.0, 1.0) if is_number else (np.zeros_like(x), np.ones_like(x))
    for k in range(1, first + 1):
        term = term / k
    for k in range(TERMS):
        total = total + term
        term = -term * value / ((2 * k + first + 1) * (2 * k + first + 2))
    return np.float64(total) if is_number else total  # type: ignore[return-value]  # numbers are arrays of shape ()


def series_of_rate(x: Array, first: int) -> Array:
    """Return twice the derivative of `series` with respect to x, Σ -2 (k + 1) (-x)^k / (2 k + 2 + first)!."""
    total, term = np.zeros_like(x), -2 * np.ones_like(x)
    for k in range(1, first + 3):
        term = term / k
    for k in range(TERMS):
        total = total + (k + 1) * term
        term = -term * x / ((2 * k + first + 3) * (2 * k + first + 4))
    return total


def quotients(x: Array) -> tuple[Array, Array, Array]:
    """Return s, a, b as functions of the squared angle x."""
    x = np.asarray(x) * 1.0
    is_small = np.abs(x) < SERIES_BELOW
    if np.all(is_small):
        return series(x, 1), series(x, 2), series(x, 3)
    t = np.sqrt(np.where(is_small, 1.0, x))
    return (
        np.where(is_small, series(x, 1), np.sin(t) / t),
        np.where(is_small, series(x, 2), (1 - np.cos(t)) / t**2),
        np.where(is_small, series(x, 3), (t - np.sin(t)) / t**3),
    )


def rates_of_quotients(x: Array) -> tuple[Array, Array]:
    """Return da, db as functions of the squared angle x."""
    x = np.asarray(x) * 1.0
    is_small = np.abs(x) < SERIES_BELOW
    t = np.sqrt(np.where(is_small, 1.0, x))
    sine, versine = np.sin(t), 1 - np.cos(t)
    return (
        np.where(is_small, series_of_rate(x, 2), (t * sine - 2 * versine) / t**4),
        np.where(is_small, series_of_rate(x, 3), (t * versine - 3 * (t - sine)) / t**5),
    )


def polynomial(theta: Array, first: Array, second: Array) -> Array:
    """Return the matrix 1 + first S + second S², (..., 3, 3), S = tilde(theta)."""
    S = tilde(theta)
    return np.eye(3) + first[..., None, None] * S + second[..., None, None] * (S @ S)


def rotation_exp(theta: Array) -> Array:
    """Return the rotation matrix of a rotation vector, (..., 3, 3) for (..., 3); complex numbers are accepted too."""
    theta = np.asarray(theta)
    s, a, _ = quotients(dot(theta, theta))
    return polynomial(theta, s, a)


def left_jacobian(theta: Array) -> Array:
    """Return L(theta), (..., 3, 3): d exp(theta) exp(theta)ᵀ = tilde(L dtheta); complex numbers are accepted too."""
    theta = np.asarray(theta)
    _, a, b = quotients(dot(theta, theta))
    return polynomial(theta, a, b)


def right_jacobian(theta: Array) -> Array:
    """Return T(theta) = L(theta)ᵀ = L(-theta), (..., 3, 3): exp(theta)ᵀ d exp(theta) = tilde(T dtheta)."""
    return left_jacobian(-np.asarray(theta))


def spin_rate(theta: Array, rate: Array, second: Array) -> Array:
    """Return the rate of the angular velocity omega = L(theta) rate of exp(theta), (..., 3), in the initial axes.

    It is L second + (theta · rate) (da theta × rate + db theta × (theta × rate)) + b rate × (theta × rate).
    """
    theta = np.asarray(theta)
    x = dot(theta, theta)
    _, _, b = quotients(x)
    da, db = rates_of_quotients(x)
    turn = cross(theta, rate)
    along = da[..., None] * turn + db[..., None] * cross(theta, turn)
    return (
        rotated(left_jacobian(theta), second) + dot(theta, rate)[..., None] * along + b[..., None] * cross(rate, turn)
    )


def rotation_log(R: Array) -> Array:
    """Return the rotation vectors, (..., 3) [rad], of rotation matrices, (..., 3, 3); their lengths are at most pi."""
    return rotation_vector(euler_parameters(R))


def rotation_vector(p: Array) -> Array:
    """Return the rotation vectors, (..., 3) [rad], of Euler parameters, (..., 4); their lengths are at most pi."""
    w, v = p[..., 0], p[..., 1:]
    sine = np.sqrt(dot(v, v))
    angle = 2 * np.arctan2(sine, np.abs(w)) * np.where(w < 0.0, -1.0, 1.0)
    return np.asarray(v * (angle / np.where(sine > 0.0, sine, 1.0))[..., None])


def rotations_between(p: Array, other: Array) -> Array:
    """Return the rotation vectors, (..., 3) [rad], from orientations `other` to p, both (..., 4)."""
    return rotation_vector(euler_parameter_product(other * CONJUGATE, p))


def continued_rotation(theta: Array, expected: Array) -> Array:
    """Return the rotation vector theta + 2 pi n theta/|theta| nearest to an expected one, (..., 3); |theta| <= pi.

    Complex numbers are accepted if the imaginary part of theta is small.
    """
    real = np.real(theta)
    t, size = np.linalg.norm(real, axis=-1), np.linalg.norm(expected, axis=-1)
    is_full = t < NEAR_FULL_TURN
    n = np.floor(((real * expected).sum(axis=-1) / np.where(is_full, 1.0, t) - t) / (2 * np.pi) + 0.5)
    length = np.sqrt(np.where(is_full, 1.0, dot(theta, theta)))
    own = np.where(is_full, 0.0, 2 * np.pi * n / length)
    n_full = np.floor(size / (2 * np.pi) + 0.5)
    other = np.where(is_full, 2 * np.pi * n_full / np.maximum(size, 1.0), 0.0)
    return np.asarray(theta + own[..., None] * theta + other[..., None] * expected)
