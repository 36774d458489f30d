"""Principal submatrices of large sparse matrices in one pass, where SciPy's indexing takes several."""

import numpy as np
import scipy.sparse as sp

from fe_models.foundation.arrays import IntArray

__all__ = ["principal_block"]


def principal_block(A: sp.csc_array, index: IntArray) -> sp.csc_array:
    """Return A[index][:, index] for ascending indices, (n, n), with sorted row indices if A has them."""
    n = len(index)
    if n == A.shape[0]:
        return A
    if n and index[-1] == n - 1:
        return sp.csc_array(A[:n, :n])
    new_row = np.full(A.shape[0], -1, A.indices.dtype)
    new_row[index] = np.arange(n)
    rows = new_row[A.indices]
    is_in = rows >= 0
    is_in &= np.repeat(new_row >= 0, np.diff(A.indptr))
    per_column = np.add.reduceat(np.append(is_in, False), A.indptr[:-1], dtype=A.indptr.dtype)
    per_column[np.diff(A.indptr) == 0] = 0  # reduceat takes one entry where a column has none
    indptr = np.zeros(n + 1, A.indptr.dtype)
    np.cumsum(per_column[index], out=indptr[1:])
    return sp.csc_array((A.data[is_in], rows[is_in], indptr), shape=(n, n))
