"""Threaded products of a large symmetric sparse matrix with blocks of columns (SciPy's own use one thread)."""

from concurrent.futures import ThreadPoolExecutor
from functools import cached_property
from itertools import pairwise
from typing import Any, Literal

import numpy as np
import scipy.sparse as sp

from fe_models.foundation.arrays import Array
from fe_models.foundation.sparse.submatrix import scalar_part
from fe_models.foundation.tall.columns import elsewhere, in_memory, ordered
from fe_models.foundation.threads import n_threads

__all__ = ["SymmetricProduct"]

SMALL = 200_000  #: number of stored entries below which threads cost more than they save
NARROW = 4  #: number of values in a row of the block below which the product of SciPy is faster
COLUMNS = 16  #: number of columns per pass over the matrix; the rows of x in use then stay in the cache


class SymmetricProduct:
    """The map x -> A x of a symmetric matrix A; its compressed columns are read as rows, without a copy.

    If A begins with S ⊗ 1₃ (`scalar_part`), like the mass of a solid, columns x with three components per node are rows
    of S that are three times as wide. Only a third of the entries is read, and the rows of x are read in longer pieces.
    With B = A[:, 3p:] for the other dofs (reference nodes, multipliers)

        (A x)_lead = (S ⊗ 1₃) x_lead + B_lead x_rest,   (A x)_rest = Bᵀ x

    A distributed matrix (`SpreadMatrix`) is multiplied on its ranks.
    """

    def __init__(self, A: sp.csc_array, *, columns: int = COLUMNS) -> None:
        self.A, self._columns = A, columns
        self._is_elsewhere = not sp.issparse(A)
        if self._is_elsewhere:
            return
        S = scalar_part(A) if A.nnz > SMALL else sp.csr_array((0, 0))
        self._n_lead = 3 * S.shape[0] if 6 * S.shape[0] > A.shape[0] else 0
        rows = S if self._n_lead else sp.csr_array((A.data, A.indices, A.indptr), shape=A.shape)
        n_parts = max(1, min(n_threads(), A.nnz // SMALL))
        cuts = np.searchsorted(rows.indptr, np.linspace(0, rows.nnz, n_parts + 1)[1:-1])
        bounds = np.concatenate([[0], cuts, [rows.shape[0]]]).astype(int)
        self._rows, self._shares = rows, list(pairwise(bounds.tolist()))
        self._pool = ThreadPoolExecutor(n_parts) if n_parts > 1 else None

    def __matmul__(self, x: Any) -> Any:
        """Return A x, (n, k), in the memory order of x; the product of distributed columns is distributed."""
        if self._is_elsewhere:
            return self.A @ (x if elsewhere(x) is not None else in_memory(x))
        x = in_memory(x)
        order: Literal["C", "F"] = "F" if x.flags.f_contiguous else "C"
        result = np.empty(x.shape)
        for first in range(0, x.shape[1], self._columns):
            block = np.ascontiguousarray(ordered(x[:, first : first + self._columns], "C"))
            if self._n_lead:
                self._multiply(block[: self._n_lead], result, first, 3)
                self._add_rest(block, result[:, first : first + self._columns])
            else:
                self._multiply(block, result, first, 1)
        return ordered(result, order)

    def _multiply(self, block: Array, result: Array, first: int, n_components: int) -> None:
        """Write the product to columns from `first` on, row by row; `n_components` rows form one row of the block."""
        rows = self._rows
        wide = block.reshape(-1, n_components * block.shape[1])
        if rows.nnz <= SMALL or wide.shape[1] < NARROW:
            result[: len(block), first : first + block.shape[1]] = (rows @ wide).reshape(block.shape)
            return
        from fe_models.foundation.sparse.sparse_kernels import multiply_rows

        def multiply(share: tuple[int, int]) -> None:
            multiply_rows(rows.indptr, rows.indices, rows.data, *share, n_components, wide, result, first)

        if self._pool is None:
            multiply(self._shares[0])
        else:
            list(self._pool.map(multiply, self._shares))

    def _add_rest(self, block: Array, target: Array) -> None:
        """Add the contribution of the columns after those of S."""
        rest, (rows, B_rows) = self._rest
        target[rows] += B_rows @ block[self._n_lead :]
        target[self._n_lead :] = rest @ block

    @cached_property
    def _rest(self) -> tuple[sp.csr_array, tuple[Array, sp.csr_array]]:
        """Return Bᵀ, and the non-empty rows of B_lead with their indices."""
        B = sp.csc_array(self.A[:, self._n_lead :])
        rows = np.unique(B.indices)
        rows = rows[rows < self._n_lead]
        return sp.csr_array(B.T), (rows, sp.csr_array(B)[rows])
