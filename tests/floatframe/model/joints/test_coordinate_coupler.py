"""Coordinate couplers: gears, racks, differentials."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import (
    GROUND,
    GeneralizedAlpha,
    Gravity,
    JointForce,
    Marker,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    System,
    integrate,
)
from floatframe.analyses import mobility
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.initial import consistent_motion
from floatframe.errors import ModelError
from floatframe.joints import CoordinateCoupler, JointCoordinate
from floatframe.model.functions.time_functions import harmonic, polynomial_of_time
from floatframe.model.rotations import euler_parameters, rotation_exp
from floatframe.results.coordinate_elements import coupler_motion
from tests.floatframe.finite_differences import assert_tangent_is_exact
from tests.floatframe.model.joints.examples import coupled_pairs, three_bodies, wheels

METHOD = GeneralizedAlpha(0.9, 1e-11)


@pytest.mark.parametrize("case", coupled_pairs())
def test_newton_matrix_is_the_derivative_of_the_residual(case):
    joints, terms = coupled_pairs()[case]
    coupler = CoordinateCoupler("c", terms, harmonic(0.3, 2.0, 0.4, 0.1))
    assert_tangent_is_exact(three_bodies(joints, coupler))


def test_a_pair_of_gears_turns_as_one_reduced_inertia():
    """phi_1 + r phi_2 = 0: (J_1 + J_2/r²) phi_1'' = T; the gear torque on wheel 1 is -J_2/r² phi_1''; many turns."""
    ratio, torque = np.pi / 2, 7.0
    system = wheels(ratio, torque=torque)
    motion = integrate(system, METHOD, 3.0, 5e-3)
    alpha = torque / (0.7 + 0.3 / ratio**2)
    assert_allclose(motion.body("a").omega_B[:, 2], alpha * motion.t, rtol=0, atol=1e-6)
    assert_allclose(motion.body("b").omega_B[:, 2], -alpha / ratio * motion.t, rtol=0, atol=1e-6)
    signals = coupler_motion(system, motion, "gear")
    assert_allclose(signals.value[:, 0], alpha * motion.t**2 / 2, rtol=0, atol=2e-4)
    assert signals.value[-1, 0] > 4 * np.pi
    assert_allclose(signals.force[:, 0], -0.3 / ratio**2 * alpha, rtol=1e-6, atol=0)
    assert_allclose(signals.force[:, 1], ratio * signals.force[:, 0], rtol=1e-12, atol=0)
    balance = motion.energies.balance
    assert np.abs(balance - balance[0]).max() < 1e-6 * motion.energies.kinetic.max()


def test_a_fast_wheel_turns_more_than_half_a_turn_in_a_step():
    system = wheels(0.5)
    spun = System([RigidBody("a", 1.0, np.diag([0.5, 0.5, 0.7]), omega_B=(0, 0, 700.0)), system.bodies[1]],
                  [*system.joints, *system.couplers])  # fmt: skip
    motion = integrate(spun, METHOD, 0.2, 1e-2)
    assert_allclose(motion.body("b").omega_B[:, 2], -2 * motion.body("a").omega_B[:, 2], rtol=1e-9, atol=0)
    angle = coupler_motion(spun, motion, "gear").value
    assert_allclose(angle[:, 0], motion.body("a").omega_B[0, 2] * motion.t, rtol=0, atol=1e-6)


def test_a_rack_falls_as_if_the_pinion_added_to_its_mass():
    """x = r phi: (m + J/r²) x'' = m g."""
    r, m, J, g = 0.2, 3.0, 0.05, 9.81
    rack, pinion = RigidBody("rack", m, np.eye(3)), RigidBody("pinion", 1.0, np.diag([0.1, 0.1, J]))
    joints = [
        PrismaticJoint("guide", GROUND, Marker("rack"), axis=(0, 0, -1)),
        RevoluteJoint("hub", GROUND, Marker("pinion"), axis=(0, 0, 1)),
        CoordinateCoupler("mesh", [(JointCoordinate("guide", "distance"), 1.0), (JointCoordinate("hub", "angle"), -r)]),
    ]
    system = System([rack, pinion], joints, [Gravity((0, 0, -g))])
    motion = integrate(system, METHOD, 1.0, 2e-3)
    acceleration = m * g / (m + J / r**2)
    assert_allclose(motion.body("rack").r[:, 2], -acceleration * motion.t**2 / 2, rtol=0, atol=1e-5)
    assert_allclose(coupler_motion(system, motion, "mesh").force[:, 0], acceleration * m - m * g, rtol=1e-6, atol=0)


def test_a_differential_shares_the_torque():
    """phi_1 + phi_2 - 2 phi_0 = 0: both wheels get half of the torque of the cage."""
    names, inertias = "abc", (0.2, 0.3, 0.5)
    bodies = [RigidBody(n, 1.0, np.diag([0.5, 0.5, J])) for n, J in zip(names, inertias, strict=True)]
    hubs = [RevoluteJoint(f"hub {n}", GROUND, Marker(n)) for n in names]
    terms = [(JointCoordinate(f"hub {n}", "angle"), f) for n, f in zip(names, (-2.0, 1.0, 1.0), strict=True)]
    forces = [JointForce("motor", "hub a", "angle", preload=3.0), JointForce("brake", "hub b", "angle", damping=0.4)]
    system = System(bodies, [*hubs, CoordinateCoupler("differential", terms)], forces)
    motion = integrate(system, METHOD, 0.5, 1e-3)
    rates = [motion.body(n).omega_B[:, 2] for n in names]
    assert_allclose(rates[1] + rates[2], 2 * rates[0], rtol=0, atol=1e-9)
    force = coupler_motion(system, motion, "differential").force
    assert_allclose(force[:, 1], force[:, 2], rtol=1e-12, atol=0)
    assert_allclose(force[:, 0], -2 * force[:, 1], rtol=1e-12, atol=0)
    assert mobility(system).n_freedoms == 2


def test_work_of_a_coupler_that_moves_stands_in_the_balance():
    system = wheels(0.5, torque=0.7)
    gear = CoordinateCoupler("gear", system.couplers[0].terms, polynomial_of_time([0.0, 0.0, 0.4, 0.3]))
    motion = integrate(System(system.bodies, [*system.joints, gear], system.forces), METHOD, 1.0, 1e-3)
    balance = motion.energies.balance
    assert np.abs(balance - balance[0]).max() < 1e-5 * motion.energies.kinetic.max()


@pytest.mark.parametrize("rate", [0.0, 0.6])
def test_a_coupler_whose_constant_moves_starts_with_the_force_of_its_acceleration(rate):
    """phi_a + r phi_b = c(t), J_a phi_a'' = T + lam, J_b phi_b'' = r lam: lam = (c'' - T/J_a)/(1/J_a + r²/J_b)."""
    r, T, J_a, J_b = -0.5, 0.7, 0.7, 0.3
    c = polynomial_of_time([0.0, rate, 0.4, 0.3])
    system = wheels(r, torque=T)
    bodies = [replace(system.bodies[0], omega_B=(0, 0, rate)), system.bodies[1]]
    gear = CoordinateCoupler("gear", system.couplers[0].terms, c)
    system = System(bodies, [*system.joints, gear], system.forces)
    motion = integrate(system, METHOD, 4e-3, 1e-3)
    lam = (c(0.0, 2) - T / J_a) / (1 / J_a + r**2 / J_b)
    assert_allclose(coupler_motion(system, motion, "gear").force[0], [lam, r * lam], rtol=1e-9)
    start = consistent_motion(system)
    found = start.u_dot[[5, 11]]
    assert_allclose(found, [(T + lam) / J_a, r * lam / J_b], rtol=1e-9)


def test_a_coupler_on_a_turntable_starts_with_the_force_of_its_centripetal_acceleration():
    """A block slides out on a table that turns with W and turns a pulley on the axle, s = r phi.

    (m + J/r²) s'' = m s W², so that the coupler pulls with -J/r² s'', also in the turned axes of the table.
    """
    W, u, at, r, m, J = 7.0, 0.6, 0.8, 0.05, 2.0, 0.01
    R, place = rotation_exp(np.array([0.4, -0.7, 0.3])), np.array([3.0, -2.0, 5.0])
    x, y, z = R.T
    turned = euler_parameters(R)
    block = RigidBody("block", m, 0.02 * np.eye(3), position=place + at * x, orientation=turned,
                      velocity=u * x + at * W * y, omega_B=(0, 0, W))  # fmt: skip
    table = RigidBody("table", 3.0, np.eye(3), position=place, orientation=turned, omega_B=(0, 0, W))
    pulley = RigidBody("pulley", 1.0, J * np.eye(3), position=place, orientation=turned, omega_B=(0, 0, W + u / r))
    joints = [
        RevoluteJoint("axle", Marker(GROUND, position=place), Marker("table"), axis=z,
                      motions={"angle": polynomial_of_time([0.0, W])}),
        PrismaticJoint("guide", Marker("table"), Marker("block"), axis=(1, 0, 0)),
        RevoluteJoint("hub", Marker("table"), Marker("pulley"), axis=(0, 0, 1)),
        CoordinateCoupler("rope", [(JointCoordinate("guide", "distance"), 1.0), (JointCoordinate("hub", "angle"), -r)]),
    ]  # fmt: skip
    start = consistent_motion(System([block, table, pulley], joints))
    s_ddot = m * at * W**2 / (m + J / r**2)
    assert_allclose(start.u_dot[:3], (s_ddot - at * W**2) * x + 2 * W * u * y, rtol=0, atol=1e-9 * at * W**2)
    assert_allclose(start.u_dot[12:18], [0, 0, 0, 0, 0, s_ddot / r], rtol=0, atol=1e-9 * s_ddot / r)


def test_a_coupler_that_repeats_joints_is_named():
    system = wheels(0.5)
    twice = CoordinateCoupler("again", system.couplers[0].terms)
    with pytest.raises(ModelError, match="'again'"):
        integrate(System(system.bodies, [*system.joints, *system.couplers, twice]), METHOD, 0.1, 1e-2)


@pytest.mark.parametrize(
    ("terms", "words"),
    [
        ([(JointCoordinate("hub x", "angle"), 1.0)], "term 1: no joint 'hub x'"),
        ([(JointCoordinate("hub a", "angel"), 1.0)], "no coordinate 'angel'.*angle"),
        ([(JointCoordinate("hub a", "angle"), 0.0)], "coefficient 1: expected a number other than zero"),
        ([("hub a", 1.0)], "term 1: no joint 'hub'"),
        ([], "expected at least one coordinate"),
        ([1.0], "expected pairs"),
    ],
)
def test_impossible_couplers_are_refused(terms, words):
    plain = wheels(1.0)

    def compiled():
        return compiled_system(System(plain.bodies, [*plain.joints, CoordinateCoupler("gear", terms)]))

    with pytest.raises(ModelError, match=words):
        compiled()
