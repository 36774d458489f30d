"""Evaluation of a kart: its turn after a steering step, and the torsional stiffness of its chassis."""

from dataclasses import dataclass

import numpy as np

from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array
from floatframe.model.system import System
from floatframe.results.element_motion import element_motion
from floatframe.results.trajectory import Trajectory

__all__ = ["Turn", "torsion_stiffness", "turn_of"]

WHEELS = ("front_left", "front_right", "rear_left", "rear_right")


@dataclass(frozen=True, eq=False)
class Turn:
    """Motion of a kart in the axes of its chassis."""

    t: Array  #: output times, (n_t,) [s]
    speed: Array  #: forward speed of the origin of the chassis, (n_t,) [m/s]
    yaw_rate: Array  #: yaw rate of the chassis, (n_t,) [rad/s]
    loads: Array  #: F_z of front left, front right, rear left, rear right, (n_t, 4) [N]

    @property
    def lateral_acceleration(self) -> Array:
        """Speed times yaw rate, (n_t,) [m/s²]."""
        return self.speed * self.yaw_rate

    @property
    def radius(self) -> float:
        """Radius of the turn at the end [m]."""
        return float(self.speed[-1] / self.yaw_rate[-1])

    def transfer(self, axle: str) -> float:
        """Return the load of the right wheel minus that of the left wheel of an axle, at the end of the run [N]."""
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
    """Return the torque divided by the twist between front and rear wheels [N m/rad].

    Upward and downward forces act on the ends of the axles, with opposite equal torques about x: q = K⁻¹ Σ Psi_zᵀ F,
    and each axle rotates by (z_left - z_right) divided by its width.
    """
    rows, widths = {}, {}
    for axle, name in (("front", "kingpin"), ("rear", "rear")):
        ends = [chassis.interface(f"{name}_{side}") for side in ("left", "right")]
        widths[axle] = float(ends[0].position[1] - ends[1].position[1])
        # rotation of the axle by the modes, and the modal load of its torque
        rows[axle] = (ends[0].Psi[2] - ends[1].Psi[2]) / widths[axle]
    twist = rows["front"] - rows["rear"]
    return float(1.0 / (twist @ np.linalg.solve(chassis.K, twist)))
