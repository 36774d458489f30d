"""Tables of the system file for drawn shapes: [[bodies.NAME.shapes]] and [[scene]]."""

from dataclasses import MISSING, fields
from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, model_validator

from fe_models.foundation.toml_file import Table, Vector3, choice, existing_file
from floatframe.files.system_file.keys import Name, NotNegative, Positive
from floatframe.model.shapes import GEOMETRIES, Shape
from floatframe.model.shapes.mesh import mesh_file

__all__ = ["ShapeSection"]

PLACE_KEYS = ("type", "position", "rotation_vector", "color", "opacity", "interface")
FILE_KEYS = ("file", "scale")  #: of a mesh, instead of nodes and triangles


class ShapeSection(Table):
    """[[bodies.NAME.shapes]] or [[scene]]: a geometry with its dimensions, position and colour."""

    type: choice("geometry", lambda: tuple(GEOMETRIES)) = Field(  # type: ignore[valid-type]
        description=f"one of {', '.join(GEOMETRIES)}"
    )
    position: Vector3 = Field((0.0, 0.0, 0.0), description="the position of its origin, [x, y, z]")
    rotation_vector: Vector3 = Field((0.0, 0.0, 0.0), description="axis times angle in rad, [x, y, z]")
    color: str | None = Field(None, description='a colour, "#rrggbb" or a name such as "steel"')
    opacity: Positive = Field(1.0, description="a number above 0 and up to 1")
    interface: Name | None = Field(None, description="the interface of a flexible body to which it is fixed")
    size: Vector3 | None = Field(None, description="the edges of a box, [x, y, z]")
    radius: Positive | None = Field(None, description="a number above 0, the radius")
    end_radius: NotNegative | None = Field(None, description="the radius of a cone at its other end, 0 or more")
    inner_radius: NotNegative | None = Field(None, description="the inner radius of a pipe, 0 or more")
    rim_radius: Positive | None = Field(None, description="a number above 0, the radius of the rim")
    length: Positive | None = Field(None, description="a number above 0, the length along the axis")
    width: Positive | None = Field(None, description="a number above 0, the width")
    axis: Vector3 | None = Field(None, description="the direction of the axis, [x, y, z]")
    n_spokes: int | None = Field(None, description="a whole number from 0 to 60, the spokes of a wheel")
    flange_side: int | None = Field(None, description="1, -1 or 0: the end of the axis with the flange, or none")
    flange_height: Positive | None = Field(None, description="a number above 0, the height of the flange")
    conicity: NotNegative | None = Field(None, description="0 or more, the conicity of the tread as drawn")
    points: list[Vector3] | None = Field(None, description="a list of points, [[x, y, z], ...]")
    profile: list[list[float]] | None = Field(None, description="a list of pairs of numbers, [[a, b], ...]")
    is_closed: bool | None = Field(None, description="true: the last point is joined to the first")
    normal: Vector3 | None = Field(None, description="the direction upwards of a plane, [x, y, z]")
    step: Positive | None = Field(None, description="a number above 0, the distance of the lines of a grid")
    x: list[float] | None = Field(None, description="rising numbers, places of a grid of heights")
    y: list[float] | None = Field(None, description="rising numbers, places of a grid of heights")
    z: list[list[float]] | None = Field(None, description="heights, a row for each x with a number for each y")
    up: Vector3 | None = Field(None, description="the direction upwards, [x, y, z]")
    is_painted: bool | None = Field(None, description="whether a road has lines painted on it")
    gauge: Positive | None = Field(None, description="a number above 0, between the middles of the rails")
    cant: float | list[float] | None = Field(
        None, description="the height of the left rail above the right one, one number or many"
    )
    rail_height: Positive | None = Field(None, description="a number above 0, the height of the rails")
    sleeper_distance: Positive | None = Field(None, description="a number above 0, from sleeper to sleeper")
    file: Annotated[Path, BeforeValidator(existing_file("surface such as an .stl file"))] | None = Field(
        None, description="the path of a surface, relative to the system file"
    )
    scale: Positive | None = Field(None, description="a factor above 0 on the numbers of the file")

    @model_validator(mode="after")
    def _keys_of_its_geometry(self) -> "ShapeSection":
        known, needed = keys_of(self.type)
        for key in type(self).model_fields:
            if key not in (*PLACE_KEYS, *known) and getattr(self, key) is not None:
                raise ValueError(f"{key}: a {self.type} has no such key; its own are {', '.join(known)}")
        for key in needed:
            if getattr(self, key) is None:
                raise ValueError(f"{key}: missing; a {self.type} needs {', '.join(needed)}")
        return self

    @property
    def shape(self) -> Shape:
        """The shape; the file of a surface is read here."""
        geometry: Any
        if self.type == "mesh":
            assert self.file is not None  # checked by the table
            geometry = mesh_file(self.file, scale=self.scale or 1.0)
        else:
            given = {key: getattr(self, key) for key in keys_of(self.type)[0]}
            geometry = GEOMETRIES[self.type](**{key: value for key, value in given.items() if value is not None})
        return Shape(geometry, **{key: getattr(self, key) for key in PLACE_KEYS if key != "type"})


def keys_of(kind: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return all keys of a geometry, and its required keys."""
    if kind == "mesh":
        return FILE_KEYS, FILE_KEYS[:1]
    own = fields(GEOMETRIES[kind])
    needed = tuple(each.name for each in own if each.default is MISSING and each.default_factory is MISSING)
    return tuple(each.name for each in own), needed
