"""Products of a large symmetric sparse matrix with blocks of columns, in threads (SciPy's own use one)."""

from concurrent.futures import ThreadPoolExecutor
from typing import Literal

import numpy as np
import scipy.sparse as sp

from cms.solvers.tall import ordered
from fe_models.foundation.arrays import Array
from fe_models.foundation.threads import n_threads

__all__ = ["SymmetricProduct"]

SMALL = 200_000  #: stored entries below which threads cost more than they bring
COLUMNS = 16  #: columns per pass over the matrix; the rows of x it touches then stay in the cache


class SymmetricProduct:
    """The map x -> A x of a symmetric matrix A; its compressed columns are read as rows, nothing is copied."""

    def __init__(self, A: sp.csc_array) -> None:
        n = A.shape[0]
        n_parts = max(1, min(n_threads(), A.nnz // SMALL))
        cuts = np.searchsorted(A.indptr, np.linspace(0, A.nnz, n_parts + 1)[1:-1])
        self._bounds = np.concatenate([[0], cuts, [n]]).astype(int)
        self._parts = [_rows(A, *bounds) for bounds in zip(self._bounds[:-1], self._bounds[1:], strict=True)]
        self._pool = ThreadPoolExecutor(n_parts) if n_parts > 1 else None

    def __matmul__(self, x: Array) -> Array:
        """Return A x in the order of x, (n, k)."""
        order: Literal["C", "F"] = "F" if x.flags.f_contiguous else "C"
        result = np.empty(x.shape)
        for first in range(0, x.shape[1], COLUMNS):
            block = np.ascontiguousarray(ordered(x[:, first : first + COLUMNS], "C"))
            target = result[:, first : first + COLUMNS]

            def multiply(k: int, block: Array = block, target: Array = target) -> None:
                target[self._bounds[k] : self._bounds[k + 1]] = self._parts[k] @ block

            if self._pool is None:
                multiply(0)
            else:
                list(self._pool.map(multiply, range(len(self._parts))))
        return ordered(result, order)


def _rows(A: sp.csc_array, first: int, last: int) -> sp.csr_array:
    entries = slice(A.indptr[first], A.indptr[last])
    indptr = A.indptr[first : last + 1] - A.indptr[first]
    return sp.csr_array((A.data[entries], A.indices[entries], indptr), shape=(last - first, A.shape[0]))
