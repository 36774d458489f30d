"""Strains of flat shells at their integration points, and the corresponding elasticity."""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array, IntArray

__all__ = [
    "N_STRAINS",
    "FlatLaw",
    "FlatStrains",
    "PlateSides",
    "inverse_2x2",
    "jacobians",
    "plane_elasticity",
    "plate_sides",
]

N_STRAINS = 9  #: number of strains: eps_x eps_y gamma_xy, kappa_x kappa_y kappa_xy, gamma_xz gamma_yz, drilling


@dataclass(frozen=True, eq=False)
class FlatStrains:
    """Operators B of n elements at p points: strains = B u with local dofs u, six for each corner."""

    B: Array  #: strain operators, (n, p, 9, 6 c)
    weights: Array  #: area elements times quadrature weights, (n, p) [m²]


@dataclass(frozen=True, eq=False)
class FlatLaw:
    """Stiffness per area of n elements in local axes, for the strain operators (`elements.shells.laminate`)."""

    A: Array  #: matrix from membrane strains to membrane forces, (n, 3, 3) [N/m]
    B: Array  #: matrix from curvatures to membrane forces, (n, 3, 3) [N]
    bending: Array  #: bending stiffness D* = D - B A⁻¹ B, (n, 3, 3) [N m]
    shear_flexibility: Array  #: shear flexibility H⁻¹, (n, 2, 2) [m/N]
    drilling: Array  #: drilling stiffness gamma G t, (n,) [N/m]
    nu: Array  #: Poisson's ratio, (n,)


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
    """Return J⁻¹ from its adjugate, (n, p, 2, 2)."""
    inverse = np.empty_like(J)
    inverse[..., 0, 0], inverse[..., 1, 1] = J[..., 1, 1], J[..., 0, 0]
    inverse[..., 0, 1], inverse[..., 1, 0] = -J[..., 0, 1], -J[..., 1, 0]
    return inverse / det[..., None, None]


@dataclass(frozen=True, eq=False)
class PlateSides:
    """Operators on w, theta_x, theta_y of the corners for rotation and shear along the sides of plate elements."""

    length: Array  #: length of each side, (n, n_sides) [m]
    along: Array  #: unit vectors from the first to the second corner, (n, n_sides, 2)
    bulge: Array  #: Delta: rotation beta_s at the mid-point minus the mean of the ends, (n, n_sides, c, 3)
    shear: Array  #: shear strain gamma of the sides, (n, n_sides, c, 3)

    def curvature(self, gradients: Array) -> Array:
        """Return the part of kappa_x kappa_y kappa_xy due to the mid-side rotations Delta, (n, p, 3, c, 3).

        Parameters
        ----------
        gradients
            Gradients of the side functions (1 at the mid-point of a side, 0 on others) by x, y, (n, p, n_sides, 2).
        """
        c, s = np.moveaxis(self.along, -1, 0)
        by_x, by_y = gradients[..., 0], gradients[..., 1]
        factors = np.stack([c[:, None] * by_x, s[:, None] * by_y, c[:, None] * by_y + s[:, None] * by_x], axis=2)
        return np.einsum("npas,nscd->npacd", factors, self.bulge)


def plate_sides(xy: Array, sides: IntArray, law: FlatLaw) -> PlateSides:
    """Return the operators for rotation and shear along the sides of plate elements (DKMT, DKMQ).

    (1) the rotation is quadratic, beta_s = linear + 4 s/L (1 - s/L) Delta
    (2) equilibrium of the side, Q = M,s, gives its constant shear strain gamma = -(2/3) phi Delta with phi = 12 D_s/L²
        (H⁻¹)_s, where D_s is the bending stiffness along the side and (H⁻¹)_s the shear flexibility; for one isotropic
        material phi = 12 D/(kappa G t L²)
    (3) ∫ (w,s + beta_s - gamma) ds = 0 gives Delta = -3/2/(1 + phi) [(w_j - w_i)/L + (beta_si + beta_sj)/2]

    Parameters
    ----------
    xy
        Corners in the plane, (n, c, 2) [m].
    sides
        First and second corner of each side, (n_sides, 2).
    law
        Law of the elements.
    """
    n, c = xy.shape[:2]
    d = xy[:, sides[:, 1]] - xy[:, sides[:, 0]]
    L = np.linalg.norm(d, axis=2)
    along = d / L[..., None]
    cos, sin = np.moveaxis(along, -1, 0)
    curvature = np.stack([cos**2, sin**2, 2 * cos * sin], axis=-1)  # components of a unit curvature along the side
    D_s = np.einsum("nsi,nij,nsj->ns", curvature, law.bending, curvature)
    phi = 12 * D_s * np.einsum("nsi,nij,nsj->ns", along, law.shear_flexibility, along) / L**2
    bulge = np.zeros((n, len(sides), c, 3))
    for k, (i, j) in enumerate(sides):
        for corner, sign in ((i, -1.0), (j, 1.0)):
            bulge[:, k, corner] = np.stack([sign / L[:, k], -along[:, k, 1] / 2, along[:, k, 0] / 2], axis=1)
    bulge *= (-1.5 / (1 + phi))[:, :, None, None]
    return PlateSides(L, along, bulge, (-2 / 3 * phi)[:, :, None, None] * bulge)
