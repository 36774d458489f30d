"""Tables of the system file for drawn shapes: [[bodies.NAME.shapes]] and [[scene]]."""

from functools import cache
from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, Field

from fe_models.foundation.toml_file import existing_file
from floatframe.files.system_file.described import DescribedSection, OneOf, Signals, keys_of_fields, model_of_keys
from floatframe.files.system_file.keys import Positive
from floatframe.model.shapes import GEOMETRIES, Shape
from floatframe.model.shapes.mesh import mesh_file
from floatframe.model.shapes.shape import COLORS

__all__ = ["ShapeSection"]

#: keys of the place and colour of a shape
PLACE = keys_of_fields(Shape, ("geometry",)) | {
    "color": (
        str | None,
        Field(None, description=f'"#rrggbb" or one of {", ".join(COLORS)}; default: that of its kind or its body'),
    )
}
SurfaceFile = Annotated[Path, BeforeValidator(existing_file("surface such as an .stl file"))]
#: keys of a mesh, instead of nodes and triangles
OF_FILE = {
    "file": (
        SurfaceFile,
        Field(
            description="the path of a surface (.stl, .obj, .ply, .vtk, .vtu, .msh and others), relative to the file"
        ),
    ),
    "scale": (Positive | None, Field(None, description="a factor above 0 on the numbers of the file")),
}


class DrawnSection(DescribedSection):
    """[[bodies.NAME.shapes]] or [[scene]]: a geometry with its dimensions, position and colour."""

    def object_named(self, name: str = "", signals: Signals = None) -> Shape:
        """Return the shape; the file of a surface is read here."""
        values = self.python_values(signals)
        place = {key: values.pop(key) for key in PLACE if key in values}
        return Shape(mesh_of(**values) if self.type == "mesh" else self.described(**values), **place)

    def require_accepted(self) -> None:
        """Raise the error of the class if it does not accept the values; a surface is not read for this."""
        if self.type != "mesh":
            self.object_named()


def mesh_of(file: Path, scale: float | None = None) -> Any:
    """Return the surface of a file."""
    return mesh_file(file, scale=1.0 if scale is None else scale)


class OneShape(OneOf):
    """Annotation of the table of a shape, whose keys are those of its geometry and of its place."""

    def section(self, kind: str) -> type[DescribedSection]:
        """Return the model of the tables of a type."""
        return drawn_section_of(kind)


@cache
def drawn_section_of(kind: str) -> type[DrawnSection]:
    """Return the model of the tables of a geometry."""
    own = OF_FILE if kind == "mesh" else keys_of_fields(GEOMETRIES[kind])
    return model_of_keys(GEOMETRIES[kind], "[[bodies.NAME.shapes]] or [[scene]]", kind, DrawnSection, {**own, **PLACE})


ShapeSection = Annotated[DrawnSection, OneShape(GEOMETRIES, "scene", "shape")]
