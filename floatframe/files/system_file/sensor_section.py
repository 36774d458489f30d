"""Tables of the system file for sensors: [sensors.NAME]."""

from typing import Any

import numpy as np
from pydantic import Field, model_validator

from fe_models.body.kept_nodes import TOLERANCE
from fe_models.foundation.toml_file import Table, Vector3, choice
from fe_models.foundation.words import nearest
from floatframe.files.system_file.place_key import (
    TOLERANCE_WORDS,
    MeasuredPlace,
    MeshNumber,
    NodeOrPosition,
    address_at,
    marker_at,
)
from floatframe.model.bodies.markers import Marker
from floatframe.results.sensors import (
    AngleSensor,
    BushingSensor,
    ControlSensor,
    CoordinateSensor,
    CouplerSensor,
    DisplacementSensor,
    ElementSensor,
    ElongationSensor,
    EnergySensor,
    InterfaceForceSensor,
    ModeSensor,
    MomentumSensor,
    PlaceSensor,
    ReactionSensor,
    RecoverySensor,
    Sensor,
    SpringSensor,
    StrainGauge,
    StressSensor,
    VonMisesSensor,
)
from floatframe.results.sensors.body_loads import INTERFACE_AXES
from floatframe.results.sensors.loads import AXES
from floatframe.results.sensors.places import PLACE_QUANTITIES

__all__ = ["SENSOR_TYPES", "SensorSection"]

MESH = ("node", "element", "set")  #: keys that specify a place in the user's mesh
AT = ("marker", *MESH, "tolerance")  #: keys of a place

SENSOR_TYPES: dict[str, tuple[str, ...]] = {  # type -> keys; those before "|" are required
    **dict.fromkeys(PLACE_QUANTITIES, ("body", "|", *AT, "relative_to", "relative_marker")),
    "angle": ("body_a", "body_b", "|", "marker_a", "marker_b", "axis"),
    "bushing": ("of", "|"),
    "control": ("of", "|"),
    "coordinate": ("joint", "coordinate", "|"),
    "coupler": ("of", "|"),
    "displacement": ("body", "|", *AT),
    "element": ("of", "|", "output"),
    "elongation": ("body", "position_a", "position_b", "|", "tolerance"),
    "energy": ("|",),
    "interface-force": ("body", "interface", "|", "axes"),
    "mode": ("body", "mode", "|"),
    "momentum": ("|",),
    "reaction": ("of", "|", "axes"),
    "recovery": ("body", "table", "|", "rows"),
    "spring": ("of", "|"),
    "strain": ("body", "direction", "young", "poisson", "|", "position", "point", "node", "tolerance"),
    "stress": ("body", "|", "position", "point", *MESH, "tolerance"),
    "von-mises": ("body", "|", *MESH),
}


class SensorSection(Table):
    """[sensors.NAME]: a quantity measured on a motion."""

    type: choice("type of sensor", lambda: tuple(SENSOR_TYPES)) = Field(  # type: ignore[valid-type]
        description=f"one of {', '.join(SENSOR_TYPES)}"
    )
    body: str | None = Field(None, description='the name of a body, or "ground"')
    marker: MeasuredPlace | None = Field(None, description="an interface, or a position [x, y, z] in the body")
    node: MeshNumber | None = Field(None, description="the number of a kept node in the mesh of the body")
    element: MeshNumber | None = Field(None, description="the number of an element on the surface of its mesh")
    set: str | None = Field(None, description="the name of a set of its mesh")
    tolerance: float | None = Field(None, ge=0, description=TOLERANCE_WORDS)
    relative_to: str | None = Field(None, description="the name of the body relative to which it is measured")
    relative_marker: MeasuredPlace | None = Field(None, description="an interface of, or a position in that body")
    body_a: str | None = Field(None, description='the name of a body, or "ground"')
    body_b: str | None = Field(None, description='the name of a body, or "ground"')
    marker_a: MeasuredPlace | None = Field(None, description="an interface, or a position [x, y, z] in body_a")
    marker_b: MeasuredPlace | None = Field(None, description="an interface, or a position [x, y, z] in body_b")
    axis: Vector3 | None = Field(None, description="an axis in the axes of marker_a, [x, y, z]; default: z")
    joint: str | None = Field(None, description="the name of a joint")
    coordinate: str | None = Field(None, description="a coordinate of the joint")
    of: str | None = Field(None, description="the name of a joint, spring, bushing, coupler, user force or element")
    output: str | None = Field(None, description="the name of an output, state or multiplier of the element")
    interface: str | None = Field(None, description="the name of an interface of the body")
    table: str | None = Field(None, description="the name of a recovery table of the modal file")
    rows: list[str] | None = Field(None, description="labels of rows, or their beginnings; default: all")
    axes: choice("kind of axes", lambda: (*AXES, "body")) | None = Field(  # type: ignore[valid-type]
        None, description=f"one of {', '.join(AXES)}; of an interface force {', '.join(INTERFACE_AXES)}"
    )
    mode: int | None = Field(None, description="a whole number, the mode, from 1")
    position: Vector3 | None = Field(None, description="a position in the body, [x, y, z]: the node there")
    point: str | None = Field(None, description="the name of a stress point of the modal file")
    position_a: NodeOrPosition | None = Field(None, description="a position in the body, [x, y, z], or {node = 12}")
    position_b: NodeOrPosition | None = Field(None, description="a position in the body, [x, y, z], or {node = 12}")
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
        given = [key for key in ("marker", "position", "point", *MESH) if getattr(self, key) is not None]
        if len(given) > 1:
            raise ValueError(f"expected one place, got {' and '.join(given)}")
        if self.type in ("stress", "strain") and not given:
            raise ValueError("expected either position or point, or node, element or set: where it is measured")
        if self.type == "displacement" and not given:
            raise ValueError("marker: missing; expected an interface, a position, or node, element or set")
        return self

    def sensor(self, name: str) -> Sensor:
        """Return the sensor of the table."""
        if self.type in PLACE_QUANTITIES:
            seen_from = None if self.relative_to is None else marker_at(self.relative_to, self.relative_marker)
            return PlaceSensor(name, self.place(), self.type, seen_from)
        if self.type == "angle":
            ends = marker_at(str(self.body_a), self.marker_a), marker_at(str(self.body_b), self.marker_b)
            return AngleSensor(name, *ends, axis=np.array(self.axis or (0.0, 0.0, 1.0)))
        if self.type == "displacement":
            return DisplacementSensor(name, self.place())
        if self.type == "elongation":
            a, b = address_at(self.position_a, self.limit), address_at(self.position_b, self.limit)
            return ElongationSensor(name, str(self.body), a, b)
        given: dict[str, Any] = {
            key: getattr(self, key) for key in SENSOR_TYPES[self.type] if key != "|" and getattr(self, key) is not None
        }
        given = {key: np.array(value) if isinstance(value, tuple) else value for key, value in given.items()}
        return BY_KEYS[self.type](name, **given)

    @property
    def limit(self) -> float:
        """Largest distance of a node from a position, relative to the size of the body."""
        return TOLERANCE if self.tolerance is None else self.tolerance

    def place(self) -> Marker:
        """Return the marker of the table, at an interface, a position, or a node, element or set."""
        if any(getattr(self, key) is not None for key in MESH):
            return Marker(str(self.body), node=self.node, element=self.element, set=self.set)
        return marker_at(str(self.body), self.marker, self.limit)


BY_KEYS: dict[str, Any] = {  # sensor classes whose fields are the keys of their table
    "bushing": BushingSensor,
    "control": ControlSensor,
    "coordinate": CoordinateSensor,
    "coupler": CouplerSensor,
    "element": ElementSensor,
    "energy": EnergySensor,
    "interface-force": InterfaceForceSensor,
    "mode": ModeSensor,
    "momentum": MomentumSensor,
    "reaction": ReactionSensor,
    "recovery": RecoverySensor,
    "spring": SpringSensor,
    "strain": StrainGauge,
    "stress": StressSensor,
    "von-mises": VonMisesSensor,
}
