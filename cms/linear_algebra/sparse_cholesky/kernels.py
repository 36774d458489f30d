"""Compiled loops for elimination tree and fronts; imported only when used, because importing numba is slow.

Graphs are given by compressed rows `start`, `neighbours`, without the vertex itself.
"""

import numpy as np

from fe_models.foundation.kernels.jit import jit

__all__ = [
    "amalgamate",
    "elimination_tree",
    "front_rows",
    "graph_of",
    "permuted",
    "places_above",
    "postorder",
    "sums_over_rows",
    "weighted_counts",
]


@jit
def sums_over_rows(indptr, indices, keys):
    """Return the sum of the keys of each row and its neighbours, (n,), given a lower triangle."""
    total = keys.copy()
    for j in range(keys.size):
        for e in range(indptr[j], indptr[j + 1]):
            i = indices[e]
            if i != j:
                total[i] += keys[j]
                total[j] += keys[i]
    return total


@jit
def graph_of(indptr, indices, representative, group):
    """Return the graph of the vertices, each represented by one row; every edge appears in both directions."""
    n = representative.size
    start, stands = np.zeros(n + 2, np.int64), np.zeros(group.size, np.bool_)
    stands[representative] = True
    for fill in range(2):
        if fill:
            for a in range(2, n + 2):
                start[a] += start[a - 1]  # start[1] is zero
            neighbours = np.empty(start[n + 1], np.int32)
        for a in range(n):
            j = representative[a]
            for e in range(indptr[j], indptr[j + 1]):
                i = indices[e]
                if i == j or not stands[i]:
                    continue
                b = group[i]
                if fill:
                    neighbours[start[a + 1]], neighbours[start[b + 1]] = b, a
                    start[b + 1] += 1
                    start[a + 1] += 1
                else:
                    start[b + 2] += 1
                    start[a + 2] += 1
    return start[: n + 1], neighbours


@jit
def runs_of_similar(start, neighbours, share):
    """Return the run of each vertex, (n,): consecutive vertices whose neighbours are nearly those of the first of them.

    A vertex joins the run if it has at least this share of the neighbours of both in common with the first one. A
    vertex counts as its own neighbour.
    """
    n = start.size - 1
    run, seen_by = np.zeros(n, np.int64), np.full(n, -2, np.int64)  # the last first vertex with this neighbour
    first = -1
    for a in range(n):
        common = 1 if seen_by[a] == first else 0
        for e in range(start[a], start[a + 1]):
            common += 1 if seen_by[neighbours[e]] == first else 0
        n_both = start[a + 1] - start[a] + start[first + 1] - start[first] + 2 - common
        if first >= 0 and common >= share * n_both:
            run[a] = run[a - 1]
            continue
        run[a], first = run[a - 1] + 1 if a else 0, a
        seen_by[a] = a
        for e in range(start[a], start[a + 1]):
            seen_by[neighbours[e]] = a
    return run


@jit
def contracted(start, neighbours, run):
    """Return the graph with one vertex for each run of vertices, whose neighbours are those of all of them, sorted."""
    n = run[-1] + 1
    begin, seen = np.zeros(n + 2, np.int64), np.empty(n, np.int64)
    for fill in range(2):
        if fill:
            for a in range(2, n + 2):
                begin[a] += begin[a - 1]  # begin[1] is zero
            found = np.empty(begin[n + 1], np.int32)
        seen[:] = -1
        for k in range(run.size):
            a = run[k]
            for e in range(start[k], start[k + 1]):
                b = run[neighbours[e]]
                if b == a or seen[b] == a:
                    continue
                seen[b] = a
                if fill:
                    found[begin[b + 1]] = a
                    begin[b + 1] += 1
                else:
                    begin[b + 2] += 1
    return begin[: n + 1], found


@jit
def elimination_tree(start, neighbours):
    """Return the parent of each column of the factor, (n,), -1 for roots; vertices are in elimination order."""
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
    """Return the columns in postorder, (n,): each subtree is contiguous and ends with its root."""
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
    """Return the total weight below the diagonal in each column of the factor, (n,)."""
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
    """Return the front of each column, (n,), and the parent of each front; fronts are in postorder.

    (1) columns with the same rows below form one front
    (2) a front is merged with its parent if that adds few zeros: always up to `few` columns, above that up to a share
        of zeros that decreases from `share` with the number of columns
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
    """Append those entries of found[lo:hi] from row `last` on that are not in front f; return rows and their end."""
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
    """Return the start of the rows below each front, and the rows in ascending order; first[f] is its first column."""
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
        rows[begin[f] : at].sort()
        begin[f + 1] = at
    return begin, rows[: begin[n_fronts]].copy()


@jit
def places_above(begin, rows, first, above):
    """Return the position of each row below a front in its parent front: columns first, then rows below."""
    place = np.empty(rows.size, np.int32)
    for f in range(above.size):
        p = above[f]
        if p == -1:
            continue
        lo, hi, k = first[p], first[p + 1], begin[p]
        for e in range(begin[f], begin[f + 1]):
            if rows[e] < hi:
                place[e] = rows[e] - lo
            else:
                while rows[k] != rows[e]:
                    k += 1
                place[e] = hi - lo + k - begin[p]
    return place


@jit
def permuted(indptr, indices, data, rank):
    """Return the lower triangle of a reordered matrix by columns: row i becomes rank[i]; rows remain unsorted."""
    n = rank.size
    start = np.zeros(n + 1, np.int64)
    for j in range(n):
        for e in range(indptr[j], indptr[j + 1]):
            start[min(rank[indices[e]], rank[j]) + 1] += 1
    for j in range(n):
        start[j + 1] += start[j]
    rows, values = np.empty(data.size, np.int32), np.empty(data.size)
    for j in range(n):
        for e in range(indptr[j], indptr[j + 1]):
            a, b = rank[indices[e]], rank[j]
            at = start[min(a, b)]
            rows[at], values[at] = max(a, b), data[e]
            start[min(a, b)] += 1
    for j in range(n, 0, -1):
        start[j] = start[j - 1]
    start[0] = 0
    return start, rows, values
