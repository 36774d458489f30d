"""A soft flexible pendulum on a spherical joint against an independent solution in minimal coordinates.

With the joint at particle P, which moves by phi_P q in the body, the joint is the origin of coordinates in which
particle p lies at y_p = c_p - c_P + (phi_p - phi_P) q: rotation and q remain, without constraint. The sums over the
particles are taken as they stand, and SciPy's DOP853 integrates.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from floatframe import GROUND, FlexibleBody, GeneralizedAlpha, Gravity, Marker, SphericalJoint, System, integrate
from floatframe.model.rotations import euler_parameter_rates, rotation_matrix
from tests.floatframe.orders import slope
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffness

STEPS = np.array([4e-3, 2e-3, 1e-3, 5e-4])
T_END = 1.0
N_Q = 3
G = np.array([1.0, -0.5, -9.81])
OMEGA = np.array([0.5, 1.0, -0.8])

POINTS = random_point_masses(N_Q, 11)
K = stiffness(N_Q, omega=3.5)
D = 0.02 * stiffness(N_Q, 5, omega=3.5)
REDUCED = reduced_body(POINTS, K, D=D, name="pendulum")


def accelerations(p, q, omega, q_dot):
    """Return alpha, q_ddot and the force of the joint on the ground, in minimal coordinates."""
    m = POINTS.m
    pin = int(np.argmin(POINTS.c[:, 0]))  # interface end_b
    y = POINTS.c - POINTS.c[pin] + (POINTS.phi - POINTS.phi[pin]) @ q
    phi = POINTS.phi - POINTS.phi[pin]
    R = rotation_matrix(p)
    # a_p = alpha × y_p + phi_p q_ddot + known
    known = np.cross(omega, np.cross(omega, y)) + 2 * np.cross(omega, phi @ q_dot) - R.T @ G
    columns = np.concatenate([np.cross(np.eye(3)[:, None], y[None]), np.moveaxis(phi, 2, 0)])  # (3 + n, p, 3)
    matrix = np.einsum("p,apx,bpx->ab", m, columns, columns)
    right = -np.einsum("p,apx,px->a", m, columns, known)
    right[3:] -= K @ q + D @ q_dot
    u_dot = np.linalg.solve(matrix, right)
    a = np.einsum("a,apx->px", u_dot, columns) + known
    return u_dot[:3], u_dot[3:], R @ (-(m @ a))


@pytest.fixture(scope="module")
def exact():
    """Return t -> (p, q, omega, q_dot, force on the ground)."""

    def rates(_, x):
        p, q, omega, q_dot = x[:4] / np.linalg.norm(x[:4]), x[4 : 4 + N_Q], x[4 + N_Q : 7 + N_Q], x[7 + N_Q :]
        alpha, q_ddot, _ = accelerations(p, q, omega, q_dot)
        return np.concatenate([euler_parameter_rates(p, omega), q_dot, alpha, q_ddot])

    start = np.concatenate([[1.0, 0, 0, 0], np.zeros(N_Q), OMEGA, np.zeros(N_Q)])
    solution = solve_ivp(rates, (0, T_END), start, method="DOP853", rtol=1e-12, atol=1e-12, dense_output=True)

    def at(t):
        x = solution.sol(t)
        p = x[:4] / np.linalg.norm(x[:4])
        q, omega, q_dot = x[4 : 4 + N_Q], x[4 + N_Q : 7 + N_Q], x[7 + N_Q :]
        return p, q, omega, q_dot, accelerations(p, q, omega, q_dot)[2]

    return at


def pendulum():
    pin = POINTS.c[int(np.argmin(POINTS.c[:, 0]))]
    body = FlexibleBody("body", REDUCED, position=-pin, omega_B=OMEGA, velocity=np.cross(pin, OMEGA))
    return System([body], [SphericalJoint("pin", GROUND, Marker("body", "end_b"))], [Gravity(G)])


@pytest.fixture(scope="module", params=[0.0, 0.8], ids=["rho_inf=0", "rho_inf=0.8"])
def motions(request):
    return [integrate(pendulum(), GeneralizedAlpha(request.param, 1e-10), T_END, h) for h in STEPS]


def errors_of(motion, exact):
    """Return the largest errors of rotation, q, omega, q_dot and the force on the ground over time."""
    body, force = motion.body("body"), motion.reaction("pin").force
    worst = np.zeros(5)
    for k in (*range(10), *range(10, len(motion.t), len(motion.t) // 50)):  # the first steps too: no kick there
        p, q, omega, q_dot, reaction = exact(motion.t[k])
        found = (rotation_matrix(body.p[k]), body.q[k], body.omega_B[k], body.q_dot[k], force[k])
        for j, (a, b) in enumerate(zip(found, (rotation_matrix(p), q, omega, q_dot, reaction), strict=True)):
            worst[j] = max(worst[j], np.abs(a - b).max())
    return worst


def test_start_has_the_accelerations_and_the_reaction_of_the_minimal_coordinates(motions):
    alpha, q_ddot, force = accelerations(np.array([1.0, 0, 0, 0]), np.zeros(N_Q), OMEGA, np.zeros(N_Q))
    body = motions[0].body("body")
    scale = np.abs(np.concatenate([alpha, q_ddot, force])).max()
    assert_allclose(body.omega_B_dot[0], alpha, rtol=0, atol=1e-11 * scale)
    assert_allclose(body.q_ddot[0], q_ddot, rtol=0, atol=1e-11 * scale)
    assert_allclose(motions[0].reaction("pin").force[0], force, rtol=0, atol=1e-11 * scale)


def test_motion_is_that_of_the_minimal_coordinates(motions, exact):
    """Deflections reach a tenth of the length: no term of second order is small here."""
    assert np.abs(motions[-1].body("body").q).max() > 0.3
    errors = errors_of(motions[-1], exact)
    assert errors[0] < 1e-5
    assert errors[1] < 1e-5
    assert errors[4] < 1e-3


def test_positions_velocities_and_reactions_converge_with_second_order(motions, exact):
    errors = np.array([errors_of(motion, exact) for motion in motions])
    for column, name in enumerate(("rotation", "q", "omega", "q_dot", "force on the ground")):
        assert abs(slope(STEPS, errors[:, column]) - 2) < 0.15, (name, errors[:, column])


def test_joint_stays_closed_to_roundoff_and_its_velocity_to_third_order(motions):
    """Velocities are held too, by one back substitution a step: what it leaves is of third order, and small."""
    distance = [m.drift("pin").distance.max() for m in motions]
    assert max(distance) < 1e-13
    rates = np.array([m.drift("pin").distance_rate.max() for m in motions])
    assert (rates < STEPS**3).all()


def test_without_stabilisation_velocities_of_the_joint_close_to_second_order():
    motions = [integrate(pendulum(), GeneralizedAlpha(0.8, 1e-10, stabilized=False), 0.2, h) for h in STEPS[:3]]
    rates = [m.drift("pin").distance_rate.max() for m in motions]
    assert abs(slope(STEPS[:3], rates) - 2) < 0.15


def test_energy_balance_closes_with_second_order(motions):
    errors = [np.abs(m.energies.balance - m.energies.balance[0]).max() for m in motions]
    assert motions[-1].energies.dissipated[-1] > 0.01
    assert abs(slope(STEPS, errors) - 2) < 0.15
