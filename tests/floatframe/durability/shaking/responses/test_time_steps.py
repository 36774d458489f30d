"""Oscillators step by step against pyYeti, the matrix exponential and closed forms."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose

from floatframe.durability.shaking.responses.time_steps import (
    base_motions,
    exponentials,
    histories,
    oscillator,
    step_of,
)
from tests.floatframe.durability.shaking.single_mass import masses


@pytest.mark.parametrize("zeta", [0.0, 0.05, 0.999, 2.0])
def test_an_oscillator_is_that_of_pyyeti(zeta):
    from pyyeti.ode import SolveUnc

    load = np.random.default_rng(1).normal(size=400) + 0.5
    omega, h = 31.0, 0.01
    own = oscillator(omega, zeta, load, h)
    other = SolveUnc(np.ones(1), np.array([2 * zeta * omega]), np.array([omega**2]), h).tsolve(load[None])
    for mine, theirs in ((own.value, other.d[0]), (own.rate, other.v[0]), (own.second, other.a[0])):
        assert_allclose(mine, theirs, rtol=0, atol=1e-9 * np.abs(theirs).max())


@pytest.mark.parametrize("zeta", [0.0, 0.02, 1.0, 3.0])
@pytest.mark.parametrize("p", [0.0, 1e-6, 0.1, 0.999, 2.0, 3.9, 4.1, 30.0])
def test_a_step_is_the_exponential_of_the_states(p, zeta):
    h = 0.013
    omega = p / h
    states = np.zeros((4, 4))
    states[:2, :2] = [[0.0, h], [-(omega**2) * h, -2 * zeta * omega * h]]
    states[1, 2], states[2, 3] = h, 1.0
    step, (A, B_0, B_1) = la.expm(states), step_of(omega, zeta, h)
    scale = np.array([1.0, max(omega, 1 / h)])
    atol = 1e-12 * (1 + p)
    assert_allclose(
        np.reshape(A, (2, 2)) / scale[:, None] * scale, step[:2, :2] / scale[:, None] * scale, rtol=0, atol=atol
    )
    for mine, theirs in ((B_0, step[:2, 2] - step[:2, 3]), (B_1, step[:2, 3])):
        assert_allclose(np.array(mine) / scale / h**2, theirs / scale / h**2, rtol=0, atol=atol)


@pytest.mark.parametrize("z", [1e-9, 0.3 + 0.4j, -0.99, 1.01j, -5 + 3j])
def test_the_exponential_and_its_quotients(z):
    step = la.expm(np.array([[z, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]]))
    assert_allclose(exponentials(z), step[0], rtol=1e-13)


def test_a_ramp_from_rest_is_met_exactly_in_one_step():
    own = oscillator(2.0, 0.0, np.array([0.0, 3.0]), 1.5)
    # x = (a t - a sin(omega t)/omega)/omega² of the load a t, a = 2
    assert_allclose(own.value[1], (3.0 - 2.0 * np.sin(3.0) / 2.0) / 4.0, rtol=1e-13)


def test_a_base_integrates_straight_pieces_exactly():
    t = np.linspace(0, 2, 5)
    motion = base_motions(3 * t, 0.5)
    assert_allclose(motion.rate, 1.5 * t**2, rtol=1e-14)
    assert_allclose(motion.value, 0.5 * t**3, rtol=1e-14)


def test_coupled_damping_gives_the_motion_of_the_whole_state_matrix():
    model = masses([20.0, 33.0, 40.0], 0.02, [1.0, 0.5, 2.0])
    C = np.array(model.C)
    C[0, 1] = C[1, 0] = 3.0
    C[1, 2] = C[2, 1] = -2.0
    model = replace(model, C=C)
    a, h = np.random.default_rng(0).normal(size=60), 0.004
    out = histories(model, a[None], h, np.array([2]))
    A = np.zeros((8, 8))
    A[:3, 3:6] = np.eye(3)
    A[3:6, :3], A[3:6, 3:6], A[3:6, 6], A[6, 7] = -np.diag(model.omega**2), -C, model.B[2, :, 2], 1.0
    step, x = la.expm(A * h), np.zeros(8)
    for n in range(59):
        x[6], x[7] = a[n], (a[n + 1] - a[n]) / h
        x = step @ x
        second = -(model.omega**2) * x[:3] - C @ x[3:6] + model.B[2, :, 2] * a[n + 1]
        expected = [second[0] + a[n + 1], x[0], model.E[2, 2] @ second + model.D[2, 2, 2] * a[n + 1]]
        scale = np.abs(out).max(axis=1)
        assert_allclose(out[:, n + 1] / scale, expected / scale, rtol=0, atol=1e-9)


def test_a_static_mode_follows_its_load_at_once():
    model = replace(masses([20.0, 500.0], 0.02, [1.0, 2.0]), n_residual=1)
    a, h = np.sin(np.arange(50) / 5), 1e-3
    E = np.array(model.E)
    E[0, 1, 1] = 1.0
    out = histories(replace(model, E=E), a[None], h, np.array([2]))
    alone = histories(masses([20.0], 0.02), a[None], h, np.array([2]))
    assert_allclose(out[1] - alone[1], -2.0 * a / model.omega[1] ** 2, rtol=0, atol=1e-15)
    assert_allclose(out[2] - alone[2], 4.0 * a, rtol=0, atol=1e-12)  # rigidly with the base
