"""Compiled loops of the assembly; imported where they are used, since numba takes half a second to import.

Every kernel works on a share of the rows, columns or elements, `part` of `n_parts`, and writes nothing outside it: the
shares run in threads without locks, and the order of additions to an entry never depends on the threads.
"""

import numpy as np
from numba import njit

__all__ = [
    "element_matrices",
    "expand_columns",
    "expand_mass",
    "node_incidence",
    "row_columns",
    "row_counts",
    "scatter_elements",
]

STRIPE = 64  #: consecutive nodes that one part owns; parts take stripes in turn, which balances any node order

jit = njit(cache=True, nogil=True, boundscheck=False)
jit_fma = njit(cache=True, nogil=True, boundscheck=False, fastmath={"contract"})  # a * b + c in one rounding, no more


@jit
def node_incidence(members, n_nodes):
    """Return start (n_nodes + 1,) and, node by node, the ascending places in `members` where the node occurs."""
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
    """Collect in `found` the nodes that share an element with `node`, unsorted; return their number."""
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
    """Count the neighbours (itself included) of the nodes of this part into counts, (n_nodes,)."""
    n_nodes = counts.size
    seen = np.full(n_nodes, -1, np.int32)
    found = np.empty(n_nodes, np.int32)
    for node in range(part * n_nodes // n_parts, (part + 1) * n_nodes // n_parts):
        counts[node] = neighbours_of(node, members, first, n_members, start, places, seen, found)


@jit
def row_columns(members, first, n_members, start, places, part, n_parts, row_start, columns):
    """Write the ascending neighbours of the nodes of this part into columns, (row_start[-1],)."""
    n_nodes = row_start.size - 1
    seen = np.full(n_nodes, -1, np.int32)
    found = np.empty(n_nodes, np.int32)
    for node in range(part * n_nodes // n_parts, (part + 1) * n_nodes // n_parts):
        count = neighbours_of(node, members, first, n_members, start, places, seen, found)
        at = row_start[node]
        for k in range(count):  # insertion sort: rows are short and nearly sorted
            value = found[k]
            m = at + k
            while m > at and columns[m - 1] > value:
                columns[m] = columns[m - 1]
                m -= 1
            columns[m] = value


@jit
def inverse_jacobian(x, dN, n, inverse):
    """Write the inverse of J_ij = dx_i / dxi_j (not divided by the determinant) and return the determinant."""
    J = np.zeros((3, 3))
    for a in range(n):
        for i in range(3):
            for j in range(3):
                J[i, j] += x[a, i] * dN[a, j]
    for i in range(3):
        i1, i2 = (i + 1) % 3, (i + 2) % 3
        for j in range(3):
            j1, j2 = (j + 1) % 3, (j + 2) % 3
            inverse[j, i] = J[i1, j1] * J[i2, j2] - J[i1, j2] * J[i2, j1]
    return J[0, 0] * inverse[0, 0] + J[0, 1] * inverse[1, 0] + J[0, 2] * inverse[2, 0]


@jit_fma
def element_matrices(nodes, cells, properties, of_cell, dN_K, w_K, N_M, dN_M, w_M, K, M, is_inverted):
    """Stiffness K, (n, 3 n_a, 3 n_a), and scalar mass M, (n, n_a, n_a), of the n elements `cells`, (n, n_a).

    (1) G = Σ_q w det(J) g gᵀ with g the gradients ∂N_a/∂x_i in one column, node-major;
    (2) K_ai,bj = lam G_ai,bj + mu G_aj,bi + mu δ_ij Σ_k G_ak,bk, for b >= a, the rest by symmetry;
    (3) M_ab = rho Σ_q w det(J) N_a N_b.

    properties: lam, mu, rho of every material, (n_materials, 3); of_cell: the material of each element.
    """
    n_a = cells.shape[1]
    x = np.empty((n_a, 3))
    g = np.empty(3 * n_a)
    G = np.empty((3 * n_a, 3 * n_a))
    inverse = np.empty((3, 3))
    for e in range(cells.shape[0]):
        lam, mu, rho = properties[of_cell[e], 0], properties[of_cell[e], 1], properties[of_cell[e], 2]
        for a in range(n_a):
            for i in range(3):
                x[a, i] = nodes[cells[e, a], i]
        is_inverted[e] = False
        G[:] = 0.0
        for q in range(w_K.size):  # (1)
            det = inverse_jacobian(x, dN_K[q], n_a, inverse)
            if det <= 0.0:
                is_inverted[e] = True
                break
            for a in range(n_a):
                for i in range(3):
                    g[3 * a + i] = (
                        dN_K[q, a, 0] * inverse[0, i] + dN_K[q, a, 1] * inverse[1, i] + dN_K[q, a, 2] * inverse[2, i]
                    )
            factor = w_K[q] / det  # det(J) once as measure, 1 / det(J) in each of the two gradients
            for r in range(3 * n_a):
                c = factor * g[r]
                row = G[r]
                for s in range(3 * (r // 3), 3 * n_a):
                    row[s] += c * g[s]
        for a in range(n_a):  # (2)
            for b in range(a, n_a):
                trace = mu * (G[3 * a, 3 * b] + G[3 * a + 1, 3 * b + 1] + G[3 * a + 2, 3 * b + 2])
                for i in range(3):
                    for j in range(3):
                        value = lam * G[3 * a + i, 3 * b + j] + mu * G[3 * a + j, 3 * b + i]
                        if i == j:
                            value += trace
                        K[e, 3 * a + i, 3 * b + j] = value
                        K[e, 3 * b + j, 3 * a + i] = value
        M[e] = 0.0
        for q in range(w_M.size):  # (3)
            det = inverse_jacobian(x, dN_M[q], n_a, inverse)
            if det <= 0.0:
                is_inverted[e] = True
                break
            for a in range(n_a):
                c = rho * w_M[q] * det * N_M[q, a]
                row = M[e, a]
                for b in range(a, n_a):
                    row[b] += c * N_M[q, b]
        for a in range(n_a):
            for b in range(a):
                M[e, a, b] = M[e, b, a]


@jit
def scatter_elements(
    cells, first_place, start, places, cursor, row_start, columns, K, M, part, n_parts, where, K_data, M_data
):
    """Add the element matrices of the consecutive elements `cells` to the rows of the nodes of this part.

    Row 3 i + c of the stiffness has 3 entries for each of the m_i neighbours of node i, so that entry (c, d) for the
    p-th neighbour lies at 9 row_start[i] + 3 m_i c + 3 p + d of K_data: no conversion follows.
    cursor: for each node, its next place in `places` that has not been added yet; where: workspace, (n_nodes,).
    """
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
    """Row starts and column numbers of the stiffness from those of the node graph: three columns for each neighbour."""
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
    """M_s ⊗ 1₃: row 3 i + c has M_s,ij in column 3 j + c."""
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
