"""Joints: one file for each; `JOINTS` is the registry for the system file."""

from floatframe.model.joints.constant_orientation import ConstantOrientation
from floatframe.model.joints.constant_velocity import ConstantVelocityJoint
from floatframe.model.joints.cylindrical import CylindricalJoint
from floatframe.model.joints.distance import DistanceJoint
from floatframe.model.joints.fixed import FixedJoint
from floatframe.model.joints.planar import PlanarJoint
from floatframe.model.joints.point_on_line import PointOnLine
from floatframe.model.joints.point_on_plane import PointOnPlane
from floatframe.model.joints.prismatic import PrismaticJoint
from floatframe.model.joints.revolute import RevoluteJoint
from floatframe.model.joints.rolling_disc import RollingDisc
from floatframe.model.joints.screw import ScrewJoint
from floatframe.model.joints.sliding import SlidingJoint
from floatframe.model.joints.spherical import SphericalJoint
from floatframe.model.joints.universal import UniversalJoint

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

Joint = (
    ConstantOrientation
    | ConstantVelocityJoint
    | CylindricalJoint
    | DistanceJoint
    | FixedJoint
    | PlanarJoint
    | PointOnLine
    | PointOnPlane
    | PrismaticJoint
    | RevoluteJoint
    | RollingDisc
    | ScrewJoint
    | SlidingJoint
    | SphericalJoint
    | UniversalJoint
)

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
