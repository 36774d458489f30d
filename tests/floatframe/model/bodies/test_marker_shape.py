"""A marker moves the same in the results, in the analyses, in discrete steps and in the time loop."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe.engine.compiling.markers import find_marker, marker_pose, n_q_of
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.newton_equations import set_iterate
from floatframe.engine.kernels.entry import evaluate_and_linearize, rates_of_constraints
from floatframe.engine.kernels.work import new_work
from floatframe.engine.structure_preserving.bodies import central_bodies
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.bodies.ground import GROUND
from floatframe.model.bodies.marker_shape import BodyFrameMotion, interface_shape, marker_motion, motion_in_body
from floatframe.model.bodies.markers import Marker
from floatframe.model.joints import SphericalJoint
from floatframe.model.rotations import euler_parameters_of_rotation_vector, rotation_exp, rotation_matrix
from floatframe.model.state import State
from floatframe.model.system import System
from floatframe.results.small_motions.marker_jacobian import marker_jacobian
from tests.floatframe.engine.structure_preserving.in_python.bodies import step_bodies
from tests.floatframe.engine.structure_preserving.in_python.markers import body_marker
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffened_body, stiffness

N_Q = 3
ROUNDOFF = 1e-13
MAKE = {"plain": reduced_body, "stiffened": stiffened_body}
TRIAD = rotation_exp(np.array([0.4, -0.3, 0.8]))


def system_of(kind):
    body = MAKE[kind](random_point_masses(N_Q, 3), stiffness(N_Q))
    return System([FlexibleBody("body", body)], [SphericalJoint("ball", Marker("body", "end_b", triad=TRIAD), GROUND)])


def random_state(seed):
    rng = np.random.default_rng(seed)
    p = euler_parameters_of_rotation_vector(rng.normal(size=3))[None]
    return State(rng.normal(size=(1, 3)), p, 0.4 * rng.normal(size=N_Q), rng.normal(size=6 + N_Q))


def body_frame(state, v_dot=np.zeros(3), alpha=np.zeros(3)):
    return BodyFrameMotion(state.r[0], rotation_matrix(state.p[0]), state.u[:3], state.u[3:6], v_dot, alpha)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("kind", MAKE)
def test_motion_in_results_is_that_of_the_kernels(kind, seed):
    system, state = system_of(kind), random_state(seed)
    compiled = compiled_system(system)
    shape = find_marker(system, "here", Marker("body", "end_b", triad=TRIAD)).shape
    motion = marker_motion(body_frame(state), motion_in_body(shape, state.q, state.u[6:], np.zeros(N_Q)))
    work = new_work(compiled.model)
    set_iterate(work, state)
    evaluate_and_linearize(compiled.model, work, 1.0, 0.0, 0.0)
    rates_of_constraints(compiled.model, work)
    m = int(compiled.model.connections.a[0])
    for found, expected in (
        (motion.position, work.markers.r[m]),
        (motion.axes, work.markers.A[m]),
        (motion.velocity, work.markers.v[m]),
        (motion.omega, work.markers.omega[m]),
        (motion.acceleration, work.markers.bias[m, :3]),
        (motion.alpha, work.markers.bias[m, 3:]),
    ):
        assert_allclose(found, expected, rtol=0, atol=ROUNDOFF * max(1.0, np.abs(expected).max()))


@pytest.mark.parametrize("kind", MAKE)
def test_place_at_the_start_and_in_discrete_steps_is_that_of_the_results(kind):
    system, state = system_of(kind), random_state(4)
    compiled = compiled_system(system)
    data = find_marker(system, "here", Marker("body", "end_b", triad=TRIAD))
    rho, axes = data.shape.pose(state.q)
    r_P, A_P = marker_pose(data, state, n_q_of(system))
    R = rotation_matrix(state.p[0])
    assert_allclose(r_P, state.r[0] + R @ rho, rtol=0, atol=ROUNDOFF)
    assert_allclose(A_P, R @ axes, rtol=0, atol=ROUNDOFF)
    bodies = step_bodies(compiled.model, central_bodies(compiled.model, ("body",), "test"))
    own = body_marker(compiled.model, bodies, int(compiled.model.connections.a[0]))
    sigma, theta = own.deformation(state.q)
    assert_allclose(sigma + bodies[0].center(state.q), rho, rtol=0, atol=ROUNDOFF)
    assert_allclose(rotation_exp(theta) @ own.shape.triad, axes, rtol=0, atol=ROUNDOFF)


@pytest.mark.parametrize("kind", MAKE)
def test_jacobian_of_small_motions_gives_the_velocities(kind):
    system, state = system_of(kind), random_state(5)
    compiled = compiled_system(system)
    data = find_marker(system, "here", Marker("body", "end_b", triad=TRIAD))
    work = new_work(compiled.model)
    set_iterate(work, state)
    R = rotation_matrix(state.p[0])
    motion = marker_motion(body_frame(state), motion_in_body(data.shape, state.q, state.u[6:], np.zeros(N_Q)))
    in_body_axes = np.concatenate([R.T @ state.u[:3], state.u[3:]])
    found = marker_jacobian(compiled, work, data) @ in_body_axes
    assert_allclose(found, np.concatenate([motion.velocity, motion.omega]), rtol=0, atol=ROUNDOFF)


@pytest.mark.parametrize("size", [1e-4, 0.3, 1.5, 4.0])
@pytest.mark.parametrize("kind", MAKE)
def test_rates_of_a_motion_in_the_body_are_derivatives_of_its_places(kind, size):
    """By complex steps, on both sides of the switch to series; a stack of one motion at two times."""
    rng = np.random.default_rng(6)
    shape = interface_shape(MAKE[kind](random_point_masses(N_Q, 3), stiffness(N_Q)), "end_a", is_stiffened=True)
    q, q_dot, q_ddot = size * rng.normal(size=(3, 2, N_Q))
    own = motion_in_body(shape, q, q_dot, q_ddot)
    s = 1e-30
    moved = shape.deformation(q + 1j * s * q_dot)
    axes_dot = np.imag(rotation_exp(moved[:, 3:])) / s @ shape.triad
    scale = ROUNDOFF * max(1.0, size) ** 4 * 10
    assert_allclose(own.rho_dot, np.imag(moved[:, :3]) / s, rtol=0, atol=scale)
    spun = np.cross(own.spin[:, None, :], np.swapaxes(own.axes, 1, 2))  # rows: rates of the axes
    assert_allclose(spun, np.swapaxes(axes_dot, 1, 2), rtol=0, atol=scale)
    after = motion_in_body(shape, q + 1j * s * q_dot, q_dot + 1j * s * q_ddot, q_ddot)
    for found, expected in ((own.rho_ddot, after.rho_dot), (own.spin_dot, after.spin)):
        expected = np.imag(expected) / s
        assert_allclose(found, expected, rtol=0, atol=ROUNDOFF * max(1.0, np.abs(expected).max()))


def test_a_stack_is_what_its_entries_are():
    rng = np.random.default_rng(7)
    shape = interface_shape(stiffened_body(random_point_masses(N_Q, 3), stiffness(N_Q)), "end_a", is_stiffened=True)
    q, q_dot, q_ddot = rng.normal(size=(3, 4, N_Q))
    stack = motion_in_body(shape, q, q_dot, q_ddot)
    for k in range(4):
        for all_of_them, one in zip(stack, motion_in_body(shape, q[k], q_dot[k], q_ddot[k]), strict=True):
            assert_allclose(all_of_them[k], one, rtol=0, atol=ROUNDOFF * max(1.0, np.abs(one).max()))
