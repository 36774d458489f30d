"""Solutions with factors from SciPy's `lu_factor`, safe for several threads with common factors."""

import numpy as np
from scipy.linalg.lapack import dgetrs

from fe_models.foundation.arrays import Array, IntArray

__all__ = ["solve_factored"]


def solve_factored(factors: tuple[Array, IntArray], right: Array, *, is_transposed: bool = False) -> Array:
    """Return x that satisfies A x = right, or Aᵀ x = right, without changing the factors.

    SciPy adds 1 to the pivots in place for LAPACK, which counts from 1, and subtracts it again after the solution.
    LAPACK runs without the interpreter's lock, so another thread may meet shifted pivots: each solution has its own
    copy.

    Parameters
    ----------
    factors
        L and U in one array, and the pivots, as `scipy.linalg.lu_factor` returns them.
    right
        (n,) or (n, k).
    is_transposed
        Whether Aᵀ is solved with.
    """
    L_and_U, pivots = factors
    return np.asarray(dgetrs(L_and_U, pivots.copy(), right, trans=int(is_transposed))[0])
