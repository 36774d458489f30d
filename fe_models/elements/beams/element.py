"""Straight two-node Timoshenko beam element in local axes: interpolation and stiffness.

The local dofs at both ends are u_x u_y u_z theta_x theta_y theta_z of the centroid, with x along the axis and xi = x/L
in 0..1. Without distributed load, the equilibrium EI theta'' + kappa G A (v' - theta) = 0, kappa G A (v' - theta)' = 0
has the solution of cubic v and quadratic theta. Expressed by the end values, with Phi = 12 E I / (kappa G A L²), this
gives the shape functions below, which are exact for end loads. Therefore the stiffness from their energy is exact too.
Torsion and shear act at the shear centre (y_s, z_s): v_s = v - z_s theta_x, w_s = w + y_s theta_x.
"""

import numpy as np

from fe_models.foundation.arrays import Array

__all__ = ["end_forces_at_centroid", "interpolation", "local_stiffness", "shear_parameter"]

# local dofs of bending in the x-y plane (v, theta_z at both ends), and in the x-z plane, where w' = -theta_y
_XY, _XZ = np.array([1, 5, 7, 11]), np.array([2, 4, 8, 10])
_SIGNS = {"xy": np.array([1.0, 1.0, 1.0, 1.0]), "xz": np.array([1.0, -1.0, 1.0, -1.0])}


def shear_parameter(EI: Array, GA_s: Array, L: Array) -> Array:
    """Return Phi = 12 E I / (G A_s L²), (n,); zero for an infinite shear area."""
    return np.asarray(12 * EI / (GA_s * L**2))


def bending_shapes(xi: Array, Phi: Array, L: Array) -> tuple[Array, Array]:
    """Return shape functions of deflection and rotation over v_1 theta_1 v_2 theta_2, (n, n_points, 4) each.

    Parameters
    ----------
    xi
        Positions x/L, (n_points,).
    Phi, L
        Shear parameter and length of the elements, (n,).
    """
    xi = np.asarray(xi, dtype=float)[None, :]
    Phi, L = np.asarray(Phi)[:, None], np.asarray(L)[:, None]
    kappa = 1 / (1 + Phi)
    deflection = [
        kappa * (1 - 3 * xi**2 + 2 * xi**3 + Phi * (1 - xi)),
        kappa * L * (xi - 2 * xi**2 + xi**3 + Phi / 2 * (xi - xi**2)),
        kappa * (3 * xi**2 - 2 * xi**3 + Phi * xi),
        kappa * L * (xi**3 - xi**2 + Phi / 2 * (xi**2 - xi)),
    ]
    rotation = [
        kappa * 6 / L * (xi**2 - xi),
        kappa * (1 - 4 * xi + 3 * xi**2 + Phi * (1 - xi)),
        kappa * 6 / L * (xi - xi**2),
        kappa * (3 * xi**2 - 2 * xi + Phi * xi),
    ]
    return np.stack(deflection, axis=-1), np.stack(rotation, axis=-1)


def interpolation(xi: Array, Phi_y: Array, Phi_z: Array, L: Array, shear_center: Array) -> Array:
    """Return the motion (u, theta) of the centroid at points xi per unit local dof, (n, n_points, 6, 12).

    Parameters
    ----------
    xi
        Positions x/L, (n_points,).
    Phi_y, Phi_z
        Shear parameters of bending in the x-y and in the x-z plane, (n,).
    L
        Lengths, (n,) [m].
    shear_center
        (y, z) of the shear centre, (n, 2) [m].
    """
    n, n_points = len(L), len(xi)
    N = np.zeros((n, n_points, 6, 12))
    linear = np.stack([1 - np.asarray(xi), np.asarray(xi)], axis=-1)  # (n_points, 2)
    for component in (0, 3):
        N[:, :, component, component] = linear[:, 0]
        N[:, :, component, component + 6] = linear[:, 1]
    for plane, dofs, Phi, u, theta in (("xy", _XY, Phi_y, 1, 5), ("xz", _XZ, Phi_z, 2, 4)):
        deflection, rotation = bending_shapes(xi, Phi, L)
        N[:, :, u, dofs] = deflection * _SIGNS[plane]
        N[:, :, theta, dofs] = rotation * _SIGNS[plane] * (-1 if plane == "xz" else 1)
    return _about_shear_center(N, shear_center)


def _about_shear_center(N: Array, shear_center: Array) -> Array:
    """Transform an interpolation of the shear centre to that of the centroid."""
    if not np.any(shear_center):
        return N
    y_s, z_s = np.asarray(shear_center).T
    to_shear_center = np.tile(np.eye(12), (len(y_s), 1, 1))  # maps nodal dofs to the shear centre
    for first in (0, 6):
        to_shear_center[:, first + 1, first + 3] = -z_s
        to_shear_center[:, first + 2, first + 3] = y_s
    N = N @ to_shear_center[:, None]
    N[:, :, 1] += z_s[:, None, None] * N[:, :, 3]
    N[:, :, 2] -= y_s[:, None, None] * N[:, :, 3]
    return N


def local_stiffness(EA: Array, GJ: Array, EIy: Array, EIz: Array, Phi_y: Array, Phi_z: Array, L: Array) -> Array:
    """Return the stiffness in local axes if shear centre and centroid coincide, (n, 12, 12) [N/m, N, N m].

    The bending block of one plane is E I / ((1 + Phi) L³) [[12, 6L, -12, 6L], [., (4+Phi)L², -6L, (2-Phi)L²], …].
    """
    n = len(L)
    K = np.zeros((n, 12, 12))
    for component, stiffness in ((0, EA / L), (3, GJ / L)):
        for i, j, sign in ((0, 0, 1), (6, 6, 1), (0, 6, -1), (6, 0, -1)):
            K[:, component + i, component + j] = sign * stiffness
    for plane, dofs, EI, Phi in (("xy", _XY, EIz, Phi_y), ("xz", _XZ, EIy, Phi_z)):
        b = np.zeros((n, 4, 4))
        b[:, 0, 0] = b[:, 2, 2] = 12.0
        b[:, 0, 2] = b[:, 2, 0] = -12.0
        b[:, 0, 1] = b[:, 1, 0] = b[:, 0, 3] = b[:, 3, 0] = 6 * L
        b[:, 2, 1] = b[:, 1, 2] = b[:, 2, 3] = b[:, 3, 2] = -6 * L
        b[:, 1, 1] = b[:, 3, 3] = (4 + Phi) * L**2
        b[:, 1, 3] = b[:, 3, 1] = (2 - Phi) * L**2
        b *= (EI / ((1 + Phi) * L**3))[:, None, None] * np.outer(_SIGNS[plane], _SIGNS[plane])
        K[np.ix_(np.arange(n), dofs, dofs)] = b
    return K


def stiffness_about_shear_center(K: Array, shear_center: Array) -> Array:
    """Return the stiffness over dofs of the centroid for torsion and shear about the shear centre, (n, 12, 12)."""
    if not np.any(shear_center):
        return K
    y_s, z_s = np.asarray(shear_center).T
    T = np.tile(np.eye(12), (len(y_s), 1, 1))
    for first in (0, 6):
        T[:, first + 1, first + 3] = -z_s
        T[:, first + 2, first + 3] = y_s
    return np.asarray(T.transpose(0, 2, 1) @ K @ T)


def end_forces_at_centroid(f: Array) -> Array:
    """Return section forces N Vy Vz Mx My Mz at both ends from element nodal forces, (n, 2, 6, k).

    The face at the second end has the normal +x, so its section forces equal the nodal forces. At the first end they
    are the negative of the nodal forces.
    """
    f = np.asarray(f)
    f = f.reshape(len(f), 2, 6, f.shape[2] if f.ndim == 3 else 1)
    return f * np.array([-1.0, 1.0])[None, :, None, None]
