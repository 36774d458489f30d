"""Forces: one file each; `FORCES` is the registry for the system file."""

from floatframe.forces.gravity import Gravity
from floatframe.forces.point_force import PointForce
from floatframe.forces.spring_damper import SpringDamper

__all__ = ["FORCES", "Force", "Gravity", "PointForce", "SpringDamper"]

Force = Gravity | PointForce | SpringDamper

FORCES = {"point-force": PointForce, "spring-damper": SpringDamper}
