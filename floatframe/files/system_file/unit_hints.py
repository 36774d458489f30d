"""Hints that numbers of a system seem to be in other units than stated."""

import numpy as np

from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.model.forces import Gravity
from floatframe.model.system import System

__all__ = ["unit_hints"]

EARTH = 9.80665  #: m/s²
POWERS = (1e-6, 1e-3, 1e3, 1e6)  #: factors by which a number is wrong if m and mm, or kg and t, are mixed up
NEAR = 0.02  #: relative difference from such a factor
FAR = 300.0  #: ratio of radius of gyration to size of the system, or the inverse with its square, that no real part has


def unit_hints(system: System) -> tuple[str, ...]:
    """Return notes on numbers that do not fit the units of a system: gravity off by 1000, or implausible inertia."""
    hints = []
    units, where = system.units, f"system {system.name!r}, units {system.units.name}"
    for force in system.forces:
        if isinstance(force, Gravity):
            size = float(np.linalg.norm(force.acceleration))
            on_earth = EARTH * units.time**2 / units.length
            if any(abs(size / (factor * on_earth) - 1) < NEAR for factor in POWERS):
                hints.append(
                    f"{where}: gravity is {size:g} {units.length_symbol}/{units.time_symbol}², but on earth "
                    f"{on_earth:g}: is it in other units?"
                )
    rigid = [body for body in system.bodies if isinstance(body, RigidBody)]
    sizes = [
        float(np.linalg.norm(np.ptp(b.reduced.nodes, axis=0))) for b in system.bodies if not isinstance(b, RigidBody)
    ]
    reach = [float(np.linalg.norm(body.center_of_mass)) for body in rigid]
    places = np.array([body.position for body in system.bodies])
    length = max([*sizes, *reach, float(np.linalg.norm(np.ptp(places, axis=0)))])
    for body in rigid:
        radius = float(np.sqrt(np.linalg.eigvalsh(body.inertia)[-1] / body.mass))
        if length > 0 and (radius > FAR * length or (sizes and radius < length / FAR**2)):
            hints.append(
                f"{where}: rigid body {body.name!r} has mass and inertia of a part with a radius of gyration of "
                f"{radius:.3g} {units.length_symbol}, in a system of {length:.3g}: are they in "
                f"{units.mass_symbol} and {units.mass_symbol} {units.length_symbol}²?"
            )
    return tuple(hints)
