"""Joints: one file for each; `JOINTS` is the registry for the system file."""

from floatframe.joints.constant_orientation import ConstantOrientation
from floatframe.joints.constant_velocity import ConstantVelocityJoint
from floatframe.joints.cylindrical import CylindricalJoint
from floatframe.joints.distance import DistanceJoint
from floatframe.joints.fixed import FixedJoint
from floatframe.joints.planar import PlanarJoint
from floatframe.joints.point_on_line import PointOnLine
from floatframe.joints.point_on_plane import PointOnPlane
from floatframe.joints.prismatic import PrismaticJoint
from floatframe.joints.revolute import RevoluteJoint
from floatframe.joints.rolling_disc import RollingDisc
from floatframe.joints.screw import ScrewJoint
from floatframe.joints.sliding import SlidingJoint
from floatframe.joints.spherical import SphericalJoint
from floatframe.joints.universal import UniversalJoint

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
