"""Forces: one file for each; `FORCES` is the registry for the system file."""

from floatframe.forces.body_load import BodyLoad
from floatframe.forces.bushing import Bushing
from floatframe.forces.gravity import Gravity
from floatframe.forces.joint_force import JointForce
from floatframe.forces.point_force import PointForce
from floatframe.forces.sphere_contact import SphereContact
from floatframe.forces.spring_damper import SpringDamper
from floatframe.forces.user_force import UserForce

__all__ = [
    "FORCES",
    "BodyLoad",
    "Bushing",
    "Force",
    "Gravity",
    "JointForce",
    "PointForce",
    "SphereContact",
    "SpringDamper",
    "UserForce",
]

Force = BodyLoad | Bushing | Gravity | JointForce | PointForce | SphereContact | SpringDamper | UserForce

FORCES = {
    "body-load": BodyLoad,
    "bushing": Bushing,
    "joint-force": JointForce,
    "point-force": PointForce,
    "sphere-contact": SphereContact,
    "spring-damper": SpringDamper,
    "user-force": UserForce,
}
