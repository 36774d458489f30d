"""Solutions with factors from SciPy's `lu_factor`, safe for several threads with common factors."""

import numpy as np
from scipy.linalg.lapack import dgetrs

from fe_models.foundation.arrays import Array, IntArray

__all__ = ["solve_factored"]


def solve_factored(factors: tuple[Array, IntArray], right: Array, *, is_transposed: bool = False) -> Array:
    """Return x that satisfies A x = right, or Aᵀ x = right, without changing the factors.

    SciPy adds 1 to the pivots in place for LAPACK, which counts from 1, and subtracts it after the solution. Meanwhile
    another thread may run and use the shifted pivots. Therefore each solution uses a copy of the pivots.

    Parameters
    ----------
    factors
        L and U in one array, and the pivots, as `scipy.linalg.lu_factor` returns them.
    right
        Right-hand sides, (n,) or (n, k).
    is_transposed
        Whether to solve with Aᵀ instead of A.
    """
    L_and_U, pivots = factors
    return np.asarray(dgetrs(L_and_U, pivots.copy(), right, trans=int(is_transposed))[0])
