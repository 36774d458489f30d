"""Inverse dynamics: the drive forces that produce a prescribed motion, with the reactions.

    inverse = inverse_dynamics(system, np.linspace(0, 2, 401))       # a fully driven system
    inverse.drives["main.angle"].force                               # torque over time
    integrate(with_motors(system, inverse.drives), GeneralizedAlpha(), 2.0, 1e-3, state=inverse.motion.state(0))

The last line reproduces the motion, with motors that exert these forces instead of the drives. If bodies vibrate in the
motion, `drive_forces(system, integrate(system, ...))` returns the drive forces including vibrations.
"""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from fe_models.foundation.arrays import Array
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from floatframe.analyses.driven.driven_motion import Elasticity, quasi_static_bodies
from floatframe.analyses.driven.kinematics import kinematics
from floatframe.errors import ModelError
from floatframe.model.forces import JointForce
from floatframe.model.functions.time_functions import table
from floatframe.model.state import State
from floatframe.model.system import System
from floatframe.results.sensors.joint_coordinate import JointCoordinate
from floatframe.results.sensors.measurement import Measurement
from floatframe.results.small_motions.joint_rates import driven_coordinates
from floatframe.results.trajectory import Trajectory

__all__ = ["InverseDynamics", "drive_forces", "inverse_dynamics", "with_motors"]


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class InverseDynamics:
    """A prescribed motion and the forces it requires.

    Parameters
    ----------
    motion
        Includes the reactions of all joints.
    drives
        Value, rate and force of the driven coordinates, by "joint.coordinate".
    """

    motion: Trajectory
    drives: Mapping[str, Measurement]


def inverse_dynamics(
    system: System,
    times: Sequence[float] | Array,
    *,
    elasticity: Elasticity = quasi_static_bodies,
    state: State | None = None,
    output: str | os.PathLike[str] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> InverseDynamics:
    """Return the motion of a fully driven system, its reactions, and the forces and torques of its drives.

    Parameters
    ----------
    system, times, state, output, progress
        As for `kinematics`.
    elasticity
        `quasi_static_bodies`: flexible bodies deform under loads and inertia, without vibrations; `frozen_bodies`: they
        keep their assembled shape.

    Raises
    ------
    ModelError, ConvergenceError
        As for `kinematics`.
    """
    motion = kinematics(system, times, elasticity=elasticity, state=state, output=output, progress=progress)
    return InverseDynamics(motion, drive_forces(system, motion))


def drive_forces(system: System, motion: Trajectory) -> dict[str, Measurement]:
    """Return value, rate and force of all driven coordinates in any motion of the system, by "joint.coordinate".

    Parameters
    ----------
    system
        The system with the prescribed motions.
    motion
        Any motion of this system.
    """
    found = {}
    for name in driven_coordinates(system):
        joint, _, coordinate = name.rpartition(".")
        found[name] = JointCoordinate(joint, coordinate).measure(system, motion)
    return found


def with_motors(system: System, drives: Mapping[str, Measurement]) -> System:
    """Return the system with motors in place of these drives; the motor forces are cubic splines over time.

    Parameters
    ----------
    system
        The system with prescribed motions.
    drives
        Motion and force of each drive to replace, by "joint.coordinate", as `drive_forces` returns them.

    Raises
    ------
    ModelError
        If a coordinate is not driven, or there are fewer than four times.
    """
    driven = driven_coordinates(system)
    for name in drives:
        if name not in driven:
            raise ModelError(f"with_motors: {name!r} is not driven; driven are {', '.join(driven) or 'none'}")
    joints = [released(joint, drives) for joint in system.joints]
    motors = [
        JointForce(
            f"motor of {name}", name.rpartition(".")[0], name.rpartition(".")[2], motor=table(drive.t, drive.force)
        )
        for name, drive in drives.items()
    ]
    return replace(system, joints=joints, forces=[*system.forces, *motors])


def released(joint: Any, drives: Mapping[str, Measurement]) -> Any:
    """Return a joint without its prescribed motions that are among the drives."""
    motions = getattr(joint, "motions", None)
    if not motions:
        return joint
    return replace(joint, motions={c: f for c, f in motions.items() if f"{joint.name}.{c}" not in drives})
