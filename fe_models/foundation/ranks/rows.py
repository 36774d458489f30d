"""Transfer of the rows of tall arrays and matrices from rank 0 to the other ranks, and back."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.ranks.ranks import Ranks

__all__ = ["Rows", "collected", "even_rows", "own_rows", "spread"]

PIECE = 2**24  #: largest number of values in one message; MPI counts bytes with 32 bits


@dataclass(frozen=True)
class Rows:
    """Distribution of rows: rank r has the rows from starts[r] to starts[r + 1]."""

    starts: tuple[int, ...]

    @property
    def n(self) -> int:
        """Number of all rows."""
        return self.starts[-1]

    def of(self, rank: int) -> slice:
        """Return the rows of a rank."""
        return slice(self.starts[rank], self.starts[rank + 1])

    def count(self, rank: int) -> int:
        """Return the number of rows on a rank."""
        return self.starts[rank + 1] - self.starts[rank]


def even_rows(indptr: np.ndarray, size: int) -> Rows:
    """Return `size` consecutive parts of rows with about equal numbers of stored entries."""
    cuts = np.searchsorted(indptr, np.linspace(0, int(indptr[-1]), size + 1)[1:-1])
    return Rows((0, *(int(cut) for cut in cuts), len(indptr) - 1))


def own_rows(ranks: Ranks, rows: Rows, x: Array | None) -> Array:
    """Return this rank's rows, (n_own, k), of a tall array on rank 0, in Fortran order."""
    k = 0 if x is None else x.shape[1]
    if ranks.size == 1:
        assert x is not None
        return np.asfortranarray(x)
    k = ranks.comm.bcast(k, root=0)
    if ranks.rank == 0:
        assert x is not None
        for other in range(1, ranks.size):
            send(ranks, np.ascontiguousarray(x[rows.of(other)].T), other)
        return np.asfortranarray(x[rows.of(0)])
    return receive(ranks, k * rows.count(ranks.rank), np.float64).reshape(k, rows.count(ranks.rank)).T


def collected(ranks: Ranks, rows: Rows, own: Array) -> Array | None:
    """Return the tall array from its distributed rows, in Fortran order, on rank 0; None on other ranks."""
    if ranks.size == 1:
        return np.asfortranarray(own)
    if ranks.rank:
        send(ranks, np.ascontiguousarray(own.T), 0)
        return None
    x = np.empty((rows.n, own.shape[1]), order="F")
    x[rows.of(0)] = own
    for other in range(1, ranks.size):
        x[rows.of(other)] = (
            receive(ranks, own.shape[1] * rows.count(other), np.float64, other)
            .reshape(own.shape[1], rows.count(other))
            .T
        )
    return x


def spread(
    ranks: Ranks, rows: Rows, arrays: tuple[np.ndarray, np.ndarray, np.ndarray] | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return indptr, indices (int32) and data of this rank's rows of a compressed matrix on rank 0."""
    if arrays is not None:
        indptr, indices, data = arrays
        for other in range(1, ranks.size):
            part = rows.of(other)
            entries = slice(int(indptr[part.start]), int(indptr[part.stop]))
            send(ranks, (indptr[part.start : part.stop + 1] - indptr[part.start]).astype(np.int64), other)
            send(ranks, np.asarray(indices[entries], np.int32), other)
            send(ranks, data[entries], other)
        stop = rows.of(0).stop
        entries = slice(0, int(indptr[stop]))
        if ranks.size == 1:
            return np.asarray(indptr, np.int32), np.asarray(indices, np.int32), data
        # copies, because views would keep the complete arrays in memory
        return indptr[: stop + 1].astype(np.int32), indices[entries].astype(np.int32), data[entries].copy()
    own_indptr = receive(ranks, rows.count(ranks.rank) + 1, np.int64)
    nnz = int(own_indptr[-1])
    return own_indptr.astype(np.int32), receive(ranks, nnz, np.int32), receive(ranks, nnz, np.float64)


def send(ranks: Ranks, x: np.ndarray, other: int) -> None:
    """Send an array in pieces."""
    flat = np.ascontiguousarray(x).reshape(-1)
    for first in range(0, len(flat), PIECE):
        ranks.comm.Send(flat[first : first + PIECE], dest=other)


def receive(ranks: Ranks, count: int, dtype: Any, other: int = 0) -> np.ndarray:
    """Receive an array of `count` numbers in pieces."""
    flat = np.empty(count, dtype)
    for first in range(0, count, PIECE):
        ranks.comm.Recv(flat[first : first + PIECE], source=other)
    return flat
