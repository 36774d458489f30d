"""The solver of every processor: our Cholesky factorisation, and SuperLU where that does not serve."""

import scipy.sparse as sp

from cms.solvers.superlu import SuperLuFactor
from cms.sparse_cholesky.factor import CholeskyFactor
from fe_models.foundation.solver import Factor

__all__ = ["SMALL", "cholesky_or_superlu"]

SMALL = 3000  #: rows below which SuperLU is done before compiled loops are loaded


def cholesky_or_superlu(lower: sp.csc_array, *, definite: bool) -> Factor:
    """Return the Cholesky factor; that of SuperLU where the matrix is small, or not meant to be positive definite."""
    if definite and lower.shape[0] >= SMALL:
        return CholeskyFactor(lower)
    return SuperLuFactor(lower, definite=definite)
