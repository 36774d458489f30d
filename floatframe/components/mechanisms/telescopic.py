"""A telescopic slider-crank: a crank pushes a flexible rod through a fixed ring."""

from collections.abc import Sequence

import numpy as np

from cms.body.reduced_body import ReducedBody
from floatframe.components.mechanisms.rods import Rod, turning
from floatframe.errors import ModelError
from floatframe.model.bodies.ground import GROUND
from floatframe.model.bodies.markers import Marker
from floatframe.model.functions.time_functions import TimeFunction
from floatframe.model.joints import Joint, RevoluteJoint, SlidingJoint, UniversalJoint
from floatframe.model.system import System

__all__ = ["telescopic_slider_crank"]

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
