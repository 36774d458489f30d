"""Forces: one file each; `FORCES` is the registry for the system file."""

from floatframe.forces.body_load import BodyLoad
from floatframe.forces.gravity import Gravity
from floatframe.forces.joint_force import JointForce
from floatframe.forces.point_force import PointForce
from floatframe.forces.spring_damper import SpringDamper

__all__ = ["FORCES", "BodyLoad", "Force", "Gravity", "JointForce", "PointForce", "SpringDamper"]

Force = BodyLoad | Gravity | JointForce | PointForce | SpringDamper

FORCES = {
    "body-load": BodyLoad,
    "joint-force": JointForce,
    "point-force": PointForce,
    "spring-damper": SpringDamper,
}
