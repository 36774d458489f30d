"""Rigid bodies against closed forms and against DOP853."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from floatframe import (
    GROUND,
    FixedJoint,
    GeneralizedAlpha,
    Gravity,
    Marker,
    PointForce,
    RevoluteJoint,
    RigidBody,
    SphericalJoint,
    SpringDamper,
    System,
    integrate,
)
from floatframe.model.rotations import euler_parameters_of_rotation_vector, rotation_exp, rotation_matrix
from tests.floatframe.orders import slope

METHOD = GeneralizedAlpha(0.8, 1e-11)


def test_torque_free_symmetric_body_precesses_as_in_closed_form():
    """omega_1 + i omega_2 turns in the body at (C - A)/A omega_3."""
    A, C = 1.0, 1.7
    steps, errors = np.array([8e-3, 4e-3, 2e-3, 1e-3]), []
    omega = np.array([0.6, 0.2, 2.0])
    for h in steps:
        body = RigidBody("top", 1.0, np.diag([A, A, C]), omega_B=omega)
        motion = integrate(System([body]), METHOD, 3.0, h).body("top")
        exact = (omega[0] + 1j * omega[1]) * np.exp(1j * (C - A) / A * omega[2] * motion.t)
        found = motion.omega_B[:, 0] + 1j * motion.omega_B[:, 1]
        errors.append(np.abs(found - exact).max())
        assert_allclose(motion.omega_B[:, 2], omega[2], rtol=0, atol=1e-12)
    assert errors[-1] < 1e-5
    assert abs(slope(steps, errors) - 2) < 0.15


def test_heavy_top_in_steady_precession_keeps_its_nutation_angle_and_rate():
    """A Omega² cos(th) - C n Omega + m g l = 0, n the total spin about the axis, A about the fixed point."""
    m, length, g, theta = 1.3, 0.4, 9.81, 0.5
    A_c, C = 0.05, 0.09
    A = A_c + m * length**2
    rate = 4.0
    n = (A * rate**2 * np.cos(theta) + m * g * length) / (C * rate)
    tilt = np.array([theta, 0.0, 0.0])
    R = rotation_exp(tilt)
    spin = n - rate * np.cos(theta)  # relative to the precessing axes
    omega_B = R.T @ (np.array([0.0, 0.0, rate]) + spin * R[:, 2])
    orientation = euler_parameters_of_rotation_vector(tilt)
    top = RigidBody("top", m, np.diag([A_c, A_c, C]), (0, 0, length), orientation=orientation, omega_B=omega_B)
    system = System([top], [SphericalJoint("tip", GROUND, Marker("top"))], [Gravity((0, 0, -g))])
    steps, errors = np.array([4e-3, 2e-3, 1e-3, 5e-4]), []
    for h in steps:
        motion = integrate(system, METHOD, 2.0, h, output_every=4).body("top")
        axis = np.array([rotation_matrix(p)[:, 2] for p in motion.p])
        nutation = np.abs(np.arccos(axis[:, 2]) - theta).max()
        turned = np.unwrap(np.arctan2(axis[:, 0], -axis[:, 1]))
        errors.append([nutation, np.abs(turned - rate * motion.t).max()])
    assert max(errors[-1]) < 1e-3
    for column in np.array(errors).T:
        assert abs(slope(steps, column) - 2) < 0.15


def test_physical_pendulum_has_the_period_of_the_elliptic_integral():
    m, length, g, J, amplitude = 2.0, 0.7, 9.81, 0.15, 2.0
    body = RigidBody("bob", m, np.diag([0.1, J, 0.1]), center_of_mass=(0, 0, -length),
                     orientation=euler_parameters_of_rotation_vector(np.array([0, amplitude, 0])))  # fmt: skip
    system = System([body], [RevoluteJoint("pin", GROUND, Marker("bob"), axis=(0, 1, 0))], [Gravity((0, 0, -g))])
    omega_0 = np.sqrt(m * g * length / (J + m * length**2))
    period = 4 * ellipk(np.sin(amplitude / 2) ** 2) / omega_0
    motion = integrate(system, METHOD, 1.1 * period, period / 8000)
    rate = motion.body("bob").omega_B[:, 1]
    late = np.flatnonzero((motion.t[:-1] > 0.6 * period) & (rate[:-1] * rate[1:] <= 0))[0]
    zero = motion.t[late] - rate[late] * (motion.t[late + 1] - motion.t[late]) / (rate[late + 1] - rate[late])
    assert_allclose(zero, period, rtol=1e-6)
    assert_allclose(motion.reaction("pin").moment[:, 1], 0, rtol=0, atol=1e-9)  # none about the axis


@pytest.fixture(scope="module")
def double_pendulum():
    """Return the system and t -> (angles, rates) of a planar double pendulum by DOP853."""
    m, length, J, g = np.array([1.0, 0.6]), np.array([0.8, 0.5]), np.array([0.06, 0.02]), 9.81
    half = length / 2

    def rates(_, x):
        a, b, da, db = x
        c, s = np.cos(a - b), np.sin(a - b)
        M = np.array([
            [J[0] + m[0] * half[0] ** 2 + m[1] * length[0] ** 2, m[1] * length[0] * half[1] * c],
            [m[1] * length[0] * half[1] * c, J[1] + m[1] * half[1] ** 2],
        ])  # fmt: skip
        f = -np.array([
            m[1] * length[0] * half[1] * s * db**2 + (m[0] * half[0] + m[1] * length[0]) * g * np.sin(a),
            -m[1] * length[0] * half[1] * s * da**2 + m[1] * half[1] * g * np.sin(b),
        ])  # fmt: skip
        return [da, db, *np.linalg.solve(M, f)]

    start = np.array([1.2, -0.4, 0.5, -1.0])
    solution = solve_ivp(rates, (0, 1.5), start, method="DOP853", rtol=1e-12, atol=1e-12, dense_output=True)
    # angles from -z towards -x... a rotation by +a about y takes -z to (-sin a, 0, -cos a)
    bodies = []
    joint, velocity = np.zeros(3), np.zeros(3)
    for k, (angle, rate) in enumerate(((start[0], start[2]), (start[1], start[3]))):
        turn = np.array([0, angle, 0])
        bodies.append(RigidBody(
            f"link{k}", m[k], np.diag([0.5 * J[k], J[k], 0.6 * J[k]]), center_of_mass=(0, 0, -half[k]), position=joint,
            orientation=euler_parameters_of_rotation_vector(turn), omega_B=(0, rate, 0),
                velocity=velocity,
        ))  # fmt: skip
        arm = rotation_exp(turn) @ [0, 0, -length[k]]
        joint, velocity = joint + arm, velocity + np.cross([0, rate, 0], arm)
    tip = Marker("link0", position=(0, 0, -length[0]))
    joints = [RevoluteJoint("upper", GROUND, Marker("link0"), axis=(0, 1, 0)),
              RevoluteJoint("lower", tip, Marker("link1"), axis=(0, 1, 0))]  # fmt: skip
    return System(bodies, joints, [Gravity((0, 0, -g))]), solution.sol


def test_double_pendulum_moves_as_in_minimal_coordinates(double_pendulum):
    system, exact = double_pendulum
    steps, errors = np.array([4e-3, 2e-3, 1e-3, 5e-4]), []
    for h in steps:
        motion = integrate(system, METHOD, 1.5, h)
        found = np.array([motion.body(name).omega_B[:, 1] for name in ("link0", "link1")])
        errors.append(np.abs(found - exact(motion.t)[2:]).max())
    assert errors[-1] < 1e-3
    assert abs(slope(steps, errors) - 2) < 0.15


def test_mass_on_a_spring_and_damper_follows_the_damped_oscillation():
    m, k, c, x0 = 2.0, 50.0, 3.0, 0.1
    body = RigidBody("mass", m, np.eye(3), position=(1.0 + x0, 0, 0))
    spring = SpringDamper("spring", Marker(GROUND), Marker("mass"), k, c, free_length=1.0)
    motion = integrate(System([body], forces=[spring]), METHOD, 2.0, 1e-3)
    delta = c / (2 * m)
    omega = np.sqrt(k / m - delta**2)
    t = motion.t
    exact = x0 * np.exp(-delta * t) * (np.cos(omega * t) + delta / omega * np.sin(omega * t))
    assert_allclose(motion.body("mass").r[:, 0] - 1.0, exact, rtol=0, atol=1e-6)
    force = motion.reaction("spring").force[:, 0]  # on marker A, the ground: a tension pulls it towards the mass
    assert_allclose(force, k * exact + c * motion.body("mass").v[:, 0], rtol=0, atol=1e-4)
    assert_allclose(motion.energies.balance, motion.energies.balance[0], rtol=0, atol=1e-5)


def test_follower_torque_spins_up_about_the_body_axis_and_dead_force_accelerates():
    body = RigidBody(
        "disc", 2.0, np.diag([1.0, 1.0, 0.5]), orientation=euler_parameters_of_rotation_vector([0.3, 0, 0])
    )
    forces = [PointForce("motor", Marker("disc"), torque=(0, 0, 0.2), is_follower=True),
              PointForce("push", Marker("disc"), force=(1.0, 0.0, 0.0))]  # fmt: skip
    motion = integrate(System([body], forces=forces), METHOD, 1.0, 1e-3)
    t = motion.t
    assert_allclose(motion.body("disc").omega_B[:, 2], 0.4 * t, rtol=0, atol=1e-12)
    assert_allclose(motion.body("disc").r[:, 0], 0.25 * t**2, rtol=0, atol=1e-9)
    assert_allclose(motion.energies.balance, 0, rtol=0, atol=1e-9)


def test_bodies_welded_together_move_as_one():
    """Two bodies held by a fixed joint, placed at odd angles, fall and spin as their union."""
    turn = euler_parameters_of_rotation_vector([0.4, -0.3, 0.8])
    first = RigidBody("first", 1.0, np.diag([0.2, 0.3, 0.4]), omega_B=(1.0, 2.0, -1.0))
    R = rotation_matrix(turn)
    second = RigidBody("second", 0.5, np.diag([0.1, 0.15, 0.2]), position=(0.6, 0.1, 0), orientation=turn,
                       omega_B=R.T @ [1.0, 2.0, -1.0], velocity=np.cross([1.0, 2.0, -1.0], [0.6, 0.1, 0]))  # fmt: skip
    weld = FixedJoint("weld", Marker("first", position=(0.3, 0.2, 0)), "second")
    motion = integrate(System([first, second], [weld]), METHOD, 1.0, 1e-3)
    c = np.array([0.6, 0.1, 0]) * 0.5 / 1.5
    J = np.zeros((3, 3))
    for mass, inertia, arm in ((1.0, first.inertia, -c), (0.5, R @ second.inertia @ R.T, np.array([0.6, 0.1, 0]) - c)):
        J += inertia + mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    union = RigidBody("union", 1.5, J, center_of_mass=c, omega_B=(1.0, 2.0, -1.0))
    alone = integrate(System([union]), METHOD, 1.0, 1e-3)
    assert_allclose(motion.body("first").r, alone.body("union").r, rtol=0, atol=1e-6)
    assert_allclose(motion.body("first").p, alone.body("union").p, rtol=0, atol=1e-6)
    assert motion.drift("weld").angle.max() < 1e-13
