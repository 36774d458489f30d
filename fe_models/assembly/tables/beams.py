"""The tables [sections.NAME] and [rods.NAME] of a model, and the beams and rods they describe (docs/job_file.md)."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from fe_models.assembly.tables.materials import MaterialSection, Name, check_all, check_material, isotropic_of
from fe_models.foundation.toml_file import Names, Table, Vector3, choice
from fe_models.foundation.words import nearest

if TYPE_CHECKING:
    from fe_models.assembly.rods import Rod
    from fe_models.elements.beams.beam_property import BeamProperty

__all__ = [
    "PLANES", "SHAPE_KEYS", "BeamSection", "RodSection", "beam_properties", "check_beams", "numbers",
    "rod_properties",
]  # fmt: skip

PLANES = {"yz": 0, "zx": 1, "xz": 1, "xy": 2}  #: index of the mesh axis normal to each plane
SHAPE_KEYS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "circle": (("radius",), ()),
    "tube": (("radius", "thickness"), ()),
    "rectangle": (("width", "height"), ()),
    "box": (("width", "height", "web", "flange"), ()),
    "i": (("width", "height", "web", "flange"), ()),
    "general": (("area", "iy", "iz", "torsion"), ("shear_area_y", "shear_area_z", "shear_center", "outline")),
}  #: required and optional keys of each shape

Positive = Annotated[float, Field(gt=0)]
Pair = tuple[float, float]
GENERAL_KEYS = {
    "area": "A",
    "iy": "Iy",
    "iz": "Iz",
    "torsion": "J",
    "shear_area_y": "A_sy",
    "shear_area_z": "A_sz",
}  #: field of `GeneralSection` for each key of a table


def numbers(*counts: int) -> Any:
    """Return the type of a list whose length is one of these numbers; integers are accepted."""

    def check(value: Any) -> tuple[float, ...]:
        is_list = isinstance(value, list | tuple) and len(value) in counts
        if not is_list or not all(isinstance(x, int | float) and not isinstance(x, bool) for x in value):
            raise ValueError(f"expected a list of {' or '.join(map(str, counts))} numbers")
        return tuple(float(x) for x in value)

    return Annotated[tuple[float, ...], BeforeValidator(check)]


def polygon(value: Any) -> tuple[Pair, ...]:
    """Return a list of at least three points (y, z)."""
    is_list = isinstance(value, list | tuple) and len(value) >= 3
    if not is_list or not all(isinstance(p, list | tuple) and len(p) == 2 for p in value):
        raise ValueError("expected three or more points [[y, z], ...]")
    return tuple((float(y), float(z)) for y, z in value)


class BeamSection(Table):
    """[sections.NAME]: cross-section, material and theory of a group of lines."""

    shape: choice("shape", lambda: tuple(SHAPE_KEYS)) = Field(  # type: ignore[valid-type]
        description=f"one of {', '.join(SHAPE_KEYS)}"
    )
    lines: Names = Field(("all",), description='"all", the name of a group of lines, or a list of names')
    material: Name | None = Field(None, description="the name of a material; default: the only one")
    radius: Positive | None = Field(None, description="a number above 0, the outer radius")
    thickness: Positive | None = Field(None, description="a number above 0, of the wall of a tube")
    width: Positive | None = Field(None, description="a number above 0, along the local y axis")
    height: Positive | None = Field(None, description="a number above 0, along the local z axis")
    web: Positive | None = Field(None, description="a number above 0, the thickness of the walls along z")
    flange: Positive | None = Field(None, description="a number above 0, the thickness of the walls along y")
    area: Positive | None = Field(None, description="a number above 0 [length^2]")
    iy: Positive | None = Field(None, description="a number above 0, the integral of z^2 [length^4]")
    iz: Positive | None = Field(None, description="a number above 0, the integral of y^2 [length^4]")
    torsion: Positive | None = Field(None, description="a number above 0, the torsion constant [length^4]")
    shear_area_y: Positive | None = Field(None, description="a number above 0 [length^2]; default: rigid in shear")
    shear_area_z: Positive | None = Field(None, description="a number above 0 [length^2]; default: rigid in shear")
    shear_center: numbers(2) | None = Field(  # type: ignore[valid-type]
        None, description="[y, z] of the shear centre from the centroid"
    )
    outline: Annotated[tuple[Pair, ...], BeforeValidator(polygon, json_schema_input_type=Any)] | None = Field(
        None, description="a polygon [[y, z], ...], anticlockwise"
    )
    orientation: Vector3 | None = Field(None, description="a vector towards the local y axis, [x, y, z]")
    offset: numbers(2) | None = Field(  # type: ignore[valid-type]
        None, description="[y, z] of the centroid from the line"
    )
    shear: bool = Field(True, description="true or false: with shear deformation (Timoshenko)")
    rotary_inertia: bool = Field(True, description="true or false: with rotary inertia of bending")
    added_mass: Annotated[float, Field(ge=0)] = Field(0.0, description="a number, 0 or more [mass / length]")

    @model_validator(mode="after")
    def _keys_of_the_shape(self) -> "BeamSection":
        needed, optional = SHAPE_KEYS[self.shape]
        every = {key for keys in SHAPE_KEYS.values() for group in keys for key in group}
        for key in sorted(every):
            if getattr(self, key) is not None and key not in (*needed, *optional):
                raise ValueError(f"shape {self.shape!r} has no key {key}{nearest(key, (*needed, *optional))}")
        missing = [key for key in needed if getattr(self, key) is None]
        if missing:
            raise ValueError(f"shape {self.shape!r} needs {', '.join(needed)}; missing: {', '.join(missing)}")
        return self

    @property
    def dimensions(self) -> dict[str, Any]:
        """Given dimensions of the cross-section, by key."""
        keys = (key for group in SHAPE_KEYS[self.shape] for key in group)
        return {key: getattr(self, key) for key in keys if getattr(self, key) is not None}


class RodSection(Table):
    """[rods.NAME]: lines with axial force only (trusses)."""

    lines: Names = Field(description="the name of a group of lines, or a list of names")
    material: Name | None = Field(None, description="the name of a material; default: the only one")
    area: Annotated[float, Field(gt=0)] = Field(description="a number above 0 [length^2]")


ON_SOLIDS = {
    "masses": "a mass on a solid or on matrices sits at an interface: remove the tables, reduce with an interface "
    "there, and add it in the system file, [[bodies.NAME.masses]] (with_masses in Python); or add tables "
    "[sections.NAME]",
}  #: advice in the error for tables that need beams, if there are none


def check_beams(sections: Mapping[str, BeamSection], others: Mapping[str, Any], materials: Mapping[str, Any]) -> None:
    """Raise `ValueError` unless every section has material and lines, and every attachment has beams."""
    for kind, tables in others.items():
        if tables and not sections:
            raise ValueError(
                f"{kind}: belong to beams; {ON_SOLIDS.get(kind, 'add tables [sections.NAME], or remove them')}"
            )
    for name, section in sections.items():
        check_material(f"sections.{name}", section.material, materials)
    check_all("sections", sections, "lines")


def beam_properties(
    sections: Mapping[str, BeamSection], materials: Mapping[str, MaterialSection]
) -> "dict[str, BeamProperty]":
    """Return section, material and beam theory for each group of lines."""
    from fe_models.elements.beams.beam_property import BeamProperty

    made: dict[str, BeamProperty] = {}
    for section in sections.values():
        item = BeamProperty(
            shape_of(section),
            isotropic_of(section, materials, "beams"),
            offset=section.offset or (0.0, 0.0),
            orientation=section.orientation,
            shear=section.shear,
            rotary_inertia=section.rotary_inertia,
            added_mass=section.added_mass,
        )
        made |= dict.fromkeys(section.lines, item)
    return made


def rod_properties(tables: Mapping[str, RodSection], materials: Mapping[str, MaterialSection]) -> "dict[str, Rod]":
    """Return material and area of the rods for each group of lines."""
    from fe_models.assembly.rods import Rod

    made: dict[str, Rod] = {}
    for table in tables.values():
        made |= dict.fromkeys(table.lines, Rod(isotropic_of(table, materials, "rods"), table.area))
    return made


def shape_of(section: BeamSection) -> Any:
    """Return the cross-section of a table."""
    from fe_models.elements.beams.sections import SECTIONS

    given = {GENERAL_KEYS.get(key, key): value for key, value in section.dimensions.items()}
    if "outline" in given:
        given["outline"] = np.array(given["outline"])
    return SECTIONS[section.shape](**given)
