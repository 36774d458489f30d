"""Planar linkages in the xy plane with one degree of freedom and no redundant constraints."""

from collections.abc import Sequence

import numpy as np

from cms.body.reduced_body import ReducedBody
from fe_models.foundation.units import Units, unit_system
from floatframe.components.flexible_parts.flexible_part import PartMaker
from floatframe.components.mechanisms.rods import Rod, turning
from floatframe.errors import ModelError
from floatframe.model.bodies.ground import GROUND
from floatframe.model.bodies.markers import Marker
from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.model.forces import Gravity
from floatframe.model.functions.time_functions import TimeFunction
from floatframe.model.joints import (
    Joint,
    PointOnLine,
    PrismaticJoint,
    RevoluteJoint,
    SlidingJoint,
    SphericalJoint,
    UniversalJoint,
)
from floatframe.model.system import System

__all__ = ["chain", "double_pendulum", "four_bar", "pendulum", "slider_crank", "telescopic_slider_crank"]


# pendulums and chains of rods in the xy plane, under gravity along -y -------------------------------------------------


AXIS = (0.0, 0.0, 1.0)


def pendulum(
    *,
    length: float = 1.0,
    mass: float = 1.0,
    angle: float = 0.0,
    gravity: float = 9.81,
    rod: ReducedBody | None = None,
    ends: tuple[str, str] = ("start", "end"),
    units: Units | None = None,
) -> System:
    """Return a rod on a hinge at the ground origin, released at an angle from the x axis [rad]: `chain` of one."""
    return chain(1, length=length, mass=mass, angles=(angle,), gravity=gravity, rod=rod, ends=ends, units=units)


def double_pendulum(
    *,
    length: float = 1.0,
    mass: float = 1.0,
    angles: tuple[float, float] = (0.0, 0.0),
    gravity: float = 9.81,
    rod: ReducedBody | None = None,
    ends: tuple[str, str] = ("start", "end"),
    units: Units | None = None,
) -> System:
    """Return two equal rods, one hanging on the other, at angles from the x axis [rad]: `chain` of two."""
    return chain(2, length=length, mass=mass, angles=angles, gravity=gravity, rod=rod, ends=ends, units=units)


def chain(
    n: int,
    *,
    length: float = 1.0,
    mass: float = 1.0,
    angles: tuple[float, ...] | None = None,
    gravity: float = 9.81,
    rod: ReducedBody | None = None,
    ends: tuple[str, str] = ("start", "end"),
    units: Units | None = None,
) -> System:
    """Return n equal rods "rod 1", "rod 2", ... in a row, with hinges "hinge 1", ... about z, the first at the origin.

    Parameters
    ----------
    n
        Number of rods.
    length, mass
        Length and mass of each rigid rod [m, kg].
    angles
        Angle of each rod from the x axis [rad]; zero by default.
    gravity
        Gravity along -y [m/s²].
    rod
        A reduced body, of which all rods are instances; `length` is then the distance between its interfaces `ends`.
    ends
        Interfaces of `rod` at its start and end.
    units
        Units of the system; default: those of `rod`, or m-kg-s.
    """
    if n < 1:
        raise ModelError(f"chain: n: expected at least 1, got {n}")
    angles = (0.0,) * n if angles is None else tuple(angles)
    if len(angles) != n:
        raise ModelError(f"chain: angles: expected {n}, got {len(angles)}")
    if rod is not None:
        a, b = (rod.interface(end).position for end in ends)
        length = float(np.linalg.norm(b - a))
    point, place = np.zeros(3), Marker(GROUND)
    bodies, joints = [], []
    for k, angle in enumerate(angles, start=1):
        end = point + length * np.array([np.cos(angle), np.sin(angle), 0.0])
        part = Rod(f"rod {k}", point, end, mass, rod, ends)
        bodies.append(part.body)
        axis = AXIS if place.interface is None else tuple(np.asarray(AXIS) @ _axes_of(place, rod, bodies[-2]))
        joints.append(RevoluteJoint(f"hinge {k}", place, part.start, axis=np.asarray(axis)))
        point, place = end, part.end
    name = {1: "pendulum", 2: "double pendulum"}.get(n, f"chain of {n}")
    units = units or (rod.units if rod is not None else unit_system("m-kg-s"))
    return System(bodies, joints, [Gravity(np.array([0.0, -gravity, 0.0]))], units, name)


def _axes_of(place: Marker, rod: ReducedBody | None, body: object) -> np.ndarray:
    """Return the axes of an assembled interface, in ground axes, (3, 3)."""
    from floatframe.model.bodies.flexible_body import FlexibleBody

    assert rod is not None and isinstance(body, FlexibleBody) and place.interface is not None  # noqa: PT018
    return np.asarray(body.frame_orientation @ rod.interface(place.interface).triad)


# a telescopic slider-crank: a crank pushes a flexible rod through a fixed ring ----------------------------------------


Z = np.array([0.0, 0.0, 1.0])


def telescopic_slider_crank(
    rod: ReducedBody,
    stations: Sequence[str],
    *,
    crank: float = 0.1,
    ring: float = 0.25,
    crank_mass: float = 0.5,
    angle: float = 0.0,
    speed: float = 0.0,
    drive: TimeFunction | None = None,
) -> System:
    """Return a crank at the origin and a flexible rod that slides through a ring on the x axis, in the xy plane.

    Bodies "crank" and "rod"; joints "main" (ground, crank), "pin" (a universal joint of crank and rod) and "ring" (a
    fixed point on the deformed line of the rod): one degree of freedom besides the deformation.

    Parameters
    ----------
    rod
        The rod, whose interfaces `stations` lie on a straight line; the first is at the pin.
    stations
        Names of interfaces along the rod, in order; more of them give a more accurate line.
    crank, ring
        Length of the crank, and distance of the ring from its hinge [m]; the rod must always reach through the ring.
    crank_mass
        Mass [kg].
    angle
        Initial angle from the x axis to the crank [rad].
    speed
        Initial angular velocity of the crank, if there is no drive [rad/s].
    drive
        Angle of the crank as a function of time, relative to `angle`; None: it rotates freely.
    """
    names = tuple(stations)
    if len(names) < 2:
        raise ModelError(f"telescopic_slider_crank: stations: expected two or more, got {list(names)}")
    first, last = (rod.interface(name).position for name in (names[0], names[-1]))
    length = float(np.linalg.norm(last - first))
    if not 0 < crank < ring or ring + crank > length:
        raise ModelError(
            "telescopic_slider_crank: expected 0 < crank < ring and ring + crank within the rod, got crank = "
            f"{crank:g}, ring = {ring:g}, rod {length:g}"
        )
    knee = crank * np.array([np.cos(angle), np.sin(angle), 0.0])
    place = np.array([ring, 0.0, 0.0])
    along = (place - knee) / np.linalg.norm(place - knee)
    arm = Rod("crank", np.zeros(3), knee, crank_mass)
    link = Rod("rod", knee, knee + length * along, 0.0, rod, (names[0], names[-1]))
    omega = (speed if drive is None else drive(0.0, 1)) * Z
    v_knee = np.cross(omega, knee)
    omega_rod = np.cross(place - knee, -v_knee) / np.dot(place - knee, place - knee)
    body = link.body
    bodies = [turning(arm.body, omega), turning(body, omega_rod, point=knee, velocity=v_knee)]
    joints: list[Joint] = [
        RevoluteJoint("main", GROUND, arm.start, axis=Z, motions={} if drive is None else {"angle": drive}),
        UniversalJoint("pin", arm.end, link.start, axis=Z, axis_b=link.across(np.cross(Z, along))),
        SlidingJoint("ring", link.start, Marker(GROUND, position=place), line=names[1:]),
    ]
    return System(bodies, joints, [], rod.units, "telescopic slider-crank")


# linkages -------------------------------------------------------------------------------------------------------------


def slider_crank(
    *,
    crank: float = 0.15,
    rod: float = 0.3,
    crank_mass: float = 0.5,
    rod_mass: float = 0.2,
    slider_mass: float = 0.1,
    angle: float = 0.0,
    speed: float = 0.0,
    drive: TimeFunction | None = None,
    flexible_rod: ReducedBody | PartMaker | None = None,
    ends: tuple[str, str] = ("start", "end"),
    units: Units | None = None,
) -> System:
    """Return a slider-crank: a crank at the origin, a rod, and a slider on the x axis.

    Bodies "crank", "rod", "slider"; joints "main" (ground, crank), "pin" (crank, rod), "gudgeon" (rod, slider: a point
    on the pin axis) and "guide" (ground, slider).

    Parameters
    ----------
    crank, rod
        Lengths [m].
    crank_mass, rod_mass, slider_mass
        Masses [kg].
    angle
        Initial angle from the x axis to the crank [rad].
    speed
        Initial angular velocity of the crank, if there is no drive [rad/s].
    drive
        Angle of the crank as a function of time, relative to `angle`; None: it rotates freely.
    flexible_rod
        A reduced body instead of the rigid rod, with its interfaces `ends` at pin and slider; or a part maker, such as
        `partial(finite_segments, line=line, n=10)`.
    ends
        Interfaces of the reduced body, or places of the part.
    units
        Units of the system; default: those of a reduced `flexible_rod`, or m-kg-s.
    """
    if not 0 < crank < rod:
        raise ModelError(f"slider_crank: expected 0 < crank < rod, got crank = {crank:g}, rod = {rod:g}")
    knee = crank * np.array([np.cos(angle), np.sin(angle), 0.0])
    end = np.array([knee[0] + np.sqrt(rod**2 - knee[1] ** 2), 0.0, 0.0])
    arm = Rod("crank", np.zeros(3), knee, crank_mass)
    link = Rod("rod", knee, end, rod_mass, flexible_rod, ends)
    # velocities of the undeformed mechanism: the rod rotates so that its end stays on the x axis
    omega = (speed if drive is None else drive(0.0, 1)) * Z
    v_knee = np.cross(omega, knee)
    omega_rod = -v_knee[1] / (end[0] - knee[0]) * Z
    v_end = v_knee + np.cross(omega_rod, end - knee)
    inertia = slider_mass * (0.1 * crank) ** 2 * np.eye(3)
    block = RigidBody("slider", slider_mass, inertia, position=end, velocity=v_end)
    joints: list[Joint] = [
        RevoluteJoint("main", GROUND, arm.start, axis=Z, motions={} if drive is None else {"angle": drive}),
        RevoluteJoint("pin", arm.end, link.start, axis=Z),
        PointOnLine("gudgeon", Marker("slider"), link.end, axis=Z),
        PrismaticJoint("guide", Marker(GROUND), Marker("slider"), axis=np.array([1.0, 0.0, 0.0])),
    ]
    units = units or (flexible_rod.units if isinstance(flexible_rod, ReducedBody) else unit_system("m-kg-s"))
    moving = (turning(body, omega_rod, point=knee, velocity=v_knee) for body in link.bodies)
    bodies = [turning(arm.body, omega), *moving, block]
    return System(bodies, [*joints, *link.joints], link.forces, units, "slider-crank")


def four_bar(
    *,
    ground: float = 1.0,
    crank: float = 0.3,
    coupler: float = 0.9,
    rocker: float = 0.7,
    mass_per_length: float = 1.0,
    angle: float = 1.0,
    drive: TimeFunction | None = None,
    flexible_coupler: ReducedBody | None = None,
    ends: tuple[str, str] = ("start", "end"),
    units: Units | None = None,
) -> System:
    """Return a four-bar linkage, with its fixed hinges at the origin and on the x axis, and the coupler above.

    Bodies "crank", "coupler", "rocker"; joints "main" and "rest" (hinges on the ground), "pin" (crank, coupler) and
    "knee" (a universal joint between coupler and rocker): no constraint is redundant.

    Parameters
    ----------
    ground, crank, coupler, rocker
        Lengths [m].
    mass_per_length
        Mass per length of the rigid bars [kg/m].
    angle
        Initial angle from the x axis to the crank [rad].
    drive
        Angle of the crank as a function of time, relative to `angle`.
    flexible_coupler, ends
        A reduced body instead of the coupler, with its interfaces `ends` at pin and knee.
    units
        Units of the system; default: those of `flexible_coupler`, or m-kg-s.
    """
    start = crank * np.array([np.cos(angle), np.sin(angle), 0.0])
    foot = np.array([ground, 0.0, 0.0])
    span = foot - start
    d = float(np.linalg.norm(span))
    along = (d**2 + coupler**2 - rocker**2) / (2 * d)
    height = coupler**2 - along**2
    if height <= 0:
        raise ModelError(
            f"four_bar: bars of {crank:g}, {coupler:g}, {rocker:g} on a base of {ground:g} do not close with the crank "
            f"at {angle:g} rad, because coupler and rocker would have to span {d:g}"
        )
    e = span / d
    knee = start + along * e + np.sqrt(height) * np.array([-e[1], e[0], 0.0])
    bars = [
        Rod("crank", np.zeros(3), start, mass_per_length * crank),
        Rod("coupler", start, knee, mass_per_length * coupler, flexible_coupler, ends),
        Rod("rocker", foot, knee, mass_per_length * rocker),
    ]
    joints: list[Joint] = [
        RevoluteJoint("main", GROUND, bars[0].start, axis=Z, motions={} if drive is None else {"angle": drive}),
        SphericalJoint("pin", bars[0].end, bars[1].start),
        UniversalJoint("knee", bars[2].end, bars[1].end, axis=Z, axis_b=np.array([0.0, 1.0, 0.0])),
        RevoluteJoint("rest", Marker(GROUND, position=foot), bars[2].start, axis=Z),
    ]
    units = units or (flexible_coupler.units if flexible_coupler is not None else unit_system("m-kg-s"))
    return System([bar.body for bar in bars], joints, [], units, "four-bar linkage")
