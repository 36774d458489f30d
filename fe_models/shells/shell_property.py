"""Thickness, material and offset of groups of cells."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fe_models.errors import ShellError
from fe_models.foundation.arrays import IntArray
from fe_models.foundation.words import nearest, quoted
from fe_models.material import Material, require_isotropic
from fe_models.meshes.shell_mesh import ShellMesh

__all__ = ["ShellProperty", "assign_shell_properties"]


@dataclass(frozen=True)
class ShellProperty:
    """Thickness, material and offset of a group of cells.

    Raises
    ------
    ShellError
        Unless the thickness is above zero, the added mass not below, and all numbers finite.
    """

    thickness: float  #: [m]
    material: Material
    offset: float = 0.0  #: of the middle surface from the nodes, along the normal of the cell [m]
    added_mass: float = 0.0  #: per area, without stiffness, spread through the thickness [kg/m²]

    def __post_init__(self) -> None:
        require_isotropic("shell property", self.material)
        for name in ("thickness", "offset", "added_mass"):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int | float | np.number) or not np.isfinite(value):
                raise ShellError(f"shell property: {name}: expected a finite number, got {value!r}")
        if not self.thickness > 0:
            raise ShellError(f"shell property: thickness: expected a length above zero, got {self.thickness}")
        if self.added_mass < 0:
            raise ShellError(f"shell property: added_mass: expected zero or more, got {self.added_mass}")


def assign_shell_properties(
    mesh: ShellMesh, properties: ShellProperty | Mapping[str, ShellProperty]
) -> tuple[tuple[ShellProperty, ...], dict[str, IntArray]]:
    """Return the properties in use and, by cell type, the number of the property of every cell.

    Parameters
    ----------
    mesh
        Its `cell_sets` name the groups.
    properties
        One for all cells, or group -> property. Groups may overlap where they agree.

    Raises
    ------
    ShellError
        If a group is unknown, or cells have no property or two.
    """
    if isinstance(properties, ShellProperty):
        return (properties,), {kind: np.zeros(len(cells), np.int64) for kind, cells in mesh.cells.items()}
    used = tuple(dict.fromkeys(properties.values()))
    number = {kind: np.full(len(cells), -1, np.int64) for kind, cells in mesh.cells.items()}
    for group, item in properties.items():
        if group not in mesh.cell_sets:
            raise ShellError(f"shells: the mesh has no group of cells {quoted(group)}{nearest(group, mesh.cell_sets)}")
        index = used.index(item)
        for kind, rows in mesh.cell_sets[group].items():
            taken = rows[(number[kind][rows] >= 0) & (number[kind][rows] != index)]
            if taken.size:
                raise ShellError(
                    f"shells: {taken.size} {kind} cells of group {group!r} have two thicknesses or materials, first "
                    f"{mesh.cell_name(kind, taken[0])}; make the groups disjoint"
                )
            number[kind][rows] = index
    missing = {kind: np.flatnonzero(index < 0) for kind, index in number.items() if (index < 0).any()}
    if missing:
        counts = ", ".join(f"{rows.size} {kind}" for kind, rows in missing.items())
        groups = [
            group
            for group, by_type in mesh.cell_sets.items()
            if any(np.isin(missing[kind], by_type[kind]).any() for kind in missing if kind in by_type)
        ]
        where = f"they are in the groups {', '.join(groups)}: give these one" if groups else "they are in no group"
        raise ShellError(
            f"shells: cells without a thickness: {counts}; {where}; cells not meant to be of the body are left "
            'out by read_shell_mesh(groups=...), in a job by accept = ["left-out"]'
        )
    return used, number
