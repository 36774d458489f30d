"""A start leaves out what the step does not follow: no restart makes a mode grow, and the order stays the second."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import floatframe as ff
from floatframe import GeneralizedAlpha, JointForce, Marker, PrismaticJoint, RigidBody, System
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.initial import consistent_motion, work_from
from floatframe.engine.initial_conditions.step_filter import step_filter

RATIOS = np.concatenate([np.logspace(-2, 0, 12), np.geomspace(1.05, 20, 60), np.logspace(1.4, 6, 24)])  #: omega h
RHO = (0.0, 0.5, 0.8, 0.9, 0.95, 1.0)


def oscillator(omega, damping=0.0):
    """One mass on a spring along a turned axis, off the origin: x'' = -omega² x - damping x'."""
    axis = np.array([2.0, -1.0, 2.0]) / 3
    mass = RigidBody("mass", 3.0, np.eye(3), position=(5.0, 7.0, -4.0))
    slide = PrismaticJoint("slide", Marker("ground", position=(5.0, 7.0, -4.0)), Marker("mass"), axis=axis)
    spring = JointForce("spring", "slide", "distance", stiffness=3.0 * omega**2, damping=3.0 * damping)
    return System([mass], [slide], [spring]), axis


def restart_map(K, C, coefficients, n, s):
    """Return the matrix of n steps of size 1 from a new start, (2, 2), of (sqrt(K) x, v) in x'' = -K x - C x'."""
    alpha_m, alpha_f, beta, gamma = coefficients
    Z = 1 / (1 + s * (gamma * C + beta * K))
    columns = []
    for x, v in ((1 / np.sqrt(K), 0.0), (0.0, 1.0)):
        u_dot = (2 * Z - Z**2) * (-K * x - C * v)
        a = u_dot + (alpha_m - alpha_f) * Z * (-K * v - C * u_dot)
        for _ in range(n):
            x_c, v_c = x + v + (0.5 - beta) * a, v + (1 - gamma) * a
            right = (1 - alpha_f) * (-K * x_c - C * v_c) + alpha_f * u_dot - alpha_m * a
            new = right / ((1 - alpha_m) + (1 - alpha_f) * (K * beta + C * gamma))
            x, v = x_c + beta * new, v_c + gamma * new
            u_dot, a = -K * x - C * v, new
        columns.append((np.sqrt(K) * x, v))
    return np.array(columns).T


@pytest.mark.parametrize("rho", RHO)
def test_no_restart_makes_a_mode_grow(rho):
    """By the map of one mass on a spring, whose eigenvalues are at most 1; 1e-3 is rounding of a = -(omega h)² x."""
    method = GeneralizedAlpha(rho)
    s = method.coefficients[3] - 0.5
    for zeta in (0.0, 0.02, 1.0, 10.0):
        for n in (1, 2, 3, 5, 10):
            maps = [restart_map(w**2, 2 * zeta * w, method.coefficients, n, s) for w in RATIOS]
            growth = np.abs(np.linalg.eigvals(np.array(maps))).max(axis=1)
            rounding = 1e-9 if rho < 1 else 1e-16 * RATIOS**2 * n + 1e-9
            assert (growth <= 1 + rounding).all(), (zeta, n, RATIOS[np.argmax(growth)], growth.max())


@pytest.mark.parametrize("formulation", ["absolute", "relative"])
@pytest.mark.parametrize("rho", [0.0, 0.8])
@pytest.mark.parametrize("ratio", [0.3, 2.0, 100.0, 1e4])
def test_restarts_of_the_engine_are_this_map(formulation, rho, ratio):
    """Three steps from displacement and from velocity, against the map by hand."""
    h, zeta = 0.01, 0.02
    system, axis = oscillator(ratio / h, 2 * zeta * ratio / h)
    method = GeneralizedAlpha(rho, tolerance=1e-13)
    placed = compiled_system(system).placed
    K, C = ratio**2, 2 * zeta * ratio
    expected = restart_map(K, C, method.coefficients, 3, method.coefficients[3] - 0.5)
    found = []
    for x, v in ((1e-3, 0.0), (0.0, 1e-3 * ratio)):
        state = ff.State(placed.r + x * axis, placed.p, placed.q, np.concatenate([v / h * axis, np.zeros(3)]))
        run = ff.integrate(system, method, 3 * h, h, state=state, formulation=formulation, watch="off")
        after = run.state(-1)
        found.append((ratio * ((after.r[0] - placed.r[0]) @ axis), h * (after.u[:3] @ axis)))
    atol = 1e-6 * abs(expected).max() + 1e-11  # and rounding of places 10 m from the origin
    assert_allclose(np.array(found).T / (1e-3 * ratio), expected, rtol=0, atol=atol)


def test_the_filter_is_a_fraction_of_two_matrices_for_springs_and_dampers():
    """Z = 1/(1 + c_d D/M + c_k K/M) along the spring; across it nothing moves."""
    system, axis = oscillator(50.0, 7.0)
    compiled = compiled_system(system)
    found = consistent_motion(system)
    z = step_filter(compiled, found, 0.0, c_d=0.03, c_k=0.002, work=work_from(compiled.model, found.w))
    y = np.concatenate([axis, np.zeros(3)])
    assert_allclose(z(y), y / (1 + 0.03 * 7.0 + 0.002 * 2500.0), rtol=1e-12, atol=1e-14)
    assert_allclose(z.twice(y), 2 * z(y) - z(z(y)), rtol=1e-12, atol=1e-14)


def test_the_filter_keeps_what_joints_ask_of_accelerations():
    """A disc that turns about an axis off its centre: the acceleration towards the axis stays, springs or not."""
    omega = 30.0
    spin = {"omega_B": (0, 0, omega), "velocity": (0, 0.3 * omega, 0)}
    disc = RigidBody("disc", 2.0, np.eye(3), position=(1.3, 0.4, 0), **spin)
    pin, rim = Marker("ground", position=(1.0, 0.4, 0)), Marker("disc", position=(-0.3, 0, 0))
    hinge = ff.RevoluteJoint("hinge", pin, rim, axis=(0, 0, 1))
    system = System([disc], [hinge], [JointForce("spring", "hinge", "angle", stiffness=1e6, free=0.1)])
    found = consistent_motion(system)
    compiled = compiled_system(system)
    z = step_filter(compiled, found, 0.0, c_d=0.01, c_k=0.01, work=work_from(compiled.model, found.w))
    towards, along = z(found.u_dot)[0], z(found.u_dot)[5]
    assert_allclose(towards, -0.3 * omega**2, rtol=1e-12)
    assert_allclose(along / found.u_dot[5], 1 / (1 + 0.01 * 1e6 / (1 + 2 * 0.3**2)), rtol=1e-2)
