"""The tables [shells.NAME] of a model, and the thickness, layers or stiffness they describe (docs/job_file.md)."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from fe_models.assembly.tables.beams import BeamSection
from fe_models.assembly.tables.materials import (
    MaterialSection,
    Name,
    check_all,
    check_material,
    isotropic_of,
    material_of,
)
from fe_models.foundation.toml_file import Names, Table, Vector3

if TYPE_CHECKING:
    from fe_models.elements.shells.shell_property import AnyShellProperty

__all__ = ["LayerTable", "ShellSection", "check_layups", "check_shells", "shell_properties"]


class LayerTable(Table):
    """One entry of `layers`."""

    thickness: Annotated[float, Field(gt=0)] = Field(description="a number above 0")
    angle: float = Field(0.0, description="a number [degree], of the material's axis 1 from the direction of the layup")
    material: Name | None = Field(None, description="the name of a material; default: the only one")


class ShellSection(Table):
    """[shells.NAME]: thickness and material, or layers, of a group of triangles and quads."""

    thickness: Annotated[float, Field(gt=0)] | None = Field(None, description="a number above 0")
    layers: list[LayerTable] = Field(
        [], description="a list of layers, bottom to top: {thickness = , angle = , material = }"
    )
    direction: Vector3 | None = Field(
        None, description="[x, y, z] in mesh axes; projected on the shell it is the direction of angle 0 of layers"
    )
    stiffness: list[list[float]] | None = Field(
        None,
        description="rows of [[A, B], [B, D]] over N_x N_y N_xy M_x M_y M_xy; then thickness is nominal and added_mass "
        "the whole mass per area",
    )
    shear_stiffness: list[list[float]] | None = Field(
        None, description="rows of the transverse shear stiffness over Q_x Q_y; belongs to stiffness"
    )
    symmetric: bool = Field(False, description="true: the layers listed are the lower half, their mirror image follows")
    cells: Names = Field(("all",), description='"all", the name of a group of cells, or a list of names')
    material: Name | None = Field(None, description="the name of a material; default: the only one")
    offset: float = Field(0.0, description="a number, of the middle surface from the nodes along the normal")
    added_mass: Annotated[float, Field(ge=0)] = Field(0.0, description="a number, 0 or more [mass / length^2]")
    bending_ratio: Annotated[float, Field(gt=0)] = Field(
        1.0, description="a number above 0: stiffness in bending over that of a plate of this thickness"
    )
    shear_ratio: Annotated[float, Field(gt=0)] = Field(
        1.0, description="a number above 0: stiffness in transverse shear over that of a plate of this thickness"
    )


def check_shells(
    shells: Mapping[str, ShellSection], sections: Mapping[str, BeamSection], body: Any, materials: Mapping[str, Any]
) -> None:
    """Raise `ValueError` unless every shell has a mesh, layers and cells, and every stiffener has lines.

    Parameters
    ----------
    shells, sections, materials
        Tables of the job, by name.
    body
        The table [body] of the job.
    """
    if not shells:
        return
    if body.mesh is None:
        raise ValueError("shells: belong to a mesh; give [body] mesh, or remove the tables")
    if body.plane is not None:
        raise ValueError("body.plane: belongs to beams alone; remove it")
    check_layups(shells, materials)
    check_all("shells", shells, "cells")
    for name, section in sections.items():
        if section.lines == ("all",):
            raise ValueError(f"sections.{name}.lines: missing; which group of lines is the stiffener?")


def check_layups(shells: Mapping[str, ShellSection], materials: Mapping[str, Any]) -> None:
    """Raise `ValueError` unless every shell has a thickness or layers, and a material for each."""
    for name, shell in shells.items():
        where = f"shells.{name}"
        if shell.stiffness is not None:
            _check_stiffness(where, shell)
            continue
        if shell.shear_stiffness is not None:
            raise ValueError(f"{where}.shear_stiffness: belongs to stiffness; remove it, or give stiffness")
        if not shell.layers:
            for key, given in (("direction", shell.direction is not None), ("symmetric", shell.symmetric)):
                if given:
                    raise ValueError(f"{where}.{key}: belongs to layers; remove it, or give layers")
            if shell.thickness is None:
                raise ValueError(f"{where}.thickness: missing; expected a number above 0, or layers")
            check_material(where, shell.material, materials)
            continue
        for key in ("thickness", "material"):
            if getattr(shell, key) is not None:
                raise ValueError(f"{where}.{key}: each of the layers has its own; remove it")
        if shell.direction is None:
            raise ValueError(f"{where}.direction: missing; expected [x, y, z], where angle 0 of the layers points")
        for number, layer in enumerate(shell.layers):
            check_material(f"{where}.layers.{number}", layer.material, materials)


def _check_stiffness(where: str, shell: ShellSection) -> None:
    for key in ("thickness", "shear_stiffness", "direction"):
        if getattr(shell, key) is None:
            raise ValueError(f"{where}.{key}: missing; stiffness needs it")
    for key in ("material", "layers", "symmetric"):
        if getattr(shell, key):
            raise ValueError(f"{where}.{key}: the matrices of stiffness stand for it; remove it")
    for key in ("bending_ratio", "shear_ratio"):
        if getattr(shell, key) != 1:
            raise ValueError(f"{where}.{key}: belongs to a material or layers; put it into the matrices")


def shell_properties(
    shells: Mapping[str, ShellSection], materials: Mapping[str, MaterialSection]
) -> "dict[str, AnyShellProperty]":
    """Return thickness and material, or layers, for each group of cells."""
    from fe_models.elements.shells.shell_property import ShellProperty

    made: dict[str, AnyShellProperty] = {}
    for shell in shells.values():
        if shell.stiffness is not None:
            made |= dict.fromkeys(shell.cells, _given_stiffness(shell))
            continue
        if shell.layers:
            made |= dict.fromkeys(shell.cells, _laminate_of(shell, materials))
            continue
        assert shell.thickness is not None  # the model has checked it
        material = isotropic_of(shell, materials, "shells of one thickness (not of layers)")
        item = ShellProperty(
            shell.thickness, material, offset=shell.offset, added_mass=shell.added_mass,
            bending_ratio=shell.bending_ratio, shear_ratio=shell.shear_ratio,
        )  # fmt: skip
        made |= dict.fromkeys(shell.cells, item)
    return made


def _given_stiffness(shell: ShellSection) -> "AnyShellProperty":
    from fe_models.elements.shells.shell_property import StiffnessProperty

    # the model has checked that all are given
    assert shell.thickness is not None
    assert shell.stiffness is not None
    assert shell.shear_stiffness is not None
    assert shell.direction is not None
    return StiffnessProperty(
        shell.thickness,
        tuple(tuple(row) for row in shell.stiffness),
        tuple(tuple(row) for row in shell.shear_stiffness),
        shell.direction,
        offset=shell.offset,
        added_mass=shell.added_mass,
    )


def _laminate_of(shell: ShellSection, materials: Mapping[str, MaterialSection]) -> "AnyShellProperty":
    from fe_models.elements.shells.shell_property import LaminateProperty, Layer, symmetric

    layers = []
    for layer in shell.layers:
        name = layer.material or next(iter(materials))
        layers.append(Layer(material_of(name, materials[name]), layer.thickness, layer.angle))
    assert shell.direction is not None  # the model has checked it
    stack = symmetric(layers) if shell.symmetric else tuple(layers)
    return LaminateProperty(
        stack, shell.direction, offset=shell.offset, added_mass=shell.added_mass,
        bending_ratio=shell.bending_ratio, shear_ratio=shell.shear_ratio,
    )  # fmt: skip
