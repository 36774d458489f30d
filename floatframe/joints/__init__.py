"""Joints: one file each; `JOINTS` is the registry for the system file."""

from floatframe.joints.fixed import FixedJoint
from floatframe.joints.revolute import RevoluteJoint
from floatframe.joints.spherical import SphericalJoint

__all__ = ["JOINTS", "FixedJoint", "Joint", "RevoluteJoint", "SphericalJoint"]

Joint = FixedJoint | RevoluteJoint | SphericalJoint

JOINTS = {"fixed": FixedJoint, "revolute": RevoluteJoint, "spherical": SphericalJoint}
