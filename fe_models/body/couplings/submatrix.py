"""Parts of large sparse matrices in one pass; SciPy's indexing needs several passes."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.ranks.spread_matrix import SpreadBlock, SpreadMatrix, whole_matrix
from fe_models.foundation.threads import n_threads

__all__ = ["PrincipalBlock", "principal_block", "scalar_part"]

SMALL = 200_000  #: number of stored entries below which compiled loops cost more than they save


@dataclass(frozen=True, eq=False)
class PrincipalBlock:
    """The submatrix A[index][:, index], (n, n); gives products and the diagonal without forming the submatrix."""

    A: sp.csc_array
    index: IntArray  #: rows and columns, in any order, each once, (n,)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return len(self.index), len(self.index)

    def diagonal(self) -> Array:
        """Return the diagonal, (n,)."""
        return np.asarray(self.A.diagonal()[self.index])

    def __matmul__(self, x: Array) -> Array:
        """Return the product with one column (n,) or many (n, k)."""
        whole = np.zeros((self.A.shape[0], *x.shape[1:]))
        whole[self.index] = x
        return np.asarray((self.A @ whole)[self.index])

    def spread(self) -> SpreadBlock | None:
        """Return the submatrix distributed over the ranks of A; None if A is not distributed, or in another order."""
        return self.A.block(self.index) if isinstance(self.A, SpreadMatrix) else None

    def cut(self) -> sp.csc_array:
        """Return the matrix."""
        return principal_block(self.A, self.index)


def principal_block(A: sp.csc_array, index: IntArray) -> sp.csc_array:
    """Return A[index][:, index], (n, n), with sorted row indices; the index may have any order."""
    A = whole_matrix(A)
    n = len(index)
    if n == A.shape[0] and (index[1:] > index[:-1]).all():
        return A
    if A.nnz < SMALL:
        block = sp.csc_array(A[:, index])[index]
        block.sort_indices()
        return block
    from fe_models.body.couplings.sparse_kernels import column_counts, column_entries

    new_row = np.full(A.shape[0], -1, A.indices.dtype)
    new_row[index] = np.arange(n)
    counts = np.empty(n, A.indptr.dtype)
    in_threads(column_counts, (A.indptr, A.indices, index, new_row), (counts,))
    indptr = np.zeros(n + 1, A.indptr.dtype)
    np.cumsum(counts, out=indptr[1:])
    indices, data = np.empty(indptr[-1], A.indices.dtype), np.empty(indptr[-1])
    in_threads(column_entries, (A.indptr, A.indices, A.data, index, new_row), (indptr, indices, data))
    block = sp.csc_array((data, indices, indptr), shape=(n, n))
    block.has_sorted_indices = True
    return block


def scalar_part(A: sp.csc_array) -> sp.csr_array:
    """Return the largest S, (p, p), with A[:3p, :3p] = S ⊗ 1₃ exactly, such as the scalar mass of a solid.

    Parameters
    ----------
    A
        Symmetric, (n, n), dofs node by node. p is 0 if the first three dofs do not form such a block, or if the row
        indices are not sorted.
    """
    from fe_models.body.couplings.sparse_kernels import n_scalar_nodes, scalar_entries

    p = n_scalar_nodes(A.indptr, A.indices, A.data) if A.has_sorted_indices else 0
    indptr = np.zeros(p + 1, A.indptr.dtype)
    scalar_entries(A.indptr, A.indices, A.data, p, indptr, A.indices[:0], A.data[:0])
    indices, data = np.empty(indptr[-1], A.indices.dtype), np.empty(indptr[-1])
    scalar_entries(A.indptr, A.indices, A.data, p, indptr, indices, data)
    return sp.csr_array((data, indices, indptr), shape=(p, p))


def in_threads(kernel: Callable[..., Any], inputs: tuple[Any, ...], outputs: tuple[Any, ...]) -> None:
    """Run kernel(*inputs, part, n_parts, *outputs) for every part, each in a thread."""
    n_parts = n_threads()
    with ThreadPoolExecutor(n_parts) as pool:
        list(pool.map(lambda part: kernel(*inputs, part, n_parts, *outputs), range(n_parts)))
