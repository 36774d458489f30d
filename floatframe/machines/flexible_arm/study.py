"""A fast move under each controller: error of the tip, residual oscillation, and torques."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.integrators.generalized_alpha import GeneralizedAlpha
from floatframe.machines.flexible_arm.collocation import OptimalMove, optimal_move
from floatframe.machines.flexible_arm.control import computed_torque, following
from floatframe.machines.flexible_arm.description import BENDING, LENGTH, FlexibleLinks, arm
from floatframe.model.forces import UserForce
from floatframe.model.functions.point_to_point import quintic
from floatframe.model.system import System
from floatframe.results.coordinate_elements import user_force_motion
from floatframe.results.sensors import measured
from floatframe.results.trajectory import Trajectory
from floatframe.simulation.integrate import integrate

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["BANDWIDTH", "DURATION", "LARGEST", "TARGET", "ArmMotion", "compared", "controlled", "moves", "plot_motions"]

TARGET = {"shoulder": 1.2, "elbow": 0.9}  #: final angles of the hinges [rad]
DURATION = 0.8  #: duration of the move [s]
LARGEST = (8.0, 3.0)  #: largest torque of each motor [N m]
BANDWIDTH = 10.0  #: bandwidth of the feedback control [rad/s]
T_END = 2.0  #: end of the motions [s]


@dataclass(frozen=True, eq=False)
class ArmMotion:
    """The motion of the complete arm under one controller."""

    system: System
    motion: Trajectory
    tip: Array  #: position of the tip, (n_t, 2) [m]
    error: Array  #: distance of the tip from its desired position, (n_t,) [m]
    torque: Array  #: torques of the motors, (n_t, 2) [N m]

    @property
    def residual(self) -> float:
        """Return the largest error after the move [m]."""
        return float(self.error[self.motion.t >= DURATION].max())


def controlled(plant: System, control: UserForce, *, t_end: float = T_END, h: float = 1e-3) -> ArmMotion:
    """Integrate the arm with a controller, in relative coordinates."""
    system = replace(plant, forces=(*plant.forces, control))
    motion = integrate(system, GeneralizedAlpha(0.8), t_end, h, formulation="relative")
    columns = measured(system, motion)["tip"].columns
    tip = np.column_stack([columns["x"], columns["y"]])
    angles = np.cumsum(list(TARGET.values()))
    aim = LENGTH * np.array([np.cos(angles).sum(), np.sin(angles).sum()])
    acting = user_force_motion(system, motion, control.name).force
    torque = np.column_stack([acting[joint] for joint in TARGET])
    return ArmMotion(system, motion, tip, np.linalg.norm(tip - aim, axis=1), torque)


def moves(parts: FlexibleLinks, *, n_intervals: int = 80, modes: Sequence[int] = BENDING) -> dict[str, OptimalMove]:
    """Return the optimal moves of the rigid arm and of the arm with some modes of each link."""
    target = {f"{joint}/angle": value for joint, value in TARGET.items()}
    systems = {"rigid": arm(parts, is_rigid=True), "flexible": arm(parts, modes=modes)}
    return {
        name: optimal_move(system, target, DURATION, torque=LARGEST, n_intervals=n_intervals)
        for name, system in systems.items()
    }


def compared(parts: FlexibleLinks, found: Mapping[str, OptimalMove]) -> dict[str, ArmMotion]:
    """Return the motions of the arm with all its modes, under computed torque and following both optimal moves."""
    plant, rigid = arm(parts), arm(parts, is_rigid=True)
    aims = {joint: quintic(0.0, DURATION, 0.0, value) for joint, value in TARGET.items()}
    controls = {
        "computed torque, rigid model": computed_torque(rigid, aims, BANDWIDTH, LARGEST),
        "optimal move of the rigid model": following(rigid, found["rigid"], BANDWIDTH, LARGEST),
        "optimal move with modes": following(rigid, found["flexible"], BANDWIDTH, LARGEST),
    }
    return {name: controlled(plant, control) for name, control in controls.items()}


def plot_motions(motions: Mapping[str, ArmMotion]) -> "Figure":
    """Plot the error of the tip, its path, and the torques."""
    import matplotlib.pyplot as plt

    figure = plt.figure(figsize=(11, 6.4), layout="constrained")
    axes = figure.subplot_mosaic([["error", "path"], ["torque", "path"]], width_ratios=(1.6, 1))
    for k, (name, each) in enumerate(motions.items()):
        t, color = each.motion.t, f"C{(3, 1, 0)[k % 3]}"
        axes["error"].semilogy(t, 1e3 * each.error, color=color, label=name)
        axes["path"].plot(*each.tip.T, color=color)
        for j, style in enumerate(("-", "--")):
            axes["torque"].plot(t, each.torque[:, j], style, color=color, lw=1.2)
    axes["error"].axvspan(0, DURATION, color="0.93", zorder=0)
    axes["error"].set(ylabel="error of the tip [mm]", ylim=(1e-3, 3e3), title=f"A move of {DURATION:g} s (grey)")
    axes["error"].legend(loc="lower left")
    for most, style in zip(LARGEST, ("-", "--"), strict=True):
        for sign in (-1, 1):
            axes["torque"].axhline(sign * most, color="0.6", lw=0.8, ls=style)
    axes["torque"].set(xlabel="t [s]", ylabel="torque [N m]", title="Motors: shoulder, elbow (dashed), limits (grey)")
    axes["path"].set(xlabel="x [m]", ylabel="y [m]", title="Path of the tip", aspect="equal")
    return figure
