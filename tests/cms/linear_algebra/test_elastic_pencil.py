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


def test_close_modes_on_both_sides_of_a_border_of_bands_are_decoupled():
    """The stiffer two of three modes are 0.9 and 1.1 times the width of a band: one band holds the second alone."""
    K = np.diag([1.0, 0.9e6, 1.1e6])
    K[1, 2] = K[2, 1] = 1.0
    turn = turn_to_diagonal(K)
    found = turn.T @ K @ turn
    size = np.sqrt(np.diag(found))
    assert_allclose(found / np.outer(size, size), np.eye(3), rtol=0, atol=1e-14)
    exact = 1e6 + np.hypot(1e5, 1.0) * np.array([-1, 1])
    assert_allclose(np.diag(found), [1.0, *exact], rtol=1e-15, atol=0)
