"""Free-free shapes of a subset of columns: rigid-body motion is known by its length, in any units."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cms.assessment.compare.free_shapes import judged_subset


@pytest.mark.parametrize("omega2_1", [2e9, 1.0, 1e-6])
def test_rigid_motion_that_rounding_has_touched_is_held_whatever_the_units(omega2_1):
    """Two motions, e_1 and e_2, where K + omega_1² M = 1; the span holds the first but for 1e-7 of its length."""
    stiff = np.array([0, 0, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95])
    c = SimpleNamespace(K=np.diag(stiff), M=np.diag(1 - stiff) / omega2_1)
    rigid = np.eye(8)[:, :2] * np.sqrt(omega2_1)
    T = np.eye(8)[:, :6]
    T[7, 0] = 1e-7
    found = judged_subset(c, T, tuple("abcdef"), rigid, omega2_1)
    assert found.n_q == 4
    assert_allclose(found.basis.omega2, omega2_1 * stiff[2:6] / (1 - stiff[2:6]), rtol=1e-10)
