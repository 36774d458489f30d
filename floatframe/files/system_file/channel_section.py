"""Tables of the system file for what is measured, watched and exchanged: sensors, events, FMUs, inputs and outputs."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field, model_validator

from fe_models.foundation.arrays import STRESS_COMPONENTS
from fe_models.foundation.toml_file import Table, Vector3, choice
from fe_models.foundation.words import nearest, quoted
from floatframe.analyses.linear.channels import AnyInput, AnyOutput, Column
from floatframe.analyses.linear.force_inputs import ForceInput
from floatframe.analyses.linear.inputs import BaseMotion, DriveMotion, ParameterInput
from floatframe.errors import ModelError
from floatframe.files.system_file.coordinate_section import of_joint
from floatframe.files.system_file.described import AcceptedTable, DescribedSection, ObjectOf, OneOf
from floatframe.files.system_file.keys import Name, Number
from floatframe.files.system_file.place_key import MeasuredPlace, marker_of
from floatframe.results.sensors import SENSORS, Sensor
from floatframe.results.sensors.channels import QUANTITIES, RATES, Channel, StressChannel
from floatframe.results.sensors.joint_coordinate import JointCoordinate
from floatframe.results.sensors.measurement import owner_and_column
from floatframe.simulation.events import Event
from floatframe.simulation.foreign_units import Coupling, ForeignUnit

__all__ = [
    "CosimulationSection",
    "EventSection",
    "FmuSection",
    "ForeignSection",
    "InputSection",
    "OutputSection",
    "SensorSection",
]


# tables of the system file for sensors: [sensors.NAME] ----------------------------------------------------------------


#: [sensors.NAME]: a quantity measured on a motion
SensorSection = Annotated[DescribedSection, OneOf(SENSORS, "sensors.NAME", "sensor", is_measured=True)]


# tables of the system file for events: [events.NAME] ------------------------------------------------------------------


#: [events.NAME]: an action of a run when a measured value crosses a level, or at a given time
EventSection = Annotated[AcceptedTable, ObjectOf(Event, "events.NAME")]


# tables of the system file for co-simulation: [fmu], [fmus.NAME] and [cosimulation] -----------------------------------


class FmuSection(Table):
    """[fmu]: the inputs, outputs and parameters of the FMU that `floatframe export --to fmu` writes."""

    inputs: list[Name] | None = Field(
        None, description="names of inputs, such as forces.NAME.amplitude, joints.NAME.angle, or a table [inputs.NAME]"
    )
    outputs: list[Name] | None = Field(None, description='names of sensors, or "joint.coordinate"')
    parameters: dict[str, Name] | None = Field(None, description="key paths of numbers in this file by name, text")


class ForeignSection(Table):
    """[fmus.NAME]: an FMU of another program that is coupled to the system."""

    file: Name = Field(description="the path of the FMU, relative to this file")
    inputs: dict[str, Name] = Field({}, description='sensors by input of the FMU, such as {phi = "hinge.angle"}')
    outputs: dict[str, Name] = Field(
        {}, description='inputs of the system by output of the FMU, such as {torque = "forces.motor.motor"}'
    )
    parameters: dict[str, Number] = Field({}, description="numbers by parameter of the FMU")

    def unit(self, name: str, folder: Path) -> ForeignUnit:
        """Return the unit; its path is relative to the folder."""
        return ForeignUnit(name, str(folder / self.file), self.inputs, self.outputs, self.parameters)


#: [cosimulation]: how the system and its FMUs are stepped together
CosimulationSection = Annotated[AcceptedTable, ObjectOf(Coupling, "cosimulation")]


# tables of the system file for inputs and outputs: [inputs.NAME], [outputs.NAME] --------------------------------------


WAYS = {  # keys that belong together, by the key that identifies the group
    "joint": ("joint", "coordinate"),
    "component": ("component", "body", "position"),
    "sensor": ("sensor", "column"),
    "body": ("body", "marker", "direction", "quantity", "relative_to", "relative_marker"),
}
INPUT_TYPES: dict[str, tuple[str, ...]] = {  # type -> keys; those before "|" are required
    "base": ("|", "direction", "quantity", "about", "joints", "measure"),
    "drive": ("joint", "coordinate", "|", "measure"),
    "parameter": ("force", "parameter", "|"),
    "amplitude": ("force", "|"),
    "motor": ("force", "|"),
}


class ChannelSection(Table):
    """A place with a direction, or a joint coordinate."""

    body: str | None = Field(None, description='the name of a body, or "ground"')
    marker: MeasuredPlace | None = Field(None, description="an interface, or a position [x, y, z] in the body")
    direction: Vector3 | None = Field(None, description="the direction in ground axes, [x, y, z]; default: x")
    quantity: choice("quantity", lambda: QUANTITIES) | None = Field(  # type: ignore[valid-type]
        None, description=f"one of {', '.join(QUANTITIES)}"
    )
    relative_to: str | None = Field(None, description="the name of the body relative to which it is measured")
    relative_marker: MeasuredPlace | None = Field(None, description="an interface of, or a position in that body")
    joint: str | None = Field(None, description="the name of a joint")
    coordinate: str | None = Field(None, description='a coordinate of the joint; without joint "JOINT.COORDINATE"')

    @model_validator(mode="before")
    @classmethod
    def _of_joint(cls, value: Any) -> Any:
        return of_joint(value)

    def way(self) -> str:
        """Return the group of `WAYS` to which the keys belong; `ValueError` if they are of different groups."""
        way = next((key for key in WAYS if getattr(self, key, None) is not None), None)
        if way is None:
            raise ValueError("expected body (with marker and direction), or joint and coordinate")
        for key in type(self).model_fields:
            if key != "measure" and getattr(self, key) is not None and key not in WAYS[way]:
                raise ValueError(f"the keys {way} and {key} do not go together; with {way}: {', '.join(WAYS[way][1:])}")
        if way == "joint" and self.coordinate is None:
            raise ValueError("coordinate: missing; expected a coordinate of the joint")
        return way

    def place_or_coordinate(self, name: str, rate: int = 0) -> Channel | JointCoordinate:
        """Return the channel of the table."""
        if self.way() == "joint":
            return JointCoordinate(str(self.joint), str(self.coordinate), name, rate)
        seen_from = None if self.relative_to is None else marker_of(self.relative_to, self.relative_marker)
        direction = np.array(self.direction or (1.0, 0.0, 0.0))
        return Channel(
            name, marker_of(str(self.body), self.marker), direction, self.quantity or QUANTITIES[0], seen_from, rate
        )


class InputSection(ChannelSection):
    """[inputs.NAME]: a force or torque; with `type`, a motion of the base or a drive, a parameter or an amplitude."""

    type: choice("type of input", lambda: tuple(INPUT_TYPES)) | None = Field(  # type: ignore[valid-type]
        None, description=f"one of {', '.join(INPUT_TYPES)}; without: a force or torque"
    )
    measure: choice("measure", lambda: RATES) | None = Field(  # type: ignore[valid-type]
        None, description=f"of a base or drive, one of {', '.join(RATES)}; default: {RATES[2]}"
    )
    about: Vector3 | None = Field(None, description="a point on the axis about which a base rotates, [x, y, z]")
    joints: list[str] | None = Field(None, description="joints and forces whose ground side moves; default: all")
    force: str | None = Field(None, description="the name of a force")
    parameter: str | None = Field(None, description="a parameter of its expressions")

    @model_validator(mode="after")
    def _fits(self) -> "InputSection":
        if self.type is None:
            if self.measure is not None:
                raise ValueError('measure: a force has none; expected type = "base" or "drive" beside it')
            self.way()
            return self
        keys = INPUT_TYPES[self.type]
        allowed, needed = [key for key in keys if key != "|"], keys[: keys.index("|")]
        for key in type(self).model_fields:
            if key != "type" and getattr(self, key) is not None and key not in allowed:
                raise ValueError(f"an input of type {self.type} has no key {key}{nearest(key, allowed)}")
        for key in needed:
            if getattr(self, key) is None:
                raise ValueError(f"{key}: missing; expected {type(self).model_fields[key].description}")
        return self

    def channel(self, name: str) -> AnyInput:
        """Return the input of the table."""
        rate = RATES.index(self.measure or RATES[2])
        if self.type == "drive":
            return DriveMotion(name, str(self.joint), str(self.coordinate), rate)
        if self.type == "parameter":
            return ParameterInput(name, str(self.force), str(self.parameter))
        if self.type in ("amplitude", "motor"):
            return ForceInput(name, str(self.force))
        if self.type == "base":
            about, direction = np.array(self.about or (0.0, 0.0, 0.0)), np.array(self.direction or (1.0, 0.0, 0.0))
            return BaseMotion(name, direction, self.quantity or QUANTITIES[0], about, self.joints, rate)
        return self.place_or_coordinate(name)


class OutputSection(ChannelSection):
    """[outputs.NAME]: a sensor or one of its columns, a motion of a point or joint coordinate, or a stress."""

    measure: choice("measure", lambda: RATES) = Field(  # type: ignore[valid-type]
        RATES[0], description=f"one of {', '.join(RATES)}"
    )
    component: choice("stress component", lambda: STRESS_COMPONENTS) | None = Field(  # type: ignore[valid-type]
        None, description=f"one of {', '.join(STRESS_COMPONENTS)}: the output is a stress"
    )
    position: Vector3 | None = Field(None, description="a position in the body, [x, y, z]: the nearest node is taken")
    sensor: str | None = Field(None, description='the name of a table [sensors.NAME], or a column, "tip.x"')
    column: str | None = Field(None, description='a column of the sensor, such as "force x"; default: all')

    @model_validator(mode="after")
    def _fits(self) -> "OutputSection":
        if self.way() == "component" and (self.body is None or self.position is None):
            raise ValueError("a stress needs body and position")
        return self

    def output(self, name: str, sensors: Sequence[Sensor]) -> AnyOutput:
        """Return the output of the table; `ModelError` with the nearest name if there is no such sensor."""
        way = self.way()
        if way == "sensor":
            known = {sensor.name: sensor for sensor in sensors}
            owner, column = owner_and_column(str(self.sensor), known)
            if owner not in known or (column and self.column):
                hint = nearest(str(self.sensor), known)
                raise ModelError(f"outputs.{name}: no sensor {quoted(str(self.sensor))}{hint}")
            column = column or self.column or ""
            return Column(known[owner], column, name) if column else replace(known[owner], name=name)
        if way == "component":
            return StressChannel(name, str(self.body), str(self.component), np.array(self.position))
        return self.place_or_coordinate(name, RATES.index(self.measure))
