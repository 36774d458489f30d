"""Every inertia term of a flexible body against plain sums over its particles, and against its kinetic energy."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.newton_equations import set_iterate
from floatframe.engine.kernels.entry import absolute_kernels, evaluate_and_linearize
from floatframe.engine.kernels.memory import memory_at
from floatframe.engine.kernels.work import new_work
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.forces import Gravity
from floatframe.model.rotations import euler_parameters_of_rotation_vector, rotation_matrix
from floatframe.model.state import State
from floatframe.model.system import System
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffness

ROUNDOFF = 1e-12
N_Q = 5


@pytest.fixture(scope="module")
def case():
    """Return particles, system, stiffness, damping."""
    points = random_point_masses(N_Q, 7)
    K, D = stiffness(N_Q), 0.1 * stiffness(N_Q, 9)
    system = System([FlexibleBody("body", reduced_body(points, K, D=D))], forces=[Gravity((1.0, -2.0, -9.81))])
    return points, system, K, D


def random_motion(seed):
    rng = np.random.default_rng(seed)
    p = euler_parameters_of_rotation_vector(rng.normal(size=3))
    state = State(rng.normal(size=(1, 3)), p[None], rng.normal(size=N_Q), rng.normal(size=6 + N_Q))
    return state, rng.normal(size=6 + N_Q)


def generalized_forces(points, state, u_dot, gravity):
    """Return force, torque, modal forces that the particles need, body axes, by plain sums."""
    m, c, phi = points.m, points.c, points.phi
    R = rotation_matrix(state.p[0])
    omega, q_dot, alpha, q_ddot = state.u[3:6], state.u[6:], u_dot[3:6], u_dot[6:]
    rho = c + phi @ state.q
    a = R.T @ (u_dot[:3] - gravity) + np.cross(alpha, rho) + np.cross(omega, np.cross(omega, rho))
    a = a + 2 * np.cross(omega, phi @ q_dot) + phi @ q_ddot
    f = m @ a
    tau = m @ np.cross(rho, a)
    h = np.einsum("p,pak,pa->k", m, phi, a)
    return np.concatenate([f, tau, h])


@pytest.mark.parametrize("seed", range(5))
def test_equations_of_motion_are_the_sums_over_the_particles(case, seed):
    points, system, K, D = case
    state, u_dot = random_motion(seed)
    work = new_work(compiled_system(system).model)
    set_iterate(work, state, u_dot)
    evaluate_and_linearize(compiled_system(system).model, work, 1.0, 0.0, 0.0)
    expected = generalized_forces(points, state, u_dot, compiled_system(system).model.gravity)
    expected[6:] += K @ state.q + D @ state.u[6:]
    assert_allclose(work.bodies.residual, expected, rtol=0, atol=ROUNDOFF * np.abs(expected).max())


def observed(system, state):
    """Return the row of results at a state."""
    memory = memory_at(state, np.zeros(len(state.u)), np.zeros(int(compiled_system(system).model.connections.w0[-1])))
    model = compiled_system(system).model
    return absolute_kernels.observe(model, new_work(model), memory=memory, t=0.0).diagnostics[0]


@pytest.mark.parametrize("seed", range(3))
def test_energies_and_momenta_are_the_sums_over_the_particles(case, seed):
    points, system, K, _ = case
    state, _ = random_motion(seed)
    m, c, phi = points.m, points.c, points.phi
    R = rotation_matrix(state.p[0])
    rho = c + phi @ state.q
    x = state.r[0] + rho @ R.T
    v = state.u[:3] + (np.cross(state.u[3:6], rho) + phi @ state.u[6:]) @ R.T
    g = compiled_system(system).model.gravity
    expected = np.concatenate([
        [0.5 * m @ (v * v).sum(axis=1), 0.5 * state.q @ K @ state.q, -m @ x @ g, 0.0], m @ v, m @ np.cross(x, v),
    ])  # fmt: skip
    assert_allclose(observed(system, state)[:10], expected, rtol=0, atol=ROUNDOFF * np.abs(expected).max())


@pytest.mark.parametrize("seed", range(3))
def test_power_of_the_forces_is_the_rate_of_the_kinetic_energy(case, seed):
    """dT/dt = f·v + tau·omega + h·q_dot along a motion, f, tau, h without gravity, elasticity and damping."""
    _, system, K, D = case
    state, u_dot = random_motion(seed)
    work = new_work(compiled_system(system).model)
    set_iterate(work, state, u_dot)
    evaluate_and_linearize(compiled_system(system).model, work, 1.0, 0.0, 0.0)
    forces = work.bodies.residual.copy()
    forces[6:] -= K @ state.q + D @ state.u[6:]
    R = rotation_matrix(state.p[0])
    power = forces @ np.concatenate([R.T @ state.u[:3], state.u[3:]])

    def kinetic(s):
        u = state.u + s * u_dot
        turn = s * state.u[3:6] + s**2 / 2 * u_dot[3:6]
        p = euler_parameters_of_rotation_vector(turn)
        moved = State(state.r, product(state.p[0], p)[None], state.q + s * state.u[6:] + s**2 / 2 * u_dot[6:], u)
        return observed(system, moved)

    s = 1e-4
    plus, minus = kinetic(s), kinetic(-s)
    rate = (plus[0] - minus[0]) / (2 * s)
    weight = (
        compiled_system(system).model.gravity @ (plus[4:7] + minus[4:7]) / 2
    )  # power of gravity, which is in `forces`
    assert_allclose(rate, power + weight, rtol=0, atol=1e-6 * np.abs(plus[0]))


def product(p, s):
    return np.array([p[0] * s[0] - p[1:] @ s[1:], *(p[0] * s[1:] + s[0] * p[1:] + np.cross(p[1:], s[1:]))])
