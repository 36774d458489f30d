r"""The three-node element: discrete Kirchhoff-Mindlin plate (DKMT), optimal membrane with drilling (ANDES).

Plate [1]_: along each side the rotation is quadratic and the shear strain constant
(`fe_models.elements.shells.strains.plate_sides`). Thin triangles are then those of discrete Kirchhoff theory, and thick
triangles deform in shear, without locking. The shear field inside is linear, with constant tangential strain on every
side.

Membrane [2]_: the element has two parts. The constant part has L lumped from linear side displacements and the drilling
rotations (alpha_b = 3/2). The linear part depends on the hierarchical drilling rotations theta~ = theta - theta_0,
where theta_0 is the rotation of the linear triangle. Its natural strains at the corners are Q_k theta~ with the optimal
coefficients. beta_0 = (1 - 4 nu²)/2 makes in-plane bending of a rectangle of two triangles nearly exact at any aspect
ratio. Both parts are orthogonal in energy.

.. [1] Katili (1993), Int. J. Numer. Meth. Engng 36, 1859-1883.
.. [2] Felippa (2003), Comput. Methods Appl. Mech. Engrg. 192, 2125-2168.
"""

import numpy as np

from fe_models.elements.shells.shapes import flat_quadrature, flat_shape
from fe_models.elements.shells.strains import N_STRAINS, FlatLaw, FlatStrains, plate_sides
from fe_models.foundation.arrays import Array

__all__ = ["triangle_strains"]

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
LEAST_BETA_0 = 0.01  #: lower bound, reached where nu is near 1/2


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
