"""The Newton matrix against finite differences of the residual, for any system."""

import numpy as np
from numpy.testing import assert_allclose

from tests.floatframe.engine.kernels.examples import C_K, Iterate, newton_matrices


def assert_tangent_is_exact(system, *, seed=1, step=1e-5, tolerance=4e-9, prepare=None):
    """Compare the Newton matrix at a random iterate with central differences; prepare(iterate) may change it."""
    iterate = Iterate(system, seed)
    iterate.work.state.time[...] = 0.37
    if prepare is not None:
        prepare(iterate)
    exact, approximate = newton_matrices(iterate, step=step)
    assert_allclose(exact, approximate, rtol=0, atol=tolerance * max(np.abs(approximate).max(), 1 / C_K))
