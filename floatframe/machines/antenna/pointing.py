"""Pointing directions of the petals of the antenna relative to the spacecraft."""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.model.bodies.markers import Marker
from floatframe.model.system import System
from floatframe.results.place_motion import PlaceMotion
from floatframe.results.sensors.places import place_motion
from floatframe.results.trajectory import Trajectory

__all__ = ["Pointing", "pointing"]


@dataclass(frozen=True, eq=False)
class Pointing:
    """Direction from the middle of each hinge to the tip of its petal, in axes of the spacecraft, (n_t, n_petals)."""

    t: Array  #: (n_t,) [s]
    theta: Array  #: from the mast [rad]
    lateral: Array  #: out of the plane of the petal and the mast [rad]


def pointing(system: System, motion: Trajectory, *, hinge_radius: float = 0.6, petal_length: float = 4.0) -> Pointing:
    """Return the pointing of the petals of an antenna during a motion.

    Parameters
    ----------
    system, motion
        The system of an antenna, and its motion.
    hinge_radius
        Distance of the petal hinges from the mast [m].
    petal_length
        Length of a petal [m].
    """

    def place(body: str, position: tuple[float, float, float]) -> PlaceMotion:
        return place_motion(system, motion, "pointing", Marker(body, position=np.array(position)))

    bus = place("bus", (0.0, 0.0, 0.0))
    n_petals = sum(body.name.startswith("petal_") for body in system.bodies)
    theta, lateral = [], []
    for k in range(1, n_petals + 1):
        turn = 2 * np.pi * k / n_petals
        tip = place(f"petal_{k}", (petal_length, 0.0, 0.0)).position - bus.position
        seen = np.einsum("tij,ti->tj", bus.axes, tip)
        out = np.cos(turn) * seen[:, 0] + np.sin(turn) * seen[:, 1] - hinge_radius
        theta.append(np.arctan2(out, seen[:, 2]))
        across = np.cos(turn) * seen[:, 1] - np.sin(turn) * seen[:, 0]
        lateral.append(np.arctan2(across, np.hypot(out, seen[:, 2])))
    return Pointing(motion.t, np.transpose(theta), np.transpose(lateral))
