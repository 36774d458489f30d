"""Joints, in one file for each family; `JOINTS` is the registry for the system file, `Joint` their base class."""

from floatframe.model.joints.joint import Joint
from floatframe.model.joints.lower_pairs import (
    CylindricalJoint,
    PlanarJoint,
    PrismaticJoint,
    RevoluteJoint,
    ScrewJoint,
    SphericalJoint,
)
from floatframe.model.joints.orientation_joints import (
    ConstantOrientation,
    ConstantVelocityJoint,
    FixedJoint,
    UniversalJoint,
)
from floatframe.model.joints.point_joints import DistanceJoint, PointOnLine, PointOnPlane
from floatframe.model.joints.rolling_disc import RollingDisc
from floatframe.model.joints.sliding import SlidingJoint

__all__ = [
    "JOINTS",
    "ConstantOrientation",
    "ConstantVelocityJoint",
    "CylindricalJoint",
    "DistanceJoint",
    "FixedJoint",
    "Joint",
    "PlanarJoint",
    "PointOnLine",
    "PointOnPlane",
    "PrismaticJoint",
    "RevoluteJoint",
    "RollingDisc",
    "ScrewJoint",
    "SlidingJoint",
    "SphericalJoint",
    "UniversalJoint",
]

JOINTS = {
    "constant-orientation": ConstantOrientation,
    "constant-velocity": ConstantVelocityJoint,
    "cylindrical": CylindricalJoint,
    "distance": DistanceJoint,
    "fixed": FixedJoint,
    "planar": PlanarJoint,
    "point-on-line": PointOnLine,
    "point-on-plane": PointOnPlane,
    "prismatic": PrismaticJoint,
    "revolute": RevoluteJoint,
    "rolling-disc": RollingDisc,
    "screw": ScrewJoint,
    "sliding": SlidingJoint,
    "spherical": SphericalJoint,
    "universal": UniversalJoint,
}
