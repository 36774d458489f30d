"""The Newton matrix against finite differences of the residual, for any system."""

import numpy as np
from numpy.testing import assert_allclose

from tests.floatframe.test_tangent import C_K, Iterate, newton_matrix


def assert_tangent_is_exact(system, *, seed=1, step=1e-5, tolerance=4e-9, prepare=None):
    """Compare the Newton matrix at a random iterate with central differences; prepare(iterate) may change it."""
    iterate = Iterate(system, seed)
    iterate.work.time[0] = 0.37
    if prepare is not None:
        prepare(iterate)
    n_u = int(iterate.model.u0[-1])
    n = n_u + iterate.n_w
    _, parts = iterate.residual(np.zeros(n_u), np.zeros(n - n_u))
    exact = newton_matrix(iterate.model, parts, iterate.n_w)
    approximate = np.zeros((n, n))
    for k in range(n):
        x = step * np.eye(n)[k]
        plus, _ = iterate.residual(x[:n_u], x[n_u:])
        minus, _ = iterate.residual(-x[:n_u], -x[n_u:])
        approximate[:, k] = (plus - minus) / (2 * step)
    assert_allclose(exact, approximate, rtol=0, atol=tolerance * max(np.abs(approximate).max(), 1 / C_K))
