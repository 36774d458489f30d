"""Inputs and outputs of a linearised system: loads and motions that act on it, and observed sensor columns."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.records import checked_fields
from fe_models.foundation.words import nearest, quoted
from floatframe.analyses.linear.force_inputs import ForceInput, force_input_unit
from floatframe.analyses.linear.inputs import BaseMotion, DriveMotion, ParameterInput
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker
from floatframe.model.forces import driven_forces
from floatframe.model.system import Named, System
from floatframe.results.sensors import coordinate_sensors, named_coordinates, sensor_and_column
from floatframe.results.sensors.channels import VALUE, Channel, StressChannel
from floatframe.results.sensors.joint_coordinate import JointCoordinate
from floatframe.results.sensors.linear_columns import linear_columns
from floatframe.results.sensors.measurement import AnyOutput, Measurement
from floatframe.results.small_motions.rows import LinearColumns, Rows, joined
from floatframe.results.small_motions.small_motions import SmallMotions
from floatframe.results.trajectory import Trajectory

__all__ = [
    "AnyInput",
    "AnyOutput",
    "Column",
    "Observed",
    "channel_unit",
    "inputs_of",
    "named_input",
    "named_output",
    "observed",
    "outputs_of",
    "require_input",
]


DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")  #: components of the motion of a place


AnyInput = Channel | JointCoordinate | DriveMotion | BaseMotion | ParameterInput | ForceInput


@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class Column:
    """One column of a sensor as an output.

    Parameters
    ----------
    sensor
        The sensor.
    column
        Name of the column, such as "force x".
    name
        Name of the output; default: "sensor.column".
    """

    sensor: AnyOutput
    column: str
    name: str = ""

    def __post_init__(self) -> None:
        if not self.name:
            object.__setattr__(self, "name", f"{self.sensor.name}.{self.column}")

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return the values of the column over time."""
        found = self.sensor.measure(system, trajectory)
        self.require(list(found.columns))
        return Measurement(self.name, found.t, {VALUE: found.columns[self.column]}, {VALUE: found.units[self.column]})

    def linear(self, small: SmallMotions) -> LinearColumns:
        """Return the column as a function of small motions; `ModelError` if it is not linear."""
        found = linear_columns(self.sensor, small)
        self.require([*found.columns, *found.not_linear])
        if self.column in found.not_linear:
            raise ModelError(f"output {self.name!r} is not linear here: {found.not_linear[self.column]}")
        return LinearColumns({VALUE: found.columns[self.column]}, {VALUE: found.units[self.column]}, {})

    def require(self, choices: list[str]) -> None:
        """Raise `ModelError`, with the closest name, if the sensor has no such column."""
        if self.column not in choices:
            raise ModelError(
                f"sensor {self.sensor.name!r}: no column {quoted(self.column)}{nearest(self.column, choices)}"
            )


@dataclass(frozen=True, eq=False)
class Observed:
    """Outputs as functions of small motions."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    rows: Rows  #: one row for each output
    values: Array  #: output values in the steady motion, (n_outputs,)
    left_out: dict[str, str]  #: columns that are not linear about the steady motion, with the reasons


def observed(small: SmallMotions, outputs: Iterable[AnyOutput]) -> Observed:
    """Return output columns as functions of small motions; a sensor with one column gives it the sensor's name.

    Raises
    ------
    ModelError
        If an output refers to an unknown object, a requested column is not linear, or two outputs have the same name.
    """
    names: list[str] = []
    units: list[str] = []
    rows = [small.by_motion(np.zeros((0, small.n_x)))]
    values: list[float] = []
    left_out: dict[str, str] = {}
    for output in outputs:
        linear, now = linear_columns(output, small), output.measure(small.system, small.now)
        is_single = len(linear.columns) + len(linear.not_linear) == 1
        named = {column: output.name if is_single else f"{output.name}.{column}" for column in linear.units}
        left_out |= {named[column]: why for column, why in linear.not_linear.items()}
        for column, row in linear.columns.items():
            if named[column] in names:
                raise ModelError(f"linearize: two outputs are called {named[column]!r}; give each its own name")
            names.append(named[column])
            units.append(linear.units[column])
            rows.append(row)
            values.append(float(now.columns[column][0]))
    return Observed(tuple(names), tuple(units), joined(rows), np.array(values), left_out)


def inputs_of(carried: Iterable[Named]) -> tuple[AnyInput, ...]:
    """Return the inputs of a system, which stores them under a general type."""
    return cast(tuple[AnyInput, ...], tuple(carried))


def outputs_of(carried: Iterable[Named]) -> tuple[AnyOutput, ...]:
    """Return the outputs of a system, which stores them under a general type."""
    return cast(tuple[AnyOutput, ...], tuple(carried))


def named_output(system: System, output: AnyOutput | str) -> AnyOutput:
    """Return an output; a text names an output or input of the system, "body/interface:x", or any sensor or column.

    Raises
    ------
    ModelError
        If there is none; the message has the nearest name.
    """
    if not isinstance(output, str):
        return output
    own = {each.name: each for each in (*outputs_of(system.outputs), *outputs_of(system.inputs))}
    if output in own:
        return own[output]
    if (place := named_place(system, output)) is not None:
        return place
    sensor, column = sensor_and_column(system, output)
    if isinstance(sensor, JointCoordinate) and sensor.rate is None and column in ("", VALUE):
        return replace(sensor, name=output, rate=0)
    return Column(sensor, column, output) if column else sensor


def named_input(system: System, channel: AnyInput | str) -> AnyInput:
    """Return an input; a text names an input of the system, a force, a drive, a coordinate, or "body/interface:x".

    Forces are named as `driven_forces` does, drives "joints.hub.angle"; the name of a coordinate, "hub.angle", means
    the force along it.

    Raises
    ------
    ModelError
        If there is none; the message has the nearest name.
    """
    if not isinstance(channel, str):
        return channel
    own = {each.name: each for each in (*inputs_of(system.inputs), *inputs_of(system.outputs))}
    forces = driven_forces(system.forces)
    drives = {
        f"joints.{joint.name}.{coordinate}": DriveMotion(f"joints.{joint.name}.{coordinate}", joint.name, coordinate)
        for joint in system.joints
        for coordinate in getattr(joint, "motions", {})
    }
    coordinates = named_coordinates(system)
    if channel in own:
        return own[channel]
    if channel in forces:
        return ForceInput(channel, forces[channel].name)
    if channel in drives:
        return drives[channel]
    if channel in coordinates:
        return replace(coordinates[channel], name=channel)
    if (place := named_place(system, channel)) is not None:
        return place
    if ":" in channel:
        body = channel.rpartition(":")[0].partition("/")[0]
        hint = f"; no body {quoted(body)}{nearest(body, [each.name for each in system.bodies])}"
    else:
        hint = nearest(channel, [*own, *forces, *drives, *(each.name for each in coordinate_sensors(system))])
    raise ModelError(
        f"system {system.name!r}: no input {quoted(channel)}: expected an input of the system, a force such as "
        f"'motor.torque', a drive such as 'joints.hub.angle', a coordinate, or body/interface:component{hint}"
    )


def named_place(system: System, name: str) -> Channel | None:
    """Return the channel "body/interface:component" or "body:component"; None if it begins with no body and a colon.

    Raises
    ------
    ModelError
        If there is no such component.
    """
    place, colon, component = name.rpartition(":")
    body, _, interface = place.partition("/")
    if not colon or body not in [each.name for each in system.bodies]:
        return None
    if component not in DIRECTIONS:
        raise ModelError(f"channel {name!r}: expected body/interface:component{nearest(component, DIRECTIONS)}")
    k = DIRECTIONS.index(component)
    return Channel(name, Marker(body, interface or None), np.eye(3)[k % 3], "translation" if k < 3 else "rotation")


def require_input(channel: Any) -> None:
    """Raise `ModelError` unless a channel can be an input."""
    if isinstance(channel, StressChannel):
        raise ModelError(f"linearize: channel {channel.name!r} is a stress: expected a force or torque as an input")
    if not isinstance(channel, AnyInput):
        raise ModelError(
            f"linearize: {getattr(channel, 'name', channel)!r} is not an input: expected a Channel or a "
            "JointCoordinate (a force along it), ForceInput, DriveMotion, BaseMotion or ParameterInput"
        )


def channel_unit(system: System, channel: AnyInput) -> str:
    """Return the unit of an input channel."""
    if isinstance(channel, ForceInput):
        return force_input_unit(system, channel)
    return channel.force_units(system.units)
