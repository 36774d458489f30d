import numpy as np
from numpy.testing import assert_allclose

from cms.linear_algebra.elastic_pencil import turn_to_diagonal


def test_a_soft_band_keeps_its_digits_beside_a_stiff_one():
    """Bands 4 ± sqrt(2) and 1e16 times that, weakly coupled: one eigenvalue problem has an error of 8 in the first."""
    band = np.array([[3.0, 1.0], [1.0, 5.0]])
    K = np.kron(np.diag([1.0, 1e16]), band)
    K[:2, 2:] = K[2:, :2] = 0.7
    turn = turn_to_diagonal(K)
    assert_allclose(turn.T @ turn, np.eye(4), rtol=0, atol=1e-14)
    found = turn.T @ K @ turn
    exact = 4 + np.sqrt(2) * np.array([-1, 1])
    assert_allclose(np.diag(found), [*exact, *1e16 * exact], rtol=1e-14)
    assert_allclose(found[:2, :2], np.diag(exact), rtol=0, atol=1e-14 * exact[1])
    assert np.abs(np.linalg.eigh(K)[0][:2] / exact - 1).max() > 1e-4
