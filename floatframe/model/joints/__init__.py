"""Joints, in one file for each family; `JOINTS` is the registry for the system file, `Joint` their base class."""

from typing import Any

from fe_models.door import Registry
from floatframe.errors import ModelError
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

#: joint classes by the `type` of a table [joints.NAME]: those of floatframe, and of other packages by entry points
JOINTS: Registry[Any] = Registry(
    "floatframe.joints",
    {
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
    },
    ModelError,
    kind="a class that derives from Joint",
    is_kind=lambda found: isinstance(found, type) and issubclass(found, Joint),
)
