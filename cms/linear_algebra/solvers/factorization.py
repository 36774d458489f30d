"""Factorisation of a large symmetric matrix, for solutions with many right-hand sides."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import partial
from typing import TypeAlias

import numpy as np
import scipy.sparse as sp

from cms.errors import FactorizationError
from cms.linear_algebra.solvers.registry import solver_of
from fe_models.foundation.arrays import Array
from fe_models.foundation.ranks.spread_matrix import spread_sum, whole_matrix
from fe_models.foundation.solver import Factor, Solver
from fe_models.foundation.sparse.submatrix import PrincipalBlock, principal_block, spread_block

__all__ = [
    "EmptyFactor",
    "Factorization",
    "Inertia",
    "Matrix",
    "factorize",
    "matrix_of",
    "require_regular",
    "shifted_matrix",
]

#: relative residual after two solves, above which a matrix is singular; condition number 1e12 causes 1e-4
SINGULAR = 1e-3

#: a sparse matrix, or a block of a larger matrix that is only computed while its entries are needed
Matrix: TypeAlias = sp.csc_array | PrincipalBlock


def matrix_of(A: Matrix) -> sp.csc_array:
    """Return the matrix; if it is a block, compute it."""
    return principal_block(A.A, A.index) if isinstance(A, PrincipalBlock) else sp.csc_array(whole_matrix(A))


def shifted_matrix(K: Matrix, M: Matrix, sigma: float) -> Matrix:
    """Return K - sigma M, (n, n): distributed if the blocks are, otherwise sparse."""
    if isinstance(K, PrincipalBlock) and isinstance(M, PrincipalBlock) and K.index is M.index:
        if not (sp.issparse(K.A) or sp.issparse(M.A)):
            return PrincipalBlock(spread_sum(K.A, M.A, -sigma), K.index)
    return sp.csc_array(matrix_of(K) - sigma * matrix_of(M))


@dataclass(frozen=True)
class Inertia:
    """Number of negative and positive eigenvalues; certain only if no pivot is zero to rounding."""

    n_negative: int
    #: number of pivots that are zero to rounding; the other two numbers include them, with guessed signs
    n_zero: int
    n_positive: int


class EmptyFactor:
    """Factor of a matrix without rows: the interior of a body whose dofs are all on interfaces."""

    n = n_factor_entries = n_negative = n_perturbed = n_positive = 0
    description = "nothing to factorise"

    def __init__(self) -> None:
        self.is_open = True

    def solve(self, b: Array) -> Array:
        """Return an array without rows, (0, k)."""
        return np.zeros((0, b.shape[1]), order="F")

    def close(self) -> None:
        """Do nothing: there is nothing to free."""
        self.is_open = False


class Factorization(AbstractContextManager["Factorization"]):
    """Factorised symmetric matrix; the context manager frees the factor."""

    def __init__(self, factor: Factor, solver: Solver) -> None:
        self.factor = factor  #: factor that the solver computed
        self.n = factor.n  #: order of the matrix
        self.description = factor.description  #: name, version and settings of the solver, for the provenance
        self.solver = solver  #: solver that computed the factor, for further matrices of the same body

    @property
    def n_factor_entries(self) -> int:
        """Number of stored entries of the factor, 8 bytes each."""
        return self.factor.n_factor_entries

    @property
    def inertia(self) -> Inertia:
        """Return the number of negative and positive eigenvalues from the pivots, by Sylvester's law.

        Raises
        ------
        FactorizationError
            If the solver used off-diagonal pivots, as SuperLU may, so that their signs are meaningless.
        """
        factor = self.factor
        if factor.n_negative < 0:
            raise FactorizationError(
                f"inertia: {self.description}: pivots are off the diagonal, so that their signs do not count "
                "eigenvalues; install pypardiso (x86-64), or do without the proof"
            )
        return Inertia(factor.n_negative, factor.n_perturbed, factor.n_positive)

    def solve(self, b: Array) -> Array:
        """Return A⁻¹ b for one column, (n,), or many columns, (n, k), in the memory order of the factor."""
        if not self.factor.is_open:
            raise FactorizationError("solve: the factorisation was closed; factorise again")
        b = np.asarray(b, dtype=np.float64)
        if b.ndim not in (1, 2) or len(b) != self.n:
            raise FactorizationError(f"solve: expected right-hand sides ({self.n},) or ({self.n}, k), got {b.shape}")
        return self.factor.solve(b[:, None])[:, 0] if b.ndim == 1 else self.factor.solve(b)

    def close(self) -> None:
        """Free the factor."""
        self.factor.close()

    def __exit__(self, *_: object) -> None:
        self.close()


def factorize(A: Matrix, *, definite: bool = True, solver: str | Solver | None = None) -> Factorization:
    """Factorise a symmetric sparse matrix.

    (1) extract the lower triangle, with every diagonal entry stored
    (2) factorise with the requested solver; default: PARDISO, or our Cholesky factorisation if there is no PARDISO or
        the matrix is large and definite
    (3) check by two solves from a fixed random column; an (almost) singular matrix is rejected

    Parameters
    ----------
    A
        Symmetric, (n, n); only its lower triangle is read. A `PrincipalBlock` is not held during the factorisation.
    definite
        Whether A must be positive definite (Cholesky); False: any regular symmetric matrix.
    solver
        A `Solver`, or the name of one in `SOLVERS`; default: the fastest installed solver.

    Raises
    ------
    FactorizationError
        If A is not square, not finite or singular, if it is not definite although `definite`, or if the solver is
        unknown or not installed.
    FactorRoomError
        If memory or disk space do not suffice for the factor.
    """
    chosen = solver_of(solver)
    make = _ready(A, definite, chosen)
    try:
        factorization = Factorization(make(), chosen)
    except FactorizationError as error:
        hint = "; it is singular or not positive definite" if definite else "; it is singular"
        raise FactorizationError(f"factorize: {error}{hint}") from error
    del make  # also frees the lower triangle
    require_regular(A, factorization)
    return factorization


def _ready(A: Matrix, definite: bool, solver: Solver) -> Callable[[], Factor]:
    """Step (1): return a function that factorises; distributed rows stay distributed if the solver allows it."""
    if solver.spread is not None and (block := spread_block(A)) is not None:
        if definite:
            _require_positive(A.diagonal())
        return partial(solver.spread, block, definite=definite)
    whole = matrix_of(A)
    if whole.shape[0] != whole.shape[1] or whole.shape[0] == 0:
        raise FactorizationError(f"factorize: expected a square matrix with at least one row, got {whole.shape}")
    if not np.isfinite(whole.data).all():
        raise FactorizationError("factorize: the matrix contains NaN or infinite entries")
    lower = lower_triangle(whole)
    del whole
    if definite:
        _require_positive(lower.data[lower.indptr[:-1]])
    return partial(solver.factor, lower, definite=definite)


def lower_triangle(A: sp.csc_array) -> sp.csc_array:
    """Return the lower triangle with all diagonal entries stored (zeros if necessary) and row indices sorted."""
    n = A.shape[0]
    if not A.has_canonical_format:
        A = A.copy()
        A.sum_duplicates()
    is_lower = A.indices >= np.repeat(np.arange(n, dtype=A.indices.dtype), np.diff(A.indptr))
    starts = np.concatenate([[0], np.cumsum(is_lower, dtype=A.indptr.dtype)])
    indptr = starts[A.indptr]
    indices, data = A.indices[is_lower], A.data[is_lower]
    del is_lower, starts
    # with sorted rows, the first entry of a column is its diagonal entry, if that is stored
    lacks = np.diff(indptr) == 0
    full = np.flatnonzero(~lacks)
    lacks[full] = indices[indptr[full]] != full
    missing = np.flatnonzero(lacks)
    if len(missing):
        at = indptr[missing]
        indices, data = np.insert(indices, at, missing), np.insert(data, at, 0.0)
        indptr = indptr + np.concatenate([[0], np.cumsum(lacks)]).astype(indptr.dtype)
    return sp.csc_array((data, indices, indptr), shape=(n, n))


def _require_positive(diagonal: Array) -> None:
    bad = np.flatnonzero(diagonal <= 0)
    if len(bad):
        raise FactorizationError(
            f"factorize: {len(bad)} diagonal entries are zero or negative, first at row {bad[0]} "
            f"({diagonal[bad[0]]:.3g}); the matrix is singular or not positive definite"
        )


def require_regular(A: Matrix, factorization: Factorization) -> None:
    """Solve twice from a random column: the result is dominated by the softest direction and reveals singularity.

    An exactly singular matrix often passes the pivot check, because rounding leaves pivots near 1e-16 instead of zero.
    Its solutions are then 1e16 times too large along the null space, and no longer satisfy A x = b.
    """
    b = np.random.default_rng(0).standard_normal(A.shape[0])
    b = factorization.solve(b)
    length = np.linalg.norm(b)
    b = b / length if np.isfinite(length) and length > 0 else np.full(len(b), np.nan)
    x = factorization.solve(b)
    residual = np.linalg.norm(A @ x - b) if np.isfinite(x).all() else np.inf
    if not residual < SINGULAR:
        factorization.close()
        raise FactorizationError(
            f"factorize: the matrix is singular: a solution leaves {100 * min(residual, 9.99):.0f} % of its right-hand "
            f"side; n = {A.shape[0]}"
        )
