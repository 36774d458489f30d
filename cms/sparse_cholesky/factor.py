"""Cholesky factorisation by fronts (multifrontal), in memory or with the factor on disk."""

from pathlib import Path

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from cms.errors import FactorizationError
from cms.sparse_cholesky.analysis import Fronts, analyse, inverse
from cms.sparse_cholesky.panels import Panels, PanelsInFile, PanelsInMemory
from fe_models.foundation.arrays import Array

__all__ = ["CholeskyFactor"]

AT_ONCE = 64  #: right-hand sides that pass the panels together


class CholeskyFactor:
    """Cholesky factor P A Pᵀ = L Lᵀ of a positive definite matrix, until `close`.

    For each front, children first, with w columns of its own and u rows below them:

    (1) F = [[F11, .], [F21, F22]]: entries of A in its columns, plus what the children left
    (2) F11 = L11 L11ᵀ;  L21 = F21 L11⁻ᵀ;  what it leaves: F22 - L21 L21ᵀ
    (3) [L11; L21] goes to the panels, which all solves pass once forwards and once backwards
    """

    def __init__(
        self, lower: sp.csc_array, *, definite: bool = True, on_disk: bool = False, folder: Path | None = None,
        fronts: Fronts | None = None,
    ) -> None:  # fmt: skip
        """Factorise the matrix with this lower triangle, (n, n), every diagonal entry stored, sorted row indices.

        Parameters
        ----------
        on_disk
            Whether the factor stands in a file of `folder` (by default that of temporary files) instead of memory.
        fronts
            Of an analysis before; made here by default.
        """
        self.is_open = False
        if not definite:
            raise FactorizationError("cholesky: expected a positive definite matrix; take superlu for others")
        self.n = lower.shape[0]
        self._fronts = analyse(lower) if fronts is None else fronts
        self.n_factor_entries = self._fronts.n_entries
        self.n_negative = self.n_perturbed = 0
        self.n_positive = self.n
        self._panels: Panels = (
            PanelsInFile(self._fronts.width, self._fronts.below, folder) if on_disk else PanelsInMemory()
        )
        self.is_open = True
        try:
            self._factorise(permuted(lower, self._fronts))
        except BaseException:
            self.close()
            raise
        where = "factor on disk" if on_disk else "factor in memory"
        self.description = f"Cholesky by {len(self._fronts.above)} fronts (own; nested dissection; {where})"

    def _factorise(self, A: sp.csc_array) -> None:
        from cms.sparse_cholesky import kernels

        fronts = self._fronts
        first, begin, rows, above = fronts.first, fronts.begin, fronts.rows, fronts.above
        local = np.zeros(self.n, np.int32)
        left: list[list[tuple[Array, Array]]] = [[] for _ in above]  # by the children of each front
        for f in range(len(above)):
            lo, hi = first[f], first[f + 1]
            below = rows[begin[f] : begin[f + 1]]
            w, u = hi - lo, len(below)
            F11, F21, F22 = (np.zeros(shape, order="F") for shape in ((w, w), (u, w), (u, u)))
            kernels.assemble_columns(A.indptr, A.indices, A.data, lo, hi, below, local, F11, F21)  # (1)
            for U, rows_of in left[f]:
                kernels.extend_add(U, rows_of, lo, hi, local, F11, F21, F22)
            left[f] = []
            L11, info = la.lapack.dpotrf(F11, lower=1, overwrite_a=1, clean=0)  # (2)
            if info:
                row = int(fronts.order[lo + info - 1])
                raise FactorizationError(f"cholesky: a pivot is zero or negative (row {row} of {self.n})")
            L21 = F21
            if u:
                L21 = la.blas.dtrsm(1.0, L11, F21, side=1, lower=1, trans_a=1, overwrite_b=1)
                F22 = la.blas.dsyrk(-1.0, L21, beta=1.0, c=F22, lower=1, overwrite_c=1)
                left[above[f]].append((F22, below))
            self._panels.append(L11, L21)  # (3)

    def solve(self, b: Array) -> Array:
        """Return A⁻¹ b for b (n, k), any order; the result is in Fortran order."""
        x = np.empty(b.shape, order="F")
        for start in range(0, b.shape[1], AT_ONCE):
            some = slice(start, start + AT_ONCE)
            X = np.ascontiguousarray(b[self._fronts.order, some])
            self._substitute(X)
            x[self._fronts.order, some] = X
        return x

    def _substitute(self, X: Array) -> None:
        """Overwrite right-hand sides in the new order, (n, k) in C order, by the solutions."""
        from cms.sparse_cholesky import kernels

        first, begin, rows = self._fronts.first, self._fronts.begin, self._fronts.rows
        for f, (L11, L21) in self._panels.each():  # L y = b
            y = X[first[f] : first[f + 1]]
            la.blas.dtrsm(1.0, L11, y.T, side=1, lower=1, trans_a=1, overwrite_b=1)
            if len(L21):
                kernels.subtract_rows(X, rows[begin[f] : begin[f + 1]], L21 @ y)
        for f, (L11, L21) in self._panels.each(backwards=True):  # Lᵀ x = y
            x = X[first[f] : first[f + 1]]
            if len(L21):
                x -= L21.T @ kernels.take_rows(X, rows[begin[f] : begin[f + 1]])
            la.blas.dtrsm(1.0, L11, x.T, side=1, lower=1, trans_a=0, overwrite_b=1)

    def close(self) -> None:
        """Free the factor; a second time does nothing."""
        if self.is_open:
            self.is_open = False
            self._panels.close()


def permuted(lower: sp.csc_array, fronts: Fronts) -> sp.csc_array:
    """Return the lower triangle of the matrix in the order of the fronts."""
    rank = inverse(fronts.order).astype(np.int32)
    columns = rank[np.repeat(np.arange(lower.shape[0]), np.diff(lower.indptr))]
    rows = rank[lower.indices]
    return sp.csc_array(
        sp.coo_array((lower.data, (np.maximum(rows, columns), np.minimum(rows, columns))), shape=lower.shape)
    )
