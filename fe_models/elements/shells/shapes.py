"""Shape functions of flat cells and of their sides, in reference coordinates."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from fe_models.foundation.arrays import Array, IntArray, frozen

__all__ = ["FlatShape", "flat_quadrature", "flat_shape"]


@dataclass(frozen=True, eq=False)
class FlatShape:
    """Shape functions at given points: N of the corners, and E of the sides (1 at its mid-point, 0 on other sides)."""

    values: Array  #: values of N, (n_points, n_corners)
    gradients: Array  #: gradients of N with respect to the reference coordinates, (n_points, n_corners, 2)
    side_values: Array  #: values of E, (n_points, n_sides)
    side_gradients: Array  #: gradients of E with respect to the reference coordinates, (n_points, n_sides, 2)
    sides: IntArray  #: first and second corner of each side, (n_sides, 2)


def flat_shape(kind: str, points: Array) -> FlatShape:
    """Return the shape functions of a cell type of `FLAT_TYPES`.

    Triangle: r, s in 0..1, N = 1 - r - s, r, s, and E = 4 N_i N_j. Quad: xi, eta in -1..1, N bilinear,
    E = (1 - xi²)(1 -+ eta)/2 and (1 - eta²)(1 +- xi)/2.

    Parameters
    ----------
    kind
        Cell type.
    points
        Reference points, (n_points, 2).
    """
    x, y = np.asarray(points, dtype=float).T
    if kind == "triangle":
        N = np.stack([1 - x - y, x, y], axis=1)
        dN = np.broadcast_to(np.array([(-1.0, -1.0), (1.0, 0.0), (0.0, 1.0)]), (len(x), 3, 2))
        sides = np.array([(0, 1), (1, 2), (2, 0)])
        i, j = sides.T
        E = 4 * N[:, i] * N[:, j]
        dE = 4 * (dN[:, i] * N[:, j, None] + N[:, i, None] * dN[:, j])
        return _frozen_shape(N, dN, E, dE, sides)
    xi, eta = QUAD_CORNERS.T
    N = (1 + np.outer(x, xi)) * (1 + np.outer(y, eta)) / 4
    dN = np.stack([xi * (1 + np.outer(y, eta)), eta * (1 + np.outer(x, xi))], axis=2) / 4
    sides = np.array([(0, 1), (1, 2), (2, 3), (3, 0)])
    E = np.stack([(1 - x**2) * (1 - y), (1 - y**2) * (1 + x), (1 - x**2) * (1 + y), (1 - y**2) * (1 - x)], axis=1) / 2
    by_x = np.stack([-2 * x * (1 - y), 1 - y**2, -2 * x * (1 + y), y**2 - 1], axis=1) / 2
    by_y = np.stack([x**2 - 1, -2 * y * (1 + x), 1 - x**2, -2 * y * (1 - x)], axis=1) / 2
    return _frozen_shape(N, dN, E, np.stack([by_x, by_y], axis=2), sides)


QUAD_CORNERS = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])


@cache
def flat_quadrature(kind: str, degree: int) -> tuple[Array, Array]:
    """Return points, (n_points, 2), and weights of a rule in reference coordinates that is exact for this degree.

    Triangles use the mid-points of the sides up to degree 2, else a rule of scikit-fem. Quads use products of Gauss
    points, exact for that degree in each direction.
    """
    if kind == "quad":
        x, w = np.polynomial.legendre.leggauss((degree + 2) // 2)
        eta, xi = (a.ravel() for a in np.meshgrid(x, x, indexing="ij"))
        return frozen(np.stack([xi, eta], axis=1)), frozen(np.outer(w, w).ravel())
    if degree <= 2:
        return frozen([(0.5, 0.0), (0.5, 0.5), (0.0, 0.5)]), frozen(np.full(3, 1 / 6))
    from skfem.quadrature import get_quadrature
    from skfem.refdom import RefTri

    points, weights = get_quadrature(RefTri, degree)
    return frozen(points.T), frozen(weights)


def _frozen_shape(N: Array, dN: Array, E: Array, dE: Array, sides: IntArray) -> FlatShape:
    return FlatShape(frozen(N), frozen(dN), frozen(E), frozen(dE), frozen(sides, np.int64))
