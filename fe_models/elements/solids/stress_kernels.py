"""Compiled loops of the stress recovery; imported only where used."""

import numpy as np
from numba import njit

from fe_models.elements.solids.assembly_kernels import jacobian
from fe_models.elements.solids.geometric_kernels import write_stress

__all__ = ["add_element_stress", "volume_at_nodes"]

jit = njit(cache=True, nogil=True, error_model="numpy")


@jit
def volume_at_nodes(nodes, cells, of_cell, of_node, dN, w, volume):
    """Add to volume, (n_nodes,), the volumes of the elements that adjoin each node and have its material."""
    n_a = cells.shape[1]
    x = np.empty((n_a, 3))
    J, Q = np.empty((3, 3)), np.empty((3, 3))
    for e in range(cells.shape[0]):
        for a in range(n_a):
            for i in range(3):
                x[a, i] = nodes[cells[e, a], i]
        total = 0.0
        for q in range(w.size):
            total += w[q] * jacobian(x, dN[q], J, Q)
        for a in range(n_a):
            if of_cell[e] == of_node[cells[e, a]]:
                volume[cells[e, a]] += total


@jit
def add_element_stress(nodes, cells, of_cell, of_node, tensors, dN, w, extrapolation, u, first, last, stress):
    """Add volume times stress of every element at its nodes to columns first..last of stress, (n_nodes, 6, k).

    u: displacement columns, (n_nodes, 3, k); tensors: matrix of every material that maps strain to stress,
    (n_materials, 6, 6); of_cell, of_node: materials of elements and nodes. The inner loop runs over the columns, so the
    geometry is computed once for all of them.
    """
    n_a = cells.shape[1]
    n_k = last - first
    x = np.empty((n_a, 3))
    J, Q = np.empty((3, 3)), np.empty((3, 3))
    H = np.empty((3, 3, n_k))
    sigma = np.empty((w.size, 6, n_k))
    for e in range(cells.shape[0]):
        for a in range(n_a):
            for i in range(3):
                x[a, i] = nodes[cells[e, a], i]
        total = 0.0
        for q in range(w.size):
            det = jacobian(x, dN[q], J, Q)
            total += w[q] * det
            H[:] = 0.0  # displacement gradient, H_ij = ∂u_i / ∂x_j
            for a in range(n_a):
                # the compiler does not know this size, so it does not unroll, and compiles faster
                for j in range(J.shape[0]):
                    g = (dN[q, a, 0] * Q[0, j] + dN[q, a, 1] * Q[1, j] + dN[q, a, 2] * Q[2, j]) / det
                    for i in range(J.shape[0]):
                        row, column = H[i, j], u[cells[e, a], i, first:last]
                        for k in range(n_k):
                            row[k] += column[k] * g
            write_stress(H, tensors[of_cell[e]], 1.0, sigma[q])
        for a in range(n_a):
            node = cells[e, a]
            if of_cell[e] != of_node[node]:
                continue
            for q in range(w.size):
                factor = total * extrapolation[a, q]
                for i in range(sigma.shape[1]):
                    row, column = stress[node, i, first:last], sigma[q, i]
                    for k in range(n_k):
                        row[k] += factor * column[k]
