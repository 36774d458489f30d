r"""The four-node element: MITC4 plate, bilinear membrane with incompatible modes, drilling rotation.

Rotation of the normal: beta_x = theta_y, beta_y = -theta_x, in-plane displacement u + z beta.

Shear (MITC4): the covariant shear strains w,xi + x,xi · beta of the bilinear fields are taken where they are free of
locking, in the middles of the sides eta = ∓1 for xi and xi = ±1 for eta, and interpolated linearly between these
[1]_. Bending strains are those of the bilinear rotations.

Membrane: the displacement is u = Σ N_i u_i + (1 - xi²) a_1 + (1 - eta²) a_2 with internal vectors a; their gradients
are taken with the Jacobian at the centre, scaled by its determinant, so that their mean is zero and constant strain
is exact on any shape. The drilling rotation is tied to the rotation of the same field by
gamma G t ∫ (½ (v,x - u,y) - theta_z)² (Hughes and Brezzi), which a rigid rotation leaves at zero. Since the internal
modes take part in the rotation, pure in-plane bending of rectangles stays exact at any gamma. The internal vectors are
condensed, so that strains are a linear function of the nodal dofs alone.

.. [1] Bathe & Dvorkin (1985), Int. J. Numer. Meth. Engng 21, 367-383.
"""

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.shells.shapes import flat_quadrature, flat_shape
from fe_models.shells.strains import N_STRAINS, FlatStrains, inverse_2x2, jacobians

__all__ = ["quad_strains"]

SIDE_MIDDLES = np.array([(0.0, -1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)])


def quad_strains(xy: Array, C: Array, drilling: Array) -> FlatStrains:
    """Return the strain operators at 2 × 2 Gauss points.

    Parameters
    ----------
    xy
        Corners in the plane, (n, 4, 2) [m].
    C
        Plane stress elasticity, (n, 3, 3) [Pa].
    drilling
        Stiffness gamma G of the drilling rotation, (n,) [Pa].
    """
    n = len(xy)
    points, w = flat_quadrature("quad", 3)
    shape = flat_shape("quad", points)
    J, det = jacobians(shape.gradients, xy)
    inverse = inverse_2x2(J, det)
    weights = w * det
    dN = np.einsum("npak,pck->npca", inverse, shape.gradients)  # by x, y
    B = np.zeros((n, len(points), N_STRAINS, 4, 6))
    B[:, :, 0, :, 0] = B[:, :, 2, :, 1] = dN[..., 0]
    B[:, :, 1, :, 1] = B[:, :, 2, :, 0] = dN[..., 1]
    B[:, :, 8, :, 0], B[:, :, 8, :, 1] = -dN[..., 1] / 2, dN[..., 0] / 2
    B[:, :, 8, :, 5] = -shape.values
    B[:, :, 3, :, 4], B[:, :, 4, :, 3] = dN[..., 0], -dN[..., 1]
    B[:, :, 5, :, 4], B[:, :, 5, :, 3] = dN[..., 1], -dN[..., 0]
    B[:, :, 6:8] = _shear(xy, points, inverse)
    operators: Array = B.reshape(n, len(points), N_STRAINS, 24)
    rows = [0, 1, 2, 8]
    operators[:, :, rows] += _condensed_modes(xy, points, det, weights, C, drilling, operators[:, :, rows])
    return FlatStrains(operators, weights)


def _shear(xy: Array, points: Array, inverse: Array) -> Array:
    """Shear strain operators of MITC4, (n, p, 2, 4, 6)."""
    middle = flat_shape("quad", SIDE_MIDDLES)
    J, _ = jacobians(middle.gradients, xy)
    sampled = np.zeros((len(xy), 4, 4, 6))  # covariant shear along the side in its middle
    for k, along in enumerate((0, 1, 0, 1)):
        sampled[:, k, :, 2] = middle.gradients[k, :, along]
        sampled[:, k, :, 4] = J[:, k, along, 0, None] * middle.values[k]
        sampled[:, k, :, 3] = -J[:, k, along, 1, None] * middle.values[k]
    xi, eta = points.T
    covariant = np.zeros((len(xy), len(points), 2, 4, 6))
    covariant[:, :, 0] = _between(sampled[:, 0], sampled[:, 2], eta)
    covariant[:, :, 1] = _between(sampled[:, 3], sampled[:, 1], xi)
    return np.einsum("npak,npkcd->npacd", inverse, covariant)


def _between(low: Array, high: Array, x: Array) -> Array:
    """Linear in x between the values at -1 and +1, (n, p, 4, 6)."""
    return np.asarray((1 - x[:, None, None]) / 2 * low[:, None] + (1 + x[:, None, None]) / 2 * high[:, None])


def _condensed_modes(
    xy: Array, points: Array, det: Array, weights: Array, C: Array, drilling: Array, B: Array
) -> Array:
    """What the internal modes add to eps_x eps_y gamma_xy and the drilling strain, (n, p, 4, 24).

    The internal vectors a make the energy least: a = -(∫ Gᵀ C G)⁻¹ ∫ Gᵀ C B u.
    """
    n, p = weights.shape
    centre = flat_shape("quad", np.zeros((1, 2)))
    J_0, det_0 = jacobians(centre.gradients, xy)
    inverse_0 = inverse_2x2(J_0, det_0)[:, 0]
    slopes = np.zeros((p, 2, 2))  # of the modes by xi, eta
    slopes[:, 0, 0], slopes[:, 1, 1] = -2 * points[:, 0], -2 * points[:, 1]
    dM = np.einsum("nak,pmk->npma", inverse_0, slopes) * (det_0 / det)[:, :, None, None]
    modes = np.zeros((n, p, 4, 2, 2))
    modes[:, :, 0, :, 0] = modes[:, :, 2, :, 1] = dM[..., 0]
    modes[:, :, 1, :, 1] = modes[:, :, 2, :, 0] = dM[..., 1]
    modes[:, :, 3, :, 0], modes[:, :, 3, :, 1] = -dM[..., 1] / 2, dM[..., 0] / 2
    G: Array = modes.reshape(n, p, 4, 4)
    stiffness = np.zeros((n, 4, 4))
    stiffness[:, :3, :3], stiffness[:, 3, 3] = C, drilling
    weighted = np.einsum("npis,nij,np->npjs", G, stiffness, weights).reshape(n, 4 * p, 4).transpose(0, 2, 1)
    a = -np.linalg.solve(weighted @ G.reshape(n, 4 * p, 4), weighted @ B.reshape(n, 4 * p, 24))
    return np.asarray(G @ a[:, None])
