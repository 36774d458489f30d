"""The solvers by name, for `--solver`, `solver` in job files and `solver=`.

To add a solver, add a line to `SOLVERS`: its name, the function that makes a factor (`MakeFactor` of
`fe_models.foundation.solver`), and the function that describes what is missing ("" if nothing is).
"""

from functools import partial

import scipy.sparse as sp

from cms.errors import FactorizationError
from cms.linear_algebra.solvers.pardiso import PardisoFactor, missing_pardiso
from cms.linear_algebra.solvers.petsc.factor import PetscFactor
from cms.linear_algebra.solvers.petsc.libraries import missing_petsc
from cms.linear_algebra.solvers.superlu import SuperLuFactor
from cms.linear_algebra.sparse_cholesky.factor import CholeskyFactor
from fe_models.foundation.solver import Factor, Solver
from fe_models.foundation.words import nearest, quoted

__all__ = ["DEFAULTS", "SMALL", "SOLVERS", "cholesky_or_superlu", "solver_of"]


# the solver that runs on every processor: our Cholesky factorisation, or SuperLU where that is unsuitable -------------


SMALL = 3000  #: number of rows below which SuperLU finishes before the compiled loops of our Cholesky factor are loaded


def cholesky_or_superlu(lower: sp.csc_array, *, definite: bool) -> Factor:
    """Return the Cholesky factor, or the factor of SuperLU if the matrix is small or need not be positive definite."""
    if definite and lower.shape[0] >= SMALL:
        return CholeskyFactor(lower)
    return SuperLuFactor(lower, definite=definite)


# registry -------------------------------------------------------------------------------------------------------------


ON_DISK = partial(PetscFactor, on_disk=True)
WITH_MATRIX = partial(PetscFactor, keeps_matrix=True)
SOLVERS = {
    solver.name: solver
    for solver in (
        Solver("pardiso", PardisoFactor, missing_pardiso),
        Solver("cholesky", cholesky_or_superlu),
        Solver("superlu", SuperLuFactor),
        Solver("petsc", PetscFactor, missing_petsc, PetscFactor),
        Solver("slepc", WITH_MATRIX, missing_petsc, WITH_MATRIX),
        Solver("petsc-disk", ON_DISK, missing_petsc, ON_DISK),
    )
}
LARGE = 30_000  #: number of rows from which our Cholesky factor is as fast as PARDISO's; its solves are faster


def pardiso_or_cholesky(lower: sp.csc_array, *, definite: bool) -> Factor:
    """Return the factor of PARDISO, or our Cholesky factor if the matrix is large and positive definite."""
    if definite and lower.shape[0] >= LARGE:
        return CholeskyFactor(lower)
    return SOLVERS["pardiso"].factor(lower, definite=definite)


#: default solvers; the first installed one is used
DEFAULTS = (Solver("pardiso", pardiso_or_cholesky, lambda: SOLVERS["pardiso"].missing()), SOLVERS["cholesky"])


def solver_of(choice: str | Solver | None = None) -> Solver:
    """Return the solver with this name, or the given solver; None: the fastest installed solver for the matrix size.

    Raises
    ------
    FactorizationError
        If there is no solver with this name, or it is not installed; the message says what to install.
    """
    if isinstance(choice, Solver):
        return choice
    if choice is None:
        return next(solver for solver in DEFAULTS if not solver.missing())
    if choice not in SOLVERS:
        raise FactorizationError(f"unknown solver {quoted(choice)}{nearest(str(choice), SOLVERS)}")
    solver = SOLVERS[choice]
    if missing := solver.missing():
        usable = ", ".join(name for name, other in SOLVERS.items() if not other.missing())
        raise FactorizationError(f"solver {choice}: {missing}; installed here: {usable}")
    return solver
