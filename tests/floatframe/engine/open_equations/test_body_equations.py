"""Arrays and functions of a body against the kernels and against Lagrange's equations by complex steps."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import floatframe as ff
from floatframe.engine.open_equations import body_equations, open_equations
from floatframe.model.rotations import rotation_matrix
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffened_body, stiffness

N = 3


def bodies():
    """Return a body without geometric stiffness and one with it."""
    points = random_point_masses(N, 5)
    return {
        "linear": ff.FlexibleBody("b", reduced_body(points, stiffness(N), D=0.1 * np.eye(N))),
        "stiffened": ff.FlexibleBody("b", stiffened_body(points, stiffness(N), size=0.1)),
    }


@pytest.mark.parametrize("name", ["linear", "stiffened"])
def test_arrays_of_a_body_are_the_equations_of_the_kernels(name):
    body = bodies()[name]
    own = body_equations(body)
    assert np.array_equal(own.S_ab, body.moved.moments.S_kl) == (name == "linear")
    eq = open_equations(ff.System([body], units=body.reduced.units))
    rng = np.random.default_rng(6)
    x, v = eq.configurations.normalized(rng.normal(size=eq.n_x)), rng.normal(size=eq.n_v)
    p, q, omega, q_dot = x[3:7], 0.2 * x[7:], v[3:6], v[6:]
    x[7:] = q
    M = own.mass_matrix(q, p)
    assert_allclose(eq.mass(x), M, rtol=0, atol=1e-12 * np.abs(M).max())
    k = own.quadratic_velocity(omega, q, q_dot) + own.elastic(q, q_dot)
    k[:3] = rotation_matrix(p) @ k[:3]
    assert_allclose(-eq.force(0.0, x, v), k, rtol=0, atol=1e-12 * np.abs(k).max())


@pytest.mark.parametrize("name", ["linear", "stiffened"])
def test_quadratic_velocity_forces_follow_from_the_kinetic_energy(name):
    """Modal part of Lagrange's equations: (dM/dt u)_q - 1/2 d(uᵀ M u)/dq = k_omega,q + (v × part), for v = 0."""
    own = body_equations(bodies()[name])
    rng = np.random.default_rng(7)
    q, q_dot, omega = 0.2 * rng.normal(size=N), rng.normal(size=N), rng.normal(size=3)
    u, h = np.concatenate([np.zeros(3), omega, q_dot]), 1e-4
    M_dot = (own.mass_matrix(q + h * q_dot) - own.mass_matrix(q - h * q_dot)) / (2 * h)
    by_q = []
    for k in range(N):
        d = np.zeros(N)
        d[k] = h
        by_q.append(0.5 * u @ (own.mass_matrix(q + d) - own.mass_matrix(q - d)) @ u / (2 * h))
    expected = (M_dot @ u)[6:] - np.array(by_q)
    found = own.quadratic_velocity(omega, q, q_dot)[6:]
    assert_allclose(found, expected, rtol=0, atol=1e-8 * np.abs(found).max())


def test_work_of_the_quadratic_velocity_forces_is_the_change_of_energy():
    """u · k_omega = 1/2 uᵀ dM/dt u for v = 0: with them alone a free body keeps its energy."""
    own = body_equations(bodies()["linear"])
    rng = np.random.default_rng(8)
    q, q_dot, omega = rng.normal(size=N), rng.normal(size=N), rng.normal(size=3)
    u, h = np.concatenate([np.zeros(3), omega, q_dot]), 1e-4
    M_dot = (own.mass_matrix(q + h * q_dot) - own.mass_matrix(q - h * q_dot)) / (2 * h)
    power = u @ own.quadratic_velocity(omega, q, q_dot)
    assert_allclose(power, 0.5 * u @ M_dot @ u, rtol=1e-7, atol=0)


def test_arrays_survive_a_file(tmp_path):
    own = body_equations(bodies()["linear"].reduced)
    np.savez(tmp_path / "body.npz", **own.arrays())
    with np.load(tmp_path / "body.npz") as read:
        assert set(read) == {"m", "S", "J0", "C1", "C2", "C3", "C4", "S_ab", "M", "K", "D", "K_t", "K_r"}
        for name, array in own.arrays().items():
            np.testing.assert_array_equal(read[name], array)


def test_stiffening_that_is_not_there_is_refused():
    with pytest.raises(ff.errors.ModelError, match="holds no geometric stiffness"):
        body_equations(bodies()["linear"].reduced, stiffening=True)
