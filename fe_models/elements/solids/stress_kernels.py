"""Compiled loops over the points of solid elements: stress, internal forces, geometric stiffness; imported lazily."""

import numpy as np

from fe_models.elements.solids.assembly_kernels import jacobian
from fe_models.foundation.kernels.jit import jit, jit_with

__all__ = [
    "add_affine_defects", "add_element_stress", "add_internal_forces", "add_stress_defects", "stress_and_products",
    "volume_at_nodes", "write_cell_stress", "write_scalar_matrices",
]  # fmt: skip

jit_fast = jit_with(fastmath={"contract", "reassoc", "nsz"})

FIRST, SECOND = np.array([0, 1, 2, 1, 0, 0]), np.array([0, 1, 2, 2, 2, 1])  # xx yy zz yz xz xy


@jit_fast
def add_gradient(field, cell, dN, Q, det, H):
    """Write H_ij = ∂u_i / ∂x_j, (3, 3, k), for columns `field`, (n_nodes, 3, k), at one point of one element."""
    n_k = field.shape[2]
    H[:] = 0.0
    for a in range(cell.size):
        for j in range(H.shape[0]):  # the compiler does not know this size, so it does not unroll, and compiles faster
            g = (dN[a, 0] * Q[0, j] + dN[a, 1] * Q[1, j] + dN[a, 2] * Q[2, j]) / det
            for i in range(H.shape[0]):
                row, column = H[i, j], field[cell[a], i]
                for k in range(n_k):
                    row[k] += column[k] * g


@jit
def write_stress(H, C, factor, sigma):
    """Write `factor` times the stress C eps, (6, k), from gradients H, (3, 3, k); zeros of C, (6, 6), are skipped."""
    sigma[:] = 0.0
    for c in range(6):
        row = sigma[c]
        for d in range(6):
            stiffness = factor * C[c, d]
            if stiffness == 0.0:
                continue
            i, j = FIRST[d], SECOND[d]
            if i == j:
                strain = H[i, i]
                for k in range(row.size):
                    row[k] += stiffness * strain[k]
            else:
                half, other = H[i, j], H[j, i]
                for k in range(row.size):
                    row[k] += stiffness * (half[k] + other[k])


@jit_fast
def write_products(G, P):
    """Write Σ_c (u_c,a v_c,b + u_c,b v_c,a) for all pairs u <= v of columns, (6, n_pairs); counted once if a = b.

    G: gradients G_ca, (3, 3, n). The product of stress and result is Σ sigma_ab u_c,a v_c,b over all a, b.
    """
    n = G.shape[2]
    for ab in range(P.shape[0]):
        a, b = FIRST[ab], SECOND[ab]
        at = 0
        for k in range(n):
            row = P[ab, at : at + n - k]
            if a == b:
                x, y, z = G[0, a, k], G[1, a, k], G[2, a, k]
                X, Y, Z = G[0, a, k:], G[1, a, k:], G[2, a, k:]
                for m in range(n - k):
                    row[m] = x * X[m] + y * Y[m] + z * Z[m]
            else:
                x, y, z, x2, y2, z2 = G[0, a, k], G[1, a, k], G[2, a, k], G[0, b, k], G[1, b, k], G[2, b, k]
                X, Y, Z = G[0, b, k:], G[1, b, k:], G[2, b, k:]
                X2, Y2, Z2 = G[0, a, k:], G[1, a, k:], G[2, a, k:]
                for m in range(n - k):
                    row[m] = x * X[m] + y * Y[m] + z * Z[m] + x2 * X2[m] + y2 * Y2[m] + z2 * Z2[m]
            at += n - k


@jit
def stress_and_products(nodes, cells, of_cell, tensors, dN, w, u, phi, sigma, products):
    """Write stress times volume of the states, and products of gradients, at the points of some elements.

    u: states, (n_nodes, 3, n_states); phi: columns, (n_nodes, 3, n); sigma: (n_cells, n_points, 6, n_states);
    products: (n_cells, n_points, 6, n_pairs); tensors: stiffness of every material, (n_materials, 6, 6).
    """
    n_a = cells.shape[1]
    x = np.empty((n_a, 3))
    J, Q = np.empty((3, 3)), np.empty((3, 3))
    H, G = np.empty((3, 3, u.shape[2])), np.empty((3, 3, phi.shape[2]))
    for e in range(cells.shape[0]):
        C = tensors[of_cell[e]]
        for a in range(n_a):
            for i in range(3):
                x[a, i] = nodes[cells[e, a], i]
        for q in range(w.size):
            det = jacobian(x, dN[q], J, Q)
            add_gradient(u, cells[e], dN[q], Q, det, H)
            write_stress(H, C, w[q] * det, sigma[e, q])
            add_gradient(phi, cells[e], dN[q], Q, det, G)
            write_products(G, products[e, q])


@jit
def write_scalar_matrices(nodes, cells, of_cell, tensors, dN, w, u, matrices):
    """Add ∫ grad N_aᵀ sigma grad N_b dV, for the stress of one state u, (n_nodes, 3, 1), to (n_cells, n_a, n_a)."""
    n_a = cells.shape[1]
    x, g = np.empty((n_a, 3)), np.empty((n_a, 3))
    J, Q = np.empty((3, 3)), np.empty((3, 3))
    H, sigma = np.empty((3, 3, 1)), np.empty((6, 1))
    for e in range(cells.shape[0]):
        C = tensors[of_cell[e]]
        for a in range(n_a):
            for i in range(3):
                x[a, i] = nodes[cells[e, a], i]
        for q in range(w.size):
            det = jacobian(x, dN[q], J, Q)
            add_gradient(u, cells[e], dN[q], Q, det, H)
            write_stress(H, C, w[q] * det, sigma)
            xx, yy, zz, yz, xz, xy = sigma[0, 0], sigma[1, 0], sigma[2, 0], sigma[3, 0], sigma[4, 0], sigma[5, 0]
            for a in range(n_a):
                for j in range(3):
                    g[a, j] = (dN[q, a, 0] * Q[0, j] + dN[q, a, 1] * Q[1, j] + dN[q, a, 2] * Q[2, j]) / det
            for a in range(n_a):
                t0 = xx * g[a, 0] + xy * g[a, 1] + xz * g[a, 2]
                t1 = xy * g[a, 0] + yy * g[a, 1] + yz * g[a, 2]
                t2 = xz * g[a, 0] + yz * g[a, 1] + zz * g[a, 2]
                for b in range(n_a):
                    matrices[e, a, b] += t0 * g[b, 0] + t1 * g[b, 1] + t2 * g[b, 2]


@jit
def add_internal_forces(nodes, cells, of_cell, tensors, dN, w, u, forces):
    """Add ∫ sigma grad N_a dV of some elements to the nodal forces, (n_nodes, 3, k); tensors: stiffness, (n, 6, 6)."""
    n_a, n_k = cells.shape[1], u.shape[2]
    x = np.empty((n_a, 3))
    J, Q = np.empty((3, 3)), np.empty((3, 3))
    H, sigma = np.empty((3, 3, n_k)), np.empty((6, n_k))
    for e in range(cells.shape[0]):
        C = tensors[of_cell[e]]
        for a in range(n_a):
            for i in range(3):
                x[a, i] = nodes[cells[e, a], i]
        for q in range(w.size):
            det = jacobian(x, dN[q], J, Q)
            add_gradient(u, cells[e], dN[q], Q, det, H)
            write_stress(H, C, w[q] * det, sigma)
            for a in range(n_a):
                for c in range(6):
                    for turn in range(1 if c < 3 else 2):
                        i, j = (FIRST[c], SECOND[c]) if turn == 0 else (SECOND[c], FIRST[c])
                        g = (dN[q, a, 0] * Q[0, j] + dN[q, a, 1] * Q[1, j] + dN[q, a, 2] * Q[2, j]) / det
                        row = forces[cells[e, a], i]
                        for k in range(n_k):
                            row[k] += sigma[c, k] * g


# stress at the nodes --------------------------------------------------------------------------------------------------


@jit
def volume_at_nodes(nodes, cells, of_cell, of_node, dN, w, volume):
    """Add the volumes of the elements that adjoin each node and have its material to volume, (n_nodes,)."""
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


# stress recovered at the nodes, against that of the elements ----------------------------------------------------------


@jit
def write_cell_stress(nodes, cells, of_cell, tensors, dN, u, part, n_parts, sigma):
    """Write the stress at the points of one part of the elements, (n_cells, n_points, 6, k), for u, (n_nodes, 3, k)."""
    x = np.empty((cells.shape[1], 3))
    J, Q, H = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3, u.shape[2]))
    for e in range(part * cells.shape[0] // n_parts, (part + 1) * cells.shape[0] // n_parts):
        for a in range(cells.shape[1]):
            for i in range(3):
                x[a, i] = nodes[cells[e, a], i]
        for q in range(dN.shape[0]):
            det = jacobian(x, dN[q], J, Q)
            add_gradient(u, cells[e], dN[q], Q, det, H)
            write_stress(H, tensors[of_cell[e]], 1.0, sigma[e, q])


@jit_fast
def add_product(d, S, factor, total):
    """Add factor d · S d to total, (k,), for stress d, (6, k), and symmetric S, (6, 6), whose zeros are skipped."""
    for b in range(d.shape[0]):
        for c in range(b + 1):
            s = (1.0 if b == c else 2.0) * S[b, c] * factor
            if s == 0.0:
                continue
            d_b, d_c = d[b], d[c]
            for k in range(total.size):
                total[k] += s * d_b[k] * d_c[k]


@jit_fast
def add_stress_defects(
    chosen, nodes, cells, of_cell, tensors, compliances, N, dN, w, u, rows, recovered, part, n_parts, defect, energy
):
    """Add ∫ d · C⁻¹ d dV with d = recovered stress - stress, and ∫ sigma · C⁻¹ sigma dV, of a part of some elements.

    chosen: indices of these elements; u: displacement columns, (n_nodes, 3, k); recovered: stress at the nodes,
    (n_rows, 6, k); rows: its row for each node of each element, (n_cells, n_a); compliances: C⁻¹ of every material,
    (n_materials, 6, 6); defect, energy: (n_cells, k).
    """
    n_k = u.shape[2]
    x = np.empty((cells.shape[1], 3))
    J, Q, H = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3, n_k))
    sigma, d = np.empty((6, n_k)), np.empty((6, n_k))
    for e in chosen[part * chosen.size // n_parts : (part + 1) * chosen.size // n_parts]:
        S = compliances[of_cell[e]]
        for a in range(cells.shape[1]):
            for i in range(3):
                x[a, i] = nodes[cells[e, a], i]
        for q in range(w.size):
            det = jacobian(x, dN[q], J, Q)
            add_gradient(u, cells[e], dN[q], Q, det, H)
            write_stress(H, tensors[of_cell[e]], 1.0, sigma)
            for c in range(d.shape[0]):
                row, column = d[c], sigma[c]
                for k in range(n_k):
                    row[k] = -column[k]
            for a in range(cells.shape[1]):
                at, factor = rows[e, a], N[q, a]
                for c in range(d.shape[0]):
                    row, column = d[c], recovered[at, c]
                    for k in range(n_k):
                        row[k] += factor * column[k]
            add_product(d, S, w[q] * det, defect[e])
            add_product(sigma, S, w[q] * det, energy[e])


@jit_fast
def add_affine_defects(
    chosen, jacobians, of_cell, compliances, from_nodes, from_samples, w, rows, recovered, sigma,
    part, n_parts, defect, energy,
):  # fmt: skip
    """Add what `add_stress_defects` adds, for elements whose reference coordinates are affine.

    The defect at node a is recovered stress - sum_p X_ap sigma_p, a polynomial in the span of the shape functions. With
    their mass matrix L Lᵀ on the reference cell, the integral is det J times a sum over the rows of Lᵀ (nodal defects).
    jacobians: det J of each chosen element; from_nodes: Lᵀ, upper triangular, (n_a, n_a); from_samples: Lᵀ X,
    (n_a, n_points); w: weights of the stress points, (n_points,); recovered: (n_rows, 6, k); sigma: at the stress
    points, (n_cells, n_points, 6, k).
    """
    n_a, n_k = from_nodes.shape[0], sigma.shape[3]
    d = np.empty((6, n_k))
    for place in range(part * chosen.size // n_parts, (part + 1) * chosen.size // n_parts):
        e, det = chosen[place], jacobians[place]
        S = compliances[of_cell[e]]
        for g in range(n_a):
            for c in range(d.shape[0]):
                row = d[c]
                row[:] = 0.0
                for a in range(g, n_a):
                    factor, column = from_nodes[g, a], recovered[rows[e, a], c]
                    for k in range(n_k):
                        row[k] += factor * column[k]
                for p in range(w.size):
                    factor, column = from_samples[g, p], sigma[e, p, c]
                    for k in range(n_k):
                        row[k] -= factor * column[k]
            add_product(d, S, det, defect[e])
        for p in range(w.size):
            add_product(sigma[e, p], S, w[p] * det, energy[e])
