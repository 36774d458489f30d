"""In-plane, bending and shear strains of flat shell elements: quadrilateral and triangle."""

import numpy as np

from fe_models.elements.shells.shapes import flat_quadrature, flat_shape
from fe_models.elements.shells.strains import (
    N_STRAINS,
    FlatLaw,
    FlatStrains,
    PlateSides,
    inverse_2x2,
    jacobians,
    plate_sides,
)
from fe_models.foundation.arrays import Array

__all__ = ["quad_strains", "triangle_strains"]


# quad -----------------------------------------------------------------------------------------------------------------
# The four-node element: discrete Kirchhoff-Mindlin plate (DKMQ), membrane with incompatible modes, drilling rotation.
#
# The rotation of the normal is beta_x = theta_y, beta_y = -theta_x; the in-plane displacement is u + z beta.
#
# Plate [1]_: along each side the rotation is quadratic and the shear strain constant, as in the triangle
# (`fe_models.elements.shells.strains.plate_sides`). Inside, the rotation is bilinear plus the contribution of the
# sides, and the covariant shear strains are linear between opposite sides. Quads and triangles therefore have the same
# rotation on a shared side. A plate of both passes the patch test of constant twist. A mixture of these triangles with
# MITC4 quads, whose rotation is linear along sides, does not.
#
# Membrane: the displacement is u = Σ N_i u_i + (1 - xi²) a_1 + (1 - eta²) a_2 with internal vectors a. Their gradients
# use the Jacobian at the centre, scaled by its determinant, so that their mean is zero and constant strain is exact for
# any shape. The drilling rotation is tied to the rotation of the same field by the energy gamma G t ∫ (½ (v,x - u,y) -
# theta_z)² (Hughes and Brezzi), which is zero for a rigid rotation. Because the internal modes contribute to the
# rotation, pure in-plane bending of rectangles is exact for any gamma. The internal vectors are condensed, so that
# strains are a linear function of the nodal dofs alone.
#
# .. [1] Katili (1993), Int. J. Numer. Meth. Engng 36, 1885-1908.


def quad_strains(xy: Array, law: FlatLaw) -> FlatStrains:
    """Return the strain operators at 2 × 2 Gauss points.

    Parameters
    ----------
    xy
        Corners in the plane, (n, 4, 2) [m].
    law
        Law of the elements.
    """
    n = len(xy)
    points, w = flat_quadrature("quad", 3)
    shape = flat_shape("quad", points)
    J, det = jacobians(shape.gradients, xy)
    inverse = inverse_2x2(J, det)
    weights = w * det
    dN = np.einsum("npak,pck->npca", inverse, shape.gradients)  # derivatives with respect to x, y
    B = np.zeros((n, len(points), N_STRAINS, 4, 6))
    B[:, :, 0, :, 0] = B[:, :, 2, :, 1] = dN[..., 0]
    B[:, :, 1, :, 1] = B[:, :, 2, :, 0] = dN[..., 1]
    B[:, :, 8, :, 0], B[:, :, 8, :, 1] = -dN[..., 1] / 2, dN[..., 0] / 2
    B[:, :, 8, :, 5] = -shape.values
    B[:, :, 3, :, 4], B[:, :, 4, :, 3] = dN[..., 0], -dN[..., 1]
    B[:, :, 5, :, 4], B[:, :, 5, :, 3] = dN[..., 1], -dN[..., 0]
    sides = plate_sides(xy, shape.sides, law)
    B[:, :, 3:6][..., 2:5] += sides.curvature(np.einsum("npak,pck->npca", inverse, shape.side_gradients))
    B[:, :, 6:8][..., 2:5] = _shear(xy, points, inverse, sides)
    operators: Array = B.reshape(n, len(points), N_STRAINS, 24)
    rows = [0, 1, 2, 8]
    operators[:, :, rows] += _condensed_modes(xy, points, det, weights, law, operators)
    return FlatStrains(operators, weights)


def _shear(xy: Array, points: Array, inverse: Array, sides: PlateSides) -> Array:
    """Return shear strain operators over w, theta_x, theta_y, (n, p, 2, 4, 3)."""
    # along xi on the sides 12 and 34, along eta on 23 and 41; covariant components are multiplied by half of the length
    covariant_sides = sides.shear * (sides.length / 2 * np.array([1.0, 1.0, -1.0, -1.0]))[:, :, None, None]
    xi, eta = points.T
    covariant = np.zeros((len(xy), len(points), 2, 4, 3))
    covariant[:, :, 0] = _between(covariant_sides[:, 0], covariant_sides[:, 2], eta)
    covariant[:, :, 1] = _between(covariant_sides[:, 3], covariant_sides[:, 1], xi)
    return np.einsum("npak,npkcd->npacd", inverse, covariant)


def _between(low: Array, high: Array, x: Array) -> Array:
    """Interpolate linearly in x between the values at -1 and +1, (n, p, 4, 6)."""
    return np.asarray((1 - x[:, None, None]) / 2 * low[:, None] + (1 + x[:, None, None]) / 2 * high[:, None])


def _condensed_modes(xy: Array, points: Array, det: Array, weights: Array, law: FlatLaw, operators: Array) -> Array:
    """Return the contribution of internal modes to eps_x eps_y gamma_xy and the drilling strain, (n, p, 4, 24).

    The internal vectors a minimise the energy: a = -(∫ Gᵀ C G)⁻¹ ∫ Gᵀ (C B u + N_kappa). C holds A and the drilling
    stiffness; N_kappa = B kappa is the membrane force of the curvatures of unsymmetric layups.
    """
    n, p = weights.shape
    centre = flat_shape("quad", np.zeros((1, 2)))
    J_0, det_0 = jacobians(centre.gradients, xy)
    inverse_0 = inverse_2x2(J_0, det_0)[:, 0]
    slopes = np.zeros((p, 2, 2))  # derivatives of the modes with respect to xi, eta
    slopes[:, 0, 0], slopes[:, 1, 1] = -2 * points[:, 0], -2 * points[:, 1]
    dM = np.einsum("nak,pmk->npma", inverse_0, slopes) * (det_0 / det)[:, :, None, None]
    modes = np.zeros((n, p, 4, 2, 2))
    modes[:, :, 0, :, 0] = modes[:, :, 2, :, 1] = dM[..., 0]
    modes[:, :, 1, :, 1] = modes[:, :, 2, :, 0] = dM[..., 1]
    modes[:, :, 3, :, 0], modes[:, :, 3, :, 1] = -dM[..., 1] / 2, dM[..., 0] / 2
    G: Array = modes.reshape(n, p, 4, 4)
    stiffness = np.zeros((n, 4, 4))
    stiffness[:, :3, :3], stiffness[:, 3, 3] = law.A, law.drilling
    weighted = np.einsum("npis,nij,np->npjs", G, stiffness, weights).reshape(n, 4 * p, 4).transpose(0, 2, 1)
    forces = weighted @ operators[:, :, [0, 1, 2, 8]].reshape(n, 4 * p, 24)
    if law.B.any():
        bent = np.einsum("npis,nij,np->npjs", G[:, :, :3], law.B, weights).reshape(n, 3 * p, 4).transpose(0, 2, 1)
        forces += bent @ operators[:, :, 3:6].reshape(n, 3 * p, 24)
    a = -np.linalg.solve(weighted @ G.reshape(n, 4 * p, 4), forces)
    return np.asarray(G @ a[:, None])


# the three-node element: discrete Kirchhoff-Mindlin plate (DKMT), optimal membrane with drilling (ANDES) --------------
# Plate [1]_: along each side the rotation is quadratic and the shear strain constant
# (`fe_models.elements.shells.strains.plate_sides`). Thin triangles then follow discrete Kirchhoff theory, and thick
# triangles deform in shear, without locking. The shear field inside is linear, with constant tangential strain on every
# side.
#
# Membrane [2]_: the element has two parts. The constant part has L lumped from linear side displacements and the
# drilling rotations (alpha_b = 3/2). The linear part depends on the hierarchical drilling rotations theta~ = theta -
# theta_0, where theta_0 is the rotation of the linear triangle. Its natural strains at the corners are Q_k theta~ with
# the optimal coefficients. beta_0 = (1 - 4 nu²)/2 makes in-plane bending of a rectangle of two triangles nearly exact
# at any aspect ratio. Both parts are orthogonal in energy.
#
# .. [1] Katili (1993), Int. J. Numer. Meth. Engng 36, 1859-1883.
# .. [2] Felippa (2003), Comput. Methods Appl. Mech. Engrg. 192, 2125-2168.


SIDES = ((0, 1), (1, 2), (2, 0))  #: sides of the membrane
#: natural strains at the corners from theta~, before scaling with 2 A/(3 l²) of the sides 21, 32, 13
CORNER_STRAINS = np.array(
    [
        [(1, 2, 1), (0, 1, -1), (-1, -1, -2)],
        [(-2, -1, -1), (1, 1, 2), (-1, 0, 1)],
        [(1, -1, 0), (-1, -2, -1), (2, 1, 1)],
    ],
    dtype=float,
)
LEAST_BETA_0 = 0.01  #: lower bound of beta_0, reached where nu is near 1/2


def triangle_strains(xy: Array, law: FlatLaw) -> FlatStrains:
    """Return the strain operators at the mid-points of the sides.

    Parameters
    ----------
    xy
        Corners in the plane, anticlockwise, (n, 3, 2) [m].
    law
        Law of the elements.
    """
    n = len(xy)
    points, w = flat_quadrature("triangle", 2)
    area = _area(xy)
    B = np.zeros((n, len(points), N_STRAINS, 3, 6))
    B[:, :, :3][..., [0, 1, 5]] = _membrane(xy, area, law.nu)
    B[:, :, 3:8][..., [2, 3, 4]] = _plate(xy, area, law, points)
    return FlatStrains(B.reshape(n, len(points), N_STRAINS, 18), 2 * area[:, None] * w)


def _membrane(xy: Array, area: Array, nu: Array) -> Array:
    """Return membrane strain operators at the mid-points of sides 12, 23, 31 over u, v, theta_z, (n, 3, 3, 3, 3)."""
    n = len(xy)
    mean = np.zeros((n, 3, 3, 3))  # Lᵀ/V: nodal forces of unit stresses, (n, strain, corner, dof)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        y_jk, x_kj = xy[:, j, 1] - xy[:, k, 1], xy[:, k, 0] - xy[:, j, 0]
        y_ik, y_ji = xy[:, i, 1] - xy[:, k, 1], xy[:, j, 1] - xy[:, i, 1]
        x_ki, x_ij = xy[:, k, 0] - xy[:, i, 0], xy[:, i, 0] - xy[:, j, 0]
        mean[:, 0, i, 0] = mean[:, 2, i, 1] = y_jk
        mean[:, 1, i, 1] = mean[:, 2, i, 0] = x_kj
        mean[:, 0, i, 2] = y_jk * (y_ik - y_ji) / 4  # alpha_b/6 = 1/4
        mean[:, 1, i, 2] = x_kj * (x_ki - x_ij) / 4
        mean[:, 2, i, 2] = (x_ki * y_ik - x_ij * y_ji) / 2  # alpha_b/3 = 1/2
    mean /= 2 * area[:, None, None, None]
    hierarchical = np.zeros((n, 3, 3, 3))  # theta~ of the three corners
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        hierarchical[:, :, i, 0] = ((xy[:, k, 0] - xy[:, j, 0]) / (4 * area))[:, None]
        hierarchical[:, :, i, 1] = ((xy[:, k, 1] - xy[:, j, 1]) / (4 * area))[:, None]
    hierarchical[:, [0, 1, 2], [0, 1, 2], 2] = 1.0
    l2 = np.stack([((xy[:, j] - xy[:, i]) ** 2).sum(axis=1) for i, j in SIDES], axis=1)  # 21, 32, 13
    at_corners = CORNER_STRAINS * (2 * area[:, None] / (3 * l2))[:, None, :, None]  # (n, corner, side, theta~)
    at_middles = (at_corners + np.roll(at_corners, -1, axis=1)) / 2
    # convert natural strains along the sides to eps_x eps_y gamma_xy
    d = np.stack([xy[:, j] - xy[:, i] for i, j in SIDES], axis=1)
    along = np.stack([d[..., 0] ** 2, d[..., 1] ** 2, d[..., 0] * d[..., 1]], axis=2) / l2[:, :, None]
    linear = np.linalg.solve(along[:, None], at_middles)  # (n, middle, strain, theta~)
    scale = 1.5 * np.sqrt(np.maximum((1 - 4 * nu**2) / 2, LEAST_BETA_0))
    return np.asarray(
        mean[:, None] + scale[:, None, None, None, None] * np.einsum("nmst,ntcd->nmscd", linear, hierarchical)
    )


def _plate(xy: Array, area: Array, law: FlatLaw, points: Array) -> Array:
    """Return curvature and shear operators over w, theta_x, theta_y, (n, p, 5, 3 corners, 3)."""
    n = len(xy)
    shape = flat_shape("triangle", points)
    slope = np.zeros((n, 3, 2))  # derivatives of the corner functions with respect to x, y
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        slope[:, i, 0] = (xy[:, j, 1] - xy[:, k, 1]) / (2 * area)
        slope[:, i, 1] = (xy[:, k, 0] - xy[:, j, 0]) / (2 * area)
    B = np.zeros((n, len(points), 5, 3, 3))
    B[:, :, 0, :, 2] = B[:, :, 2, :, 2] = slope[:, None, :, 0]
    B[:, :, 2, :, 2] = slope[:, None, :, 1]
    B[:, :, 1, :, 1] = -slope[:, None, :, 1]
    B[:, :, 2, :, 1] = -slope[:, None, :, 0]
    sides = plate_sides(xy, shape.sides, law)
    by_xy = slope[:, 1:]  # the reference coordinates are the functions of the second and third corner
    B[:, :, :3] += sides.curvature(np.einsum("pks,nsa->npka", shape.side_gradients, by_xy))
    along, shear = sides.along, sides.shear
    for corner, (k, m) in enumerate(((0, 2), (1, 0), (2, 1))):  # the sides that meet at the corner
        here = np.linalg.solve(along[:, [k, m]], shear[:, [k, m]].reshape(n, 2, 9)).reshape(n, 2, 3, 3)
        B[:, :, 3:] += shape.values[None, :, corner, None, None, None] * here[:, None]
    return B


def _area(xy: Array) -> Array:
    a, b = xy[:, 1] - xy[:, 0], xy[:, 2] - xy[:, 0]
    return np.asarray((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2)
