"""The petals of the antenna: their mesh, and their directions relative to the spacecraft."""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.model.bodies.markers import Marker
from floatframe.model.system import System
from floatframe.results.place_motion import PlaceMotion
from floatframe.results.sensors.places import place_motion
from floatframe.results.trajectory import Trajectory

__all__ = ["Pointing", "petal_mesh", "pointing"]


def petal_mesh(
    *, length: float = 4.0, width: float = 0.3, elbow: float = 1.2, n_along: int = 20, n_across: int = 2
) -> str:
    """Return the mesh of a petal (Abaqus): a strip of quads along x, width along y, with a rib on its middle line.

    Parameters
    ----------
    length, width
        Length and width of the petal [m].
    elbow
        Distance from the hinge to the node of the strut [m].
    n_along, n_across
        Numbers of cells along and across the petal.
    """
    n, m = n_along, n_across
    x = np.linspace(0.0, length, n + 1)
    y = np.linspace(-0.5, 0.5, m + 1) * width

    def number(i: int, j: int) -> int:
        return 1 + i * (m + 1) + j

    lines = ["*NODE"]
    lines += [f"{number(i, j)}, {x[i]:.6g}, {y[j]:.6g}, 0" for i in range(n + 1) for j in range(m + 1)]
    lines.append("*ELEMENT, TYPE=S4, ELSET=SKIN")
    for i in range(n):
        for j in range(m):
            corners = number(i, j), number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)
            lines.append(", ".join(map(str, (1 + i * m + j, *corners))))
    lines.append("*ELEMENT, TYPE=B31, ELSET=RIB")
    lines += [f"{1001 + i}, {number(i, m // 2)}, {number(i + 1, m // 2)}" for i in range(n)]
    lines += ["*NSET, NSET=ROOT", str(number(0, m // 2)), "*NSET, NSET=ELBOW",
              str(number(round(elbow / length * n), m // 2)), "*NSET, NSET=TIP", str(number(n, m // 2))]  # fmt: skip
    return "\n".join(lines) + "\n"


@dataclass(frozen=True, eq=False)
class Pointing:
    """Direction from the middle of each hinge to the tip of its petal, in axes of the spacecraft, (n_t, n_petals)."""

    t: Array  #: output times, (n_t,) [s]
    theta: Array  #: angle of the petal from the mast [rad]
    lateral: Array  #: angle out of the plane of petal and mast [rad]


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
