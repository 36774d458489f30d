"""Systems, bodies and helpers that several tests share: kinematics, runs."""

import numpy as np
import pytest

from floatframe import (
    GROUND,
    FixedJoint,
    JointForce,
    Marker,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    SphericalJoint,
    System,
)
from floatframe.joints import ConstantOrientation, CylindricalJoint, PlanarJoint, ScrewJoint, UniversalJoint
from floatframe.model.functions.time_functions import harmonic
from tests.floatframe.engine.tree.mechanisms import DOWN


def rubbed_block():
    """A block with an arm, pushed along a rail that rubs by its normal force."""
    block = RigidBody("block", 2.0, np.eye(3), velocity=(1.0, 0.0, 0.0))
    arm = RigidBody("arm", 0.5, 0.1 * np.eye(3), position=(0.3, 0.0, 0.0), velocity=(1.0, 0.0, 0.0))
    joints = [
        PrismaticJoint("rail", GROUND, Marker("block"), axis=(1.0, 0.0, 0.0)),
        RevoluteJoint("hinge", Marker("block"), Marker("arm", position=(-0.3, 0.0, 0.0))),
    ]
    friction = JointForce("rub", "rail", "distance", friction_coefficient=0.2, friction_speed=1e-2)
    return System([block, arm], joints, [DOWN, friction])


AXIS = (0.2, 1.0, 0.3)
DRIVE = harmonic(0.3, 2.0, 0.4, 0.1)
SLOW_DRIVE = harmonic(0.03, 2.0, 0.4)
JOINTS = {  # joint, whether its points may be apart, number of coordinates
    "fixed": (lambda *ends: FixedJoint("j", *ends), False, 0),
    "revolute": (lambda *ends: RevoluteJoint("j", *ends, axis=AXIS), False, 1),
    "prismatic": (lambda *ends: PrismaticJoint("j", *ends, axis=AXIS), True, 1),
    "cylindrical": (lambda *ends: CylindricalJoint("j", *ends, axis=AXIS), True, 2),
    "screw": (lambda *ends: ScrewJoint("j", *ends, axis=AXIS, lead=0.7), False, 1),
    "universal": (lambda *ends: UniversalJoint("j", *ends, axis=(1, 0.1, 0), axis_b=(0, 1, 0)), False, 2),
    "planar": (lambda *ends: PlanarJoint("j", *ends, axis=AXIS), True, 3),
    "spherical": (lambda *ends: SphericalJoint("j", *ends), False, 3),
    "constant orientation": (lambda *ends: ConstantOrientation("j", *ends), True, 3),
}
DRIVEN = {
    "revolute driven": (lambda *ends: RevoluteJoint("j", *ends, axis=AXIS, motions={"angle": DRIVE}), False, 0),
    "planar driven": (
        lambda *ends: PlanarJoint("j", *ends, axis=AXIS, motions={"first": DRIVE, "angle": DRIVE}),
        True,
        1,
    ),
    "universal driven": (
        lambda *ends: UniversalJoint("j", *ends, axis=(1, 0.1, 0), motions={"angle_b": DRIVE}),
        False,
        1,
    ),
    "screw driven": (
        lambda *ends: ScrewJoint("j", *ends, axis=AXIS, lead=0.7, motions={"distance": SLOW_DRIVE}),
        False,
        0,
    ),
}
CASES = [
    pytest.param(*case, swap, id=f"{name}{' swapped' if swap else ''}")
    for name, case in (JOINTS | DRIVEN).items()
    for swap in (False, True)
]
