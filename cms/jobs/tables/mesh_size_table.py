"""The table [mesh_size] of a reduction job: element sizes for a CAD file (docs/job_file.md)."""

from pathlib import Path
from typing import Annotated

from pydantic import Field, model_validator

from fe_models.files.cad.cad_units import CAD_SUFFIXES
from fe_models.foundation.toml_file import Table

__all__ = ["MeshSizeSection", "check_mesh_size"]

Positive = Annotated[float, Field(gt=0)]


class MeshSizeSection(Table):
    """[mesh_size]: largest element size, and adaptation to the geometry."""

    size: Positive = Field(description="a number above 0, the largest edge of an element")
    smallest: Positive | None = Field(None, description="a number above 0, the smallest edge for curved surfaces")
    curvature: Annotated[float, Field(ge=0, le=1000)] = Field(
        12.0, description="a number from 3 to 1000, elements around a circle, or 0: the size does not follow curvature"
    )
    order: Annotated[int, Field(ge=1, le=2)] = Field(2, description="1 (tetra) or 2 (tetra10)")
    optimise: bool = Field(True, description="true or false, whether elements are improved after meshing")

    @model_validator(mode="after")
    def _in_order(self) -> "MeshSizeSection":
        if self.smallest is not None and self.smallest > self.size:
            raise ValueError(f"smallest: expected at most the size {self.size:g}, got {self.smallest:g}")
        if 0 < self.curvature < 3:
            raise ValueError(f"curvature: expected 3 to 1000 elements around a circle, or 0, got {self.curvature:g}")
        return self


def check_mesh_size(table: MeshSizeSection | None, mesh: Path | None, *, has_others: bool) -> None:
    """Raise `ValueError` unless a CAD file has its table, and no other source has one.

    Parameters
    ----------
    mesh
        Source file of the body.
    has_others
        Whether the job has shells or beams.
    """
    is_cad = mesh is not None and mesh.suffix.lower() in CAD_SUFFIXES
    if is_cad and table is None:
        raise ValueError(
            "mesh_size: missing; a CAD file has to be meshed: expected a table [mesh_size] with size, the largest edge "
            "of an element"
        )
    if table is not None and not is_cad:
        raise ValueError("mesh_size: belongs to a CAD file; a mesh has its sizes, remove the table")
    if is_cad and has_others:
        raise ValueError(
            "body.mesh: of a CAD file the solids are meshed, without shells and beams; remove [shells] and [sections], "
            "or give a mesh"
        )
