"""Inputs of a system that another program sets: force factors, motors and drives, held between communication steps.

Each input is a function of time with one piece in the compiled system. A unit writes its coefficients at every
communication point; nothing is compiled again.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from fe_models.foundation.words import nearest, quoted
from floatframe.analyses.linear.channels import channel_unit, inputs_of
from floatframe.engine.compiling.system import CompiledSystem
from floatframe.errors import ModelError
from floatframe.model.forces import BodyLoad, JointForce, PointForce
from floatframe.model.functions.time_functions import TimeFunction, constant
from floatframe.model.system import System
from floatframe.results.sensors.channels import Channel
from floatframe.results.sensors.joint_coordinate import JointCoordinate
from floatframe.results.sensors.measurement import amplitude_unit, unit_words
from floatframe.simulation.held_functions import force_numbers

__all__ = ["HeldInput", "function_numbers", "input_choices", "with_held_inputs"]


@dataclass(frozen=True)
class HeldInput:
    """A value that another program prescribes: name, unit and initial value."""

    name: str  #: name, such as forces.push.amplitude, joints.hub.angle, or the name of a table [inputs.NAME]
    unit: str  #: unit in the symbols of the system, "1" for a factor
    words: str  #: description of the input
    start: float  #: value at t = 0
    is_drive: bool = False  #: whether it is a prescribed coordinate, given with its first two rates
    is_own: bool = True  #: whether it is constant in the file, so that it is an input by default

    def variables(self, time_symbol: str) -> list[tuple[str, str]]:
        """Return names and units of the variables: one, or three (value, rate, acceleration) for a drive."""
        if not self.is_drive:
            return [(self.name, self.unit)]
        per_time = (f"{self.unit}/{time_symbol}", f"{self.unit}/{time_symbol}²")
        return [(self.name, self.unit), (f"{self.name}.rate", per_time[0]), (f"{self.name}.acceleration", per_time[1])]


def force_channels(system: System) -> list[Channel | JointCoordinate]:
    """Return the inputs of a system that are forces; drives are separate inputs, and bases are not supported."""
    return [each for each in inputs_of(system.inputs) if isinstance(each, Channel | JointCoordinate)]


def is_constant(function: TimeFunction | float | None) -> bool:
    """Return whether a function of time is constant."""
    return not isinstance(function, TimeFunction) or (len(function.begins) == 1 and not function.pieces[0, 1:7].any())


def value_at_start(function: TimeFunction | float | None, default: float) -> float:
    """Return the value of a function of time at t = 0."""
    return default if function is None else function(0.0) if isinstance(function, TimeFunction) else float(function)


def input_choices(system: System) -> dict[str, HeldInput]:
    """Return all possible inputs of a system by name."""
    return {each.name: each for each in found_inputs(system)}


def found_inputs(system: System) -> Iterator[HeldInput]:
    """Yield the possible inputs of a system from forces, drives and channels."""
    for channel in force_channels(system):
        unit = channel_unit(system, channel)
        yield HeldInput(channel.name, unit, f"force or torque of the input {channel.name}", 0.0)
    for force in system.forces:
        if isinstance(force, PointForce | BodyLoad):
            begin, own = value_at_start(force.amplitude, 1.0), is_constant(force.amplitude)
            yield HeldInput(f"forces.{force.name}.amplitude", "1", f"factor of {force.name}", begin, is_own=own)
        elif isinstance(force, JointForce):
            begin, own = value_at_start(force.motor, 0.0), is_constant(force.motor)
            what, unit = "moment" if force.is_angular else "force", amplitude_unit(system.units, force)
            yield HeldInput(f"forces.{force.name}.motor", unit, f"motor {what} of {force.name}", begin, is_own=own)
    for joint in system.joints:
        for coordinate, motion in getattr(joint, "motions", {}).items():
            what = "angle" if is_angle(system, joint.name, coordinate) else "length"
            words, begin = f"prescribed {coordinate} of joint {joint.name}", value_at_start(motion, 0.0)
            name, own = f"joints.{joint.name}.{coordinate}", is_constant(motion)
            yield HeldInput(name, unit_words(system.units, what), words, begin, is_drive=True, is_own=own)


def is_angle(system: System, joint: str, coordinate: str) -> bool:
    """Return whether a joint coordinate is an angle rather than a distance."""
    return coordinate.startswith("angle")


def with_held_inputs(system: System, names: Sequence[str] | None = None) -> tuple[System, tuple[HeldInput, ...]]:
    """Return a system in which inputs are functions with one piece, and the inputs.

    Parameters
    ----------
    system
        The system.
    names
        Names in `input_choices`; None: the tables [inputs.NAME], and all constant forces and drives of the system.

    Raises
    ------
    ModelError
        If a name is not one of the choices, with the nearest.
    """
    if system.controllers:
        raise ModelError(
            f"system {system.name!r}: controllers ({', '.join(each.name for each in system.controllers)}) act in plain "
            "runs only; in a unit or beside units, let the other program control the system"
        )
    choices = input_choices(system)
    for name in names or ():
        if name not in choices:
            prescribed = " (a coordinate is an input where the file prescribes it: [joints.NAME.motions.COORDINATE])"
            hint = prescribed if name.startswith("joints.") else ""
            raise ModelError(f"system {system.name!r}: no input {quoted(name)}{nearest(name, choices)}{hint}")
    taken = [each for each in choices.values() if (each.is_own if names is None else each.name in names)]
    held = {each.name: constant(each.start) for each in taken}
    forces: list[Any] = []
    for force in system.forces:
        for key in ("amplitude", "motor"):
            name = f"forces.{getattr(force, 'name', '')}.{key}"
            if name in held:
                force = replace(force, **{key: held[name]})  # type: ignore[arg-type]
        forces.append(force)
    joints: list[Any] = []
    for joint in system.joints:
        motions = dict(getattr(joint, "motions", {}))
        driven = {c: held[f"joints.{joint.name}.{c}"] for c in motions if f"joints.{joint.name}.{c}" in held}
        joints.append(replace(joint, motions=motions | driven) if driven else joint)
    for channel in force_channels(system):
        if channel.name in held:
            forces += channel_forces(channel, held[channel.name])
    return replace(system, forces=forces, joints=joints, inputs=()), tuple(taken)


def channel_forces(channel: Any, function: TimeFunction) -> list[PointForce | JointForce]:
    """Return the forces along a channel of a linearised system, whose size is a function of time."""
    if not isinstance(channel, Channel):
        return [JointForce(f"inputs.{channel.name}", channel.joint, channel.coordinate, motor=function)]
    key = "force" if channel.quantity == "translation" else "torque"
    ends = [(f"inputs.{channel.name}", channel.marker, 1.0)]
    if channel.relative_to is not None:
        ends.append((f"inputs.{channel.name}.against", channel.relative_to, -1.0))
    return [
        PointForce(name, marker, **{key: sign * channel.direction}, amplitude=function)  # type: ignore[arg-type]
        for name, marker, sign in ends
    ]


def function_numbers(system: System, compiled: CompiledSystem, held: HeldInput) -> list[int]:
    """Return the numbers of an input's functions in the compiled system."""
    model = compiled.model
    names = {held.name, f"inputs.{held.name}", f"inputs.{held.name}.against"}
    names |= {held.name.removeprefix("forces.").removesuffix(end) for end in (".amplitude", ".motor")}
    if held.is_drive:
        rows = zip(compiled.owners, compiled.coordinates, model.rows.motion, strict=True)
        return [int(f) for owner, coordinate, f in rows if f >= 0 and f"joints.{owner}.{coordinate}" == held.name]
    return force_numbers(system, compiled, names)
