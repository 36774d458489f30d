"""Forces and loads; `FORCES` is the registry for the system file."""

from floatframe.model.forces.bushing import Bushing
from floatframe.model.forces.loads import BodyLoad, Gravity, PointForce
from floatframe.model.forces.sphere_contact import SphereContact
from floatframe.model.forces.springs import JointForce, SpringDamper
from floatframe.model.forces.user_force import UserForce

__all__ = [
    "FORCES",
    "WITH_AMPLITUDE",
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

#: name of the function of time in each type of force
WITH_AMPLITUDE = {PointForce: "amplitude", BodyLoad: "amplitude", JointForce: "motor"}
