"""Compiled loops of the recovery on patches (`patches`), imported lazily; a kernel does one part of the rows."""

import numpy as np

from fe_models.foundation.kernels.jit import jit_with

__all__ = ["write_moments", "write_node_values"]

jit = jit_with(fastmath={"contract"})

WIDTH = 64  #: number of columns at a time; the samples of a patch then stay in the nearest cache


@jit
def write_moments(start, samples, basis, values, part, n_parts, moments):
    """Write the sums of basis times values over the samples of each patch, (n_patches, n_terms, k).

    start: first entry of each patch, (n_patches + 1,); samples, basis: of each entry, (n_entries,) and (n_entries,
    n_terms); values: at the samples, (n_samples, k).
    """
    n_patches, n_terms, n_k = moments.shape
    total = np.empty(WIDTH)
    for patch in range(part * n_patches // n_parts, (part + 1) * n_patches // n_parts):
        for first in range(0, n_k, WIDTH):
            width = min(WIDTH, n_k - first)
            for term in range(n_terms):
                total[:] = 0.0
                e, end = start[patch], start[patch + 1]
                while e + 4 <= end:
                    a, b, c, d = basis[e, term], basis[e + 1, term], basis[e + 2, term], basis[e + 3, term]
                    x_a, x_b = values[samples[e], first:], values[samples[e + 1], first:]
                    x_c, x_d = values[samples[e + 2], first:], values[samples[e + 3], first:]
                    for k in range(width):
                        total[k] = (((total[k] + a * x_a[k]) + b * x_b[k]) + c * x_c[k]) + d * x_d[k]
                    e += 4
                while e < end:
                    a, x_a = basis[e, term], values[samples[e], first:]
                    for k in range(width):
                        total[k] += a * x_a[k]
                    e += 1
                for k in range(width):
                    moments[patch, term, first + k] = total[k]


@jit
def write_node_values(start, patches, weights, moments, part, n_parts, found):
    """Write the sums of weights times moments over the patches of each node, (n_nodes, k).

    start: first entry of each node, (n_nodes + 1,); patches, weights: of each entry, (n_entries,) and (n_entries,
    n_terms); moments: (n_patches, n_terms, k).
    """
    for node in range(part * found.shape[0] // n_parts, (part + 1) * found.shape[0] // n_parts):
        row = found[node]
        row[:] = 0.0
        for e in range(start[node], start[node + 1]):
            for term in range(weights.shape[1]):
                factor, moment = weights[e, term], moments[patches[e], term]
                for k in range(row.size):
                    row[k] += factor * moment[k]
