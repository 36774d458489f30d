"""Modes by SLEPc: Krylov-Schur iteration for the largest theta of S = K⁻¹ M, with a distributed basis."""

from itertools import count

import numpy as np

from cms.errors import EigenError
from cms.linear_algebra.solvers.factorization import Factorization, lower_triangle
from cms.linear_algebra.solvers.petsc.factor import PetscFactor, communicator
from cms.linear_algebra.solvers.petsc.libraries import petsc, slepc
from cms.linear_algebra.solvers.shift_inverted import Modes, ShiftInverted, Wanted
from cms.linear_algebra.solvers.sparse_product import SymmetricProduct
from fe_models.foundation.arrays import Array
from fe_models.foundation.ranks.ranks import Ranks
from fe_models.foundation.ranks.rows import Rows, collected, spread

__all__ = ["SlepcSearch"]

GUARDS = 4  #: modes requested beyond the wanted ones, to see where a frequency is passed
FIRST_GUESS = 30  #: expected number of modes, while only a frequency is given
#: factor on the tolerance of the caller; here it applies to theta, whose error is the square of the residual
SHARPER = 1e-6
numbers = count()


class SlepcSearch:
    """Krylov-Schur with distributed vectors; rank 0 receives the modes."""

    def __init__(self, operator: ShiftInverted, wanted: Wanted) -> None:
        assert isinstance(operator.factorization, Factorization)
        factor = operator.factorization.factor
        assert isinstance(factor, PetscFactor)
        assert isinstance(operator.M_product, SymmetricProduct)
        self.operator, self.factor = operator, factor
        version = ".".join(str(k) for k in slepc().Sys.getVersion())
        self.description = f"Krylov-Schur (SLEPc {version})"
        self.key = f"mass {next(numbers)}"
        factor.ranks.store[self.key] = lower_triangle(operator.M_product.A)
        factor.ranks.everywhere(spread_mass, self.key, factor.rows)

    def modes(self, wanted: Wanted, at_least: int = 0) -> Modes:
        """Return the wanted modes, or at least `at_least`."""
        operator = self.operator
        n_asked = max(wanted.count or FIRST_GUESS, at_least) + GUARDS
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
        k = max(wanted.count or int((omega2 <= wanted.omega2).sum()), at_least)
        if len(omega2) < k:
            raise EigenError(f"eigenmodes: SLEPc found {len(omega2)} of {k} modes to {tolerance:.1e}")
        operator.report(k, wanted.count or 0)
        return Modes(omega2, k, errors[:k], Phi, np.eye(len(omega2)), operator.space)


def spread_mass(ranks: Ranks, key: str, rows: Rows) -> None:
    """Keep this rank's rows of the upper triangle of M."""
    PETSc = petsc()
    n_own = rows.count(ranks.rank)
    lower = ranks.store.pop(key, None)  # columns of the lower triangle are rows of the upper triangle
    csr = spread(ranks, rows, None if lower is None else (lower.indptr, lower.indices, lower.data))
    M = PETSc.Mat().createSBAIJ(((n_own, rows.n), (n_own, rows.n)), 1, csr=csr, comm=communicator(ranks))
    M.assemble()
    M.setOption(PETSc.Mat.Option.SYMMETRIC, True)
    ranks.store[key] = M


def n_solved() -> int:
    """Return how many columns this process has solved, as counted by PETSc."""
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
