"""The ten inertial parameters of a rigid body, in which its inverse dynamics is linear.

    phi = (m, S_x, S_y, S_z, J_xx, J_xy, J_xz, J_yy, J_yz, J_zz)

contains the mass, the first moment and the inertia about the origin of the body frame, all in axes of the body (J_xy
etc. are elements of the tensor: minus the products of inertia).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.errors import ModelError
from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.model.system import System

__all__ = [
    "INERTIAL", "body_from_parameters", "inertia_columns", "parameters_in", "parameters_of", "point_mass",
    "pseudo_inertia", "system_with",
]  # fmt: skip

INERTIAL = ("m", "S_x", "S_y", "S_z", "J_xx", "J_xy", "J_xz", "J_yy", "J_yz", "J_zz")
#: elements of the inertia tensor J in the order of the parameters
PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


def parameters_of(body: RigidBody) -> Array:
    """Return the parameters of a body, (10,) [kg, kg m, kg m²]."""
    J = body.inertia_about_origin
    return np.array([body.mass, *(body.mass * body.center_of_mass), *(J[pair] for pair in PAIRS)])


def tensor(phi: Array) -> Array:
    """Return the inertia tensors J, (..., 3, 3), for parameters, (..., 10)."""
    xx, xy, xz, yy, yz, zz = np.moveaxis(np.asarray(phi)[..., 4:], -1, 0)
    return np.stack([np.stack(row, -1) for row in ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))], -2)


def pseudo_inertia(phi: Array) -> Array:
    """Return the integral over mass of (c, 1)(c, 1)ᵀ, (..., 4, 4): positive definite for every real body [1]_.

    References
    ----------
    .. [1] Wensing, Kim & Slotine (2018), IEEE Robotics and Automation Letters 3, 60-67.
    """
    phi = np.asarray(phi)
    J = tensor(phi)
    P = np.zeros((*phi.shape[:-1], 4, 4))
    P[..., :3, :3] = 0.5 * np.trace(J, axis1=-2, axis2=-1)[..., None, None] * np.eye(3) - J
    P[..., :3, 3] = P[..., 3, :3] = phi[..., 1:4]
    P[..., 3, 3] = phi[..., 0]
    return P


def point_mass(c: Array) -> Array:
    """Return the parameters of a unit point mass at c, (3,), as (10,)."""
    J = c @ c * np.eye(3) - np.outer(c, c)
    return np.array([1.0, *c, *(J[pair] for pair in PAIRS)])


def parameters_in(r: Array, R: Array) -> Array:
    """Return the matrix, (10, 10), from parameters in a frame at r with axes R (columns) to those in the ground."""
    out = np.zeros((10, 10))
    for k in range(10):
        unit = np.zeros(10)
        unit[k] = 1.0
        m, S, J = unit[0], R @ unit[1:4], R @ tensor(unit) @ R.T
        shifted = J + (m * (r @ r) + 2 * r @ S) * np.eye(3) - m * np.outer(r, r) - np.outer(r, S) - np.outer(S, r)
        out[:, k] = [m, *(S + m * r), *(shifted[pair] for pair in PAIRS)]
    return out


def inertia_columns(x: Array) -> Array:
    """Return L(x), (..., 3, 6), with J x = L(x) (J_xx, J_xy, J_xz, J_yy, J_yz, J_zz)."""
    x = np.asarray(x)
    out = np.zeros((*x.shape[:-1], 3, 6))
    for k, (a, b) in enumerate(PAIRS):
        out[..., a, k] += x[..., b]
        if a != b:
            out[..., b, k] += x[..., a]
    return out


def body_from_parameters(body: RigidBody, phi: Array) -> RigidBody:
    """Return a body with other parameters, (10,); `ModelError` if they are physically impossible."""
    phi = np.asarray(phi, dtype=float)
    if not phi[0] > 0:
        raise ModelError(f"rigid body {body.name!r}: mass: expected a number above 0, got {phi[0]:.6g}")
    c = phi[1:4] / phi[0]
    J = tensor(phi) - phi[0] * (c @ c * np.eye(3) - np.outer(c, c))
    return replace(body, mass=float(phi[0]), center_of_mass=c, inertia=J)


def system_with(system: System, parameters: Sequence[Array] | Array) -> System:
    """Return a system whose rigid bodies have other parameters, (n_b, 10) or flat."""
    phi = np.asarray(parameters, dtype=float).reshape(-1, 10)
    if len(phi) != len(system.bodies):
        raise ModelError(
            f"system {system.name!r}: expected 10 parameters for each of {len(system.bodies)} bodies, got {phi.size}"
        )
    bodies = []
    for body, values in zip(system.bodies, phi, strict=True):
        if not isinstance(body, RigidBody):
            raise ModelError(f"system {system.name!r}: body {body.name!r}: expected a rigid body, got a flexible one")
        bodies.append(body_from_parameters(body, values))
    return replace(system, bodies=bodies)
