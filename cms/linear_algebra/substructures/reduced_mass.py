"""Mass matrix of the reduced pencil: unit diagonal, and a dense block between each substructure and all below it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from cms.linear_algebra.substructures.by_columns import by_columns
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["ReducedMass"]


@dataclass(frozen=True, eq=False)
class ReducedMass:
    """1 + C + Cᵀ over the modes of all substructures in order; C has one block per substructure.

    Block t has the columns of its own modes, starts[t] to starts[t + 1], and the rows of all modes of the substructures
    below it, which are contiguous: firsts[t] to starts[t].
    """

    starts: IntArray  #: first mode of each substructure, and the end, (n_substructures + 1,)
    firsts: IntArray  #: first mode in the subtree of each substructure, (n_substructures,)
    blocks: Sequence[Array]  #: block of each substructure t, (starts[t] - firsts[t], starts[t + 1] - starts[t])

    @property
    def n(self) -> int:
        """Number of modes."""
        return int(self.starts[-1])

    def __matmul__(self, Z: Array) -> Array:
        """Return M Z, (n, k)."""
        product = np.array(Z, order="C")

        def add(columns: slice) -> None:
            z, y = np.ascontiguousarray(Z[:, columns]), product[:, columns]
            for below, own, C in self._parts():
                y[below] += C @ z[own]
                y[own] += C.T @ z[below]

        by_columns(Z.shape[1], add)
        return product

    def between(self, to: NDArray[np.bool_], of: NDArray[np.bool_], Z: Array) -> Array:
        """Return M_to,of Z, (n_to, k), for two disjoint parts of the modes, given as masks (n,); Z is (n_of, k)."""
        at_to, at_of = (np.concatenate([[0], np.cumsum(part)]) for part in (to, of))
        product = np.zeros((int(at_to[-1]), Z.shape[1]))
        work = []
        for below, own, C in self._parts():
            for rows, columns, A in ((below, own, C), (own, below, C.T)):
                block = A[to[rows]][:, of[columns]]
                if block.size:
                    place = slice(at_to[rows.start], at_to[rows.stop]), slice(at_of[columns.start], at_of[columns.stop])
                    work.append((*place, block))

        def add(columns: slice) -> None:
            z, y = np.ascontiguousarray(Z[:, columns]), product[:, columns]
            for rows, others, block in work:
                y[rows] += block @ z[others]

        by_columns(Z.shape[1], add)
        return product

    def of(self, is_kept: NDArray[np.bool_]) -> "ReducedMass":
        """Return the mass matrix of some modes, given as a mask (n,)."""
        number = np.concatenate([[0], np.cumsum(is_kept)])
        blocks = [
            C if is_kept[below].all() and is_kept[own].all() else C[is_kept[below]][:, is_kept[own]]
            for below, own, C in self._parts(empty=True)
        ]
        return ReducedMass(number[self.starts], number[self.firsts], blocks)

    def toarray(self) -> Array:
        """Return M as a dense matrix, (n, n)."""
        M = np.eye(self.n)
        for below, own, C in self._parts():
            M[below, own] = C
            M[own, below] = C.T
        return M

    def tocsc(self) -> sp.csc_array:
        """Return M as a sparse matrix, (n, n)."""
        rows, columns, values = [np.arange(self.n)], [np.arange(self.n)], [np.ones(self.n)]
        for below, own, C in self._parts():
            row, column = (x.ravel() for x in np.mgrid[below, own])
            rows += [row, column]
            columns += [column, row]
            values += [C.ravel(), C.ravel()]
        entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
        return sp.csc_array(sp.coo_array(entries, shape=(self.n, self.n)))

    def _parts(self, *, empty: bool = False) -> list[tuple[slice, slice, Array]]:
        """Return rows, columns and entries of the blocks."""
        starts, firsts = self.starts.tolist(), self.firsts.tolist()
        return [
            (slice(firsts[t], starts[t]), slice(starts[t], starts[t + 1]), C)
            for t, C in enumerate(self.blocks)
            if C.size or empty
        ]
