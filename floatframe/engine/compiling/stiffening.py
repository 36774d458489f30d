"""Geometric stiffness in the arrays of the kernels (docs/theory.md §7).

The kinetic energy of a body changes by

    v·(qᵀK_t q_dot + omega × 1/2 qᵀK_t q) + omega·(qᵀK_r q_dot) - 1/2 Σ omega_a omega_b qᵀK_ab q

so that the equations of motion (kernels/body.py) need, besides K_t and the two terms of second order in q_dot,

    J_ab -= qᵀ K_ab q,   B_a,k += (K_r,a q)_k,   D_k -= (K_ab q)_k + 1/2 tilde((K_r q)_k)

(D_k from 2 Σ q_dot_k D_k omega = J_dot omega + omega × B q_dot). Without stiffening, the terms of J, B and D_k that
depend on q are formed from S_ab alone. All three changes therefore result from

    S_ab += K_ab - 1/2 delta_ab Σ_c K_cc + 1/2 tilde_ab(K_r)

without cost in the time loop: delta_ab Σ_c S_cc - S_ab changes by -K_ab - 1/2 tilde_ab(K_r), S_zy - S_yz by K_r,x.
"""

import numpy as np

from cms.body.geometric_stiffness import SPIN_PAIRS, GeometricStiffness
from fe_models.foundation.arrays import Array

__all__ = ["spin_tensor", "stiffened_shape_moments"]


def spin_tensor(geometric: GeometricStiffness) -> Array:
    """Return K_ab for all pairs of axes, (3, 3, n_q, n_q)."""
    n = geometric.n_q
    K = np.zeros((3, 3, n, n))
    for (a, b), matrix in zip(SPIN_PAIRS, geometric.spin, strict=True):
        K[a, b] = K[b, a] = matrix
    return K


def stiffened_shape_moments(S_kl: Array, geometric: GeometricStiffness) -> Array:
    """Return S_ab,kl plus the stiffness matrices of spin and angular acceleration, (3, 3, n_q, n_q)."""
    K_ab, K_r = spin_tensor(geometric), np.asarray(geometric.rotation)
    S = S_kl + K_ab
    trace = np.einsum("cckl->kl", K_ab)
    for a in range(3):
        S[a, a] -= 0.5 * trace
        b, c = (a + 1) % 3, (a + 2) % 3
        S[c, b] += 0.5 * K_r[a]  # tilde(x)_cb = x_a, tilde(x)_bc = -x_a
        S[b, c] -= 0.5 * K_r[a]
    return np.asarray(S)
