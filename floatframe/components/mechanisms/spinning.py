"""Spinning slender bodies, for which a linear floating frame fails without geometric stiffness.

The bodies are given as reduced bodies whose axis is the x axis of their mesh.
"""

from typing import Literal

import numpy as np

from cms.body.reduced_body import ReducedBody
from fe_models.foundation.units import Units, unit_system
from floatframe.components.mechanisms.rods import Rod, between, turning
from floatframe.errors import ModelError
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.bodies.ground import GROUND
from floatframe.model.bodies.markers import Marker
from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.model.forces import Gravity
from floatframe.model.functions.time_functions import TimeFunction, cycloidal_spin_up
from floatframe.model.joints import FixedJoint, Joint, PointOnLine, RevoluteJoint, SphericalJoint
from floatframe.model.rotations import euler_parameters_of_rotation_vector
from floatframe.model.shapes import Shape, Sphere
from floatframe.model.system import System

__all__ = ["rotating_blade", "satellite", "spin_up_beam", "spinning_shaft", "spinning_top"]


# a satellite: a rigid hub in free flight with two booms ---------------------------------------------------------------


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
        Length and mass of rigid booms [m, kg]; with `boom`, the length is the distance between its interfaces.
    spin
        Initial angular velocity about z of hub and undeformed booms [rad/s].
    boom
        A reduced body, of which both booms are instances.
    ends
        Interfaces of `boom` at the hub and at the tip.
    units
        Units of the system; default: those of `boom`, or m-kg-s.
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


# spinning -------------------------------------------------------------------------------------------------------------


# the heavy symmetric top with a fixed point ---------------------------------------------------------------------------


def spinning_top(
    *,
    mass: float = 1.0,
    arm: float = 0.1,
    inertia: tuple[float, float] = (0.002, 0.001),
    tilt: float = 0.5,
    spin: float = 300.0,
    precession: float = 0.0,
    gravity: float = 9.81,
) -> System:
    """Return a body "top" on a spherical joint "tip" at the origin, its z axis tilted about x, under gravity along -z.

    Parameters
    ----------
    mass
        Mass [kg].
    arm
        Distance of the centre of mass from the tip [m].
    inertia
        Principal moments about the centre of mass, transverse and axial [kg m²].
    tilt
        Angle of the axis from the vertical [rad].
    spin
        Initial angular velocity about the axis of the top [rad/s].
    precession
        Initial angular velocity about the vertical [rad/s].
    gravity
        Gravity along -z [m/s²].
    """
    across, along = inertia
    up = np.array([0.0, np.sin(tilt), np.cos(tilt)])  # the vertical in body axes
    body = RigidBody(
        "top",
        mass,
        np.diag([across, across, along]),
        center_of_mass=np.array([0.0, 0.0, arm]),
        orientation=euler_parameters_of_rotation_vector(np.array([tilt, 0.0, 0.0])),
        omega_B=np.array([0.0, 0.0, spin]) + precession * up,
    )
    return System(
        [body], [SphericalJoint("tip", GROUND, Marker("top"))], [Gravity(np.array([0, 0, -gravity]))], name="top"
    )


# spinning -------------------------------------------------------------------------------------------------------------


Stiffening = bool | Literal["auto"]
Z = np.array([0.0, 0.0, 1.0])
X = np.array([1.0, 0.0, 0.0])


def spin_up_beam(
    beam: ReducedBody,
    *,
    speed: float = 6.0,
    duration: float = 15.0,
    hub_radius: float = 0.0,
    pitch: TimeFunction | None = None,
    root: str = "root",
    stiffening: Stiffening = "auto",
) -> System:
    """Return a beam along x that a driven hub accelerates to a spin about z (problem of Kane, Ryan and Banerjee).

    Bodies "hub" (rigid, its motion prescribed) and "beam"; joints "drive" (ground, hub) and "root" (hub, beam).
    The angle of the drive is `cycloidal_spin_up(speed, duration)`.

    Parameters
    ----------
    beam
        A reduced body with an interface at its root.
    speed, duration
        Final speed and duration of the spin-up [rad/s, s].
    hub_radius
        Distance of the root from the axis [m].
    pitch
        Rotation of the root about the beam axis as a function of time, in addition to the spin; None: fixed to the hub.
    root
        Interface of the beam.
    stiffening
        As for `FlexibleBody`.
    """
    at = np.array([hub_radius, 0.0, 0.0])
    size = float(np.linalg.norm(np.ptp(beam.nodes, axis=0))) or 1.0
    hub = RigidBody("hub", beam.moments.m, beam.moments.m * size**2 * np.eye(3))
    blade = FlexibleBody("beam", beam, position=at - between(beam, root), stiffening=stiffening)
    on_hub, on_beam = Marker("hub", position=at), Marker("beam", root)
    held: Joint = FixedJoint("root", on_hub, on_beam)
    if pitch is not None:
        held = RevoluteJoint("root", on_hub, on_beam, axis=X, motions={"angle": pitch})
    drive = cycloidal_spin_up(speed, duration)
    joints = [RevoluteJoint("drive", GROUND, Marker("hub"), axis=Z, motions={"angle": drive}), held]
    return System([hub, blade], joints, [], beam.units, "spin-up of a beam")


def rotating_blade(
    blade: ReducedBody,
    *,
    hub_radius: float = 0.0,
    hub_inertia: float | None = None,
    root: str = "root",
    stiffening: Stiffening = "auto",
) -> System:
    """Return a blade along x, fixed to a hub that rotates freely about z.

    Bodies "hub" and "blade"; joints "main" (ground, hub) and "root". With `floatframe.analyses.campbell` or
    `steady_rotation` it gives the frequencies of the rotating blade.

    Parameters
    ----------
    blade
        A reduced body with an interface at its root.
    hub_radius
        Distance of the root from the axis [m].
    hub_inertia
        Inertia of the hub about z [kg m²]; default: 1e9 times the inertia of the blade, so that the speed is constant.
    root
        Interface of the blade.
    stiffening
        As for `FlexibleBody`.
    """
    at = np.array([hub_radius, 0.0, 0.0])
    size = float(np.linalg.norm(np.ptp(blade.nodes, axis=0))) + hub_radius
    if hub_inertia is None:
        hub_inertia = 1e9 * blade.moments.m * size**2
    if not hub_inertia > 0:
        raise ModelError(f"rotating_blade: hub_inertia: expected a number above 0, got {hub_inertia:g}")
    hub = RigidBody("hub", hub_inertia / size**2, hub_inertia * np.eye(3))
    body = FlexibleBody("blade", blade, position=at - between(blade, root), stiffening=stiffening)
    joints: list[Joint] = [
        RevoluteJoint("main", GROUND, Marker("hub"), axis=Z),
        FixedJoint("root", Marker("hub", position=at), Marker("blade", root)),
    ]
    return System([hub, body], joints, [], blade.units, "rotating blade")


def spinning_shaft(
    shaft: ReducedBody,
    *,
    speed: float = 0.0,
    ends: tuple[str, str] = ("left", "right"),
    stiffening: Stiffening = "auto",
) -> System:
    """Return a shaft along x that spins about x on two bearings, which allow bending, and sliding at the right end.

    Body "shaft"; joints "left" (spherical) and "right" (a point on the axis).

    Parameters
    ----------
    shaft
        A reduced body with interfaces at the bearings.
    speed
        Initial spin [rad/s].
    ends
        Interfaces at the bearings.
    stiffening
        As for `FlexibleBody`.
    """
    a, b = (between(shaft, end) for end in ends)
    body = FlexibleBody("shaft", shaft, position=-a, omega_B=speed * X, stiffening=stiffening)
    joints: list[Joint] = [
        SphericalJoint("left", GROUND, Marker("shaft", ends[0])),
        PointOnLine("right", Marker(GROUND, position=b - a), Marker("shaft", ends[1]), axis=X),
    ]
    return System([body], joints, [], shaft.units, "spinning shaft")
