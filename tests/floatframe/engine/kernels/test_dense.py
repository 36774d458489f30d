"""Solves with small dense matrices."""

from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe.engine.kernels.compiler.compilation import entry
from floatframe.engine.kernels.dense import lu_factor, lu_solve, lu_solve_columns, six_columns

compiled = partial(entry, cache=False)  # the cache does not see changes of what is called


@compiled
def solve(A, pivot, x, X):
    """Overwrite x and X by A⁻¹ x and A⁻¹ X, and A by its factors; return whether A is regular."""
    is_regular = lu_factor(A, pivot)
    lu_solve(A, pivot, x)
    lu_solve_columns(A, pivot, X)
    return is_regular


@compiled
def multiply(A, X, out):
    """Write the first rows of A X."""
    six_columns(A, X, out)


def solutions(A, b, B):
    """Return A⁻¹ b and A⁻¹ B."""
    x, X = b.copy(), B.copy()
    assert solve(A.copy(), np.zeros(len(A), dtype=int), x, X)
    return x, X


@pytest.mark.parametrize("n", range(1, 14))
def test_solutions_give_the_right_sides_again(n):
    """Sizes around the four rows that are solved at once, six columns at once and two more, pivots out of order."""
    rng = np.random.default_rng(n)
    A, b, B = rng.standard_normal((n, n)), rng.standard_normal(n), rng.standard_normal((n, 8))
    x, X = solutions(A, b, B)
    bound = 1e-14 * n * np.linalg.cond(A)
    assert_allclose(A @ x, b, rtol=0, atol=bound)
    assert_allclose(A @ X, B, rtol=0, atol=bound)


def test_numbers_that_are_small_in_their_rows_are_no_pivots():
    """They would leave nothing of other rows: a diagonal of 1e-18, rows and columns in units of their own."""
    n, rng = 8, np.random.default_rng(0)
    A, b = rng.standard_normal((n, n)), rng.standard_normal(n)
    np.fill_diagonal(A, 1e-18)
    rows, columns = 10.0 ** rng.integers(-6, 6, n), 10.0 ** rng.integers(-6, 6, n)
    x, _ = solutions(rows[:, None] * A * columns, rows * b, np.zeros((n, 1)))
    assert_allclose(A @ (columns * x), b, rtol=0, atol=1e-14 * n * np.linalg.cond(A))


def test_six_columns_is_a_product():
    rng = np.random.default_rng(1)
    A, X, out = rng.standard_normal((12, 5)), rng.standard_normal((5, 6)), np.zeros((7, 6))
    multiply(A, X, out)
    assert_allclose(out, (A @ X)[:7], rtol=0, atol=1e-14)
