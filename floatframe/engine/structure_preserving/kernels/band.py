"""LU factors of a band matrix with row exchanges, rows one after the other: A[i, below + j - i] stands for (i, j).

Rows have room for `below` further numbers after the `above` of the band, which exchanges fill.
"""

from floatframe.engine.kernels.compiler.compilation import matrix_loops

__all__ = ["band_factor", "band_solve"]


@matrix_loops
def band_factor(A, pivot, below, above):
    """Overwrite A with its factors. Return False if a pivot is zero or not finite."""
    n, reach = A.shape[0], below + above
    for k in range(n):
        last, end = min(n - 1, k + below), min(n, k + reach + 1)
        best, row = -1.0, k
        for i in range(k, last + 1):
            size = abs(A[i, below + k - i])
            if size > best:
                best, row = size, i
        pivot[k] = row
        if not (best > 0.0 and best < 1e300):
            return False
        if row != k:
            for j in range(k, end):
                x = A[k, below + j - k]
                A[k, below + j - k] = A[row, below + j - row]
                A[row, below + j - row] = x
        inverse = 1.0 / A[k, below]
        top = A[k]
        for i in range(k + 1, last + 1):
            own, shift = A[i], k - i
            factor = own[below + shift] * inverse
            own[below + shift] = factor
            if factor != 0.0:
                for j in range(below + 1, below + end - k):
                    own[j + shift] -= factor * top[j]
    return True


@matrix_loops
def band_solve(A, pivot, below, above, b):
    """Overwrite b with A⁻¹ b."""
    n, reach = A.shape[0], below + above
    for k in range(n):
        row = pivot[k]
        if row != k:
            x = b[k]
            b[k] = b[row]
            b[row] = x
        x = b[k]
        if x != 0.0:
            for i in range(k + 1, min(n, k + below + 1)):
                b[i] -= A[i, below + k - i] * x
    for i in range(n - 1, -1, -1):
        total, own = b[i], A[i]
        for j in range(1, min(n - i, reach + 1)):
            total -= own[below + j] * b[i + j]
        b[i] = total / own[below]
