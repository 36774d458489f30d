"""What is read off a kart: its turn after a steering step, and the torsion of its chassis."""

from dataclasses import dataclass

import numpy as np

from cms.reduced_body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array
from floatframe.results.element_motion import element_motion
from floatframe.results.trajectory import Trajectory
from floatframe.system import System

__all__ = ["Turn", "torsion_stiffness", "turn_of"]

WHEELS = ("front_left", "front_right", "rear_left", "rear_right")


@dataclass(frozen=True, eq=False)
class Turn:
    """A kart over time, in the axes of its chassis."""

    t: Array  #: (n_t,) [s]
    speed: Array  #: ahead, of the origin of the chassis, (n_t,) [m/s]
    yaw_rate: Array  #: (n_t,) [rad/s]
    loads: Array  #: F_z of front left, front right, rear left, rear right, (n_t, 4) [N]

    @property
    def lateral_acceleration(self) -> Array:
        """Speed times yaw rate, (n_t,) [m/s²]."""
        return self.speed * self.yaw_rate

    @property
    def radius(self) -> float:
        """Of the turn at the end [m]."""
        return float(self.speed[-1] / self.yaw_rate[-1])

    def transfer(self, axle: str) -> float:
        """Load that the end of the run has on the right wheel of an axle more than on its left one [N]."""
        k = 0 if axle == "front" else 2
        return float(self.loads[-1, k + 1] - self.loads[-1, k])


def turn_of(system: System, motion: Trajectory) -> Turn:
    """Return the turn of a kart."""
    chassis = motion.body("chassis")
    yaw = 2 * np.arctan2(chassis.p[:, 3], chassis.p[:, 0])
    loads = [element_motion(system, motion, f"tyre_{name}").outputs["Fz"] for name in WHEELS]
    return Turn(
        t=motion.t,
        speed=np.cos(yaw) * chassis.v[:, 0] + np.sin(yaw) * chassis.v[:, 1],
        yaw_rate=np.asarray(chassis.omega_B[:, 2]),
        loads=np.stack(loads, axis=1),
    )


def torsion_stiffness(chassis: ReducedBody) -> float:
    """Return the torque over the twist between front and rear wheels [N m/rad].

    Upward and downward forces on the ends of the axles, equal torques about x that balance each other:
    q = K⁻¹ Σ Psi_zᵀ F, and each axle turns by (z_left - z_right) over its width.
    """
    rows, widths = {}, {}
    for axle, name in (("front", "kingpin"), ("rear", "rear")):
        ends = [chassis.interface(f"{name}_{side}") for side in ("left", "right")]
        widths[axle] = float(ends[0].position[1] - ends[1].position[1])
        rows[axle] = (ends[0].Psi[2] - ends[1].Psi[2]) / widths[axle]  # turn of the axle, and its torque's load
    twist = rows["front"] - rows["rear"]
    return float(1.0 / (twist @ np.linalg.solve(chassis.K, twist)))
