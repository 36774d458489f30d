"""Systems, bodies and helpers that several tests share: coordinate basis."""

from dataclasses import replace

import numpy as np

from floatframe import GROUND, JointForce, Marker, SpringDamper
from floatframe.components.mechanisms import double_pendulum, four_bar, rotating_blade, satellite
from tests.floatframe.engine.tree.mechanisms import beam, falling


def held_satellite():
    """A flexible boom on a free hub, held by springs and dampers in its plane: a free body with modes."""
    free = satellite(spin=0.0, boom_length=1.0, boom=beam())
    ends = [(2.0, 0.0, 0.0), (-1.0, 2.0, 0.3), (0.0, -2.0, 1.0), (0.0, 0.4, -2.0)]
    springs = [
        SpringDamper(f"spring {k}", Marker(GROUND, position=end), Marker("hub", position=0.1 * np.roll(end, 1)), 40.0,
                     0.5, free_length=1.5)
        for k, end in enumerate(ends)
    ]  # fmt: skip
    return falling(replace(free, forces=[*free.forces, *springs]))


def sprung(system, joint):
    """The system with a spring and a damper in a joint."""
    own = JointForce("spring", joint, "angle", stiffness=30.0, free=0.3, damping=2.0)
    return replace(system, forces=[*system.forces, own])


CASES = {  # system and where to stand: at rest, or turning
    "double pendulum": lambda: sprung(double_pendulum(angles=(-1.4, -1.7), rod=beam()), "hinge 2"),
    "four-bar": lambda: sprung(falling(four_bar(angle=-1.2, flexible_coupler=beam(0.9))), "main"),
    "free": held_satellite,
    "turning": lambda: sprung(rotating_blade(beam(), hub_inertia=0.5, root="start"), "main"),
}
