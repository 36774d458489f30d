"""Numbers of a system that look as if they were in other units than it says."""

import numpy as np

from floatframe.bodies.rigid_body import RigidBody
from floatframe.forces import Gravity
from floatframe.system import System

__all__ = ["unit_hints"]

EARTH = 9.80665  #: m/s²
POWERS = (1e-6, 1e-3, 1e3, 1e6)  #: factors by which a mixture of m and mm, of kg and t, is wrong
NEAR = 0.02  #: of such a factor
FAR = 300.0  #: radius of gyration by the size of the system, or the reverse with its square, that no real part has


def unit_hints(system: System) -> tuple[str, ...]:
    """Return in words what does not fit the units of a system: gravity off by 1000, inertia of a giant or a grain."""
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
