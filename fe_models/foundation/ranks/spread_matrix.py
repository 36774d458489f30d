"""A symmetric sparse matrix distributed by rows: rank 0 stores its own rows, and a key for the rows of the others.

The row order (`order`) places neighbours near each other, so that a rank needs few remote rows in a product. Rows of a
principal block stay on their ranks, so factorisation and eigensolver use them without redistribution.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.errors import BodyError
from fe_models.foundation.ranks.product import RowsProduct
from fe_models.foundation.ranks.ranks import Ranks
from fe_models.foundation.ranks.row_layout import RowLayout, new_key
from fe_models.foundation.ranks.rows import Rows, collected, own_rows, receive, send
from fe_models.foundation.ranks.spread_columns import Part, SpreadColumns, own_part
from fe_models.foundation.ranks.trim import give_back

__all__ = ["OwnRows", "SpreadMatrix", "largest_entry", "spread_sum", "whole_matrix"]

COLUMNS = 32  #: number of columns of a product at a time


@dataclass(frozen=True, eq=False)
class OwnRows:
    """Compressed rows of a matrix that are on one rank, over all columns."""

    indptr: np.ndarray  #: start of each row, (n_own + 1,) int32
    indices: np.ndarray  #: column of each entry, ascending in each row, (n_entries,) int32
    data: Array  #: entries, (n_entries,)


class SpreadMatrix:
    """A distributed symmetric matrix, (n, n); freed when the last reference is dropped.

    Columns x and products A x are either arrays of rank 0 in the order of the dofs, or both distributed
    (`SpreadColumns`). Operations that this class does not offer need the complete matrix: `whole`.
    """

    __array_ufunc__ = None  #: makes NumPy leave products to this class

    def __init__(
        self, ranks: Ranks, order: IntArray, rows: Rows, function: Callable[..., Any], *arguments: Any
    ) -> None:
        """Let every rank create and keep its rows.

        Parameters
        ----------
        order
            Dof of each row, in the order of distribution, (n,).
        rows
            Rows on each rank.
        function
            Function that is called on all ranks at once with the arguments. It returns `OwnRows`, with columns in the
            order of the rows.
        """
        self.layout = RowLayout(ranks, order, rows)
        self.ranks, self.order, self.rows, self.key = ranks, order, rows, new_key()
        self.position = self.layout.position
        self.layout.free_with(self, self.key)
        found = self._ask(made_here, self.key, rows, function, *arguments)
        self.nnz = sum(entries for entries, _ in found)
        self.largest = max(largest for _, largest in found)  #: largest magnitude of all entries
        self._diagonal: Array | None = None

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return len(self.order), len(self.order)

    def _ask(self, function: Callable[..., Any], *arguments: Any) -> list[Any]:
        """Call function(ranks, *arguments) on all ranks, after they have dropped data without references."""
        return self.layout.ask(function, *arguments)

    def diagonal(self) -> Array:
        """Return the diagonal, (n,)."""
        if self._diagonal is None:
            self._diagonal = np.concatenate(self._ask(diagonal_here, self.key))[self.position]
        return self._diagonal.copy()

    def __matmul__(self, x: Any) -> Any:
        """Return A x for one column, (n,), or many, (n, k), in blocks; distributed x gives a distributed product."""
        if isinstance(x, SpreadColumns):
            return self._on_ranks(x)
        x = np.asarray(x)
        if x.ndim == 1:
            return np.asarray((self @ x[:, None])[:, 0])
        result = np.empty(x.shape)
        for first in range(0, x.shape[1], COLUMNS):
            block = slice(first, first + COLUMNS)
            self.ranks.store["columns"] = x[self.order, block]
            result[self.order, block] = self._ask(multiplied_here, self.key, self.rows)[0]
        return result

    def _on_ranks(self, x: SpreadColumns) -> SpreadColumns:
        if not self.layout.is_like(x.layout):
            raise BodyError(f"SpreadMatrix: rows of columns {x.shape} lie otherwise than those of A, {self.shape}")
        product = SpreadColumns(x.layout, Part(new_key(), 0, x.shape[1]))
        self._ask(product_here, product.part.key, self.key, x.part)
        return product

    def __getitem__(self, index: tuple[slice, IntArray]) -> sp.csc_array:
        """Return the columns A[:, dofs], (n, k), as a matrix of rank 0."""
        every, dofs = index
        if not isinstance(every, slice) or every != slice(None):
            raise IndexError("SpreadMatrix: expected A[:, dofs]; take whole() for other parts")
        parts = self._ask(columns_here, self.key, self.position[np.asarray(dofs)])
        return sp.csc_array(sp.vstack(parts, format="csr")[self.position])

    def ordered(self, dofs: IntArray) -> IntArray:
        """Return the dofs sorted in the order of the rows."""
        return dofs[np.argsort(self.position[dofs])]

    def block(self, dofs: IntArray) -> "SpreadBlock | None":
        """Return A[dofs][:, dofs], distributed over the same ranks; None if dofs are not in the order of the rows."""
        where = self.position[dofs]
        if not (where[1:] > where[:-1]).all():
            return None
        return SpreadBlock(self, where)

    def whole(self) -> sp.csc_array:
        """Return the matrix on rank 0, (n, n), with sorted row indices."""
        A = self._ask(collected_here, self.key, self.rows)[0]
        columns = self.order[A.indices].astype(A.indices.dtype)
        A = sp.csr_array((A.data, columns, A.indptr), shape=A.shape)[self.position]
        A.sort_indices()
        whole = sp.csc_array((A.data, A.indices, A.indptr), shape=A.shape)
        whole.has_canonical_format = True
        return whole


class SpreadBlock:
    """A principal block of a distributed matrix."""

    def __init__(self, matrix: SpreadMatrix, where: np.ndarray) -> None:
        """Select the rows, ascending."""
        self.matrix, self.is_chosen = matrix, np.zeros(len(matrix.order), bool)
        self.is_chosen[where] = True
        before = np.concatenate([[0], np.cumsum(self.is_chosen)])
        self.rows = Rows(tuple(int(before[start]) for start in matrix.rows.starts))  #: rows of the block on each rank

    def keep(self, key: str, *, upper: bool = False) -> int:
        """Let every rank keep its `OwnRows` under a key (all columns, or upper triangle); return the entry count."""
        return sum(self.matrix._ask(block_here, key, self.matrix.key, self.is_chosen, self.rows, upper))

    def expanded(self, x: SpreadColumns) -> SpreadColumns:
        """Return columns over all rows of the matrix, zero outside the block; x is distributed like the block."""
        layout, key = self.matrix.layout, new_key()
        layout.ask(expanded_here, key, x.part, self.is_chosen, layout.rows)
        return SpreadColumns(layout, Part(key, 0, x.shape[1]))


def spread_sum(A: SpreadMatrix, B: SpreadMatrix, factor: float) -> SpreadMatrix:
    """Return A + factor B for matrices with the same distribution, distributed likewise."""
    if not A.layout.is_like(B.layout):
        raise BodyError(f"spread_sum: rows of matrices {A.shape} and {B.shape} lie otherwise on the ranks")
    return SpreadMatrix(A.ranks, A.order, A.rows, added_here, A.key, B.key, factor)


def whole_matrix(A: Any) -> sp.csc_array:
    """Return the complete matrix on rank 0; a distributed matrix is collected there."""
    return A.whole() if isinstance(A, SpreadMatrix) else A


def largest_entry(A: Any) -> float:
    """Return the largest magnitude of the entries of a matrix; 0 if it has no entries."""
    return A.largest if isinstance(A, SpreadMatrix) else float(np.abs(A.data).max(initial=0.0))


def made_here(ranks: Ranks, key: str, rows: Rows, function: Callable[..., Any], *arguments: Any) -> tuple[int, float]:
    """Create and keep this rank's rows; return the number of entries and their largest magnitude."""
    own: OwnRows = function(ranks, *arguments)
    product = RowsProduct(ranks, rows, own.indptr, own.indices, own.data)
    del own
    ranks.store[key] = product
    give_back()
    data = product.A.data
    return len(data), float(max(data.max(initial=0.0), -data.min(initial=0.0)))


def added_here(ranks: Ranks, key: str, other_key: str, factor: float) -> OwnRows:
    """Return this rank's rows of A + factor B."""
    A = sp.csr_array(ranks.store[key].rows_of_all() + factor * ranks.store[other_key].rows_of_all())
    A.sort_indices()
    return OwnRows(A.indptr.astype(np.int32), A.indices.astype(np.int32), A.data)


def diagonal_here(ranks: Ranks, key: str) -> Array:
    """Return the diagonal entries of this rank's rows; the first columns are the own ones."""
    return np.asarray(ranks.store[key].A.diagonal())


def multiplied_here(ranks: Ranks, key: str, rows: Rows) -> Array | None:
    """Return A x on rank 0 for columns on rank 0."""
    x = own_rows(ranks, rows, ranks.store.pop("columns", None))
    return collected(ranks, rows, ranks.store[key] @ x)


def product_here(ranks: Ranks, key: str, matrix_key: str, x: Part) -> None:
    """Keep this rank's rows of A x for distributed columns."""
    ranks.store[key] = ranks.store[matrix_key] @ own_part(ranks, x)


def expanded_here(ranks: Ranks, key: str, x: Part, is_chosen: np.ndarray, rows: Rows) -> None:
    """Keep this rank's rows of a block, expanded to the rows of the matrix."""
    whole = np.zeros((rows.count(ranks.rank), x.last - x.first), order="F")
    whole[is_chosen[rows.of(ranks.rank)]] = own_part(ranks, x)
    ranks.store[key] = whole


def columns_here(ranks: Ranks, key: str, columns: np.ndarray) -> sp.csr_array:
    """Return some columns of this rank's rows, (n_own, k)."""
    return sp.csr_array(ranks.store[key].rows_of_all()[:, columns])


def block_here(ranks: Ranks, key: str, matrix_key: str, is_chosen: np.ndarray, rows: Rows, upper: bool) -> int:
    """Keep the selected rows and columns of this rank's rows."""
    A, own = ranks.store[matrix_key].rows_of_all(), rows.of(ranks.rank)
    number = np.cumsum(is_chosen, dtype=np.int32) - np.int32(1)
    number[~is_chosen] = -1
    of_row = number[ranks.store[matrix_key].first :][: A.shape[0]]
    columns = number[A.indices]
    row = np.repeat(of_row, np.diff(A.indptr))
    is_kept = (row >= 0) & (columns >= (row if upper else 0))
    counts = np.bincount(row[is_kept] - own.start, minlength=own.stop - own.start)
    indptr = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
    block = sp.csr_array((A.data[is_kept], columns[is_kept], indptr), shape=(own.stop - own.start, rows.n))
    block.sort_indices()
    ranks.store[key] = with_diagonal(block, own.start) if upper else OwnRows(block.indptr, block.indices, block.data)
    return block.nnz


def with_diagonal(upper: sp.csr_array, first: int) -> OwnRows:
    """Return the rows of the upper triangle, starting with row `first`, with every diagonal entry stored."""
    indptr, indices, data = upper.indptr, upper.indices, upper.data
    lacks = np.diff(indptr) == 0
    full = np.flatnonzero(~lacks)
    lacks[full] = indices[indptr[full]] != first + full
    missing = np.flatnonzero(lacks)
    if len(missing):
        indices, data = np.insert(indices, indptr[missing], first + missing), np.insert(data, indptr[missing], 0.0)
        indptr = (indptr + np.concatenate([[0], np.cumsum(lacks)])).astype(np.int32)
    return OwnRows(indptr, indices, data)


def collected_here(ranks: Ranks, key: str, rows: Rows) -> sp.csr_array | None:
    """Return the complete matrix in the order of the rows on rank 0."""
    A = ranks.store[key].rows_of_all()
    if ranks.rank:
        for x in (A.indptr.astype(np.int64), A.indices, A.data):
            send(ranks, x, 0)
        return None
    parts = [A]
    for other in range(1, ranks.size):
        indptr = receive(ranks, rows.count(other) + 1, np.int64, other)
        indices, data = (receive(ranks, int(indptr[-1]), dtype, other) for dtype in (np.int32, np.float64))
        parts.append(sp.csr_array((data, indices, indptr), shape=(rows.count(other), rows.n)))
    return sp.csr_array(sp.vstack(parts, format="csr"))
