"""Evaluation of a start: modes, supply lines in the loads of the mounts, and their predictions."""

from dataclasses import replace
from typing import NamedTuple, cast

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.analyses.linear.channels import AnyOutput, Column
from floatframe.analyses.linear.linearization import LinearSystem, linearize
from floatframe.analyses.linear.system_modes import SystemModes, system_modes
from floatframe.components.drives import InductionMotor
from floatframe.errors import ModelError
from floatframe.files.signals.orders import order_cut, order_map
from floatframe.files.signals.signals import Signal
from floatframe.machines.motor_bogie.closed_forms import speed_of_torque, torque_lines, torque_over_speed
from floatframe.machines.motor_bogie.description import ENDS, MotorBogie
from floatframe.model.system import System
from floatframe.results.element_motion import element_motion
from floatframe.results.sensors import measured
from floatframe.results.sensors.channels import CoordinateChannel
from floatframe.results.trajectory import Trajectory

__all__ = ["ModeOfBogie", "SupplyLines", "at_rest", "modes_of", "predicted_lines", "supply_lines", "supply_phase"]

MULTIPLES = (6, 12)  #: multiples of the supply frequency, for a six-step inverter


def at_rest(system: System, load: str = "leading_lower", column: str = "force x") -> LinearSystem:
    """Return the bogie without supply, linearised at rest.

    Inputs are the air-gap torques of both motors. Outputs are a column of a mount, and the speed of the leading rotor
    relative to its motor. Wheels at rest stick to the rails, as they do at small slip.
    """
    drives = [each for each in system.elements if isinstance(each, InductionMotor)]
    bodies = [replace(each, velocity=np.zeros(3), omega_B=np.zeros(3)) for each in system.bodies]
    still = replace(
        system, bodies=bodies, elements=[each for each in system.elements if each not in drives], sensors=[]
    )
    sensor = next((each for each in system.sensors if each.name == load), None)
    if sensor is None:
        raise ModelError(f"at_rest: the system has no sensor {load!r}")
    torques = [CoordinateChannel(f"torque {word}", f"{word}_spindle", "angle") for word in ENDS]
    speed = CoordinateChannel("speed", "leading_spindle", "angle", 1)
    return linearize(still, inputs=torques, outputs=[Column(cast(AnyOutput, sensor), column), speed])


class ModeOfBogie(NamedTuple):
    """An oscillation, and the location of its kinetic energy."""

    frequency: float  #: [Hz]
    damping: float  #: ratio
    where: str  #: the two bodies with the largest shares
    flexible: float  #: share of the kinetic energy in the modes of the frame


def modes_of(linear: LinearSystem, lowest: float = 5.0, highest: float = 200.0) -> list[ModeOfBogie]:
    """Return the oscillations of the bogie at rest between two frequencies."""
    modes: SystemModes = system_modes(linear)
    sizes = [len(mass) for mass in linear.body_masses]
    first = np.concatenate([[0], np.cumsum(sizes)])
    found = []
    for k, root in enumerate(modes.eigenvalues):
        f = abs(root) / (2 * np.pi)
        if root.imag <= 0 or not lowest < f < highest:
            continue
        parts, elastic = [], 0.0
        for i, mass in enumerate(linear.body_masses):
            x = modes.shapes[first[i] : first[i + 1], k]
            parts.append(float((x.conj() @ mass @ x).real))
            if sizes[i] > 6:
                elastic = float((x[6:].conj() @ mass[6:, 6:] @ x[6:]).real)
        order = np.argsort(parts)[::-1][:2]
        where = ", ".join(linear.body_names[i] for i in order)
        found.append(ModeOfBogie(f, float(-root.real / abs(root)), where, elastic / sum(parts)))
    return found


class SupplyLines(NamedTuple):
    """Amplitudes at multiples of the supply frequency."""

    frequency: Array  #: of the supply, (n,) [Hz]
    torque: dict[int, Array]  #: in the air gap of the leading motor, by multiple, each (n,) [N m]
    load: dict[int, Array]  #: in a mount, each (n,) [N]


def supply_phase(system: System, t: Array, drive: str = "leading_drive") -> tuple[Array, Array]:
    """Return frequency [Hz] and phase [rad] of the supply of a motor, (n_t,) each."""
    motor = next(each for each in system.elements if each.name == drive)
    assert isinstance(motor, InductionMotor)
    frequency = motor.frequency.at(t)  # type: ignore[union-attr]
    return frequency, 2 * np.pi * np.concatenate(
        [[0.0], np.cumsum(0.5 * (frequency[1:] + frequency[:-1]) * np.diff(t))]
    )


def supply_lines(
    system: System, motion: Trajectory, load: str = "leading_lower", column: str = "force x",
    *, multiples: tuple[int, ...] = MULTIPLES, slowest: float = 1.5,
) -> SupplyLines:  # fmt: skip
    """Return the supply lines of a start, by order tracking relative to the supply, above a supply frequency [Hz]."""
    t = np.asarray(motion.t)
    _, phase = supply_phase(system, t)
    torque = element_motion(system, motion, "leading_drive").outputs["torque"]
    force = measured(system, motion)[load].columns[column]
    maps = [
        order_map(
            Signal(name, t, np.asarray(values), unit), phase, max_order=max(multiples) + 1.0, resolution=0.5,
            slowest=2 * np.pi * slowest,
        )
        for name, values, unit in (("torque", torque, "N m"), ("load", force, "N"))
    ]  # fmt: skip
    speeds = maps[0].speeds
    assert speeds is not None
    cuts = [{n: order_cut(each, n) for n in multiples} for each in maps]
    return SupplyLines(speeds / (2 * np.pi), cuts[0], cuts[1])


def predicted_lines(
    data: MotorBogie, linear: LinearSystem, frequencies: Array, torque: float, multiples: tuple[int, ...] = MULTIPLES
) -> SupplyLines:
    """Return the lines for constant speed at each supply frequency, from closed forms and frequency responses.

    The ripple T_n of `torque_lines` rotates the rotors with the mobility Y = speed / torque of the linearised bogie.
    This adds G = `torque_over_speed` times the speed to the torque: T = T_n/(1 - G Y). The load is the response H to
    both torques.
    """
    f = np.asarray(frequencies, dtype=float)
    rotor = np.array([speed_of_torque(data.motor, each, torque) for each in f])
    lines = [torque_lines(data.motor, data.harmonics, each, speed) for each, speed in zip(f, rotor, strict=True)]
    torques, loads = {}, {}
    for n in multiples:
        response = linear.response(n * f).sum(axis=2)  # both motors have the same supply
        G = np.array([torque_over_speed(data.motor, each, w, n * each) for each, w in zip(f, rotor, strict=True)])
        T = np.array([each[n] for each in lines]) / (1 - G * response[:, 1])
        torques[n], loads[n] = np.abs(T), np.abs(T * response[:, 0])
    return SupplyLines(f, torques, loads)
