"""Products of a sparse matrix and tall arrays that are both distributed by rows, and exchange of remote rows."""

import numpy as np
import scipy.sparse as sp

from fe_models.foundation.arrays import Array
from fe_models.foundation.ranks.ranks import Ranks
from fe_models.foundation.ranks.rows import Rows

__all__ = ["Halo", "RowsProduct"]

COLUMNS = 16  #: columns per pass over the matrix, so that the rows of x remain in the cache


class Halo:
    """Exchange of remote rows: each rank announces once which rows it needs, and then receives them on request."""

    def __init__(self, ranks: Ranks, rows: Rows, places: np.ndarray) -> None:
        """Prepare the exchange; called on all ranks at once, each with the remote rows that it needs, ascending."""
        self.ranks, self.places = ranks, places
        bounds = np.searchsorted(places, rows.starts)
        asked = [(places[a:b] - first) for a, b, first in zip(bounds, bounds[1:], rows.starts, strict=False)]
        self.sent = [asked[0]] if ranks.size == 1 else ranks.comm.alltoall(asked)

    def rows(self, x: Array) -> Array:
        """Return the remote rows, (n_places, k), given the own rows, (n_own, k); called on all ranks at once."""
        if self.ranks.size == 1:
            return x[:0]
        return np.concatenate(self.ranks.comm.alltoall([x[index] for index in self.sent]))


class RowsProduct:
    """The map x -> A x with A, x and A x distributed by rows.

    (1) once, every rank requests from the others the rows that its matrix entries need (the halo)
    (2) the columns of its part of A are renumbered: own rows of x first, then the halo, owner by owner
    (3) in a product, ranks exchange the halo rows and multiply their rows of A by [own x; halo]
    """

    def __init__(self, ranks: Ranks, rows: Rows, indptr: np.ndarray, indices: np.ndarray, data: Array) -> None:
        """Prepare products; called on all ranks, each with its compressed rows of A over all columns, (n_own, n)."""
        self.ranks = ranks
        own = rows.of(ranks.rank)
        self.first, self.n = own.start, rows.n
        is_own = (indices >= own.start) & (indices < own.stop)
        halo = np.unique(indices[~is_own])
        self.exchange = Halo(ranks, rows, halo)  # (1)
        columns = np.where(is_own, indices - own.start, 0).astype(np.int32)  # (2)
        columns[~is_own] = (own.stop - own.start) + np.searchsorted(halo, indices[~is_own])
        self.n_own, self.n_halo, self.halo = own.stop - own.start, len(halo), halo
        self.A = sp.csr_array((data, columns, indptr), shape=(self.n_own, self.n_own + self.n_halo))

    def __matmul__(self, x: Array) -> Array:
        """Return this rank's rows of A x, (n_own, k), in Fortran order, from its rows of x; called on all ranks."""
        result = np.empty((self.n_own, x.shape[1]), order="F")
        for first in range(0, x.shape[1], COLUMNS):
            block = slice(first, min(first + COLUMNS, x.shape[1]))
            whole = np.empty((self.n_own + self.n_halo, block.stop - first))  # (3)
            whole[: self.n_own] = x[:, block]
            whole[self.n_own :] = self.exchange.rows(whole)
            result[:, block] = self.A @ whole
        return result

    def rows_of_all(self) -> sp.csr_array:
        """Return this rank's rows of A over all columns in their original numbering, (n_own, n)."""
        columns = np.concatenate([np.arange(self.first, self.first + self.n_own), self.halo]).astype(np.int32)
        return sp.csr_array((self.A.data, columns[self.A.indices], self.A.indptr), shape=(self.n_own, self.n))
