"""The solver that runs on every processor: our Cholesky factorisation, or SuperLU where that is unsuitable."""

import scipy.sparse as sp

from cms.linear_algebra.solvers.superlu import SuperLuFactor
from cms.linear_algebra.sparse_cholesky.factor import CholeskyFactor
from fe_models.foundation.solver import Factor

__all__ = ["SMALL", "cholesky_or_superlu"]

SMALL = 3000  #: number of rows below which SuperLU finishes before the compiled loops are loaded


def cholesky_or_superlu(lower: sp.csc_array, *, definite: bool) -> Factor:
    """Return the Cholesky factor, or the factor of SuperLU if the matrix is small or need not be positive definite."""
    if definite and lower.shape[0] >= SMALL:
        return CholeskyFactor(lower)
    return SuperLuFactor(lower, definite=definite)
