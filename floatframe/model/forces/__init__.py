"""Forces and loads; `FORCES` is the registry for the system file."""

from collections.abc import Iterable
from typing import Any

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
    "driven_forces",
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


def driven_forces(forces: Iterable[Any]) -> dict[str, PointForce | BodyLoad | JointForce]:
    """Return the forces whose amplitude or motor can be an input, by all their names.

    These are "push", "push.amplitude" and "forces.push.amplitude" for a force or load with an amplitude, and "motor",
    "motor.torque" ("motor.force" along a distance) and "forces.motor.motor" for a joint force. A force that itself is
    called "motor.torque" keeps this name.
    """
    found: dict[str, PointForce | BodyLoad | JointForce] = {}
    driven = [force for force in forces if type(force) in WITH_AMPLITUDE]
    for force in driven:
        key = WITH_AMPLITUDE[type(force)]
        short = key if key == "amplitude" else "torque" if force.is_angular else "force"
        found |= dict.fromkeys((force.name, f"{force.name}.{short}", f"forces.{force.name}.{key}"), force)
    return found | {force.name: force for force in driven}
