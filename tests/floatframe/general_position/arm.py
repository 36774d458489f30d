"""An arm on a hinge and a block on a slide in it, in general position."""

import numpy as np
from scipy.spatial.transform import Rotation

from floatframe import GROUND, Gravity, JointForce, Marker, PrismaticJoint, RevoluteJoint, RigidBody, System

__all__ = ["PLACE", "R", "arm_with"]

R = Rotation.from_rotvec([0.7, -0.4, 1.1]).as_matrix()
PLACE = np.array([30.0, -20.0, 15.0])


def arm_with(*forces):
    """Return the arm with gravity, a spring and damper with a preload about its hinge, and more forces."""
    places = np.array([0.5, -0.2, 0.4]), np.array([1.1, -0.1, 0.5])
    bodies = [
        RigidBody("arm", 2.0, np.diag([0.1, 0.12, 0.14]), (0.3, 0.05, 0.02), position=places[0]),
        RigidBody("block", 0.7, np.diag([0.02, 0.03, 0.04]), (0.01, 0.02, 0.03), position=places[1]),
    ]
    joints = [
        RevoluteJoint("hinge", Marker(GROUND, position=places[0]), Marker("arm"), axis=(0.6, 0.8, 0)),
        PrismaticJoint("slide", Marker("arm", position=places[1] - places[0]), Marker("block"), axis=(0.8, 0, 0.6)),
    ]
    rub = JointForce("rub", "hinge", "angle", stiffness=60.0, free=0.1, damping=0.3, preload=0.2)
    return System(bodies, joints, [Gravity((0.5, -1.0, -9.81)), rub, *forces])
