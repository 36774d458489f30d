r"""The four-node element: discrete Kirchhoff-Mindlin plate (DKMQ), membrane with incompatible modes, drilling rotation.

The rotation of the normal is beta_x = theta_y, beta_y = -theta_x; the in-plane displacement is u + z beta.

Plate [1]_: along each side the rotation is quadratic and the shear strain constant, as in the triangle
(`fe_models.elements.shells.strains.plate_sides`). Inside, the rotation is bilinear plus the contribution of the sides,
and the covariant shear strains are linear between those of opposite sides. Quads and triangles therefore have the same
rotation on a shared side. A plate of both passes the patch test of constant twist; a mixture of these triangles with
quads that have straight sides (MITC4) does not.

Membrane: the displacement is u = Σ N_i u_i + (1 - xi²) a_1 + (1 - eta²) a_2 with internal vectors a. Their gradients
use the Jacobian at the centre, scaled by its determinant, so that their mean is zero and constant strain is exact for
any shape. The drilling rotation is tied to the rotation of the same field by the energy gamma G t ∫ (½ (v,x - u,y) -
theta_z)² (Hughes and Brezzi), which is zero for a rigid rotation. Because the internal modes contribute to the
rotation, pure in-plane bending of rectangles is exact for any gamma. The internal vectors are condensed, so that
strains are a linear function of the nodal dofs alone.

.. [1] Katili (1993), Int. J. Numer. Meth. Engng 36, 1885-1908.
"""

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

__all__ = ["quad_strains"]


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
    """Return the contribution of the internal modes to eps_x eps_y gamma_xy and the drilling strain, (n, p, 4, 24).

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
