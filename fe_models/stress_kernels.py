"""Compiled loops of the stress recovery; imported where they are used."""

import numpy as np
from numba import njit

from fe_models.assembly_kernels import jacobian

__all__ = ["add_element_stress", "volume_at_nodes"]

jit = njit(cache=True, nogil=True, error_model="numpy")


@jit
def volume_at_nodes(nodes, cells, of_cell, of_node, dN, w, volume):
    """Add to volume, (n_nodes,), that of the elements which adjoin the node and have its material."""
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
def add_element_stress(nodes, cells, of_cell, of_node, lame, dN, w, extrapolation, u, stress):
    """Add to stress, (n_nodes, 6), volume times stress of every element at its nodes; u: displacements, (n_nodes, 3).

    lame: lam and mu of every material, (n_materials, 2); of_cell, of_node: materials of elements and nodes.
    """
    n_a = cells.shape[1]
    x = np.empty((n_a, 3))
    J, Q = np.empty((3, 3)), np.empty((3, 3))
    H = np.empty((3, 3))
    sigma = np.empty((w.size, 6))
    for e in range(cells.shape[0]):
        lam, mu = lame[of_cell[e], 0], lame[of_cell[e], 1]
        for a in range(n_a):
            for i in range(3):
                x[a, i] = nodes[cells[e, a], i]
        total = 0.0
        for q in range(w.size):
            det = jacobian(x, dN[q], J, Q)
            total += w[q] * det
            H[:] = 0.0  # displacement gradient, H_ij = ∂u_i / ∂x_j
            for a in range(n_a):
                for j in range(3):
                    g = (dN[q, a, 0] * Q[0, j] + dN[q, a, 1] * Q[1, j] + dN[q, a, 2] * Q[2, j]) / det
                    for i in range(3):
                        H[i, j] += u[cells[e, a], i] * g
            pressure = lam * (H[0, 0] + H[1, 1] + H[2, 2])
            for i in range(3):
                sigma[q, i] = pressure + 2.0 * mu * H[i, i]
            sigma[q, 3] = mu * (H[1, 2] + H[2, 1])
            sigma[q, 4] = mu * (H[0, 2] + H[2, 0])
            sigma[q, 5] = mu * (H[0, 1] + H[1, 0])
        for a in range(n_a):
            node = cells[e, a]
            if of_cell[e] != of_node[node]:
                continue
            for q in range(w.size):
                factor = total * extrapolation[a, q]
                for i in range(6):
                    stress[node, i] += factor * sigma[q, i]
