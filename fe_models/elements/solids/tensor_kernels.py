"""Compiled stiffness of solid elements from an elasticity tensor; imported only where used."""

import numpy as np
from numba import njit

from fe_models.elements.solids.assembly_kernels import jacobian

__all__ = ["tensor_stiffness"]

jit = njit(cache=True, nogil=True, error_model="numpy")

PLACE = np.array([[0, 5, 4], [5, 1, 3], [4, 3, 2]])  #: index of component i, j in xx yy zz yz xz xy


@jit
def tensor_stiffness(nodes, cells, tensors, is_general, of_cell, dN, w, K):
    """Write K, (n, 3 n_a, 3 n_a), of the elements whose material is not isotropic; leave the other entries unchanged.

    (1) T_j = Σ_l C_ij,kl g_bl: the stress in row i, column j from a unit displacement of node b along k
    (2) K_ai,bk = Σ_q w det(J) Σ_j g_aj T_j, for b >= a, and its transpose

    tensors: matrix of every material that maps strain to stress, (n_materials, 6, 6); g: shape function gradients.
    """
    n_a = cells.shape[1]
    x, g = np.empty((n_a, 3)), np.empty((n_a, 3))
    J, Q, T = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3, 3))
    for e in range(cells.shape[0]):
        if not is_general[of_cell[e]]:
            continue
        C = tensors[of_cell[e]]
        for a in range(n_a):
            for i in range(3):
                x[a, i] = nodes[cells[e, a], i]
        K[e] = 0.0
        for q in range(w.size):
            det = jacobian(x, dN[q], J, Q)
            if not det > 0.0:
                break  # the loop over all elements reports the inverted element
            for a in range(n_a):
                for i in range(J.shape[0]):
                    g[a, i] = (dN[q, a, 0] * Q[0, i] + dN[q, a, 1] * Q[1, i] + dN[q, a, 2] * Q[2, i]) / det
            volume = w[q] * det
            for b in range(n_a):
                for i in range(J.shape[0]):  # (1)
                    for j in range(J.shape[0]):
                        for k in range(J.shape[0]):
                            total = 0.0
                            for m in range(J.shape[0]):
                                total += C[PLACE[i, j], PLACE[k, m]] * g[b, m]
                            T[i, j, k] = volume * total
                for a in range(b + 1):  # (2)
                    for i in range(J.shape[0]):
                        for k in range(J.shape[0]):
                            K[e, 3 * a + i, 3 * b + k] += (
                                g[a, 0] * T[i, 0, k] + g[a, 1] * T[i, 1, k] + g[a, 2] * T[i, 2, k]
                            )
        for row in range(3 * n_a):
            for column in range(row):
                K[e, row, column] = K[e, column, row]
