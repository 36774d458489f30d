"""Tables of the system file for bodies: [bodies.NAME]."""

import logging
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from cms.body.modal_file.file import convert_units, read
from cms.body.reduced_body import ReducedBody
from cms.errors import CmsError
from fe_models.foundation.paths import file_digest, file_state
from fe_models.foundation.toml_file import Matrix3, Table, Vector3, existing_file
from fe_models.foundation.units import Units
from floatframe.errors import ModelError
from floatframe.files.system_file.keys import Count, Name, Numbers, Parameters4, Positive
from floatframe.files.system_file.shape_section import ShapeSection
from floatframe.model.bodies.added_mass import AddedMass, with_masses
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.bodies.mass_properties import MassProperties, combined, mass_properties, point_mass
from floatframe.model.bodies.mode_choice import frozen_to_rigid, with_modes, without_modes
from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.model.rotations import euler_parameters_of_rotation_vector
from floatframe.model.system import Body

if TYPE_CHECKING:
    from cms.reduction.parametric.parametric_body import ParametricBody

__all__ = ["BodySection", "ReadBodies", "body_of"]

log = logging.getLogger(__name__)

RIGID_KEYS = ("inertia_axes", "inertia_about", "positive_products")


MODE_KEYS = ("modes", "without_modes", "is_rigid")
FLEXIBLE_KEYS = (*MODE_KEYS, "at", "q", "q_dot")


class MassSection(Table):
    """[[bodies.NAME.masses]]: a small mass fixed to a body."""

    mass: Positive = Field(description="a number above 0, the mass of the part")
    interface: Name | None = Field(None, description="the name of an interface of a flexible body")
    position: Vector3 | None = Field(None, description="its centre of mass in a rigid body, [x, y, z]")
    offset: Vector3 | None = Field(
        None, description="its centre of mass relative to the interface, in interface axes, [x, y, z]"
    )
    inertia: Matrix3 | None = Field(None, description="its inertia tensor about its centre of mass, three rows")


class BodySection(Table):
    """[bodies.NAME]: a flexible body from a modal file, or a rigid one from its mass properties."""

    file: Annotated[Path, BeforeValidator(existing_file("modal file"))] | None = Field(
        None, description="the path of a modal file, relative to the system file"
    )
    at: dict[str, float] | None = Field(
        None, description="a table {length = 1.1}: values of the parameters, if file is a family (cms family)"
    )
    mass: Positive | None = Field(None, description="a number above 0, the mass of a rigid body")
    inertia: Matrix3 | None = Field(None, description="the inertia tensor about the centre of mass, three rows")
    center_of_mass: Vector3 | None = Field(None, description="the centre of mass in the body frame, [x, y, z]")
    inertia_axes: Matrix3 | None = Field(None, description="the axes of the inertia tensor, [x axis, y axis, z axis]")
    inertia_about: Vector3 | None = Field(None, description="the point of the inertia tensor in the body, [x, y, z]")
    positive_products: bool | None = Field(
        None, description="true: products of inertia are given without their minus sign"
    )
    masses: list[MassSection] = Field([], description="tables [[bodies.NAME.masses]], masses fixed to the body")
    modes: list[Count] | None = Field(None, description="a list of whole numbers from 0, the modes to keep")
    without_modes: list[Count] | None = Field(None, description="a list of whole numbers from 0, the modes to remove")
    is_rigid: bool | None = Field(None, description="true: a flexible body without its modes")
    position: Vector3 | None = Field(
        None, description="the position of the body (mesh) origin, [x, y, z]; without it, the joints place the body"
    )
    rotation_vector: Vector3 | None = Field(None, description="axis times angle in rad from ground to body, [x, y, z]")
    euler_parameters: Parameters4 | None = Field(None, description="Euler parameters of length 1, [w, x, y, z]")
    velocity: Vector3 = Field((0.0, 0.0, 0.0), description="the velocity of the body (mesh) origin, [x, y, z]")
    omega_B: Vector3 = Field((0.0, 0.0, 0.0), description="the angular velocity in body (mesh) axes, [x, y, z]")  # noqa: N815
    q: Numbers | None = Field(None, description="a list of numbers, the modal coordinates at the start, one a mode")
    q_dot: Numbers | None = Field(None, description="a list of numbers, the rates of the modal coordinates")
    stiffening: bool | None = Field(
        None, description="true or false: whether to use the geometric stiffness of the file"
    )
    leave_out_missing: bool | None = Field(
        None, description="true: neglect inertia terms that the file of the body lacks"
    )
    shapes: list[ShapeSection] = Field([], description="tables [[bodies.NAME.shapes]], its appearance")

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
        if self.mass is not None and self.leave_out_missing is not None:
            raise ValueError("leave_out_missing: a rigid body has all of its inertia; remove it")
        others = RIGID_KEYS if self.file is not None else FLEXIBLE_KEYS
        for key in others:
            if getattr(self, key) is not None:
                raise ValueError(f"{key}: a {'flexible' if self.file else 'rigid'} body has no such key; remove it")
        if sum(getattr(self, key) is not None for key in MODE_KEYS) > 1:
            raise ValueError(f"expected one of {', '.join(MODE_KEYS)}, got several")
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


#: state and body of each modal file, which a task that reads many systems keeps from one to the next
ReadBodies = dict[Path, tuple[tuple[int, ...] | None, ReducedBody]]


def body_of(
    name: str, section: BodySection, files: dict[Any, ReducedBody], units: Units, read_bodies: ReadBodies | None = None
) -> Body:
    """Return the body of a table, in the given units; a modal file is read once for all its instances."""
    if section.euler_parameters is not None:
        orientation = np.array(section.euler_parameters)
    else:
        orientation = euler_parameters_of_rotation_vector(np.array(section.rotation_vector or (0.0, 0.0, 0.0)))
    motion: dict[str, Any] = {
        "position": section.position,
        "orientation": orientation,
        "velocity": section.velocity,
        "omega_B": section.omega_B,
        "shapes": [each.object_named() for each in section.shapes],
    }
    if section.file is None:
        assert section.mass is not None  # ensured by the validation of the table
        return RigidBody(name, **rigid_mass(section).arguments, **motion)
    if source_key(section) not in files:
        try:
            reduced = reduced_of(name, section, read_bodies)
            files[source_key(section)] = convert_units(reduced, units)
        except CmsError as error:
            raise ModelError(f"bodies.{name}.file: {error}") from error
        if reduced.units != units:
            log.warning("%s is in units %s: converted to those of the system, %s", section.file, reduced.units.name,
                        units.name)  # fmt: skip
    reduced = changed_body(section, files)
    for key in ("q", "q_dot"):
        values = getattr(section, key)
        if values is not None and len(values) != reduced.n_q:
            raise ModelError(
                f"bodies.{name}.{key}: expected {reduced.n_q} numbers, one for each mode of the body, got {len(values)}"
            )
        motion[key] = np.array(values or ())
    motion["leave_out_missing"] = bool(section.leave_out_missing)
    motion["stiffening"] = "auto" if section.stiffening is None else section.stiffening
    source = str(section.file.resolve()) if section.at is None else ""  # a body of a family has no modal file
    return FlexibleBody(name, reduced, source=source, **motion)


def source_key(section: BodySection) -> Any:
    """Return what identifies the reduced body of a table before its changes: its file, and parameters of a family."""
    return section.file if section.at is None else (section.file, repr(sorted(section.at.items())))


def reduced_of(name: str, section: BodySection, read_bodies: ReadBodies | None) -> ReducedBody:
    """Return the body of the modal file, or of the family at its parameters."""
    assert section.file is not None  # ensured by the caller
    if section.at is None:
        if read_bodies is None:
            return read(section.file)
        state = file_state(section.file)
        known = read_bodies.get(section.file)
        if known is None or known[0] != state:
            known = read_bodies[section.file] = (state, read(section.file))
        return known[1]
    family = family_of(section.file, file_digest(section.file))
    try:
        return family.at(**section.at)
    except CmsError as error:
        raise ModelError(f"bodies.{name}.at: {error}") from error


@lru_cache(maxsize=2)  # the points of a sweep read one family and align its modes once
def family_of(file: Path, digest: str) -> "ParametricBody":
    """Return the parametric body in a file; `digest` is that of the file, which may change."""
    from cms.reduction.parametric.family_file import read_parametric_body

    return read_parametric_body(file)


def rigid_mass(section: BodySection) -> MassProperties:
    """Return the mass properties of a rigid body, including the masses fixed to it."""
    assert section.mass is not None  # ensured by the validation of the table
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
    """Return the reduced body with the requested modes and masses; instances with the same request share it."""
    chosen = [getattr(section, name) for name in MODE_KEYS]
    key = (source_key(section), repr(chosen), repr(section.masses))
    if key not in files:
        body = files[source_key(section)]
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
