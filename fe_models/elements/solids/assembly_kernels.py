"""Compiled loops of the assembly, imported only when used, because importing numba takes half a second.

Every kernel processes one share of the rows, columns or elements, `part` of `n_parts`, and writes only to this share.
The shares run in threads without locks, and the order of additions to an entry does not depend on the threads.
"""

import numpy as np

from fe_models.foundation.kernels.jit import jit, jit_with

__all__ = [
    "element_matrices",
    "expand_columns",
    "expand_mass",
    "node_incidence",
    "row_columns",
    "row_counts",
    "scatter_elements",
    "tensor_stiffness",
]

#: number of consecutive nodes in a stripe; parts take stripes in turn, which balances the load for any node order
STRIPE = 64

jit_fma = jit_with(fastmath={"contract"})  # only allow fused a * b + c


@jit
def node_incidence(members, n_nodes):
    """Return start, (n_nodes + 1,), and for each node its ascending positions in `members`."""
    start = np.zeros(n_nodes + 1, np.int64)
    for place in range(members.size):
        start[members[place] + 1] += 1
    for node in range(n_nodes):
        start[node + 1] += start[node]
    cursor = start[:-1].copy()
    places = np.empty(members.size, np.int32)
    for place in range(members.size):
        node = members[place]
        places[cursor[node]] = place
        cursor[node] += 1
    return start, places


@jit
def neighbours_of(node, members, first, n_members, start, places, seen, found):
    """Collect the nodes that share an element with `node` in `found`, unsorted; return their number."""
    count = 0
    for k in range(start[node], start[node + 1]):
        element_first = first[places[k]]
        for m in range(element_first, element_first + n_members[places[k]]):
            other = members[m]
            if seen[other] != node:
                seen[other] = node
                found[count] = other
                count += 1
    return count


@jit
def row_counts(members, first, n_members, start, places, part, n_parts, counts):
    """Write the number of neighbours of each node of this part, including itself, into counts, (n_nodes,)."""
    n_nodes = counts.size
    seen = np.full(n_nodes, -1, np.int32)
    found = np.empty(n_nodes, np.int32)
    for node in range(part * n_nodes // n_parts, (part + 1) * n_nodes // n_parts):
        counts[node] = neighbours_of(node, members, first, n_members, start, places, seen, found)


@jit
def row_columns(members, first, n_members, start, places, part, n_parts, row_start, columns):
    """Write the ascending neighbours of each node of this part into columns, (row_start[-1],)."""
    n_nodes = row_start.size - 1
    seen = np.full(n_nodes, -1, np.int32)
    found = np.empty(n_nodes, np.int32)
    for node in range(part * n_nodes // n_parts, (part + 1) * n_nodes // n_parts):
        count = neighbours_of(node, members, first, n_members, start, places, seen, found)
        at = row_start[node]
        for k in range(count):  # insertion sort, because rows are short and nearly sorted
            value = found[k]
            m = at + k
            while m > at and columns[m - 1] > value:
                columns[m] = columns[m - 1]
                m -= 1
            columns[m] = value


@jit_fma
def cofactors_of(J, cofactors):
    """Write det(J) J⁻¹ for J, (3, 3), into `cofactors`, and return det(J)."""
    # the compiler does not know this size, so it does not unroll, and compiles in half of the time
    for i in range(J.shape[0]):
        i1, i2 = (i + 1) % 3, (i + 2) % 3
        for j in range(J.shape[0]):
            j1, j2 = (j + 1) % 3, (j + 2) % 3
            cofactors[j, i] = J[i1, j1] * J[i2, j2] - J[i1, j2] * J[i2, j1]
    return J[0, 0] * cofactors[0, 0] + J[0, 1] * cofactors[1, 0] + J[0, 2] * cofactors[2, 0]


@jit_fma
def jacobian(x, dN, J, Q):
    """Write J_ij = ∂x_i / ∂xi_j and Q = det(J) J⁻¹, (3, 3), and return det(J); x and dN are (n_a, 3)."""
    for i in range(J.shape[0]):
        for j in range(J.shape[0]):
            total = 0.0
            for a in range(x.shape[0]):
                total += x[a, i] * dN[a, j]
            J[i, j] = total
    return cofactors_of(J, Q)


@jit
def is_affine(x, corners, reference, J):
    """Write J from the edges at node 0; return whether x is affine in the reference coordinates to rounding.

    x: positions of the nodes, (n_a, 3); corners: the nodes at e_1, e_2, e_3 of the reference cell, (3,); reference:
    nodes of the reference cell, (n_a, 3).
    """
    largest = 0.0
    for i in range(3):
        for j in range(3):
            J[i, j] = x[corners[j], i] - x[0, i]
    for a in range(x.shape[0]):
        for i in range(3):
            largest = max(largest, abs(x[a, i]))
    for a in range(x.shape[0]):
        for i in range(3):
            image = x[0, i] + J[i, 0] * reference[a, 0] + J[i, 1] * reference[a, 1] + J[i, 2] * reference[a, 2]
            if abs(x[a, i] - image) > 1e-15 * largest:
                return False
    return True


@jit_fma
def affine_element(J, lam, mu, rho, R_K, R_M, K, M):
    """Compute element matrices for a constant Jacobian from integrals over the reference cell; return det(J).

    (1) C_ij,kl = det(J) (lam Q_ki Q_lj + mu Q_kj Q_li + mu δ_ij Q_k·Q_l) with Q = J⁻¹
    (2) K_ai,bj = Σ_kl C_ij,kl ∫ ∂N_a/∂xi_k ∂N_b/∂xi_l,  M_ab = rho det(J) ∫ N_a N_b, for the pairs b >= a.

    R_K, (9, n_pairs), and R_M, (n_pairs,): the integrals.
    """
    n_a = M.shape[0]
    Q, C, block = np.empty((3, 3)), np.empty((9, 9)), np.empty((9, R_M.size))
    det = cofactors_of(J, Q)
    if not det > 0.0:
        return det
    for kl in range(9):  # (1)
        k, m = kl // 3, kl % 3
        dot = Q[k, 0] * Q[m, 0] + Q[k, 1] * Q[m, 1] + Q[k, 2] * Q[m, 2]
        for ij in range(9):
            i, j = ij // 3, ij % 3
            value = lam * Q[k, i] * Q[m, j] + mu * Q[k, j] * Q[m, i] + (mu * dot if i == j else 0.0)
            C[ij, kl] = value / det
    for ij in range(C.shape[0]):  # (2)
        out = block[ij]
        for pair in range(R_M.size):
            out[pair] = 0.0
        for kl in range(C.shape[0]):
            c, row = C[ij, kl], R_K[kl]
            for pair in range(R_M.size):
                out[pair] += c * row[pair]
    pair = 0
    for a in range(n_a):
        for b in range(a, n_a):
            for ij in range(C.shape[0]):
                value = block[ij, pair]
                K[3 * a + ij // 3, 3 * b + ij % 3] = value
                K[3 * b + ij % 3, 3 * a + ij // 3] = value
            M[a, b] = M[b, a] = rho * det * R_M[pair]
            pair += 1
    return det


@jit_fma
def curved_element(x, lam, mu, rho, dN_K, w_K, N_M, dN_M, w_M, g, K, M):
    """Compute element matrices by quadrature; return the smallest det(J), or the first that is not positive.

    (1) G = Σ_q w det(J) g gᵀ, where g holds the gradients ∂N_a/∂x_i in one column, node-major
    (2) K_ai,bj = lam G_ai,bj + mu G_aj,bi + mu δ_ij Σ_k G_ak,bk for the pairs b >= a
    (3) M_ab = rho Σ_q w det(J) N_a N_b.

    x: positions of the nodes, (n_a, 3); dN_K, dN_M: derivatives of the shape functions, (n_points, n_a, 3);
    g: workspace, (n_points of K, 3 n_a).
    """
    n_a = x.shape[0]
    J, Q, factor = np.empty((3, 3)), np.empty((3, 3)), np.empty(max(w_K.size, w_M.size))
    for q in range(w_K.size):
        det = jacobian(x, dN_K[q], J, Q)
        if not det > 0.0:
            return det
        factor[q] = w_K[q] / det  # det(J) from the measure, and 1 / det(J) from each of the two gradients
        for a in range(n_a):
            for i in range(J.shape[0]):
                g[q, 3 * a + i] = dN_K[q, a, 0] * Q[0, i] + dN_K[q, a, 1] * Q[1, i] + dN_K[q, a, 2] * Q[2, i]
    for r in range(3 * n_a):  # (1); K is the workspace for G
        first = 3 * (r // 3)
        row = K[r, first:]
        for s in range(row.size):
            row[s] = 0.0
        for q in range(w_K.size):
            c, column = factor[q] * g[q, r], g[q, first:]
            for s in range(row.size):
                row[s] += c * column[s]
    for a in range(n_a):  # (2)
        for b in range(a, n_a):
            trace = mu * (K[3 * a, 3 * b] + K[3 * a + 1, 3 * b + 1] + K[3 * a + 2, 3 * b + 2])
            for i in range(J.shape[0]):
                for j in range(J.shape[0]):
                    J[i, j] = lam * K[3 * a + i, 3 * b + j] + mu * K[3 * a + j, 3 * b + i]
                J[i, i] += trace
            for i in range(J.shape[0]):
                for j in range(J.shape[0]):
                    K[3 * a + i, 3 * b + j] = K[3 * b + j, 3 * a + i] = J[i, j]
    for q in range(w_M.size):
        det = jacobian(x, dN_M[q], J, Q)
        if not det > 0.0:
            return det
        factor[q] = rho * w_M[q] * det
    for a in range(n_a):  # (3)
        row = M[a, a:]
        for b in range(row.size):
            row[b] = 0.0
        for q in range(w_M.size):
            c, column = factor[q] * N_M[q, a], N_M[q, a:]
            for b in range(row.size):
                row[b] += c * column[b]
        for b in range(row.size):
            M[a + b, a] = row[b]
    return 1.0


@jit
def element_matrices(nodes, cells, properties, of_cell, affine, stiffness, mass, part, n_parts, K, M, is_inverted):
    """Compute stiffness K, (n, 3 n_a, 3 n_a), and scalar mass M, (n, n_a, n_a), of the n elements `cells`, (n, n_a).

    properties: lam, mu, rho of every material, (n_materials, 3); of_cell: the material of each element;
    affine, stiffness, mass: tables of the reference element, see `fe_models.elements.solids.assembly.kernel_tables`.
    """
    n_a = cells.shape[1]
    reference, corners, R_K, R_M = affine
    dN_K, w_K = stiffness
    N_M, dN_M, w_M = mass
    x, J, g = np.empty((n_a, 3)), np.empty((3, 3)), np.empty((w_K.size, 3 * n_a))
    for e in range(part * cells.shape[0] // n_parts, (part + 1) * cells.shape[0] // n_parts):
        for a in range(n_a):
            for i in range(3):
                x[a, i] = nodes[cells[e, a], i]
        lam, mu, rho = properties[of_cell[e], 0], properties[of_cell[e], 1], properties[of_cell[e], 2]
        if is_affine(x, corners, reference, J):
            det = affine_element(J, lam, mu, rho, R_K, R_M, K[e], M[e])
        else:
            det = curved_element(x, lam, mu, rho, dN_K, w_K, N_M, dN_M, w_M, g, K[e], M[e])
        is_inverted[e] = not det > 0.0


@jit
def scatter_elements(
    cells, first_place, start, places, row_start, columns, K, M, part, n_parts, cursor, workspace, K_data, M_data
):
    """Add the element matrices of the consecutive elements `cells` to the rows of the nodes of this part.

    Row 3 i + c of the stiffness has 3 entries for each of the m_i neighbours of node i. Entry (c, d) of the p-th
    neighbour is therefore at 9 row_start[i] + 3 m_i c + 3 p + d of K_data, which is the final storage.
    cursor: for each node, its first place in `places` that has not been added yet; workspace: (n_parts, n_nodes).
    """
    where = workspace[part]  # position of a node among the neighbours of another node
    n_nodes = row_start.size - 1
    n_a = cells.shape[1]
    end_place = first_place + cells.size
    for stripe in range(part * STRIPE, n_nodes, n_parts * STRIPE):
        for node in range(stripe, min(stripe + STRIPE, n_nodes)):
            k, stop = cursor[node], start[node + 1]
            if k == stop or places[k] >= end_place:
                continue
            at = row_start[node]
            m_i = row_start[node + 1] - at
            for p in range(m_i):
                where[columns[at + p]] = p
            while k < stop and places[k] < end_place:
                e, a = divmod(places[k] - first_place, n_a)
                for b in range(n_a):
                    p = where[cells[e, b]]
                    M_data[at + p] += M[e, a, b]
                    for c in range(3):
                        target = 9 * at + 3 * (m_i * c + p)
                        for d in range(3):
                            K_data[target + d] += K[e, 3 * a + c, 3 * b + d]
                k += 1
            cursor[node] = k


@jit
def expand_columns(row_start, columns, part, n_parts, indptr, indices):
    """Write row starts and column numbers of the stiffness from the node graph, three columns per neighbour."""
    n_nodes = row_start.size - 1
    for node in range(part * n_nodes // n_parts, (part + 1) * n_nodes // n_parts):
        at = row_start[node]
        m_i = row_start[node + 1] - at
        for c in range(3):
            target = 9 * at + 3 * m_i * c
            indptr[3 * node + c + 1] = target + 3 * m_i
            for p in range(m_i):
                for d in range(3):
                    indices[target + 3 * p + d] = 3 * columns[at + p] + d


@jit
def expand_mass(row_start, columns, M_data, part, n_parts, indptr, indices, data):
    """Write M_s ⊗ 1₃: row 3 i + c has M_s,ij in column 3 j + c."""
    n_nodes = row_start.size - 1
    for node in range(part * n_nodes // n_parts, (part + 1) * n_nodes // n_parts):
        at = row_start[node]
        m_i = row_start[node + 1] - at
        for c in range(3):
            target = 3 * at + m_i * c
            indptr[3 * node + c + 1] = target + m_i
            for p in range(m_i):
                indices[target + p] = 3 * columns[at + p] + c
                data[target + p] = M_data[at + p]


# stiffness from an elasticity tensor ----------------------------------------------------------------------------------


PLACE = np.array([[0, 5, 4], [5, 1, 3], [4, 3, 2]])  #: index of component i, j in xx yy zz yz xz xy


@jit
def tensor_stiffness(nodes, cells, tensors, is_general, of_cell, dN, w, part, n_parts, K):
    """Write K, (n, 3 n_a, 3 n_a), of the elements whose material is not isotropic; leave the other entries unchanged.

    (1) T_j = Σ_l C_ij,kl g_bl: the stress in row i, column j from a unit displacement of node b along k
    (2) K_ai,bk = Σ_q w det(J) Σ_j g_aj T_j, for b >= a, and its transpose

    tensors: matrix of every material that maps strain to stress, (n_materials, 6, 6); g: shape function gradients.
    """
    n_a = cells.shape[1]
    x, g = np.empty((n_a, 3)), np.empty((n_a, 3))
    J, Q, T = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3, 3))
    for e in range(part * cells.shape[0] // n_parts, (part + 1) * cells.shape[0] // n_parts):
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
                break  # the loop over all elements reports inverted elements
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
