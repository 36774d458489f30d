"""Strains of flat shells at their integration points, and the elasticity that belongs to them."""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array

__all__ = ["N_STRAINS", "FlatStrains", "inverse_2x2", "jacobians", "plane_elasticity"]

N_STRAINS = 9  #: eps_x eps_y gamma_xy, kappa_x kappa_y kappa_xy, gamma_xz gamma_yz, drilling


@dataclass(frozen=True, eq=False)
class FlatStrains:
    """Strain operators of n elements at p points: strains = B u with u the local dofs, six per corner."""

    B: Array  #: (n, p, 9, 6 c)
    weights: Array  #: area elements, (n, p) [m²]


def plane_elasticity(E: Array, nu: Array) -> Array:
    """Return plane stress elasticity C = E/(1 - nu²) [[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu)/2]], (n, 3, 3) [Pa]."""
    C = np.zeros((len(E), 3, 3))
    C[:, 0, 0] = C[:, 1, 1] = E / (1 - nu**2)
    C[:, 0, 1] = C[:, 1, 0] = nu * E / (1 - nu**2)
    C[:, 2, 2] = E / (2 * (1 + nu))
    return C


def jacobians(dN: Array, xy: Array) -> tuple[Array, Array]:
    """Return J = [[x,xi  y,xi], [x,eta  y,eta]], (n, p, 2, 2), and its determinant, (n, p)."""
    J = np.einsum("pck,nca->npka", dN, xy)
    return J, J[..., 0, 0] * J[..., 1, 1] - J[..., 0, 1] * J[..., 1, 0]


def inverse_2x2(J: Array, det: Array) -> Array:
    """Return J⁻¹ by its adjugate, (n, p, 2, 2)."""
    inverse = np.empty_like(J)
    inverse[..., 0, 0], inverse[..., 1, 1] = J[..., 1, 1], J[..., 0, 0]
    inverse[..., 0, 1], inverse[..., 1, 0] = -J[..., 0, 1], -J[..., 1, 0]
    return inverse / det[..., None, None]
