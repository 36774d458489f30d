"""Eigenmodes of distributed matrices: the space of rank rows, and the search by SLEPc."""

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.sparse as sp

from cms.errors import EigenError
from cms.linear_algebra.solvers.factorization import Factorization, Matrix, lower_triangle, matrix_of
from cms.linear_algebra.solvers.inverse import Inverse
from cms.linear_algebra.solvers.mode_count import ModeCount
from cms.linear_algebra.solvers.petsc.factor import CHUNK, PetscFactor, communicator, rows_here, solved_rows
from cms.linear_algebra.solvers.petsc.libraries import petsc, slepc
from cms.linear_algebra.solvers.shift_inverted import Modes, ShiftInverted
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.ranks.product import RowsProduct
from fe_models.foundation.ranks.ranks import Ranks
from fe_models.foundation.ranks.row_layout import RowLayout, new_key
from fe_models.foundation.ranks.rows import Rows, collected, spread
from fe_models.foundation.ranks.spread_columns import Part, SpreadColumns, own_part, spread_columns, spread_parts
from fe_models.foundation.ranks.trim import give_back
from fe_models.foundation.sparse.sparse_product import SymmetricProduct
from fe_models.foundation.sparse.submatrix import spread_block

__all__ = ["RankSpace", "SlepcSearch", "search_on_ranks"]


# the tall columns of an iteration, distributed by rows: rank 0 stores their keys, and small matrices ------------------
# Rank 0 runs the iteration and decides. All ranks perform operations on columns with their own rows at once. The rows
# are distributed like those of the factor, so solves need no redistribution, and no array as long as the body passes
# through rank 0.


class RankProduct:
    """Product of columns with a distributed matrix."""

    def __init__(self, space: "RankSpace", A: Matrix) -> None:
        self.space, self.key = space, new_key()
        block = spread_block(A)
        if block is not None and block.rows == space.rows:
            block.keep(self.key)
        else:
            space.ranks.store[self.key] = matrix_of(A)
        space.layout.ask(product_here, self.key, space.rows)
        space.layout.free_with(self, self.key)

    def __matmul__(self, x: SpreadColumns) -> SpreadColumns:
        """Return A x, (n, k)."""
        return self.space.made(x.shape[1], multiplied_here, self.key, x.part)


class RankSpace:
    """Space whose columns are rows on all ranks, identified by keys until `close`; rank 0 stores only its own rows."""

    def __init__(self, factor: PetscFactor, numbering: IntArray | None = None) -> None:
        """Distribute columns like the rows of the factor; `numbering` as in `ArraySpace`."""
        self.numbering = slice(None) if numbering is None else numbering
        self.factor, self.ranks, self.rows, self.n = factor, factor.ranks, factor.rows, factor.n
        self.layout = RowLayout(factor.ranks, np.arange(factor.n), factor.rows)

    def made(self, k: int, function: Callable[..., Any], *arguments: Any) -> SpreadColumns:
        """Return new columns, (n, k), whose rows each rank computes by function(ranks, *arguments)."""
        found = SpreadColumns(self.layout, Part(new_key(), 0, k))
        self.layout.ask(rows_kept_here, found.part.key, function, *arguments)
        return found

    def close(self) -> None:
        """Free unreferenced data on all ranks."""
        self.layout.ask(give_back_here)

    def random(self, generator: np.random.Generator, k: int) -> SpreadColumns:
        """Return columns of normally distributed numbers, (n, k), equal to those of a single process."""
        return spread_columns(self.layout, generator.standard_normal((k, self.n))[:, self.numbering].T)

    def empty(self, k: int) -> SpreadColumns:
        """Return k uninitialised columns, (n, k)."""
        return spread_parts(self.layout, k, ())

    def has_rows_of(self, A: Matrix) -> bool:
        """Return whether a matrix has the same distribution of rows as the columns."""
        block = spread_block(A)
        return block is not None and block.rows == self.rows

    def product(self, A: Matrix) -> RankProduct:
        """Return the product with a symmetric matrix, (n, n), whose rows are distributed if necessary."""
        return RankProduct(self, A)

    def solver(self, factorization: Inverse) -> Callable[[SpreadColumns], SpreadColumns]:
        """Return the solution with the factor of this space as an operator on columns."""
        assert isinstance(factorization, Factorization)
        assert factorization.factor is self.factor
        return lambda b: self.made(b.shape[1], solved_here, self.factor.key, self.rows, b.part)


def search_on_ranks(
    factorization: Inverse, numbering: IntArray | None
) -> tuple["type[SlepcSearch] | None", RankSpace | None]:
    """Return the mode search of the solver, None for block Lanczos, and the space for the columns of block Lanczos.

    The space is None unless the factor is distributed over several ranks: then the columns are arrays of this process.
    """
    if not isinstance(factorization, Factorization) or not isinstance(factorization.factor, PetscFactor):
        return None, None
    if factorization.solver.name == "slepc":
        return SlepcSearch, None
    return None, RankSpace(factorization.factor, numbering) if factorization.factor.ranks.size > 1 else None


def rows_kept_here(ranks: Ranks, key: str, function: Callable[..., Any], *arguments: Any) -> None:
    """Store the rows of columns that a function returns on this rank."""
    ranks.store[key] = function(ranks, *arguments)


def give_back_here(ranks: Ranks) -> None:
    """Return freed memory to the system."""
    give_back()


def product_here(ranks: Ranks, key: str, rows: Rows) -> None:
    """Replace a matrix on rank 0 by its rows on this rank; columns are rows, because A is symmetric."""
    A = ranks.store.pop(key, None)
    ranks.store[key] = (A.indptr, A.indices, A.data) if isinstance(A, sp.csc_array) else A
    ranks.store[key] = RowsProduct(ranks, rows, *rows_here(ranks, key, rows))


def multiplied_here(ranks: Ranks, key: str, x: Part) -> Array:
    """Return the rows of A x on this rank."""
    return np.asarray(ranks.store[key] @ own_part(ranks, x))


def solved_here(ranks: Ranks, key: str, rows: Rows, b: Part) -> Array:
    """Return the rows of A⁻¹ b on this rank, for blocks of columns."""
    x = np.empty((rows.count(ranks.rank), b.last - b.first), order="F")
    for first in range(b.first, b.last, CHUNK):
        some = Part(b.key, first, min(first + CHUNK, b.last))
        x[:, first - b.first : some.last - b.first] = solved_rows(ranks, key, rows, own_part(ranks, some))
    return x


# modes by SLEPc: Krylov-Schur iteration for the largest theta of S = K⁻¹ M, with a distributed basis ------------------


GUARDS = 4  #: number of modes beyond the wanted ones, which show where the cutoff frequency is exceeded
FIRST_GUESS = 30  #: assumed number of modes if only a cutoff frequency is given
#: factor on the caller's tolerance for SLEPc, which tests the error of theta, and this is the square of the residual
SHARPER = 1e-6


class SlepcSearch:
    """Krylov-Schur iteration with distributed vectors; rank 0 receives the modes."""

    def __init__(self, operator: ShiftInverted, wanted: ModeCount) -> None:
        assert isinstance(operator.factorization, Factorization)
        factor = operator.factorization.factor
        assert isinstance(factor, PetscFactor)
        assert isinstance(operator.M_product, SymmetricProduct)
        self.operator, self.factor = operator, factor
        version = ".".join(str(k) for k in slepc().Sys.getVersion())
        self.description = f"Krylov-Schur (SLEPc {version})"
        self.key = new_key()
        factor.ranks.store[self.key] = lower_triangle(operator.M_product.A)
        factor.ranks.everywhere(spread_mass, self.key, factor.rows)

    def modes(self, wanted: ModeCount, at_least: int = 0) -> Modes:
        """Return the wanted modes, at least `at_least`."""
        operator = self.operator
        n_asked = max(wanted.n or FIRST_GUESS, at_least) + GUARDS
        while True:
            n_asked = min(n_asked, operator.n)
            tolerance = max(1e-13, SHARPER * operator.tolerance)
            answer = self.factor.ranks.everywhere(
                search_here, self.factor.key, self.key, self.factor.rows, n_asked, tolerance
            )
            omega2, errors, Phi, n_solves = answer[0]
            omega2 = omega2 + operator.shift
            operator.n_solves += n_solves
            if wanted.omega2 is None or omega2[-1] > wanted.omega2 or n_asked == operator.n:
                break
            n_asked *= 2
        k = max(wanted.n or int((omega2 <= wanted.omega2).sum()), at_least)
        if len(omega2) < k:
            raise EigenError(f"eigenmodes: SLEPc found {len(omega2)} of {k} modes to {tolerance:.1e}")
        operator.report(k, wanted.n or 0)
        return Modes(omega2, k, errors, Phi, np.eye(len(omega2)))


def spread_mass(ranks: Ranks, key: str, rows: Rows) -> None:
    """Store the rows of the upper triangle of M on this rank."""
    PETSc = petsc()
    n_own = rows.count(ranks.rank)
    lower = ranks.store.pop(key, None)  # columns of the lower triangle are rows of the upper triangle
    csr = spread(ranks, rows, None if lower is None else (lower.indptr, lower.indices, lower.data))
    M = PETSc.Mat().createSBAIJ(((n_own, rows.n), (n_own, rows.n)), 1, csr=csr, comm=communicator(ranks))
    M.assemble()
    M.setOption(PETSc.Mat.Option.SYMMETRIC, True)
    ranks.store[key] = M


def n_solved() -> int:
    """Return the number of columns that this process has solved, as counted by PETSc."""
    return int(petsc().Log.Event("MatSolve").getPerfInfo()["count"])


def search_here(
    ranks: Ranks, factor_key: str, mass_key: str, rows: Rows, n_asked: int, tolerance: float
) -> tuple[Array, Array, Array | None, int]:
    """Return omega² above the shift, ascending, their errors, the modes on rank 0, and the number of solves."""
    SLEPc = slepc()
    _, ksp, A = ranks.store[factor_key]
    M = ranks.store[mass_key]
    eps = SLEPc.EPS().create(communicator(ranks))
    eps.setOperators(A, M)
    eps.setProblemType(SLEPc.EPS.ProblemType.GHEP)
    eps.setType(SLEPc.EPS.Type.KRYLOVSCHUR)
    eps.setTarget(0.0)
    eps.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
    eps.setDimensions(n_asked, min(rows.n, 2 * n_asked + 20))
    eps.setTolerances(tolerance, 1000)
    st = eps.getST()
    st.setType(SLEPc.ST.Type.SINVERT)
    st.setShift(0.0)
    st.setKSP(ksp)  # with the factor of A; the matrix of a zero shift is A itself
    before = n_solved()
    eps.solve()
    n_solves = n_solved() - before
    n = min(eps.getConverged(), n_asked)
    omega2 = np.array([eps.getEigenvalue(k).real for k in range(n)])
    errors = np.array([eps.getErrorEstimate(k) for k in range(n)])
    v = M.createVecLeft()
    own = np.empty((rows.count(ranks.rank), n), order="F")
    for k in range(n):
        eps.getEigenvector(k, v)
        own[:, k] = v.array_r
    eps.destroy()
    return omega2, errors, collected(ranks, rows, own), n_solves
