"""The tables of a reduction job that describe beams and attachments at their nodes (docs/job_file.md)."""

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, StringConstraints, model_validator

from fe_models.foundation.arrays import MOTION_COMPONENTS as COMPONENTS
from fe_models.foundation.toml_file import Matrix3, Names, Table, Vector3, choice, names
from fe_models.foundation.words import nearest, quoted

__all__ = ["PLANES", "SHAPE_KEYS", "BeamSection", "LinkSection", "MassSection", "SpringSection", "TieSection"]

PLANES = {"yz": 0, "zx": 1, "xz": 1, "xy": 2}  #: index of the mesh axis normal to each plane
SHAPE_KEYS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "circle": (("radius",), ()),
    "tube": (("radius", "thickness"), ()),
    "rectangle": (("width", "height"), ()),
    "box": (("width", "height", "web", "flange"), ()),
    "i": (("width", "height", "web", "flange"), ()),
    "general": (("area", "iy", "iz", "torsion"), ("shear_area_y", "shear_area_z", "shear_center", "outline")),
}  #: required and optional keys of each shape

Name = Annotated[str, StringConstraints(min_length=1)]
NodeNumber = Annotated[int, Field(ge=0, strict=True)]
Positive = Annotated[float, Field(gt=0)]
Pair = tuple[float, float]


def numbers(*counts: int) -> Any:
    """Return the type of a list whose length is one of these numbers; integers are accepted."""

    def check(value: Any) -> tuple[float, ...]:
        is_list = isinstance(value, list | tuple) and len(value) in counts
        if not is_list or not all(isinstance(x, int | float) and not isinstance(x, bool) for x in value):
            raise ValueError(f"expected a list of {' or '.join(map(str, counts))} numbers")
        return tuple(float(x) for x in value)

    return Annotated[tuple[float, ...], BeforeValidator(check)]


def component_numbers(value: Any) -> tuple[int, ...]:
    """Return component names as numbers 0-5."""
    words = names(value)
    for word in words:
        if word not in COMPONENTS:
            raise ValueError(f"unknown component {quoted(word)}{nearest(word, COMPONENTS)}")
    return tuple(COMPONENTS.index(word) for word in words)


def polygon(value: Any) -> tuple[Pair, ...]:
    """Return a list of at least three points (y, z)."""
    is_list = isinstance(value, list | tuple) and len(value) >= 3
    if not is_list or not all(isinstance(p, list | tuple) and len(p) == 2 for p in value):
        raise ValueError("expected three or more points [[y, z], ...]")
    return tuple((float(y), float(z)) for y, z in value)


def inertia_numbers(value: Any) -> Any:
    """Return one number, three numbers, or three rows of three."""
    rows = value if isinstance(value, list | tuple) else [value]
    flat = [x for row in rows for x in (row if isinstance(row, list | tuple) else [row])]
    if len(flat) not in (1, 3, 9) or not all(isinstance(x, int | float) and not isinstance(x, bool) for x in flat):
        raise ValueError("expected one number, three principal values, or three rows of three")
    return value


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


class MassSection(Table):
    """[masses.NAME]: a rigid piece at a node."""

    node: Name | NodeNumber = Field(description="the name of a group that holds one node, or a node number")
    mass: Annotated[float, Field(ge=0)] = Field(description="a number, 0 or more")
    inertia: Annotated[Any, BeforeValidator(inertia_numbers, json_schema_input_type=Any)] = Field(
        0.0, description="about the centre of mass: one number, three principal values, or three rows of three"
    )
    offset: Vector3 | None = Field(None, description="from the node to the centre of mass, [x, y, z]")


class SpringSection(Table):
    """[springs.NAME]: a spring between two nodes."""

    nodes: Annotated[Names, Field(min_length=2, max_length=2)] = Field(
        description="two names of groups that hold one node each"
    )
    stiffness: numbers(6) = Field(  # type: ignore[valid-type]
        description="six numbers: along x y z, about x y z"
    )
    damping: numbers(6) | None = Field(  # type: ignore[valid-type]
        None, description="six numbers: along x y z, about x y z"
    )
    point: Vector3 | None = Field(None, description="where it acts, [x, y, z]; default: midway")
    triad: Matrix3 | None = Field(None, description="its axes, [x axis, y axis, z axis]")


class LinkSection(Table):
    """[links.NAME]: nodes that move rigidly with one node."""

    node: Name = Field(description="the name of a group that holds one node, which leads")
    followers: Names = Field(description="the name of a group of nodes, or a list of names")
    components: Annotated[tuple[int, ...], BeforeValidator(component_numbers, json_schema_input_type=Any)] = Field(
        tuple(range(6)), description="with a deck: components that follow, ux to rz; default: all"
    )


class TieSection(Table):
    """[ties.NAME]: a node of the beams held by nodes of the solid."""

    node: Name = Field(description="the name of a group that holds one node of the beams")
    kind: choice("kind", lambda: ("rigid", "distributing")) = Field(  # type: ignore[valid-type]
        description="one of rigid, distributing"
    )
    faces: Name | None = Field(None, description="the name of a group of faces of the solid")
    nodes: Name | None = Field(None, description="the name of a group of nodes of the solid")

    @model_validator(mode="after")
    def _one_selection(self) -> "TieSection":
        if (self.faces is None) == (self.nodes is None):
            raise ValueError(f"expected either faces or nodes of the solid, got {'both' if self.faces else 'neither'}")
        return self


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
        if section.material is None and len(materials) != 1:
            raise ValueError(f"sections.{name}.material: missing; there are {len(materials)} materials, name one")
        if section.material is not None and section.material not in materials:
            raise ValueError(
                f'sections.{name}.material = "{section.material}": there is no such material'
                f"{nearest(section.material, materials)}"
            )
        if section.lines == ("all",) and len(sections) > 1:
            raise ValueError(
                f'sections.{name}: lines = "all", but there are {len(sections)} sections; name the lines of each'
            )
