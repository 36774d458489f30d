"""A satellite: a rigid hub in free flight with two booms."""

import numpy as np

from cms.body.reduced_body import ReducedBody
from fe_models.foundation.units import Units, unit_system
from floatframe.components.mechanisms.rods import Rod, turning
from floatframe.model.bodies.markers import Marker
from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.model.joints import FixedJoint
from floatframe.model.shapes import Shape, Sphere
from floatframe.model.system import System

__all__ = ["satellite"]


def satellite(
    *,
    hub_mass: float = 100.0,
    hub_radius: float = 0.5,
    boom_length: float = 5.0,
    boom_mass: float = 2.0,
    spin: float = 0.0,
    boom: ReducedBody | None = None,
    ends: tuple[str, str] = ("start", "end"),
    units: Units | None = None,
) -> System:
    """Return a spherical hub with two equal booms along +x and -x, fixed to its surface, all spinning about z.

    Parameters
    ----------
    hub_mass, hub_radius
        Mass and radius of the hub [kg, m].
    boom_length, boom_mass
        Mass and length of rigid booms [m, kg]; with `boom`, the length is the distance between its interfaces.
    spin
        Initial angular velocity about z of hub and undeformed booms [rad/s].
    boom
        A reduced body, of which both booms are instances.
    ends
        Interfaces of `boom` at the hub and at the tip.
    units
        Default: those of `boom`, or m-kg-s.
    """
    if boom is not None:
        boom_length = float(np.linalg.norm(np.subtract(*(boom.interface(end).position for end in ends))))
    ball = Shape(Sphere(hub_radius), color="gold")
    bodies: list = [RigidBody("hub", hub_mass, 0.4 * hub_mass * hub_radius**2 * np.eye(3), shapes=[ball])]
    joints = []
    for name, sign in (("right", 1.0), ("left", -1.0)):
        root = np.array([sign * hub_radius, 0.0, 0.0])
        part = Rod(name, root, root + sign * np.array([boom_length, 0.0, 0.0]), boom_mass, boom, ends)
        bodies.append(part.body)
        joints.append(FixedJoint(f"{name} root", Marker("hub", position=root), part.start))
    bodies = [turning(body, np.array([0.0, 0.0, spin])) for body in bodies]
    units = units or (boom.units if boom is not None else unit_system("m-kg-s"))
    return System(bodies, joints, [], units, "satellite")
