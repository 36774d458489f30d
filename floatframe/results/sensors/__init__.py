"""Named sensors that measure a motion, in Python and in the tables [sensors.NAME] of a system file.

`SENSORS` is the registry; a new sensor is a class with `measure`, and its line there.
"""

from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from typing import Any, cast

from fe_models.door import Registry
from fe_models.foundation.words import nearest, quoted
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker
from floatframe.model.system import System
from floatframe.results.sensors.body_loads import InterfaceForceSensor, RecoverySensor, SpringSensor
from floatframe.results.sensors.channels import Channel, StressChannel
from floatframe.results.sensors.elements import BushingSensor, ControlSensor, CouplerSensor, ElementSensor
from floatframe.results.sensors.joint_coordinate import JointCoordinate
from floatframe.results.sensors.left_out import LeftOutSensor
from floatframe.results.sensors.loads import EnergySensor, ModeSensor, MomentumSensor, ReactionSensor
from floatframe.results.sensors.measurement import Measurement, Sensor, owner_and_column
from floatframe.results.sensors.places import (
    PLACE_QUANTITIES,
    AngleSensor,
    DisplacementSensor,
    PlaceSensor,
    found_at,
    found_nodes,
    is_at_node,
)
from floatframe.results.sensors.stresses import (
    ElongationSensor,
    StrainGauge,
    StressSensor,
    VonMisesSensor,
    address_of,
    flexible_body,
)
from floatframe.results.trajectory import Trajectory

__all__ = [
    "SENSORS",
    "AngleSensor",
    "BushingSensor",
    "Channel",
    "ControlSensor",
    "CouplerSensor",
    "DisplacementSensor",
    "ElementSensor",
    "ElongationSensor",
    "EnergySensor",
    "InterfaceForceSensor",
    "JointCoordinate",
    "LeftOutSensor",
    "Measurement",
    "ModeSensor",
    "MomentumSensor",
    "PlaceSensor",
    "ReactionSensor",
    "RecoverySensor",
    "Sensor",
    "SpringSensor",
    "StrainGauge",
    "StressChannel",
    "StressSensor",
    "VonMisesSensor",
    "coordinate_sensors",
    "measured",
    "measurement_of",
    "named_coordinates",
    "sensor_and_column",
    "sensor_of",
    "sensor_points",
    "sensors_of",
]


def is_sensor(kind: Any) -> bool:
    """Whether an object is a class of sensors."""
    return is_dataclass(kind) and callable(getattr(kind, "measure", None))


#: sensor classes by the `type` of a table [sensors.NAME]; their fields are the keys of the table. Other packages add
#: classes by entry points
SENSORS: Registry[type[Sensor]] = Registry(
    "floatframe.sensors",
    {
        **dict.fromkeys(PLACE_QUANTITIES, PlaceSensor),
        "angle": AngleSensor,
        "bushing": BushingSensor,
        "control": ControlSensor,
        "coordinate": JointCoordinate,
        "coupler": CouplerSensor,
        "displacement": DisplacementSensor,
        "element": ElementSensor,
        "elongation": ElongationSensor,
        "energy": EnergySensor,
        "interface-force": InterfaceForceSensor,
        "left-out": LeftOutSensor,
        "mode": ModeSensor,
        "momentum": MomentumSensor,
        "reaction": ReactionSensor,
        "recovery": RecoverySensor,
        "spring": SpringSensor,
        "strain": StrainGauge,
        "stress": StressSensor,
        "von-mises": VonMisesSensor,
    },
    ModelError,
    kind="a dataclass with the method measure",
    is_kind=is_sensor,
)


def measured(system: System, trajectory: Trajectory, sensors: Sequence[Sensor] | None = None) -> dict[str, Measurement]:
    """Return the measurements of sensors during a motion, by name; by default of all sensors of the system.

    Parameters
    ----------
    system
        The system that moved.
    trajectory
        Its motion.
    sensors
        The sensors to evaluate; None: all sensors of the system.

    Raises
    ------
    ModelError
        If the motion is of another system, or a sensor refers to an object that does not exist.
    """
    names = [body.name for body in system.bodies]
    if names != list(trajectory.body_names):
        raise ModelError(
            f"measured: the motion has bodies {', '.join(trajectory.body_names)}, but system {system.name!r} has "
            f"{', '.join(names)}; give the system of the run"
        )
    return {
        sensor.name: sensor.measure(system, trajectory)
        for sensor in (sensors_of(system) if sensors is None else sensors)
    }


def sensors_of(system: System) -> tuple[Sensor, ...]:
    """Return the sensors of a system, which stores them under a general type."""
    return cast(tuple[Sensor, ...], system.sensors)


def coordinate_sensors(system: System) -> tuple[JointCoordinate, ...]:
    """Return a sensor "joint.coordinate" for every coordinate of every joint; made once for a system."""
    return system.derived(make_coordinate_sensors)


def make_coordinate_sensors(system: System) -> tuple[JointCoordinate, ...]:
    """Return a new sensor for every coordinate of every joint."""
    return tuple(JointCoordinate(joint.name, coordinate) for joint in system.joints for coordinate in joint.coordinates)


def named_coordinates(system: System) -> dict[str, JointCoordinate]:
    """Return the sensors of all joint coordinates by their names "pin.angle" and "pin angle"."""
    sensors = coordinate_sensors(system)
    return {f"{each.joint}{sign}{each.coordinate}": each for sign in " ." for each in sensors}


def sensor_of(system: System, name: str) -> Sensor:
    """Return a sensor by name, or a new sensor for "joint.coordinate" or "element.output"; it must be no column.

    Raises
    ------
    ModelError
        If there is none, or the name is that of a column.
    """
    sensor, column = sensor_and_column(system, name)
    if column:
        raise ModelError(f"{quoted(name)}: expected the name of a sensor, got its column; take {quoted(sensor.name)}")
    return sensor


def sensor_and_column(system: System, name: str) -> tuple[Sensor, str]:
    """Return the sensor that a name means, and the name of one of its columns, "" for all.

    A name is that of a sensor, of an output of the system, or of a coordinate, "pin.angle" or "pin angle"; of a column
    of one of these, "tip.x" or "tip x"; or of an output of an element, "damper.force" or "damper force".

    Raises
    ------
    ModelError
        If there is none; the message has the nearest name.
    """
    own: dict[str, Sensor] = {each.name: each for each in (*system.outputs, *system.sensors)}  # type: ignore[misc]
    coordinates = {each.name: each for each in coordinate_sensors(system)}
    known = {**named_coordinates(system), **own, **coordinates}
    elements = [element.name for element in system.elements]
    owner, column = owner_and_column(name, [*known, *elements])
    if owner in known and (owner not in elements or not column):
        return known[owner], column
    if not column:
        hint = nearest(name, [*own, *coordinates, *elements])
        raise ModelError(f"system {system.name!r}: no sensor or joint coordinate {quoted(name)}{hint}")
    return ElementSensor(name, owner, column), ""


def measurement_of(system: System, trajectory: Trajectory, name: str) -> Measurement:
    """Return the measurement of a sensor, coordinate or column by name, as `sensor_and_column` reads it.

    Raises
    ------
    ModelError
        If there is no such sensor, coordinate or column; the message has the nearest name.
    """
    sensor, column = sensor_and_column(system, name)
    whole = measured(system, trajectory, [sensor])[sensor.name]
    return whole.alone(column, name) if column else whole


# descriptions of the points that sensors use: the requested place, the node used for it, and their distance -----------


def sensor_points(system: System) -> dict[str, tuple[str, ...]]:
    """Return, for each sensor, its points on flexible bodies that are not interfaces; sensors without any are omitted.

    Raises
    ------
    ModelError
        If a sensor refers to a node, element or set that is not kept, or no kept node is at its position.
    """
    found = {sensor.name: places_of(system, sensor) for sensor in sensors_of(system)}
    return {name: words for name, words in found.items() if words}


def places_of(system: System, sensor: Sensor) -> tuple[str, ...]:
    """Return descriptions of the points that a sensor uses."""
    where = f"sensor {sensor.name!r}"
    if isinstance(sensor, StressSensor | StrainGauge | VonMisesSensor):
        body, address = flexible_body(system, sensor.name, sensor.body), address_of(sensor)
        return () if address is None else (found_at(body, where, address, of_stress=True).description(),)
    if isinstance(sensor, ElongationSensor):
        return tuple(each.description() for each in sensor.ends(flexible_body(system, sensor.name, sensor.body)))
    at_nodes = [marker for marker in markers_of(sensor) if is_at_node(system, marker)]
    return tuple(found_nodes(system, where, marker)[1].description() for marker in at_nodes)


def markers_of(sensor: Sensor) -> tuple[Marker, ...]:
    """Return the markers among the fields of a sensor."""
    values = [getattr(sensor, field.name) for field in fields(sensor)]
    return tuple(value for value in values if isinstance(value, Marker))
