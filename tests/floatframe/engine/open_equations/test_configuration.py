"""The maps of the group of configurations against their definitions."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe.engine.open_equations.configuration import Configurations, inverse_right_jacobian
from floatframe.model.rotations import right_jacobian

GROUP = Configurations(np.array([2, 0]))


def some_x(seed):
    return GROUP.normalized(np.random.default_rng(seed).normal(size=GROUP.n_x))


def some_v(seed, size=1.0):
    return size * np.random.default_rng(seed).normal(size=GROUP.n_v)


def test_the_difference_undoes_the_retraction():
    x, dx = some_x(1), some_v(2, 0.7)
    assert_allclose(GROUP.difference(x, GROUP.retract(x, dx)), dx, rtol=0, atol=1e-13)
    tiny = 1e-9 * dx
    assert_allclose(GROUP.difference(x, GROUP.retract(x, tiny)), tiny, rtol=0, atol=1e-15)


def test_the_tangent_is_the_derivative_of_the_retraction_by_a_complex_step():
    """x (+) (dx + i h d) in local coordinates of x (+) dx."""
    x, dx, d, h = some_x(3), some_v(4, 0.6), some_v(5), 1e-30
    end = GROUP.retract(x, dx)
    moved = GROUP.retract(x, dx + 1j * h * d).imag / h
    assert_allclose(GROUP.velocity(end, moved), GROUP.tangent(dx) @ d, rtol=0, atol=1e-13)


def test_rates_and_velocities_are_each_other_undone():
    x, v = some_x(6), some_v(7)
    assert_allclose(GROUP.velocity(x, GROUP.rate(x, v)), v, rtol=0, atol=1e-13)


@pytest.mark.parametrize("angle", [1e-9, 0.3, 0.4999999, 0.5000001, 3.0])
def test_the_inverse_tangent_is_the_inverse(angle):
    theta = angle * np.array([0.6, -0.64, 0.48])
    assert_allclose(inverse_right_jacobian(theta) @ right_jacobian(theta), np.eye(3), rtol=0, atol=1e-13)
    dx = some_v(8, 0.5)
    assert_allclose(GROUP.inverse_tangent(dx) @ GROUP.tangent(dx), np.eye(GROUP.n_v), rtol=0, atol=1e-13)
