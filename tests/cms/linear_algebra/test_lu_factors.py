"""Factors that threads share are left as they are."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose

from cms.linear_algebra.lu_factors import solve_factored


def matrix(n, seed=0):
    """Pivots in another order than the rows, so that shifted ones give another solution."""
    return np.random.default_rng(seed).normal(size=(n, n))


@pytest.mark.parametrize("shape", [(7,), (7, 1), (7, 3)])
@pytest.mark.parametrize("is_transposed", [False, True])
def test_the_solution_is_that_of_the_matrix(shape, is_transposed):
    A, right = matrix(7), np.random.default_rng(1).normal(size=shape)
    found = solve_factored(la.lu_factor(A), right, is_transposed=is_transposed)
    assert_allclose((A.T if is_transposed else A) @ found, right, rtol=0, atol=1e-12)


def test_pivots_keep_their_values_while_a_solution_runs():
    """Another thread watches the last one."""
    L_and_U, pivots = la.lu_factor(matrix(300))
    right = np.random.default_rng(1).normal(size=(300, 40))
    seen = set()

    def watch() -> None:
        while not done:
            seen.add(int(pivots[-1]))

    done = False
    with ThreadPoolExecutor(1) as pool:
        watching = pool.submit(watch)
        for _ in range(50):
            solve_factored((L_and_U, pivots), right)
        done = True
        watching.result()
    assert seen == {299}


def test_threads_that_share_factors_get_the_solutions_of_one():
    A, right = matrix(120), np.random.default_rng(1).normal(size=(120, 30))
    factors = la.lu_factor(A)
    expected = np.linalg.solve(A, right)
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda _: solve_factored(factors, right), range(200)))
    scale = np.linalg.cond(A) * np.abs(expected).max()
    for each in found:
        assert_allclose(each, expected, rtol=0, atol=1e-13 * scale)
