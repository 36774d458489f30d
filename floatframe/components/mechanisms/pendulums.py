"""Pendulums and chains of rods in the xy plane, under gravity along -y."""

import numpy as np

from cms.body.reduced_body import ReducedBody
from fe_models.foundation.units import Units, unit_system
from floatframe.components.mechanisms.rods import Rod
from floatframe.errors import ModelError
from floatframe.model.bodies.ground import GROUND
from floatframe.model.bodies.markers import Marker
from floatframe.model.forces import Gravity
from floatframe.model.joints import RevoluteJoint
from floatframe.model.system import System

__all__ = ["chain", "double_pendulum", "pendulum"]

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
        Of each rigid rod [m, kg].
    angles
        Angle of each rod from the x axis [rad]; zero by default.
    gravity
        Gravity along -y [m/s²].
    rod
        A reduced body, of which all rods are instances; `length` is then the distance between its interfaces `ends`.
    ends
        Interfaces of `rod` at its start and end.
    units
        Default: those of `rod`, or m-kg-s.
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
