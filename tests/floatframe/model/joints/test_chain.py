"""Flexible bodies joined at interfaces that deflect and turn with the modes."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import (
    GROUND,
    FixedJoint,
    FlexibleBody,
    GeneralizedAlpha,
    Gravity,
    Marker,
    RevoluteJoint,
    SpringDamper,
    System,
    integrate,
)
from floatframe.model.rotations import rotation_exp, rotation_matrix
from tests.floatframe.orders import slope
from tests.floatframe.point_masses import random_point_masses, reduced_body, stiffness

STEPS = np.array([4e-3, 2e-3, 1e-3, 5e-4])


def chain():
    """Two soft bodies welded together, on a hinge, with a third hinged to their end; a spring to the ground."""
    soft = reduced_body(random_point_masses(3, 3), stiffness(3, omega=8.0), rotation_scale=0.6)
    other = reduced_body(random_point_masses(2, 5), stiffness(2, omega=9.0), rotation_scale=0.6)
    first, last = (soft.interface(name).position for name in ("end_b", "end_a"))
    second = last - first - other.interface("end_b").position
    third = second + other.interface("end_a").position - first
    bodies = [
        FlexibleBody("first", soft, position=-first),
        FlexibleBody("second", other, position=second),
        FlexibleBody("third", soft, position=third, omega_B=(0.0, 0.0, 1.0)),
    ]
    joints = [
        RevoluteJoint("hinge", GROUND, Marker("first", "end_b"), axis=(0, 1, 0.2)),
        FixedJoint("weld", Marker("first", "end_a"), Marker("second", "end_b")),
        RevoluteJoint("knee", Marker("second", "end_a"), Marker("third", "end_b"), axis=(0.1, 0.3, 1)),
    ]
    spring = SpringDamper("spring", Marker("third", "end_a"), Marker(GROUND, position=(1.0, 2.0, 1.0)), 5.0)
    return System(bodies, joints, [Gravity((0, 0, -9.81)), spring])


@pytest.fixture(scope="module")
def motions():
    return [integrate(chain(), GeneralizedAlpha(0.9, 1e-10), 0.8, h, output_every=4) for h in STEPS]


def test_energy_is_kept_to_second_order_by_joints_that_carry_moments(motions):
    """The wrench of a joint does the work that its rows say: exact Jacobians of the elastic rotations of markers."""
    errors = [np.abs(m.energies.balance - m.energies.balance[0]).max() for m in motions]
    assert np.abs(motions[-1].body("first").q).max() > 0.1
    assert errors[-1] < 1e-4 * np.ptp(motions[-1].energies.kinetic)
    assert abs(slope(STEPS, errors) - 2) < 0.15


def test_joints_stay_closed_in_position_and_angle(motions):
    for name in ("hinge", "weld", "knee"):
        assert motions[0].drift(name).distance.max() < 1e-12
        assert motions[0].drift(name).angle.max() < 1e-12


def test_hinge_axis_of_the_deformed_marker_keeps_its_direction(motions):
    """Independent of the rows: the axis on the body, carried by frame and elastic rotation, lies in the ground."""
    system, motion = chain(), motions[0]
    body = motion.body("first")
    axis = np.array([0, 1, 0.2]) / np.linalg.norm([0, 1, 0.2])
    Psi_r = system.bodies[0].reduced.interface("end_b").Psi[3:]
    assert np.abs(body.q @ Psi_r.T).max() > 0.05  # it does turn in the body
    for k in range(0, len(motion.t), 20):
        R = rotation_matrix(body.p[k]) @ rotation_exp(Psi_r @ body.q[k])
        assert_allclose(R @ axis, axis, rtol=0, atol=1e-12)


def test_reaction_of_the_hinge_balances_weight_spring_and_momentum(motions):
    """d(momentum)/dt = weight + spring + reaction, momentum differentiated from its own output."""
    motion = motions[-1]
    momentum, t = motion.linear_momentum, motion.t
    rate = (momentum[2:] - momentum[:-2]) / (t[2:] - t[:-2])[:, None]
    mass = sum(body.reduced.moments.m for body in chain().bodies)
    forces = mass * np.array([0, 0, -9.81]) + motion.reaction("spring").force - motion.reaction("hinge").force
    assert_allclose(rate, forces[1:-1], rtol=0, atol=2e-3 * np.abs(forces).max())
