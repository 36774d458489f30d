"""Rotations by two routes each."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from floatframe.engine.kernels import rotation as kernels
from floatframe.engine.kernels.compiler.compilation import entry
from floatframe.engine.kernels.vector import put_matrix, vector
from floatframe.model.rotations import (
    euler_parameter_rates,
    euler_parameters,
    euler_parameters_of_rotation_vector,
    left_jacobian,
    right_jacobian,
    rotation_exp,
    rotation_log,
    rotation_matrix,
    spin_rate,
    tilde,
)

ROUNDOFF = 1e-14
ANGLES = [0.0, 1e-9, 1e-4, 9.9e-3, 1.01e-2, 0.3, 0.499999, 0.500001, 1.0, 3.0, 3.1]


def some_vectors():
    rng = np.random.default_rng(0)
    for angle in ANGLES:
        axis = rng.normal(size=3)
        yield angle * axis / np.linalg.norm(axis)


VECTORS = list(some_vectors())


@pytest.mark.parametrize("theta", VECTORS)
def test_exp_of_a_rotation_vector_is_that_of_scipy_and_of_its_euler_parameters(theta):
    expected = Rotation.from_rotvec(theta).as_matrix()
    assert_allclose(rotation_exp(theta), expected, rtol=0, atol=ROUNDOFF)
    p = euler_parameters_of_rotation_vector(theta)
    assert_allclose(rotation_matrix(p), expected, rtol=0, atol=ROUNDOFF)
    assert_allclose(euler_parameters(expected), p, rtol=0, atol=ROUNDOFF)
    assert_allclose(rotation_log(expected), theta, rtol=0, atol=1e-12)


@pytest.mark.parametrize("axis", np.eye(3))
def test_half_turns_have_euler_parameters_too(axis):
    p = euler_parameters(2 * np.outer(axis, axis) - np.eye(3))
    assert_allclose(p, [0, *axis], rtol=0, atol=ROUNDOFF)


@pytest.mark.parametrize("theta", VECTORS)
def test_right_jacobian_is_the_derivative_of_exp(theta):
    """exp(-tilde) d exp = tilde(T dtheta), by central differences."""
    s = 1e-5
    R, T = rotation_exp(theta), right_jacobian(theta)
    for k in range(3):
        change = R.T @ (rotation_exp(theta + s * np.eye(3)[k]) - rotation_exp(theta - s * np.eye(3)[k])) / (2 * s)
        assert_allclose(change, tilde(T[:, k]), rtol=0, atol=1e-9)


def test_rates_of_euler_parameters_are_those_of_the_matrix():
    rng = np.random.default_rng(1)
    p = euler_parameters_of_rotation_vector(rng.normal(size=3))
    omega, s = rng.normal(size=3), 1e-6
    p_dot = euler_parameter_rates(p, omega)
    R_dot = (rotation_matrix(p + s * p_dot) - rotation_matrix(p - s * p_dot)) / (2 * s)
    assert_allclose(R_dot, rotation_matrix(p) @ tilde(omega), rtol=0, atol=1e-9)


def all_functions(theta, v, p, out):
    th, u = vector(theta), vector(v)
    put_matrix(out[0], kernels.exp_matrix(th))
    put_matrix(out[1], kernels.right_jacobian(th))
    put_matrix(out[2], kernels.left_jacobian(th))
    put_matrix(out[3], kernels.left_jacobian_derivative(th, u, 1.0))
    put_matrix(out[4], kernels.left_jacobian_derivative(th, u, -1.0))
    put_matrix(out[5], kernels.matrix_of_euler_parameters(kernels.rotate_euler_parameters(p, th)))


compiled_functions = entry(all_functions, cache=False)  # inner functions have no machine code of their own


@pytest.mark.parametrize("theta", VECTORS)
def test_compiled_rotations_are_the_plain_ones_on_both_sides_of_the_switch(theta):
    v, p, out = np.array([0.3, -1.2, 0.7]), euler_parameters_of_rotation_vector([0.2, 0.9, -0.4]), np.zeros((6, 3, 3))
    compiled_functions(theta, v, p, out)
    assert_allclose(out[0], rotation_exp(theta), rtol=0, atol=ROUNDOFF)
    assert_allclose(out[1], right_jacobian(theta), rtol=0, atol=1e-12)
    assert_allclose(out[2], right_jacobian(theta).T, rtol=0, atol=1e-12)
    assert_allclose(out[5], rotation_matrix(p) @ rotation_exp(theta), rtol=0, atol=ROUNDOFF)
    s = 1e-4
    for k in range(3):
        step = s * np.eye(3)[k]
        left = (right_jacobian(theta + step).T - right_jacobian(theta - step).T) @ v / (2 * s)
        right = (right_jacobian(theta + step) - right_jacobian(theta - step)) @ v / (2 * s)
        assert_allclose(out[3][:, k], left, rtol=0, atol=1e-8)
        assert_allclose(out[4][:, k], right, rtol=0, atol=1e-8)


@pytest.mark.parametrize("theta", VECTORS)
def test_rate_of_the_spin_is_its_derivative_by_a_complex_step(theta):
    rng = np.random.default_rng(2)
    rate, second, s = rng.normal(size=3), rng.normal(size=3), 1e-30
    along = left_jacobian(theta + 1j * s * rate) @ (rate + 1j * s * second)
    assert_allclose(spin_rate(theta, rate, second), np.imag(along) / s, rtol=0, atol=1e-13)


def test_stacks_of_rotations_are_what_their_entries_are():
    theta = np.array(VECTORS)
    for function in (rotation_exp, left_jacobian, right_jacobian, tilde, euler_parameters_of_rotation_vector):
        assert_array_equal(function(theta), np.array([function(each) for each in theta]))
    p = euler_parameters_of_rotation_vector(theta)
    assert_array_equal(rotation_matrix(p), np.array([rotation_matrix(each) for each in p]))
