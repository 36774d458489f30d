"""Solves with small dense matrices."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe.engine.kernels.dense import lu_factor, lu_solve, lu_solve_columns


@pytest.mark.parametrize("n", range(1, 14))
def test_solutions_give_the_right_sides_again(n):
    """The formulas as Python; sizes around the four rows that are solved at once, pivots out of order."""
    rng = np.random.default_rng(n)
    A, b, B = rng.standard_normal((n, n)), rng.standard_normal(n), rng.standard_normal((n, 3))
    factors, pivot, x, X = A.copy(), np.zeros(n, dtype=int), b.copy(), B.copy()
    assert lu_factor.py_func(factors, pivot)
    lu_solve.py_func(factors, pivot, x)
    lu_solve_columns.py_func(factors, pivot, X)
    bound = 1e-14 * n * np.linalg.cond(A)
    assert_allclose(A @ x, b, rtol=0, atol=bound)
    assert_allclose(A @ X, B, rtol=0, atol=bound)
