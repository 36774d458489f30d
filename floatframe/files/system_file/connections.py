"""Sections of joints and forces of a system file."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Annotated, Any

import numpy as np
from pydantic import Field, model_validator

from fe_models.foundation.toml_file import Matrix3, Table, Vector3, choice
from fe_models.foundation.words import nearest
from floatframe.errors import ModelError
from floatframe.files.system_file.coordinate_section import CoordinateSection, NamedCoordinate, marker_of
from floatframe.files.system_file.keys import Name, NotNegative, NotNegativeOrSix, NumberOrSix, Positive
from floatframe.files.system_file.motion_section import MotionSection, require_quantity
from floatframe.files.system_file.place_key import PlaceOnBody
from floatframe.files.system_file.signal_section import SignalFunction
from floatframe.model.bodies.markers import Place
from floatframe.model.forces import (
    FORCES,
    BodyLoad,
    Bushing,
    Force,
    JointForce,
    PointForce,
    SphereContact,
    SpringDamper,
    UserForce,
)
from floatframe.model.forces.bushing import AXES, DEFORMATIONS
from floatframe.model.forces.sphere_contact import DISSIPATIONS
from floatframe.model.functions.time_functions import constant
from floatframe.model.joints import JOINTS, Joint
from floatframe.model.joints.coordinate_coupler import CoordinateCoupler, Limits

__all__ = ["CouplerSection", "ForceSection", "JointSection", "coupler_of", "force_of", "joint_of"]


# tables of the system file for joints and couplers: [joints.NAME], [couplers.NAME] ------------------------------------


KEYS_OF_JOINTS = {
    kind: tuple(field.name for field in fields(joint) if field.name not in ("name", "marker_a", "marker_b"))
    for kind, joint in JOINTS.items()
}


#: joints by the names that other programs give them
ELSEWHERE = {
    "hinge": "revolute", "pin": "revolute", "continuous": "revolute", "translational": "prismatic",
    "translation": "prismatic", "slider": "prismatic", "slide": "prismatic", "ball": "spherical", "point": "spherical",
    "weld": "fixed", "rigid": "fixed", "bracket": "fixed", "cardan": "universal", "hooke": "universal",
    "homokinetic": "constant-velocity", "helical": "screw", "inline": "point-on-line", "inplane": "point-on-plane",
}  # fmt: skip


class JointSection(Table):
    """[joints.NAME]: a joint between two bodies."""

    type: choice("type of joint", lambda: tuple(JOINTS), ELSEWHERE) = Field(  # type: ignore[valid-type]
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


# tables of the system file for forces: [forces.NAME] ------------------------------------------------------------------


KEYS_OF_FORCES = {
    "body-load": ("body", "load_case", "amplitude"),
    "joint-force": tuple(field.name for field in fields(JointForce) if field.name != "name"),
    "point-force": ("body", "marker", "triad", "force", "torque", "is_follower", "amplitude"),
    "spring-damper": (
        "body_a",
        "marker_a",
        "body_b",
        "marker_b",
        "stiffness",
        "damping",
        "free_length",
        "preload",
        "characteristic",
    ),
    "bushing": (
        "body_a", "marker_a", "triad_a", "body_b", "marker_b", "triad_b",
        "stiffness", "damping", "preload", "characteristics", "axes",
    ),
    "sphere-contact": (
        "body_a", "marker_a", "triad_a", "body_b", "marker_b",
        *(field.name for field in fields(SphereContact) if field.name not in ("name", "marker_a", "marker_b")),
    ),
    "user-force": ("coordinates", "forces", "rates", "states", "parameters", "functions", "switches"),
}  # fmt: skip


Signals = Mapping[str, SignalFunction] | None  #: signals of a system file, by name


class ForceSection(Table):
    """[forces.NAME]: a force element."""

    type: choice("type of force", lambda: tuple(FORCES)) = Field(  # type: ignore[valid-type]
        description=f"one of {', '.join(FORCES)}"
    )
    body: Name | None = Field(None, description='the name of a body, or "ground"')
    marker: PlaceOnBody | None = Field(None, description="an interface, or a position [x, y, z] in the body")
    triad: Matrix3 | None = Field(None, description="the axes of the marker, [x axis, y axis, z axis]")
    force: Vector3 | None = Field(None, description="the force, [x, y, z]")
    torque: Vector3 | None = Field(None, description="the torque, [x, y, z]")
    is_follower: bool | None = Field(None, description="true: fixed in the body; false: fixed in space")
    body_a: Name | None = Field(None, description='the name of a body, or "ground"')
    body_b: Name | None = Field(None, description='the name of a body, or "ground"')
    marker_a: PlaceOnBody | None = Field(None, description="an interface, or a position [x, y, z] in body_a")
    marker_b: PlaceOnBody | None = Field(None, description="an interface, or a position [x, y, z] in body_b")
    stiffness: NotNegativeOrSix | None = Field(None, description="a number, 0 or more, the stiffness of the spring")
    damping: NotNegativeOrSix | None = Field(None, description="a number, 0 or more, the constant of the damper")
    free_length: NotNegative | None = Field(None, description="a number, 0 or more, the free length")
    preload: NumberOrSix | None = Field(None, description="a number, the constant part of the tension or force")
    load_case: Name | None = Field(None, description="the name of a load case of the modal file")
    amplitude: MotionSection | None = Field(None, description="a table, the factor as a function of time")
    joint: Name | None = Field(None, description="the name of a joint")
    coordinate: Name | None = Field(None, description="a coordinate of the joint")
    free: float | None = Field(None, description="a number, the coordinate at which the spring has no force")
    motor: float | MotionSection | None = Field(
        None, description="a number, or a table, the force as a function of time; 0 if a controller drives it"
    )
    characteristic: MotionSection | None = Field(None, description="a table, the force as a function of the elongation")
    friction: NotNegative | None = Field(None, description="a number, 0 or more, Coulomb friction")
    friction_coefficient: NotNegative | None = Field(
        None, description="a number, 0 or more, ratio of friction to normal force"
    )
    friction_speed: Positive | None = Field(
        None, description="a number above 0, the speed at which friction is fully developed"
    )
    triad_a: Matrix3 | None = Field(None, description="the axes of marker_a, [x axis, y axis, z axis]")
    triad_b: Matrix3 | None = Field(None, description="the axes of marker_b, [x axis, y axis, z axis]")
    characteristics: dict[str, MotionSection] | None = Field(
        None, description=f"tables of the force over one deformation, of {', '.join(DEFORMATIONS)}"
    )
    axes: choice("axes", lambda: tuple(AXES)) | None = Field(  # type: ignore[valid-type]
        None, description='axes in which a bushing acts: of marker "a" (default) or "b", or "half way" between them'
    )
    radius_a: Positive | None = Field(None, description="a number above 0, the radius of the sphere at marker_a")
    radius_b: Positive | None = Field(None, description="a number above 0, the radius of the sphere at marker_b")
    axis: Vector3 | None = Field(None, description="the normal of the plane in the axes of marker_a, [x, y, z]")
    modulus: Positive | None = Field(None, description="a number above 0, the contact modulus of Hertz")
    exponent: Positive | None = Field(None, description="a number, 1 or more, the exponent of the depth")
    restitution: Positive | None = Field(None, description="a number above 0 and up to 1, the restitution")
    dissipation: choice("law of restitution", lambda: tuple(DISSIPATIONS)) | None = Field(  # type: ignore[valid-type]
        None, description=f"one of {', '.join(DISSIPATIONS)}"
    )
    slow: Positive | None = Field(None, description="a number above 0, the smallest speed of approach")
    coordinates: dict[str, NamedCoordinate] | None = Field(
        None, description='coordinates by name, each "JOINT.COORDINATE" or a table'
    )
    forces: dict[str, str] | None = Field(None, description="expressions of forces, text, by coordinate")
    rates: dict[str, str] | None = Field(None, description="expressions of the rates of states, text, by state")
    switches: dict[str, str] | None = Field(
        None, description="expressions at whose zeros the forces jump, text, by a name that stands for their sign"
    )
    states: dict[str, float] | None = Field(None, description="initial values of states, numbers by state")
    parameters: dict[str, float] | None = Field(None, description="numbers of the expressions, by name")
    functions: dict[str, MotionSection] | None = Field(None, description="tables of functions of one number, by name")

    @model_validator(mode="after")
    def _fits_the_type(self) -> "ForceSection":
        allowed = KEYS_OF_FORCES[self.type]
        for key in type(self).model_fields:
            if key != "type" and getattr(self, key) is not None and key not in allowed:
                raise ValueError(f"a {self.type} has no key {key}{nearest(key, allowed)}")
        for key in ("body", "body_a", "body_b"):
            if key in allowed and getattr(self, key) is None:
                raise ValueError(f'{key}: missing; expected the name of a body, or "ground"')
        needed = {
            "body-load": ("load_case",), "joint-force": ("joint", "coordinate"), "sphere-contact": ("radius_b",),
            "user-force": ("coordinates",),
        }  # fmt: skip
        for key in needed.get(self.type, ()):
            if getattr(self, key) is None:
                raise ValueError(f"{key}: missing; expected {type(self).model_fields[key].description}")
        for key in ("stiffness", "damping", "preload"):
            value = getattr(self, key)
            if isinstance(value, list) != (self.type == "bushing") and value is not None:
                expected = "six numbers, or six rows of six" if self.type == "bushing" else "a number"
                raise ValueError(f"{key}: expected {expected} for a {self.type}, got {value}")
        if self.type == "point-force" and self.force is None and self.torque is None:
            raise ValueError("expected force or torque or both, got neither")
        return self


def bushing_of(name: str, section: ForceSection) -> Bushing:
    """Return the bushing of a table; a body without a marker is attached at the position of the other marker."""
    ends: list[Place] = []
    for body, place, triad in ((section.body_a, section.marker_a, section.triad_a),
                               (section.body_b, section.marker_b, section.triad_b)):  # fmt: skip
        assert body is not None  # ensured by the validation of the table
        ends.append(body if place is None and triad is None else marker_of(body, place, triad))
    given = {"stiffness": section.stiffness, "damping": section.damping, "preload": section.preload}
    options = {key: np.array(value) for key, value in given.items() if value is not None}
    tables = {key: table.function() for key, table in (section.characteristics or {}).items()}
    return Bushing(name, ends[0], ends[1], characteristics=tables, axes=section.axes or "a", **options)


def contact_of(name: str, section: ForceSection) -> SphereContact:
    """Return the contact of a table."""
    assert section.body_a is not None  # ensured by the validation of the table
    assert section.body_b is not None
    a = marker_of(section.body_a, section.marker_a, section.triad_a)
    b = marker_of(section.body_b, section.marker_b)
    keys = [key for key in KEYS_OF_FORCES["sphere-contact"] if not key.startswith(("body", "marker", "triad"))]
    return SphereContact(name, a, b, **{k: getattr(section, k) for k in keys if getattr(section, k) is not None})


def user_force_of(name: str, section: ForceSection, signals: Signals = None) -> UserForce:
    """Return the user force of a table."""
    return UserForce(
        name,
        {key: coordinate.found() for key, coordinate in (section.coordinates or {}).items()},
        section.forces or {},
        section.rates or {},
        section.states or {},
        section.parameters or {},
        {key: table.function(signals) for key, table in (section.functions or {}).items()},
        switches=section.switches or {},
    )


def force_of(name: str, section: ForceSection, signals: Signals = None) -> Force:
    """Return the force of a table; `signals` are those of the system file, by name."""
    if isinstance(section.motor, MotionSection):
        require_quantity(f"forces.{name}.motor", section.motor, signals, ("force", "moment", "number"))
    laws = {"characteristic": section.characteristic} | {
        f"characteristics.{key}": table for key, table in (section.characteristics or {}).items()
    }
    for key, law in laws.items():
        if law is not None and any(True for _ in law.signals()):
            raise ModelError(f"forces.{name}.{key}: a function of a deformation, expected no signal over time")
    functions = {
        key: table.function(signals) if isinstance(table, MotionSection) else None if table is None else constant(table)
        for key, table in (("amplitude", section.amplitude), ("characteristic", section.characteristic),
                           ("motor", section.motor))
    }  # fmt: skip
    if section.type == "bushing":
        return bushing_of(name, section)
    if section.type == "sphere-contact":
        return contact_of(name, section)
    if section.type == "user-force":
        return user_force_of(name, section, signals)
    if section.type == "body-load":
        assert section.body is not None  # ensured by the validation of the table
        assert section.load_case is not None
        return BodyLoad(name, section.body, section.load_case, functions["amplitude"] or 1.0)
    if section.type == "joint-force":
        options = {
            key: functions.get(key, getattr(section, key))
            for key in KEYS_OF_FORCES["joint-force"]
            if getattr(section, key) is not None
        }
        return JointForce(name, **options)
    if section.type == "point-force":
        assert section.body is not None  # ensured by the validation of the table
        marker = marker_of(section.body, section.marker, section.triad)
        zero = (0.0, 0.0, 0.0)
        return PointForce(
            name,
            marker,
            np.array(section.force or zero),
            np.array(section.torque or zero),
            bool(section.is_follower),
            functions["amplitude"],
        )
    assert section.body_a is not None  # ensured by the validation of the table
    assert section.body_b is not None
    given = [each or 0.0 for each in (section.stiffness, section.damping, section.preload)]
    # the validation of the table excludes lists
    stiffness, damping, preload = (each for each in given if isinstance(each, float))
    return SpringDamper(
        name,
        marker_of(section.body_a, section.marker_a),
        marker_of(section.body_b, section.marker_b),
        stiffness,
        damping,
        section.free_length,
        preload,
        functions["characteristic"],
    )
