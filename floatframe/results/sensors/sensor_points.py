"""Descriptions of the points that sensors use: the requested place, the node used for it, and their distance."""

from dataclasses import fields

from floatframe.model.bodies.markers import Marker
from floatframe.model.system import System
from floatframe.results.sensors import (
    ElongationSensor,
    Sensor,
    StrainGauge,
    StressSensor,
    VonMisesSensor,
    sensors_of,
)
from floatframe.results.sensors.places import found_at, found_nodes, is_at_node
from floatframe.results.sensors.stresses import address_of, flexible_body

__all__ = ["sensor_points"]


def sensor_points(system: System) -> dict[str, tuple[str, ...]]:
    """Return, by sensor, the points on flexible bodies that are not interfaces; sensors without any are omitted.

    Raises
    ------
    ModelError
        If a sensor refers to a node, element or set that is not kept, or no kept node is at its position.
    """
    found = {sensor.name: places_of(system, sensor) for sensor in sensors_of(system)}
    return {name: words for name, words in found.items() if words}


def places_of(system: System, sensor: Sensor) -> tuple[str, ...]:
    """Return descriptions of the points of a sensor."""
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
