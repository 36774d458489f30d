"""Rotations: Euler parameters, rotation vectors, matrices, and the Jacobians of the exponential map.

One convention: R_GB maps components, v_G = R_GB @ v_B; p = (w, x, y, z) are its unit Euler parameters (Hamilton
product); a rotation vector theta turns B by |theta| about theta; omega_B is the angular velocity in body axes, so
that R_dot = R tilde(omega_B).
"""

import numpy as np

from fe_models.foundation.arrays import Array

__all__ = [
    "euler_parameter_rates",
    "euler_parameters",
    "euler_parameters_of_rotation_vector",
    "right_jacobian",
    "rotation_exp",
    "rotation_log",
    "rotation_matrix",
    "tilde",
]

SERIES_BELOW = 1e-2  #: rotation angle [rad] below which the trigonometric quotients come from their series


def tilde(a: Array) -> Array:
    """Return the matrix of a cross product, (3, 3): tilde(a) @ b = a × b."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def rotation_matrix(p: Array) -> Array:
    """R_GB, (3, 3), of the Euler parameters p = (w, x, y, z), (4,): v_G = R_GB @ v_B."""
    w, x, y, z = np.asarray(p, dtype=float)
    return np.array(
        [
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
    )


def euler_parameters(R: Array) -> Array:
    """Return p, (4,), of a rotation matrix, (3, 3); w >= 0.

    The largest of the four squares (from trace and diagonal) is taken first, so that no small number divides.
    """
    R = np.asarray(R, dtype=float)
    trace = np.trace(R)
    squares = np.array([1 + trace, *(1 + 2 * np.diag(R) - trace)]) / 4
    largest = int(np.argmax(squares))
    products = np.array(
        [  # p_i p_j
            [squares[0], (R[2, 1] - R[1, 2]) / 4, (R[0, 2] - R[2, 0]) / 4, (R[1, 0] - R[0, 1]) / 4],
            [(R[2, 1] - R[1, 2]) / 4, squares[1], (R[0, 1] + R[1, 0]) / 4, (R[0, 2] + R[2, 0]) / 4],
            [(R[0, 2] - R[2, 0]) / 4, (R[0, 1] + R[1, 0]) / 4, squares[2], (R[1, 2] + R[2, 1]) / 4],
            [(R[1, 0] - R[0, 1]) / 4, (R[0, 2] + R[2, 0]) / 4, (R[1, 2] + R[2, 1]) / 4, squares[3]],
        ]
    )
    p = products[largest] / np.sqrt(squares[largest])
    p /= np.linalg.norm(p)
    return p if p[0] >= 0 else -p


def euler_parameters_of_rotation_vector(theta: Array) -> Array:
    """Return p = (cos(|theta|/2), sin(|theta|/2) theta/|theta|), (4,), of a rotation vector, (3,) [rad]."""
    theta = np.asarray(theta, dtype=float)
    angle = np.linalg.norm(theta)
    return np.array([np.cos(angle / 2), *(0.5 * np.sinc(angle / (2 * np.pi)) * theta)])


def euler_parameter_rates(p: Array, omega_B: Array) -> Array:
    """p_dot = 1/2 p * (0, omega_B), (4,) [1/s]; omega_B, (3,) [rad/s], in body axes."""
    w, v = p[0], np.asarray(p[1:])
    return 0.5 * np.array([-(v @ omega_B), *(w * np.asarray(omega_B) + np.cross(v, omega_B))])


def rotation_exp(theta: Array) -> Array:
    """Return the rotation matrix of a rotation vector, (3, 3): 1 + sin(t)/t tilde + (1 - cos t)/t² tilde²."""
    theta = np.asarray(theta, dtype=float)
    S = tilde(theta)
    t = np.linalg.norm(theta)
    return np.eye(3) + np.sinc(t / np.pi) * S + 0.5 * np.sinc(t / (2 * np.pi)) ** 2 * (S @ S)


def rotation_log(R: Array) -> Array:
    """Return the rotation vector, (3,) [rad], of a rotation matrix; its length lies in 0..pi."""
    p = euler_parameters(R)
    sine = np.linalg.norm(p[1:])
    if sine == 0.0:
        return np.zeros(3)
    return 2 * np.arctan2(sine, p[0]) * p[1:] / sine


def right_jacobian(theta: Array) -> Array:
    """Return T(theta), (3, 3): exp(theta)ᵀ d exp(theta) = tilde(T dtheta); T = 1 - a tilde + b tilde².

    a = (1 - cos t)/t², b = (t - sin t)/t³. The left Jacobian is T(theta)ᵀ = T(-theta).
    """
    theta = np.asarray(theta, dtype=float)
    t = np.linalg.norm(theta)
    S = tilde(theta)
    a = 0.5 * np.sinc(t / (2 * np.pi)) ** 2
    b = 1 / 6 - t**2 / 120 + t**4 / 5040 if t < SERIES_BELOW else (t - np.sin(t)) / t**3
    return np.eye(3) - a * S + b * (S @ S)
