"""The railway vehicle on a circular track."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from floatframe.components.rails import ContactLaws, Pair, Segment, Track
from floatframe.errors import ModelError
from floatframe.machines.bogie.vehicle import RailVehicle, vehicle
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.rotations import euler_parameters
from floatframe.model.system import System

__all__ = ["circle", "in_circle"]

LEAD = 50.0  #: length of the circle behind the middle of the vehicle [m]
LENGTH = 1e5  #: of the circle [m]


def circle(radius: float, cant: float = 0.0) -> Track:
    """Return a track on a left-hand circle about (0, radius), along x at the origin; cant in metres."""
    if not radius >= 20.0:
        raise ModelError(f"circle: radius: expected 20 m or more, got {radius:g}")
    angle = LEAD / radius
    start = np.array([-radius * np.sin(angle), radius * (1 - np.cos(angle)), 0.0])
    return Track((Segment(LENGTH, (1 / radius, 1 / radius), (cant, cant)),), start=start, heading=-angle)


def in_circle(
    data: RailVehicle,
    speed: float,
    radius: float,
    *,
    cant: float = 0.0,
    pair: Pair | None = None,
    laws: ContactLaws | None = None,
    is_independent: bool = False,
    frames: Sequence[FlexibleBody] = (),
) -> System:
    """Return the vehicle on a circle; every body has the axes and the velocity of the track at its position.

    Parameters
    ----------
    data, speed, pair, laws, is_independent, frames
        As for `vehicle`.
    radius, cant
        Radius of the circle [m]; height of the outer rail above the inner one [m].
    """
    track = circle(radius, cant)
    straight = vehicle(data, speed, pair=pair, track=track, laws=laws, is_independent=is_independent, frames=frames)
    bodies = []
    for body in straight.bodies:
        x, y, z = np.asarray(body.position)
        here = track.frame(LEAD + x)
        placed = here.origin + here.axes @ np.array([0.0, y, z])
        axes = euler_parameters(here.axes)
        bodies.append(replace(body, position=placed, orientation=axes, velocity=speed * here.axes[:, 0]))
    return replace(straight, bodies=bodies, name="rail vehicle in a circle")
