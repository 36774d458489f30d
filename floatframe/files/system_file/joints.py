"""Tables of the system file for joints and couplers: [joints.NAME], [couplers.NAME]."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Annotated, Any

import numpy as np
from pydantic import Field, model_validator

from fe_models.foundation.toml_file import Matrix3, Table, Vector3, choice
from fe_models.foundation.words import nearest
from floatframe.files.system_file.coordinate_section import CoordinateSection, marker_of
from floatframe.files.system_file.keys import Name, Positive
from floatframe.files.system_file.motion_section import MotionSection, require_quantity
from floatframe.files.system_file.place_key import PlaceOnBody
from floatframe.files.system_file.signal_section import SignalFunction
from floatframe.model.bodies.markers import Place
from floatframe.model.joints import JOINTS, Joint
from floatframe.model.joints.coordinate_coupler import CoordinateCoupler, Limits

__all__ = ["CouplerSection", "JointSection", "coupler_of", "joint_of"]

KEYS_OF_JOINTS = {
    kind: tuple(field.name for field in fields(joint) if field.name not in ("name", "marker_a", "marker_b"))
    for kind, joint in JOINTS.items()
}


class JointSection(Table):
    """[joints.NAME]: a joint between two bodies."""

    type: choice("type of joint", lambda: tuple(JOINTS)) = Field(  # type: ignore[valid-type]
        description=f"one of {', '.join(JOINTS)}"
    )
    body_a: Name = Field(description='the name of a body, or "ground"')
    body_b: Name = Field(description='the name of a body, or "ground"')
    marker_a: PlaceOnBody | None = Field(None, description="an interface, or a position [x, y, z] in body_a")
    marker_b: PlaceOnBody | None = Field(None, description="an interface, or a position [x, y, z] in body_b")
    triad_a: Matrix3 | None = Field(None, description="the axes of marker_a, [x axis, y axis, z axis]")
    triad_b: Matrix3 | None = Field(None, description="the axes of marker_b, [x axis, y axis, z axis]")
    axis: Vector3 | None = Field(None, description="the axis in the axes of marker_a, [x, y, z]")
    axis_b: Vector3 | None = Field(None, description="the axis in the axes of marker_b, [x, y, z]; default: as placed")
    rotation: Matrix3 | None = Field(None, description="the held rotation, three rows; default: as placed")
    lead: float | None = Field(None, description="a number other than 0, the advance of a screw for one turn")
    distance: Positive | None = Field(None, description="a number above 0, the length of a rod; default: as placed")
    radius: Positive | None = Field(None, description="a number above 0, the radius of a rolling disc")
    line: list[Name] | None = Field(None, description="the names of further interfaces along the line of marker_a")
    is_aligned: bool | None = Field(None, description="true or false: whether marker_b rotates with the line")
    normal: Vector3 | None = Field(
        None, description="a direction perpendicular to the line, in axes of body_a, [x, y, z]"
    )
    motions: dict[str, MotionSection] | None = Field(
        None, description="tables [joints.NAME.motions.COORDINATE], functions of time"
    )

    @model_validator(mode="after")
    def _fits_the_type(self) -> "JointSection":
        for key in (
            "axis",
            "axis_b",
            "rotation",
            "lead",
            "distance",
            "radius",
            "line",
            "is_aligned",
            "normal",
            "motions",
        ):
            if getattr(self, key) is not None and key not in KEYS_OF_JOINTS[self.type]:
                raise ValueError(f"a {self.type} joint has no key {key}{nearest(key, KEYS_OF_JOINTS[self.type])}")
        if "axis" in KEYS_OF_JOINTS[self.type] and self.axis is None:
            raise ValueError(f"axis: missing; a {self.type} joint needs its axis in the axes of marker_a, [x, y, z]")
        if self.type == "universal" and self.axis_b is None:
            raise ValueError("axis_b: missing; a universal joint needs its axis in the axes of marker_b, [x, y, z]")
        if self.type == "rolling-disc" and (self.axis_b is None or self.radius is None):
            key = "axis_b" if self.axis_b is None else "radius"
            raise ValueError(f"{key}: missing; a rolling disc needs its radius and its axis in the axes of marker_b")
        if self.type == "sliding" and (self.line is None or self.marker_a is None):
            key = "line" if self.line is None else "marker_a"
            raise ValueError(f"{key}: missing; a sliding joint needs the interface marker_a and the others of its line")
        if self.type == "screw" and self.lead is None:
            raise ValueError("lead: missing; a screw joint needs its advance for one turn")
        if self.marker_a is None and self.marker_b is None:
            raise ValueError("expected marker_a or marker_b or both: the interface or position where the joint is")
        return self


class TermSection(CoordinateSection):
    """[[couplers.NAME.terms]]: a coordinate and its coefficient."""

    factor: float = Field(description="a number other than 0, the coefficient of the coordinate")


class LimitsSection(Table):
    """[couplers.NAME.limits]: stops of a linear combination of coordinates."""

    lower: float | None = Field(None, description="a number in the unit of the sum")
    upper: float | None = Field(None, description="a number in the unit of the sum")
    restitution: Annotated[float, Field(ge=0, le=1)] = Field(
        0.0, description="a number from 0 to 1, Newton's coefficient of restitution"
    )

    def found(self) -> Limits:
        """Return the limits of the table."""
        return Limits(self.lower, self.upper, self.restitution)


class CouplerSection(Table):
    """[couplers.NAME]: a linear relation between coordinates."""

    terms: list[TermSection] = Field(description="tables [[couplers.NAME.terms]], coordinates with factors")
    constant: float | MotionSection | None = Field(
        None, description="a number, or a function of time; default: as placed, or as caught by an event"
    )
    engaged: bool = Field(True, description="false: no force until an event switches it on (latch, clutch, brake)")
    limits: LimitsSection | None = Field(None, description="stops: it acts only while the sum is at one of them")


def joint_of(name: str, section: JointSection, signals: Mapping[str, SignalFunction] | None = None) -> Joint:
    """Return the joint of a table; a marker without a place is put where the other marker is."""
    ends: list[Place] = []
    for body, place, triad in (
        (section.body_a, section.marker_a, section.triad_a),
        (section.body_b, section.marker_b, section.triad_b),
    ):
        ends.append(body if place is None else marker_of(body, place, triad))
    options: dict[str, Any] = {}
    for key in KEYS_OF_JOINTS[section.type]:
        value = getattr(section, key)
        if key == "motions":
            for coordinate, table in (value or {}).items():
                expected = ("angle",) if coordinate.startswith("angle") else ("length",)
                require_quantity(f"joints.{name}.motions.{coordinate}", table, signals, expected)
            options[key] = {coordinate: table.function(signals) for coordinate, table in (value or {}).items()}
        elif value is not None:
            options[key] = value if isinstance(value, float | bool | list) else np.array(value)
    return JOINTS[section.type](name, ends[0], ends[1], **options)


def coupler_of(
    name: str, section: CouplerSection, signals: Mapping[str, SignalFunction] | None = None
) -> CoordinateCoupler:
    """Return the coupler of a table."""
    constant = section.constant
    terms = [(term.found(), term.factor) for term in section.terms]
    return CoordinateCoupler(
        name,
        terms,
        constant.function(signals) if isinstance(constant, MotionSection) else constant,
        section.engaged,
        None if section.limits is None else section.limits.found(),
    )
