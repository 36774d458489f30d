"""The Newton matrix of the time step is the exact derivative of the residual, for random states of random systems."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe.engine.kernels.entry import newton_correction
from tests.floatframe.engine.kernels.examples import (
    C_D,
    C_K,
    C_M,
    Iterate,
    newton_matrices,
    newton_matrix,
    system_with_everything,
)


@pytest.mark.parametrize("seed", range(4))
def test_newton_matrix_is_the_derivative_of_the_residual(seed):
    iterate = Iterate(system_with_everything(), seed)
    exact, approximate = newton_matrices(iterate)
    assert_allclose(exact, approximate, rtol=0, atol=2e-9 * np.abs(approximate).max())


def test_elimination_body_by_body_solves_the_whole_newton_system():
    iterate = Iterate(system_with_everything(), 5)
    n_u = int(iterate.model.bodies.u0[-1])
    residual, parts = iterate.residual(np.zeros(n_u), np.zeros(iterate.n_w))
    matrix = newton_matrix(iterate.model, parts, iterate.n_w)
    expected = np.linalg.solve(matrix, -residual)
    outcome = newton_correction(iterate.model, iterate.work, C_M, C_D, C_K)
    assert outcome.status == 0
    found = np.concatenate([iterate.work.solver.y, iterate.work.solver.mu])
    assert_allclose(found, expected, rtol=0, atol=1e-13 * np.linalg.cond(matrix) * np.abs(expected).max())
