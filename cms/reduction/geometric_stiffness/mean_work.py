"""Second-order mean motion, which a linear distributing interface neglects when its members rotate (theory.md §7).

The mean motion of members is the rigid motion that fits theirs best in least squares with weights w. With positions x
from their weighted centre and displacements v, Σ w (x + v) × (R x) = 0. To first order J theta = Σ w x × v with J = Σ w
(x² 1 - x xᵀ). To second order, in addition to the linear mean of the second-order motion of the members,

    J gamma_kl = -Σ w { v_k × (theta_l × x) + v_l × (theta_k × x)
                        + ½ x × [theta_k × (theta_l × x) + theta_l × (theta_k × x)] }

The reference point, at a lever rho from the centre, moves by gamma × rho and by the second-order part of theta × rho.
"""

import numpy as np

from fe_models.body.mass_loads import rotation_work
from fe_models.foundation.arrays import Array

__all__ = ["mean_second_order"]


def mean_second_order(points: Array, weights: Array, reference: Array, v: Array, *, turns: bool = True) -> Array:
    """Return the bilinear second-order translation and rotation of the reference point, (6, n, n).

    Parameters
    ----------
    points
        Undeformed positions of the members, (m, 3) [m].
    weights
        Weights with sum 1, (m,).
    reference
        Reference point, (3,) [m].
    v
        Translations of the members, (m, 3, n) [m].
    turns
        False: the members are collinear, so their mean has no rotation and the second-order motion is zero.
    """
    n = v.shape[2]
    gamma = np.zeros((6, n, n))
    if not turns:
        return gamma
    center = weights @ points
    x = points - center
    C = np.einsum("i,ia,ib->ab", weights, x, x)
    X = np.einsum("i,ia,ibk->kab", weights, x, v)  # Σ w x vᵀ
    J = np.trace(C) * np.eye(3) - C
    moment = np.stack([X[:, 1, 2] - X[:, 2, 1], X[:, 2, 0] - X[:, 0, 2], X[:, 0, 1] - X[:, 1, 0]])  # Σ w x × v
    theta = np.linalg.solve(J, moment)  # (3, n)
    # v_k × (theta_l × x) = theta_l (v_k·x) - x (v_k·theta_l);  x × (theta_k × (theta_l × x)) = (x × theta_l)(x·theta_k)
    half = np.einsum("al,kbb->akl", theta, X) - np.einsum("kab,bl->akl", X, theta)
    half = half + np.cross((C @ theta)[:, :, None], theta[:, None, :], axis=0) / 2
    gamma[3:] = -np.einsum("ab,bkl->akl", np.linalg.inv(J), half + half.transpose(0, 2, 1))
    rho = reference - center
    gamma[:3] = np.cross(gamma[3:], rho[:, None, None], axis=0)
    for a in range(3):
        gamma[a] += theta.T @ rotation_work(np.outer(np.eye(3)[a], rho)) @ theta
    return gamma
