"""SuperLU through SciPy: the factorisation that is always available."""

import logging

import numpy as np
import scipy
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from cms.errors import FactorizationError, FactorRoomError
from cms.linear_algebra.sparse_cholesky.analysis import Fronts, analyse, dissection_order
from fe_models.foundation.arrays import Array

__all__ = ["SuperLuFactor"]

SMALL = 3000  #: number of rows below which minimum degree is a good ordering, and faster than loading compiled loops
MANY = 50_000  #: number of rows above which the duration is estimated
LONG = 30.0  #: duration in seconds above which a warning is given before the work
#: operations per second (4.6e9 to 4.8e9 measured: tet10 rod with 58 788 rows, grid with 32 768; one processor)
OPERATIONS = 4e9
BYTES = 48.0  #: memory per entry of the triangular factor while L and U are computed [bytes]

log = logging.getLogger(__name__)


class SuperLuFactor:
    """L U factor of a symmetric matrix, with pivots on the diagonal where possible."""

    def __init__(self, lower: sp.csc_array, *, definite: bool) -> None:
        """Factorise a matrix from its lower triangle, (n, n), all diagonal entries stored, row indices sorted."""
        self.n = lower.shape[0]
        if self.n >= MANY:
            announce(analyse(lower), definite=definite)
        A = sp.csc_matrix(lower + sp.tril(lower, k=-1, format="csc").T)
        is_small = self.n < SMALL
        self._order = None if is_small else dissection_order(lower)
        if self._order is not None:
            A = A[self._order][:, self._order].tocsc()
        try:
            self._lu = splu(
                A,
                permc_spec="MMD_AT_PLUS_A" if is_small else "NATURAL",
                diag_pivot_thresh=0.0 if definite else 1e-3,
                options={"SymmetricMode": True},
            )
        except MemoryError as error:
            raise FactorRoomError(f"SuperLU: not enough memory; n = {self.n}, {lower.nnz} entries") from error
        except RuntimeError as error:  # the message is "Factor is exactly singular"
            raise FactorizationError(f"SuperLU: {error}; n = {self.n}, {lower.nnz} entries") from error
        self.is_open = True
        pivots = self._lu.U.diagonal()
        # P_r A P_c = L U is the symmetric P A Pᵀ = L D Lᵀ with D = diag U, whose signs are those of A, as long as every
        # pivot is on the diagonal
        self._is_symmetric = np.array_equal(self._lu.perm_r, self._lu.perm_c)
        self.n_negative = int((pivots < 0).sum()) if self._is_symmetric else -1
        self.n_perturbed = 0
        self.n_positive = self.n - self.n_negative if self._is_symmetric else -1
        if definite and (self.n_negative > 0 or not self._is_symmetric):
            raise FactorizationError(
                f"SuperLU: {self.n_negative} pivots are negative: the matrix is not positive definite"
            )
        kind = "definite" if definite else "indefinite"
        order = "minimum degree" if is_small else "nested dissection"
        self.description = f"SuperLU (SciPy {scipy.__version__}; L U, {kind}, {order})"

    @property
    def n_factor_entries(self) -> int:
        """Number of stored entries of the factor."""
        return int(self._lu.nnz)

    def solve(self, b: Array) -> Array:
        """Return A⁻¹ b for b, (n, k), in any memory order; the result is in Fortran order."""
        if self._order is None:
            return np.asfortranarray(self._lu.solve(np.asfortranarray(b)))
        x = np.empty(b.shape, order="F")
        x[self._order] = self._lu.solve(np.asfortranarray(b[self._order]))
        return x

    def close(self) -> None:
        """Free the factor."""
        self.is_open = False
        if hasattr(self, "_lu"):
            del self._lu


def announce(fronts: Fronts, *, definite: bool) -> None:
    """Warn before the work if SuperLU needs much time and memory, and name solvers that need less."""
    seconds = 2 * fronts.operations / OPERATIONS
    if seconds < LONG:
        return
    better = 'solver = "pardiso" (x86-64: pip install pypardiso)'
    if definite:
        better += ' or solver = "cholesky" (everywhere)'
    else:
        better += ', or rigid interfaces instead of distributing ones, which solver = "cholesky" factorises'
    log.warning(
        "SuperLU: %d rows: about %.2g minutes of one processor and %.2g GB for the factorisation; %s takes a fraction "
        "of both", len(fronts.order), seconds / 60, BYTES * fronts.n_entries / 1e9, better,
    )  # fmt: skip
