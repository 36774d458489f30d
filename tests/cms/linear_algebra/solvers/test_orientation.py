import numpy as np
from numpy.testing import assert_allclose
from scipy.stats import ortho_group

from cms.linear_algebra.solvers.eigen import orientation, turn_in_place


def test_any_rotation_of_a_multiple_mode_gives_the_same_basis():
    rng = np.random.default_rng(1)
    Phi = rng.normal(size=(40, 6))
    omega2 = np.array([1.0, 2.0, 2.0, 2.0, 5.0, 9.0])
    standard = Phi @ orientation(Phi, omega2)
    turned = Phi.copy()
    turned[:, 1:4] = turned[:, 1:4] @ ortho_group.rvs(3, random_state=rng)
    turned[:, 5] *= -1
    assert_allclose(turned @ orientation(turned, omega2), standard, rtol=0, atol=1e-12)


def test_orientation_is_orthogonal_and_mixes_only_equal_frequencies():
    Phi = np.random.default_rng(2).normal(size=(10, 4))
    Z = orientation(Phi, np.array([0.0, 1.0, 1.0 + 1e-12, 3.0]))
    assert_allclose(Z.T @ Z, np.eye(4), rtol=0, atol=1e-14)
    assert Z[0, 1] == Z[1, 3] == Z[2, 3] == 0.0


def test_largest_entry_of_a_single_mode_is_positive():
    Phi = np.array([[0.1], [-3.0], [2.0]])
    assert_allclose(Phi @ orientation(Phi, np.array([1.0])), -Phi, rtol=0, atol=0)


def test_turning_in_place_is_the_product():
    rng = np.random.default_rng(3)
    Phi = rng.normal(size=(20, 6))
    Z = orientation(Phi, np.array([1.0, 2.0, 2.0, 2.0, 5.0, 5.0]))
    product = Phi @ Z
    turn_in_place(Phi, Z)
    assert_allclose(Phi, product, rtol=0, atol=1e-14)
