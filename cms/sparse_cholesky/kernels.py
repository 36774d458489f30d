"""Compiled loops of elimination tree and fronts; imported where they are used: numba takes half a second to import.

Graphs are compressed rows `start`, `neighbours` without the vertex itself.
"""

import numpy as np
from numba import njit

__all__ = [
    "amalgamate",
    "assemble_columns",
    "elimination_tree",
    "extend_add",
    "front_rows",
    "postorder",
    "subtract_rows",
    "take_rows",
    "weighted_counts",
]

jit = njit(cache=True, nogil=True, error_model="numpy")


@jit
def elimination_tree(start, neighbours):
    """Return the parent of each column of the factor, (n,), -1 of a root; vertices in the order of elimination."""
    n = start.size - 1
    parent, ancestor = np.full(n, -1, np.int64), np.full(n, -1, np.int64)
    for i in range(n):
        for e in range(start[i], start[i + 1]):
            j = neighbours[e]
            while j != -1 and j < i:
                above = ancestor[j]
                ancestor[j] = i
                if above == -1:
                    parent[j] = i
                j = above
    return parent


@jit
def postorder(parent):
    """Return the columns so that each subtree is a range and ends with its root, (n,)."""
    n = parent.size
    first, beside = np.full(n, -1, np.int64), np.full(n, -1, np.int64)
    for j in range(n - 1, -1, -1):
        if parent[j] != -1:
            beside[j] = first[parent[j]]
            first[parent[j]] = j
    order, stack = np.empty(n, np.int64), np.empty(n, np.int64)
    k = 0
    for root in range(n):
        if parent[root] != -1:
            continue
        top = 0
        stack[0] = root
        while top >= 0:
            j = stack[top]
            if first[j] != -1:
                top += 1
                stack[top] = first[j]
                first[j] = beside[first[j]]
            else:
                order[k] = j
                k += 1
                top -= 1
    return order


@jit
def weighted_counts(start, neighbours, parent, weight):
    """Return the weight below the diagonal of each column of the factor, (n,)."""
    n = parent.size
    count, seen = np.zeros(n, np.int64), np.full(n, -1, np.int64)
    for i in range(n):
        seen[i] = i
        for e in range(start[i], start[i + 1]):
            j = neighbours[e]
            while j < i and seen[j] != i:
                seen[j] = i
                count[j] += weight[i]
                j = parent[j]
    return count


@jit
def amalgamate(parent, count, weight, few, share):
    """Return the front of each column, (n,), and the parent of each front; fronts in postorder.

    (1) columns with the same rows below are one front
    (2) a front joins its parent's where that adds few zeros: up to `few` columns always, above up to a share of zeros
        that falls from `share` with the number of columns
    """
    n = parent.size
    front = np.empty(n, np.int64)
    n_fronts = 0
    for j in range(n):  # (1)
        is_same = j > 0 and parent[j - 1] == j and count[j - 1] == count[j] + weight[j]
        if not is_same:
            n_fronts += 1
        front[j] = n_fronts - 1
    above = np.full(n_fronts, -1, np.int64)
    width, below = np.zeros(n_fronts, np.int64), np.zeros(n_fronts, np.int64)
    for j in range(n):
        width[front[j]] += weight[j]
        below[front[j]] = count[j]
        above[front[j]] = front[parent[j]] if parent[j] != -1 else -1
    zeros, joins = np.zeros(n_fronts, np.int64), np.full(n_fronts, -1, np.int64)
    for f in range(n_fronts):  # (2)
        p = above[f]
        if p == -1:
            continue
        columns = width[f] + width[p]
        added = zeros[f] + zeros[p] + width[f] * (width[p] + below[p] - below[f])
        entries = columns * (columns + 1) // 2 + columns * below[p]
        allowed = 1.0 if columns <= few else max(share * few / columns, 0.03)
        if added <= allowed * entries:
            joins[f] = p
            width[p] = columns
            zeros[p] = added
    number, n_heads = np.empty(n_fronts, np.int64), 0
    for f in range(n_fronts):
        if joins[f] == -1:
            number[f] = n_heads
            n_heads += 1
    for f in range(n_fronts - 1, -1, -1):
        if joins[f] != -1:
            number[f] = number[joins[f]]
    heads = np.full(n_heads, -1, np.int64)
    for f in range(n_fronts):
        if joins[f] == -1 and above[f] != -1:
            heads[number[f]] = number[above[f]]
    for j in range(n):
        front[j] = number[front[j]]
    return front, heads


@jit
def append_rows(rows, at, found, lo, hi, last, seen, f):
    """Append what front f has not seen of found[lo:hi] from row `last` on; return rows (maybe longer) and their end."""
    for k in range(lo, hi):
        i = found[k]
        if i >= last and seen[i] != f:
            seen[i] = f
            if at == rows.size:
                rows = np.concatenate((rows, np.empty(rows.size, np.int32)))
            rows[at] = i
            at += 1
    return rows, at


@jit
def front_rows(start, neighbours, first, above):
    """Return where the rows below each front begin, and the rows, ascending; columns of front f: first[f] and on."""
    n_fronts, n = first.size - 1, start.size - 1
    seen = np.full(n, -1, np.int64)
    begin = np.zeros(n_fronts + 1, np.int64)
    rows = np.empty(max(16, 4 * n), np.int32)
    child, beside = np.full(n_fronts, -1, np.int64), np.full(n_fronts, -1, np.int64)
    for f in range(n_fronts):
        if above[f] != -1:
            beside[f] = child[above[f]]
            child[above[f]] = f
    for f in range(n_fronts):
        at, last = begin[f], first[f + 1]
        for j in range(first[f], last):
            rows, at = append_rows(rows, at, neighbours, start[j], start[j + 1], last, seen, f)
        c = child[f]
        while c != -1:
            rows, at = append_rows(rows, at, rows, begin[c], begin[c + 1], last, seen, f)
            c = beside[c]
        rows[begin[f] : at] = np.sort(rows[begin[f] : at])
        begin[f + 1] = at
    return begin, rows[: begin[n_fronts]].copy()


@jit
def assemble_columns(indptr, indices, data, lo, hi, rows, local, F11, F21):
    """Add the columns lo to hi of a lower triangle to a front; `local` becomes the places of the rows below."""
    for k in range(rows.size):
        local[rows[k]] = k
    for j in range(lo, hi):
        for e in range(indptr[j], indptr[j + 1]):
            i = indices[e]
            if i < hi:
                F11[i - lo, j - lo] += data[e]
            else:
                F21[local[i], j - lo] += data[e]


@jit
def extend_add(U, rows, lo, hi, local, F11, F21, F22):
    """Add the lower triangle of what a child leaves to a front."""
    m = rows.size
    inside = 0
    while inside < m and rows[inside] < hi:
        inside += 1
    for j in range(m):
        if j < inside:
            c = rows[j] - lo
            for i in range(j, inside):
                F11[rows[i] - lo, c] += U[i, j]
            for i in range(inside, m):
                F21[local[rows[i]], c] += U[i, j]
        else:
            c = local[rows[j]]
            for i in range(j, m):
                F22[local[rows[i]], c] += U[i, j]


@jit
def subtract_rows(X, rows, Y):
    """X[rows] -= Y."""
    for k in range(rows.size):
        for c in range(X.shape[1]):
            X[rows[k], c] -= Y[k, c]


@jit
def take_rows(X, rows):
    """Return X[rows]."""
    Y = np.empty((rows.size, X.shape[1]))
    for k in range(rows.size):
        for c in range(X.shape[1]):
            Y[k, c] = X[rows[k], c]
    return Y
