"""Rotations of a step, for stacks of vectors and complex numbers.

Formulas: `floatframe.engine.structure_preserving.kernels.markers`.
"""

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.model.rotations import (
    cross,
    dot,
    euler_parameter_product,
    euler_parameters_of_rotation_vector,
    tilde,
)


def cayley(theta: Array) -> Array:
    """Return cay(theta), (..., 3, 3)."""
    S = tilde(theta)
    return np.eye(3) + (S + 0.5 * S @ S) / (1 + 0.25 * dot(theta, theta))[..., None, None]


def cayley_parameters(p: Array, theta: Array) -> Array:
    """Return the Euler parameters of R(p) cay(theta), (4,)."""
    made = euler_parameter_product(p, np.array([1.0, *(0.5 * theta)]))
    return made / np.linalg.norm(made)


def relative_cayley(theta_0: Array, theta_1: Array) -> Array:
    """Return psi with exp(theta_1) = cay(psi) exp(theta_0), (..., 3)."""
    p_0, p_1 = (euler_parameters_of_rotation_vector(theta) for theta in (theta_0, theta_1))
    (c0, b0), (c1, b1) = ((p[..., :1], p[..., 1:]) for p in (p_0, p_1))
    return 2 * (c0 * b1 - c1 * b0 - cross(b1, b0)) / (c0 * c1 + dot(b0, b1)[..., None])
