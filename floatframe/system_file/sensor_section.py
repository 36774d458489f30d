"""Tables of the system file for sensors: [sensors.NAME]."""

from typing import Any

import numpy as np
from pydantic import Field, model_validator

from fe_models.foundation.toml_file import Table, Vector3, choice
from fe_models.foundation.words import nearest
from floatframe.bodies.markers import Marker
from floatframe.results.sensors import (
    AngleSensor,
    ControlSensor,
    CoordinateSensor,
    CouplerSensor,
    DisplacementSensor,
    ElongationSensor,
    EnergySensor,
    ModeSensor,
    MomentumSensor,
    PlaceSensor,
    ReactionSensor,
    Sensor,
    StrainGauge,
    StressSensor,
    VonMisesSensor,
)
from floatframe.results.sensors.loads import AXES
from floatframe.results.sensors.places import PLACE_QUANTITIES
from floatframe.system_file.place_key import PlaceOnBody

__all__ = ["SENSOR_TYPES", "SensorSection"]

SENSOR_TYPES: dict[str, tuple[str, ...]] = {  # type -> keys; the first ones up to "|" are needed
    **dict.fromkeys(PLACE_QUANTITIES, ("body", "|", "marker", "relative_to", "relative_marker")),
    "angle": ("body_a", "body_b", "|", "marker_a", "marker_b", "axis"),
    "control": ("of", "|"),
    "coordinate": ("joint", "coordinate", "|"),
    "coupler": ("of", "|"),
    "displacement": ("body", "marker", "|"),
    "elongation": ("body", "position_a", "position_b", "|"),
    "energy": ("|",),
    "mode": ("body", "mode", "|"),
    "momentum": ("|",),
    "reaction": ("of", "|", "axes"),
    "strain": ("body", "direction", "young", "poisson", "|", "position", "point"),
    "stress": ("body", "|", "position", "point"),
    "von-mises": ("body", "|"),
}


class SensorSection(Table):
    """[sensors.NAME]: what is measured on a motion."""

    type: choice("type of sensor", lambda: tuple(SENSOR_TYPES)) = Field(  # type: ignore[valid-type]
        description=f"one of {', '.join(SENSOR_TYPES)}"
    )
    body: str | None = Field(None, description='the name of a body, or "ground"')
    marker: PlaceOnBody | None = Field(None, description="an interface, or a position [x, y, z] in the body")
    relative_to: str | None = Field(None, description="the name of the body that sees it")
    relative_marker: PlaceOnBody | None = Field(None, description="an interface of, or a position in that body")
    body_a: str | None = Field(None, description='the name of a body, or "ground"')
    body_b: str | None = Field(None, description='the name of a body, or "ground"')
    marker_a: PlaceOnBody | None = Field(None, description="an interface, or a position [x, y, z] in body_a")
    marker_b: PlaceOnBody | None = Field(None, description="an interface, or a position [x, y, z] in body_b")
    axis: Vector3 | None = Field(None, description="an axis in the axes of marker_a, [x, y, z]; default: z")
    joint: str | None = Field(None, description="the name of a joint")
    coordinate: str | None = Field(None, description="a coordinate of the joint")
    of: str | None = Field(None, description="the name of a joint or spring-damper; of a coupler, of a user force")
    axes: choice("kind of axes", lambda: AXES) | None = Field(  # type: ignore[valid-type]
        None, description=f"one of {', '.join(AXES)}"
    )
    mode: int | None = Field(None, description="a whole number, the mode, from 1")
    position: Vector3 | None = Field(None, description="a position in the body, [x, y, z]: the nearest node is taken")
    point: str | None = Field(None, description="the name of a stress point of the modal file")
    position_a: Vector3 | None = Field(None, description="a position in the body, [x, y, z]: the nearest node is taken")
    position_b: Vector3 | None = Field(None, description="a position in the body, [x, y, z]: the nearest node is taken")
    direction: Vector3 | None = Field(None, description="the direction of the gauge in the body, [x, y, z]")
    young: float | None = Field(None, description="a number above 0, Young's modulus")
    poisson: float | None = Field(None, description="a number, Poisson's ratio")

    @model_validator(mode="after")
    def _fits_the_type(self) -> "SensorSection":
        keys = SENSOR_TYPES[self.type]
        allowed, needed = [key for key in keys if key != "|"], keys[: keys.index("|")]
        for key in type(self).model_fields:
            if key != "type" and getattr(self, key) is not None and key not in allowed:
                raise ValueError(f"a sensor of type {self.type} has no key {key}{nearest(key, allowed)}")
        for key in needed:
            if getattr(self, key) is None:
                raise ValueError(f"{key}: missing; expected {type(self).model_fields[key].description}")
        if self.type in ("stress", "strain") and (self.position is None) == (self.point is None):
            raise ValueError("expected either position or point: where it is measured")
        return self

    def sensor(self, name: str) -> Sensor:
        """Return the sensor of the table."""
        if self.type in PLACE_QUANTITIES:
            seen_from = None if self.relative_to is None else marker_at(self.relative_to, self.relative_marker)
            return PlaceSensor(name, marker_at(self.body, self.marker), self.type, seen_from)
        if self.type == "angle":
            ends = marker_at(self.body_a, self.marker_a), marker_at(self.body_b, self.marker_b)
            return AngleSensor(name, *ends, axis=np.array(self.axis or (0.0, 0.0, 1.0)))
        if self.type == "displacement":
            return DisplacementSensor(name, marker_at(self.body, self.marker))
        given: dict[str, Any] = {
            key: getattr(self, key) for key in SENSOR_TYPES[self.type] if key != "|" and getattr(self, key) is not None
        }
        given = {key: np.array(value) if isinstance(value, tuple) else value for key, value in given.items()}
        return BY_KEYS[self.type](name, **given)


BY_KEYS: dict[str, Any] = {  # sensors whose fields are the keys of their table
    "control": ControlSensor,
    "coordinate": CoordinateSensor,
    "coupler": CouplerSensor,
    "elongation": ElongationSensor,
    "energy": EnergySensor,
    "mode": ModeSensor,
    "momentum": MomentumSensor,
    "reaction": ReactionSensor,
    "strain": StrainGauge,
    "stress": StressSensor,
    "von-mises": VonMisesSensor,
}


def marker_at(body: str | None, place: str | tuple[float, float, float] | None) -> Marker:
    """Return a marker by interface or position."""
    assert body is not None  # checked by the table
    if isinstance(place, str):
        return Marker(body, place)
    return Marker(body, position=None if place is None else np.array(place))
