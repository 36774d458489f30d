"""The tables of a reduction job that describe shells (docs/job_file.md)."""

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, StringConstraints

from cms.jobs.beam_tables import BeamSection, names
from fe_models.foundation.toml_file import Table
from fe_models.foundation.words import nearest

__all__ = ["ShellSection", "check_shells"]

Name = Annotated[str, StringConstraints(min_length=1)]


class ShellSection(Table):
    """[shells.NAME]: thickness and material of a group of triangles and quads."""

    thickness: Annotated[float, Field(gt=0)] = Field(description="a number above 0")
    cells: Annotated[tuple[str, ...], BeforeValidator(names)] = Field(
        ("all",), description='"all", the name of a group of cells, or a list of names'
    )
    material: Name | None = Field(None, description="the name of a material; default: the only one")
    offset: float = Field(0.0, description="a number, of the middle surface from the nodes along the normal")
    added_mass: Annotated[float, Field(ge=0)] = Field(0.0, description="a number, 0 or more [mass / length^2]")


def check_shells(
    shells: Mapping[str, ShellSection], sections: Mapping[str, BeamSection], body: Any, materials: Mapping[str, Any]
) -> None:
    """Raise `ValueError` unless every shell has a mesh, a material and its cells, and every stiffener its lines.

    Parameters
    ----------
    shells, sections, materials
        Tables of the job by name.
    body
        Its table [body].
    """
    if not shells:
        return
    if body.mesh is None:
        raise ValueError("shells: belong to a mesh; give [body] mesh, or remove the tables")
    if body.plane is not None:
        raise ValueError("body.plane: belongs to beams alone; remove it")
    for name, shell in shells.items():
        if shell.material is None and len(materials) != 1:
            raise ValueError(f"shells.{name}.material: missing; there are {len(materials)} materials, name one")
        if shell.material is not None and shell.material not in materials:
            raise ValueError(
                f'shells.{name}.material = "{shell.material}": there is no such material'
                f"{nearest(shell.material, materials)}"
            )
        if shell.cells == ("all",) and len(shells) > 1:
            raise ValueError(
                f'shells.{name}: cells = "all", but there are {len(shells)} tables; name the cells of each'
            )
    for name, section in sections.items():
        if section.lines == ("all",):
            raise ValueError(f"sections.{name}.lines: missing; which group of lines is the stiffener?")
