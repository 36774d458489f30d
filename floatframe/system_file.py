"""The system file: what `floatframe run` reads (docs/system_file.md).

    system, run = read_system("swing.toml")
    trajectory = integrate(system, run.integrator, run.t_end, run.h, output="swing.h5", output_every=run.output_every,
                           progress=callback)          # callback(Progress(t, t_end, n_steps, n_total, n_iterations))
    trajectory = read_results("swing.h5")

All of them raise `FloatframeError`, whose text is one message for the user.
"""

import logging
import os
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field, StringConstraints, ValidationInfo, field_validator, model_validator

from cms.errors import CmsError
from cms.modal_file import convert_units, read
from cms.paths import near_file
from cms.reduced_body import ReducedBody
from cms.toml_file import Matrix3, Table, Vector3, choice, numbers, read_toml, validated
from cms.units import UNIT_SYSTEMS, Units, unit_system
from cms.words import nearest
from floatframe.added_mass import AddedMass, with_masses
from floatframe.changed_content import changed
from floatframe.channel_section import InputSection, OutputSection
from floatframe.coordinate_section import CoordinateSection, marker_of
from floatframe.couplers import CoordinateCoupler
from floatframe.errors import FloatframeError, ModelError, SystemFileError
from floatframe.event_section import EventSection
from floatframe.events import require_events
from floatframe.flexible_body import FlexibleBody
from floatframe.forces import (
    FORCES,
    BodyLoad,
    Bushing,
    Force,
    Gravity,
    JointForce,
    PointForce,
    SphereContact,
    SpringDamper,
    UserForce,
)
from floatframe.forces.bushing import DEFORMATIONS
from floatframe.forces.sphere_contact import DISSIPATIONS
from floatframe.ground import GROUND
from floatframe.joints import JOINTS, Joint
from floatframe.markers import Place
from floatframe.mass_properties import MassProperties, combined, mass_properties, point_mass
from floatframe.mode_choice import frozen_to_rigid, with_modes, without_modes
from floatframe.motion_section import MotionSection
from floatframe.place_key import PlaceOnBody
from floatframe.rigid_body import RigidBody
from floatframe.rotations import euler_parameters_of_rotation_vector
from floatframe.run_section import RunOptions, RunSection
from floatframe.sensor_section import SensorSection
from floatframe.system import REDUNDANT, Body, System
from floatframe.unit_hints import unit_hints

__all__ = ["RunOptions", "read_system"]

log = logging.getLogger(__name__)

Name = Annotated[str, StringConstraints(min_length=1)]
Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Count = Annotated[int, Field(ge=0)]
RIGID_KEYS = ("inertia_axes", "inertia_about", "positive_products")
FLEXIBLE_KEYS = ("modes", "without_modes", "is_rigid")
KEYS_OF_JOINTS = {
    kind: tuple(field.name for field in fields(joint) if field.name not in ("name", "marker_a", "marker_b"))
    for kind, joint in JOINTS.items()
}
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
        "stiffness", "damping", "preload", "characteristics",
    ),
    "sphere-contact": (
        "body_a", "marker_a", "triad_a", "body_b", "marker_b",
        *(field.name for field in fields(SphereContact) if field.name not in ("name", "marker_a", "marker_b")),
    ),
    "user-force": ("coordinates", "forces", "rates", "states", "parameters", "functions"),
}  # fmt: skip


def four_numbers(value: Any) -> tuple[float, ...]:
    """Return Euler parameters."""
    try:
        return (*numbers(value[:3]), *numbers([value[3], 0.0, 0.0])[:1]) if len(value) == 4 else numbers(None)
    except (ValueError, TypeError):
        raise ValueError("expected four numbers, [w, x, y, z]") from None


def number_or_six(value: Any) -> Any:
    """Return a number, or for a bushing six numbers or six rows of them."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    try:
        rows = np.array(value, dtype=float)
    except (TypeError, ValueError):
        rows = np.zeros(0)
    if rows.shape not in ((6,), (6, 6)) or not np.isfinite(rows).all():
        raise ValueError("expected a number; for a bushing six numbers, or six rows of six numbers")
    return rows.tolist()


def not_negative_or_six(value: Any) -> Any:
    """Return the same, a single number not below zero."""
    result = number_or_six(value)
    if isinstance(result, float) and result < 0:
        raise ValueError("expected a number, 0 or more; for a bushing six numbers, or six rows of six numbers")
    return result


NumberOrSix = Annotated[float | list, BeforeValidator(number_or_six)]
NotNegativeOrSix = Annotated[float | list, BeforeValidator(not_negative_or_six)]
Parameters4 = Annotated[tuple[float, float, float, float], BeforeValidator(four_numbers)]


class SystemSection(Table):
    """[system]: name, units, gravity."""

    name: Name | None = Field(None, description="the name of the system, text; default: the name of the file")
    units: choice("unit system", lambda: tuple(UNIT_SYSTEMS)) = Field(  # type: ignore[valid-type]
        description=f"the unit system of all numbers, one of {', '.join(UNIT_SYSTEMS)}"
    )
    gravity: Vector3 = Field((0.0, 0.0, 0.0), description="the acceleration of free fall, [x, y, z]")
    redundant: choice("way with redundant constraints", lambda: REDUNDANT) = Field(  # type: ignore[valid-type]
        "refuse", description=f"one of {', '.join(REDUNDANT)}"
    )


class MassSection(Table):
    """[[bodies.NAME.masses]]: a small part fixed to a body."""

    mass: Positive = Field(description="a number above 0, the mass of the part")
    interface: Name | None = Field(None, description="the name of an interface of a flexible body")
    position: Vector3 | None = Field(None, description="its centre of mass in a rigid body, [x, y, z]")
    offset: Vector3 | None = Field(None, description="its centre of mass from the interface, in its axes, [x, y, z]")
    inertia: Matrix3 | None = Field(None, description="its inertia tensor about its centre of mass, three rows")


class BodySection(Table):
    """[bodies.NAME]: a flexible body from a modal file, or a rigid one from its mass properties."""

    file: Path | None = Field(None, description="the path of a modal file, relative to the system file")
    mass: Positive | None = Field(None, description="a number above 0, the mass of a rigid body")
    inertia: Matrix3 | None = Field(None, description="the inertia tensor about the centre of mass, three rows")
    center_of_mass: Vector3 | None = Field(None, description="the centre of mass in the body frame, [x, y, z]")
    inertia_axes: Matrix3 | None = Field(None, description="the axes of the inertia tensor, [x axis, y axis, z axis]")
    inertia_about: Vector3 | None = Field(None, description="the point of the inertia tensor in the body, [x, y, z]")
    positive_products: bool | None = Field(None, description="true: products of inertia without their minus sign")
    masses: list[MassSection] = Field([], description="tables [[bodies.NAME.masses]], parts fixed to the body")
    modes: list[Count] | None = Field(None, description="a list of whole numbers from 0, the modes to keep")
    without_modes: list[Count] | None = Field(
        None, description="a list of whole numbers from 0, the modes to leave out"
    )
    is_rigid: bool | None = Field(None, description="true: a flexible body without its modes")
    position: Vector3 = Field((0.0, 0.0, 0.0), description="the position of the body (mesh) origin, [x, y, z]")
    rotation_vector: Vector3 | None = Field(None, description="axis times angle in rad from ground to body, [x, y, z]")
    euler_parameters: Parameters4 | None = Field(None, description="Euler parameters of length 1, [w, x, y, z]")
    velocity: Vector3 = Field((0.0, 0.0, 0.0), description="the velocity of the body (mesh) origin, [x, y, z]")
    omega_B: Vector3 = Field((0.0, 0.0, 0.0), description="the angular velocity in body (mesh) axes, [x, y, z]")  # noqa: N815
    stiffening: bool | None = Field(None, description="true or false: whether geometric stiffness of the file counts")

    @field_validator("file", mode="before")
    @classmethod
    def _beside_the_system(cls, value: Any, info: ValidationInfo) -> Path:
        if not isinstance(value, str) or not value:
            raise ValueError("expected the path of a modal file, text")
        path = Path(info.context or ".") / value
        if not path.is_file():
            raise ValueError(f"no such file: {path}{near_file(path)}")
        return path

    @model_validator(mode="after")
    def _one_kind(self) -> "BodySection":
        if (self.file is None) == (self.mass is None):
            raise ValueError(
                f"expected either file (flexible) or mass and inertia (rigid), got {'both' if self.file else 'neither'}"
            )
        if self.mass is not None and self.inertia is None:
            raise ValueError("inertia: missing; a rigid body needs mass and inertia")
        if self.file is not None and (self.inertia is not None or self.center_of_mass is not None):
            raise ValueError("a flexible body has its inertia in its file; remove inertia and center_of_mass")
        if self.mass is not None and self.stiffening is not None:
            raise ValueError("stiffening: a rigid body has none; remove it")
        others = RIGID_KEYS if self.file is not None else FLEXIBLE_KEYS
        for key in others:
            if getattr(self, key) is not None:
                raise ValueError(f"{key}: a {'flexible' if self.file else 'rigid'} body has no such key; remove it")
        if sum(getattr(self, key) is not None for key in FLEXIBLE_KEYS) > 1:
            raise ValueError(f"expected one of {', '.join(FLEXIBLE_KEYS)}, got several")
        for part in self.masses:
            wrong = ("interface", "offset") if self.file is None else ("position",)
            for key in wrong:
                if getattr(part, key) is not None:
                    kind = "flexible body; give position" if self.file is None else "rigid body; give interface"
                    raise ValueError(f"masses: {key} is for a {kind}")
            needed = "position" if self.file is None else "interface"
            if getattr(part, needed) is None:
                raise ValueError(f"masses: {needed}: missing; expected where the part is")
        if self.rotation_vector is not None and self.euler_parameters is not None:
            raise ValueError("expected either rotation_vector or euler_parameters, got both")
        return self


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
    is_aligned: bool | None = Field(None, description="true or false: marker_b turns with the line")
    normal: Vector3 | None = Field(None, description="a direction across the line, axes of body_a, [x, y, z]")
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
    free: float | None = Field(None, description="a number, the coordinate where the spring is free")
    motor: MotionSection | None = Field(None, description="a table, the force as a function of time")
    characteristic: MotionSection | None = Field(None, description="a table, the force as a function of the elongation")
    friction: NotNegative | None = Field(None, description="a number, 0 or more, Coulomb friction")
    friction_coefficient: NotNegative | None = Field(None, description="a number, 0 or more, friction by normal force")
    friction_speed: Positive | None = Field(None, description="a number above 0, the speed of full friction")
    triad_a: Matrix3 | None = Field(None, description="the axes of marker_a, [x axis, y axis, z axis]")
    triad_b: Matrix3 | None = Field(None, description="the axes of marker_b, [x axis, y axis, z axis]")
    characteristics: dict[str, MotionSection] | None = Field(
        None, description=f"tables of the force over one deformation, of {', '.join(DEFORMATIONS)}"
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
    slow: Positive | None = Field(None, description="a number above 0, the least speed of approach")
    coordinates: dict[str, CoordinateSection] | None = Field(None, description="tables of coordinates by name")
    forces: dict[str, str] | None = Field(None, description="expressions of forces, text, by coordinate")
    rates: dict[str, str] | None = Field(None, description="expressions of the rates of states, text, by state")
    states: dict[str, float] | None = Field(None, description="values of states at the start, numbers by state")
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


class TermSection(CoordinateSection):
    """[[couplers.NAME.terms]]: a coordinate and its coefficient."""

    factor: float = Field(description="a number other than 0, the coefficient of the coordinate")


class CouplerSection(Table):
    """[couplers.NAME]: a linear relation between coordinates."""

    terms: list[TermSection] = Field(description="tables [[couplers.NAME.terms]], coordinates with factors")
    constant: float | MotionSection | None = Field(
        None, description="a number, or a function of time; default: as placed"
    )


class SystemFile(Table):
    """A system and its run."""

    system: SystemSection = Field(description="a table [system] with units and gravity")
    bodies: dict[str, BodySection] = Field(description="tables [bodies.NAME]")
    joints: dict[str, JointSection] = Field({}, description="tables [joints.NAME]")
    couplers: dict[str, CouplerSection] = Field({}, description="tables [couplers.NAME]")
    forces: dict[str, ForceSection] = Field({}, description="tables [forces.NAME]")
    sensors: dict[str, SensorSection] = Field({}, description="tables [sensors.NAME]")
    inputs: dict[str, InputSection] = Field({}, description="tables [inputs.NAME]")
    outputs: dict[str, OutputSection] = Field({}, description="tables [outputs.NAME]")
    events: dict[str, EventSection] = Field({}, description="tables [events.NAME]")
    run: RunSection | None = Field(None, description="a table [run] with t_end and h")

    @model_validator(mode="after")
    def _names_bodies(self) -> "SystemFile":
        choices = [GROUND.name, *self.bodies]
        terms = {f"{name}.terms": term for name, coupler in self.couplers.items() for term in coupler.terms}
        coordinates = {
            f"{name}.coordinates.{key}": section
            for name, force in self.forces.items()
            for key, section in (force.coordinates or {}).items()
        }
        for kind, sections in (("joints", self.joints), ("forces", self.forces), ("sensors", self.sensors),
                               ("couplers", terms), ("forces", coordinates),
                               ("inputs", self.inputs), ("outputs", self.outputs)):  # fmt: skip
            for name, section in sections.items():
                for key in ("body", "body_a", "body_b", "relative_to"):
                    body = getattr(section, key, None)
                    if body is not None and body not in choices:
                        hint = nearest(body, choices)
                        raise ValueError(f'{kind}.{name}.{key} = "{body}": there is no such body{hint}')
        return self


def read_system(
    path: str | os.PathLike[str], changes: Mapping[str, Any] | None = None
) -> tuple[System, RunOptions | None]:
    """Read and check a system file and the modal files it names; return the system, and its run if it has [run].

    Parameters
    ----------
    path
        The file.
    changes
        Values that take the place of those in the file, by key path: {"bodies.rod.mass": 2.0}.

    Raises
    ------
    SystemFileError
        With every problem: key path, value, what was expected, choices and the nearest name.
    """
    path = Path(path)
    content = changed(read_toml(path, SystemFileError), changes or {}, str(path), SystemFileError)
    data = validated(SystemFile, content, path, SystemFileError, context=path.parent)
    files: dict[Any, ReducedBody] = {}
    try:
        units = unit_system(data.system.units)
        bodies = [body_of(name, section, files, units) for name, section in data.bodies.items()]
        joints = [joint_of(name, section) for name, section in data.joints.items()]
        couplers = [coupler_of(name, section) for name, section in data.couplers.items()]
        forces: list[Force] = [force_of(name, section) for name, section in data.forces.items()]
        if any(data.system.gravity):
            forces.insert(0, Gravity(np.array(data.system.gravity)))
        name = data.system.name or path.stem
        sensors = [section.sensor(key) for key, section in data.sensors.items()]
        system = System(
            bodies, joints, forces, units, name, data.system.redundant, couplers, sensors=sensors,
            inputs=[section.channel(key) for key, section in data.inputs.items()],
            outputs=[section.output(key) for key, section in data.outputs.items()],
            events=[section.event(key) for key, section in data.events.items()],
            source=str(path.resolve()),
        )  # fmt: skip
        _ = system.compiled  # markers and interfaces are looked up here
        require_events(system)
        for hint in unit_hints(system):
            log.warning("%s: %s", path, hint)
    except (FloatframeError, CmsError) as error:
        raise SystemFileError(f"{path}: {error}") from error
    return system, None if data.run is None else data.run.options()


def body_of(name: str, section: BodySection, files: dict[Any, ReducedBody], units: Units) -> Body:
    """Return the body of a table; a modal file is read once for all its instances, and converted to the units."""
    if section.euler_parameters is not None:
        orientation = np.array(section.euler_parameters)
    else:
        orientation = euler_parameters_of_rotation_vector(np.array(section.rotation_vector or (0.0, 0.0, 0.0)))
    motion: dict[str, Any] = {
        "position": section.position,
        "orientation": orientation,
        "velocity": section.velocity,
        "omega_B": section.omega_B,
    }
    if section.file is None:
        assert section.mass is not None  # checked by the table
        return RigidBody(name, **rigid_mass(section).arguments, **motion)
    if section.file not in files:
        try:
            reduced = read(section.file)
            files[section.file] = convert_units(reduced, units)
        except CmsError as error:
            raise ModelError(f"bodies.{name}.file: {error}") from error
        if reduced.units != units:
            log.warning("%s is in units %s: converted to those of the system, %s", section.file, reduced.units.name,
                        units.name)  # fmt: skip
    motion["stiffening"] = "auto" if section.stiffening is None else section.stiffening
    return FlexibleBody(name, changed_body(section, files), source=str(section.file.resolve()), **motion)


def rigid_mass(section: BodySection) -> MassProperties:
    """Return the mass properties of a rigid body with the parts fixed to it."""
    assert section.mass is not None  # checked by the table
    own = mass_properties(
        section.mass,
        section.center_of_mass or (0.0, 0.0, 0.0),
        np.array(section.inertia),
        axes=None if section.inertia_axes is None else np.array(section.inertia_axes).T,
        reference=section.inertia_about,
        positive_products=bool(section.positive_products),
    )
    parts = [
        point_mass(
            part.mass, part.position or (0.0, 0.0, 0.0), None if part.inertia is None else np.array(part.inertia)
        )
        for part in section.masses
    ]
    return combined(own, *parts)


def changed_body(section: BodySection, files: dict[Any, ReducedBody]) -> ReducedBody:
    """Return the reduced body with the modes and parts asked for; instances with the same ones share it."""
    chosen = [getattr(section, name) for name in FLEXIBLE_KEYS]
    key = (section.file, repr(chosen), repr(section.masses))
    if key not in files:
        body = files[section.file]
        if section.modes is not None:
            body = with_modes(body, section.modes)
        if section.without_modes is not None:
            body = without_modes(body, section.without_modes)
        if section.is_rigid:
            body = frozen_to_rigid(body)
        parts = [
            AddedMass(
                part.interface or "",
                part.mass,
                np.array(part.offset or (0.0, 0.0, 0.0)),
                np.zeros((3, 3)) if part.inertia is None else np.array(part.inertia),
            )
            for part in section.masses
        ]
        files[key] = with_masses(body, parts) if parts else body
    return files[key]


def joint_of(name: str, section: JointSection) -> Joint:
    """Return the joint of a table; an end without marker lies where the other end is placed."""
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
            options[key] = {coordinate: table.function() for coordinate, table in (value or {}).items()}
        elif value is not None:
            options[key] = value if isinstance(value, float | bool | list) else np.array(value)
    return JOINTS[section.type](name, ends[0], ends[1], **options)


def coupler_of(name: str, section: CouplerSection) -> CoordinateCoupler:
    """Return the coupler of a table."""
    constant = section.constant
    terms = [(term.found(), term.factor) for term in section.terms]
    return CoordinateCoupler(name, terms, constant.function() if isinstance(constant, MotionSection) else constant)


def bushing_of(name: str, section: ForceSection) -> Bushing:
    """Return the bushing of a table; a body without a marker is met where the other marker is placed."""
    ends: list[Place] = []
    for body, place, triad in ((section.body_a, section.marker_a, section.triad_a),
                               (section.body_b, section.marker_b, section.triad_b)):  # fmt: skip
        assert body is not None  # checked by the table
        ends.append(body if place is None and triad is None else marker_of(body, place, triad))
    given = {"stiffness": section.stiffness, "damping": section.damping, "preload": section.preload}
    options = {key: np.array(value) for key, value in given.items() if value is not None}
    tables = {key: table.function() for key, table in (section.characteristics or {}).items()}
    return Bushing(name, ends[0], ends[1], characteristics=tables, **options)


def contact_of(name: str, section: ForceSection) -> SphereContact:
    """Return the contact of a table."""
    assert section.body_a is not None  # checked by the table
    assert section.body_b is not None
    a = marker_of(section.body_a, section.marker_a, section.triad_a)
    b = marker_of(section.body_b, section.marker_b)
    keys = [key for key in KEYS_OF_FORCES["sphere-contact"] if not key.startswith(("body", "marker", "triad"))]
    return SphereContact(name, a, b, **{k: getattr(section, k) for k in keys if getattr(section, k) is not None})


def user_force_of(name: str, section: ForceSection) -> UserForce:
    """Return the user force of a table."""
    return UserForce(
        name,
        {key: coordinate.found() for key, coordinate in (section.coordinates or {}).items()},
        section.forces or {},
        section.rates or {},
        section.states or {},
        section.parameters or {},
        {key: table.function() for key, table in (section.functions or {}).items()},
    )


def force_of(name: str, section: ForceSection) -> Force:
    """Return the force of a table."""
    functions = {
        key: None if table is None else table.function()
        for key, table in (("amplitude", section.amplitude), ("characteristic", section.characteristic),
                           ("motor", section.motor))
    }  # fmt: skip
    if section.type == "bushing":
        return bushing_of(name, section)
    if section.type == "sphere-contact":
        return contact_of(name, section)
    if section.type == "user-force":
        return user_force_of(name, section)
    if section.type == "body-load":
        assert section.body is not None  # checked by the table
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
        assert section.body is not None  # checked by the table
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
    assert section.body_a is not None  # checked by the table
    assert section.body_b is not None
    given = [each or 0.0 for each in (section.stiffness, section.damping, section.preload)]
    stiffness, damping, preload = (each for each in given if isinstance(each, float))  # no lists: the table checks
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
