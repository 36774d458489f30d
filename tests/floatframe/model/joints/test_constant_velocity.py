"""Two shafts that turn equally, whatever their angle."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from floatframe import GROUND, GeneralizedAlpha, Marker, PointForce, RevoluteJoint, RigidBody, System, integrate
from floatframe.analyses import consistent_state
from floatframe.errors import ModelError
from floatframe.joints import ConstantVelocityJoint, JointCoordinate, PointOnLine, UniversalJoint
from floatframe.model.functions.time_functions import polynomial_of_time
from floatframe.model.rotations import euler_parameters_of_rotation_vector, rotation_exp, rotation_log, rotation_matrix

ANGLE = 0.7  #: between the shafts [rad]
TILT = np.array([0.3, 0.2, -0.4])  #: of both of them against the ground axes
ALONG = rotation_exp(TILT) @ np.array([1.0, 0.0, 0.0])  #: of the first shaft
BESIDE = rotation_exp(TILT) @ rotation_exp(np.array([0.0, 0.0, ANGLE])) @ np.array([1.0, 0.0, 0.0])
SPEED = 5.0


def two_shafts(make, forces=(), *, spin=0.0):
    """Two shafts with the joint in the ground origin: the first on a hinge, a point of the second on its line."""
    first = euler_parameters_of_rotation_vector(TILT)
    R_2 = rotation_exp(TILT) @ rotation_exp(np.array([0.0, 0.0, ANGLE]))
    bodies = [
        RigidBody("first", 2.0, np.diag([0.3, 0.2, 0.2]), orientation=first, omega_B=(SPEED, 0, 0)),
        RigidBody("second", 1.0, np.diag([0.1, 0.2, 0.2]), position=R_2 @ [1.0, 0, 0],
                  orientation=euler_parameters_of_rotation_vector(rotation_log(R_2)), omega_B=(spin, 0, 0)),
    ]  # fmt: skip
    joints = [
        RevoluteJoint("drive", GROUND, Marker("first"), axis=ALONG,
                      motions={"angle": polynomial_of_time([0.0, SPEED])}),
        make("joint", Marker("first"), Marker("second", position=(-1.0, 0, 0))),
        PointOnLine("rear", Marker(GROUND, position=tuple(BESIDE)), Marker("second"), axis=BESIDE),
    ]  # fmt: skip
    return System(bodies, joints, list(forces))


def constant_velocity(name, a, b):
    return ConstantVelocityJoint(name, a, b, axis=(1, 0, 0), axis_b=(1, 0, 0))


def universal(name, a, b):
    return UniversalJoint(name, a, b, axis=(0, 0, 1), axis_b=(0, 1, 0))


def speed_of_second(motion):
    """Return the angular velocity of the second shaft about its axis, over time."""
    return motion.body("second").omega_B[:, 0]


def test_the_second_shaft_turns_as_fast_as_the_first_at_every_instant():
    motion = integrate(two_shafts(constant_velocity, spin=SPEED), GeneralizedAlpha(0.9, 1e-11), 2.0, 2e-3)
    assert motion.body("first").omega_B[-1, 0] * 2.0 > 6 * np.pi / 2  # some turns
    assert_allclose(speed_of_second(motion), SPEED, rtol=0, atol=1e-8)


def test_a_universal_joint_in_its_place_does_not():
    """The closed form of Cardan's joint: omega_2/omega_1 = cos b/(1 - sin² b cos² phi)."""
    motion = integrate(two_shafts(universal, spin=SPEED), GeneralizedAlpha(0.9, 1e-11), 1.3, 1e-3)  # a full turn
    ratio = speed_of_second(motion) / SPEED
    assert_allclose([ratio.min(), ratio.max()], [np.cos(ANGLE), 1 / np.cos(ANGLE)], rtol=0, atol=2e-3)


def test_the_moment_is_along_the_bisector_and_carries_the_power():
    """M = T/cos(b/2) along it, T the torque of both shafts; from force and moment balance of a light shaft."""
    T = 7.0
    brake = PointForce("brake", Marker("second"), (0, 0, 0), (-T, 0, 0), is_follower=True)
    motion = integrate(two_shafts(constant_velocity, [brake], spin=SPEED), GeneralizedAlpha(0.9, 1e-11), 0.5, 2e-3)
    moment = motion.reaction("joint").moment
    bisector = (ALONG + BESIDE) / np.linalg.norm(ALONG + BESIDE)
    # the second shaft turns steadily about its axis of symmetry, so that the moment about that axis balances T
    assert_allclose(moment, np.tile(-T / np.cos(ANGLE / 2) * bisector, (len(moment), 1)), rtol=0, atol=1e-6 * T)
    drive = JointCoordinate("drive", "angle").measure(two_shafts(constant_velocity, [brake], spin=SPEED), motion)
    assert_allclose(drive.force, T, rtol=0, atol=1e-6 * T)


def test_the_second_shaft_is_the_first_turned_straight_from_axis_to_axis():
    """The rotation vector from the first to the second shaft has no part along either."""
    motion = integrate(two_shafts(constant_velocity, spin=SPEED), GeneralizedAlpha(0.9, 1e-11), 1.0, 2e-3)
    for p_1, p_2 in zip(motion.body("first").p[::50], motion.body("second").p[::50], strict=True):
        vector = rotation_log(rotation_matrix(p_2) @ rotation_matrix(p_1).T)
        assert_allclose(np.linalg.norm(vector), ANGLE, rtol=0, atol=1e-8)
        assert_allclose([vector @ ALONG, vector @ BESIDE], 0, rtol=0, atol=1e-8)


def test_shafts_that_are_nearly_folded_are_refused():
    bodies = [RigidBody(name, 1.0, np.eye(3)) for name in ("first", "second")]
    joint = ConstantVelocityJoint("bent", Marker("first"), Marker("second"), axis=(1, 0, 0), axis_b=(-1, 0.2, 0))
    with pytest.raises(ModelError, match=r"'bent': expected shafts less than 135 degrees .* got 168"):
        consistent_state(System(bodies, [joint]))
