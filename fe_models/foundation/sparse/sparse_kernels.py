"""Compiled loops over large sparse matrices in compressed columns; imported only where used.

A kernel works on one share of the columns, `part` of `n_parts`, and writes only to that share.
"""

import numpy as np

from fe_models.foundation.kernels.jit import jit

__all__ = ["column_counts", "column_entries", "multiply_rows", "n_scalar_nodes", "scalar_entries"]


@jit
def column_counts(indptr, indices, index, new_row, part, n_parts, counts):
    """Count the kept entries of column index[k] into counts, (n,); new_row is -1 for rows that are dropped."""
    for k in range(part * index.size // n_parts, (part + 1) * index.size // n_parts):
        count = 0
        for e in range(indptr[index[k]], indptr[index[k] + 1]):
            if new_row[indices[e]] >= 0:
                count += 1
        counts[k] = count


@jit
def column_entries(indptr, indices, data, index, new_row, part, n_parts, new_indptr, new_indices, new_data):
    """Write the entries that `column_counts` counted, with ascending rows in every column.

    Consecutive rows, such as those of a node, stay consecutive. (1) Sort the runs of such rows; (2) write them.
    """
    first_k, last_k = part * index.size // n_parts, (part + 1) * index.size // n_parts
    longest = 0
    for k in range(first_k, last_k):
        longest = max(longest, new_indptr[k + 1] - new_indptr[k])
    run_row, run_entry = np.empty(longest, np.int64), np.empty(longest, np.int64)
    for k in range(first_k, last_k):
        n_runs, next_row = 0, -1
        for e in range(indptr[index[k]], indptr[index[k] + 1]):  # (1)
            row = new_row[indices[e]]
            if row >= 0 and row != next_row:
                m = n_runs
                while m > 0 and run_row[m - 1] > row:
                    run_row[m], run_entry[m] = run_row[m - 1], run_entry[m - 1]
                    m -= 1
                run_row[m], run_entry[m] = row, e
                n_runs += 1
            next_row = row + 1 if row >= 0 else -1
        at, end = new_indptr[k], indptr[index[k] + 1]
        for run in range(n_runs):  # (2)
            row, e = run_row[run], run_entry[run]
            while e < end and new_row[indices[e]] == row:
                new_indices[at], new_data[at] = row, data[e]
                at, e, row = at + 1, e + 1, row + 1


@jit
def n_scalar_nodes(indptr, indices, data):
    """Return the largest p for which the first 3 p rows and columns of a symmetric matrix are exactly S ⊗ 1₃.

    The columns of a node are compared only in its own rows and those of earlier nodes, because the matrix is symmetric.
    """
    n_nodes = (indptr.size - 1) // 3
    for node in range(n_nodes):
        first = indptr[3 * node]
        count = 0
        while first + count < indptr[3 * node + 1] and indices[first + count] < 3 * node + 3:
            if indices[first + count] % 3 != 0:
                return node
            count += 1
        for c in range(1, 3):
            at, end = indptr[3 * node + c], indptr[3 * node + c + 1]
            if end - at < count or (end - at > count and indices[at + count] < 3 * node + 3):
                return node
            for e in range(count):
                if indices[at + e] != indices[first + e] + c or data[at + e] != data[first + e]:
                    return node
    return n_nodes


@jit
def scalar_entries(indptr, indices, data, p, new_indptr, new_indices, new_data):
    """Write S, (p, p), from the first 3 p columns S ⊗ 1₃; with empty output arrays only count its entries."""
    at = 0
    for node in range(p):
        for e in range(indptr[3 * node], indptr[3 * node + 1]):
            if indices[e] < 3 * p:
                if new_indices.size:
                    new_indices[at], new_data[at] = indices[e] // 3, data[e]
                at += 1
        new_indptr[node + 1] = at


@jit
def multiply_rows(indptr, indices, data, first, last, n_components, wide, y, column):
    """Write rows c first to c last of (S ⊗ 1_c) x, (n, k), from the compressed rows of S, to y from a column on.

    SciPy's own product allocates new memory in every call, and passes over the output row once for every entry.
    wide: x, (n, k), as rows of c k numbers. Four entries are added at a time, so the output row stays in the nearest
    cache. The order of summation is that of SciPy.
    """
    width = wide.shape[1]
    k = width // n_components
    total = np.empty(width)
    for row in range(first, last):
        e, end = indptr[row], indptr[row + 1]
        total[:] = 0.0
        while e + 4 <= end:
            a, b, c, d = data[e], data[e + 1], data[e + 2], data[e + 3]
            x_a, x_b, x_c, x_d = wide[indices[e]], wide[indices[e + 1]], wide[indices[e + 2]], wide[indices[e + 3]]
            for j in range(width):
                total[j] = (((total[j] + a * x_a[j]) + b * x_b[j]) + c * x_c[j]) + d * x_d[j]
            e += 4
        while e < end:
            a, x_a = data[e], wide[indices[e]]
            for j in range(width):
                total[j] += a * x_a[j]
            e += 1
        for component in range(n_components):
            for j in range(k):
                y[n_components * row + component, column + j] = total[component * k + j]
