"""The compiled product of sparse rows with a block of columns; imported only where used.

SciPy's own product allocates new memory in every call, and passes over the output row once for every entry.
"""

import numpy as np
from numba import njit

__all__ = ["multiply_rows"]


@njit(cache=True, nogil=True, error_model="numpy")
def multiply_rows(indptr, indices, data, first, last, n_components, wide, y):
    """Write rows c first to c last of y = (S ⊗ 1_c) x, (n, k), with any strides, from the compressed rows of S.

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
                y[n_components * row + component, j] = total[component * k + j]
