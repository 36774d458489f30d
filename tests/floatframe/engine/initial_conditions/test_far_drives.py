"""Drives of angles far from where their bodies were placed begin at the prescribed angle, not half a turn from it."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import GROUND, Marker, RevoluteJoint, RigidBody, System
from floatframe.analyses import consistent_state
from floatframe.joints import CylindricalJoint, DistanceJoint, UniversalJoint
from floatframe.model.rotations import rotation_matrix

LINK = np.diag([0.1, 0.2, 0.3])
TIP = np.array([1.0, 0.0, 0.0])


def tip_of(system, body=0):
    made = consistent_state(system)
    return made.state.r[body] + rotation_matrix(made.state.p[body]) @ TIP


@pytest.mark.parametrize("angle", [0.3, 1.4, 1.7, 2.0, 3.0, np.pi, -2.5, 4.0, -np.pi, 9.0])
@pytest.mark.parametrize("joint", [RevoluteJoint, CylindricalJoint])
def test_a_link_placed_along_x_begins_at_its_prescribed_angle(joint, angle):
    drive = joint("pin", Marker(GROUND), Marker("link"), axis=(0, 0, 1), motions={"angle": angle})
    tip = tip_of(System([RigidBody("link", 1.0, LINK)], [drive]))
    assert_allclose(tip, [np.cos(angle), np.sin(angle), 0.0], atol=1e-11)


@pytest.mark.parametrize("angle", [0.5, 2.2, -2.8])
def test_an_angle_about_an_axis_of_b_too(angle):
    markers = Marker(GROUND), Marker("link")
    cross = UniversalJoint("cross", *markers, axis=(0, 0, 1), axis_b=(0, 1, 0), motions={
        "angle": 0.4, "angle_b": angle})  # fmt: skip
    made = consistent_state(System([RigidBody("link", 1.0, LINK)], [cross]))
    a, b = np.cos, np.sin
    turn_z = np.array([[a(0.4), -b(0.4), 0], [b(0.4), a(0.4), 0], [0, 0, 1]])
    turn_y = np.array([[a(angle), 0, b(angle)], [0, 1, 0], [-b(angle), 0, a(angle)]])
    assert_allclose(rotation_matrix(made.state.p[0]), turn_z @ turn_y, atol=1e-11)


def test_two_drives_in_a_chain_are_led_together():
    links = [RigidBody("first", 1.0, LINK), RigidBody("second", 1.0, LINK, position=(1, 0, 0))]
    joints = [
        RevoluteJoint("a", Marker(GROUND), Marker("first"), axis=(0, 0, 1), motions={"angle": 2.5}),
        RevoluteJoint("b", Marker("first", position=(1, 0, 0)), Marker("second"), axis=(0, 0, 1),
                      motions={"angle": -3.0}),
    ]  # fmt: skip
    tip = tip_of(System(links, joints), 1)
    assert_allclose(tip, [np.cos(2.5) + np.cos(-0.5), np.sin(2.5) + np.sin(-0.5), 0.0], atol=1e-11)


@pytest.mark.parametrize("angle", [0.8, 2.6, -2.0])
def test_a_loop_is_led_to_the_angle_of_its_crank(angle):
    """Crank-rocker of lengths 1, 3, 2.5 on a base of 3.2; the pin of the rocker stays on its side of the base."""
    bodies = [
        RigidBody("crank", 1.0, LINK),
        RigidBody("rocker", 1.0, LINK, position=(3.2, 0.0, 0.0), orientation=(np.cos(0.9), 0, 0, np.sin(0.9))),
    ]
    crank, rocker = Marker("crank", position=(1, 0, 0)), Marker("rocker", position=(2.5, 0, 0))
    joints = [
        RevoluteJoint("a", Marker(GROUND), Marker("crank"), axis=(0, 0, 1), motions={"angle": angle}),
        RevoluteJoint("d", Marker(GROUND, position=(3.2, 0, 0)), Marker("rocker"), axis=(0, 0, 1)),
        DistanceJoint("coupler", crank, rocker, distance=3.0),
    ]
    made = consistent_state(System(bodies, joints))
    first = made.state.r[0] + rotation_matrix(made.state.p[0]) @ TIP
    second = made.state.r[1] + rotation_matrix(made.state.p[1]) @ (2.5 * TIP)
    assert_allclose(first, [np.cos(angle), np.sin(angle), 0.0], atol=1e-10)
    assert_allclose(np.linalg.norm(second - first), 3.0, rtol=1e-10)
    assert second[1] > 0
