"""Joints closed the wrong way round are told, not moved on with."""

import numpy as np
import pytest

from floatframe import GROUND, FixedJoint, Marker, PrismaticJoint, RevoluteJoint, RigidBody, System
from floatframe.analyses import consistent_state
from floatframe.errors import ModelError
from floatframe.model.rotations import euler_parameters_of_rotation_vector


def body(turn):
    return RigidBody(
        "body", 1.0, np.diag([1.0, 1.5, 2.0]), orientation=euler_parameters_of_rotation_vector(np.array(turn))
    )


@pytest.mark.parametrize("axis", np.eye(3).tolist(), ids="xyz")
def test_a_fixed_orientation_also_vanishes_at_half_a_turn_and_this_is_told(axis):
    joint = FixedJoint("weld", Marker(GROUND), Marker("body"), rotation=np.eye(3))
    consistent_state(System([body(0.3 * np.array(axis))], [joint]))  # near by it is turned back
    with pytest.raises(ModelError, match="joint 'weld' is closed half a turn away from its orientation"):
        consistent_state(System([body(np.pi * np.array(axis))], [joint]))


def test_a_third_of_a_turn_about_the_diagonal_is_told_too():
    joint = FixedJoint("weld", Marker(GROUND), Marker("body"), rotation=np.eye(3))
    third = 2 * np.pi / 3 * np.ones(3) / np.sqrt(3)
    told = 0
    for sense in (1.0, -1.0):
        try:
            consistent_state(System([body(sense * third)], [joint]))
        except ModelError as error:
            told += "a third of a turn away" in str(error)
    assert told == 1  # one sense fulfils the equations, from the other they lead back


def test_an_axis_given_the_other_way_round_is_told():
    with pytest.raises(ModelError, match="joint 'hinge' is closed half a turn away"):
        consistent_state(System([body((0.0, 0.0, 0.3))], [
            RevoluteJoint("hinge", Marker(GROUND), Marker("body"), axis=(0, 0, 1), axis_b=(0, 0, -1))]))  # fmt: skip


def test_joints_as_placed_are_never_told():
    for turn in ((0.0, 0.0, 0.0), (np.pi, 0.0, 0.0), (1.0, 2.0, 0.5)):
        joint = PrismaticJoint("guide", Marker(GROUND), Marker("body"), axis=(1.0, 0.0, 0.0))
        consistent_state(System([body(turn)], [joint]))
