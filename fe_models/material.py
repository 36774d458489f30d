"""Isotropic linear elastic materials, and which cell has which."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fe_models.errors import MaterialError
from fe_models.foundation.arrays import IntArray
from fe_models.foundation.words import nearest, quoted
from fe_models.meshes.mesh import Mesh

__all__ = ["Material", "assign_materials"]


@dataclass(frozen=True)
class Material:
    """Isotropic, linear elastic.

    Raises
    ------
    MaterialError
        Unless E > 0, rho > 0 and -1 < nu < 0.5, all finite.
    """

    name: str
    E: float  #: Young's modulus [Pa]
    nu: float  #: Poisson's ratio [-]
    rho: float  #: density [kg/m³]

    def __post_init__(self) -> None:
        where = f"material {self.name!r}"
        for key in ("E", "nu", "rho"):
            value = getattr(self, key)
            if isinstance(value, bool) or not isinstance(value, int | float | np.number):
                raise MaterialError(f"{where}: {key}: expected a number, got {value!r}")
            object.__setattr__(self, key, float(value))
            if not math.isfinite(value):
                raise MaterialError(f"{where}: {key}: expected a finite number, got {value}")
        if self.E <= 0:
            raise MaterialError(f"{where}: E: expected a modulus above zero, got {self.E:g}")
        if self.rho <= 0:
            raise MaterialError(f"{where}: rho: expected a density above zero, got {self.rho:g}")
        if not -1 < self.nu < 0.5:
            raise MaterialError(
                f"{where}: nu: expected -1 < nu < 0.5, got {self.nu:g}; an incompressible material "
                f"(0.5) needs a mixed element, which solids here do not have"
            )

    @property
    def lam(self) -> float:
        """First Lamé constant [Pa]."""
        return self.E * self.nu / ((1 + self.nu) * (1 - 2 * self.nu))

    @property
    def mu(self) -> float:
        """Shear modulus, second Lamé constant [Pa]."""
        return self.E / (2 * (1 + self.nu))


def assign_materials(
    mesh: Mesh, materials: Material | Mapping[str, Material]
) -> tuple[tuple[Material, ...], dict[str, IntArray]]:
    """Return the materials in use and, by cell type, the number of the material of every cell.

    Parameters
    ----------
    mesh
        Its `cell_sets` name the groups.
    materials
        One material for all cells, or group name -> material. Groups may overlap where they agree.

    Returns
    -------
    tuple
        (materials), and cell type -> index into them, (n_cells,).

    Raises
    ------
    MaterialError
        If a group is unknown, or cells have no material or two.
    """
    if isinstance(materials, Material):
        return (materials,), {kind: np.zeros(len(cells), np.int64) for kind, cells in mesh.cells.items()}
    if not materials:
        raise MaterialError("materials: expected one material, or one for each group of cells; got none")
    used = tuple(dict.fromkeys(materials.values()))
    number = {kind: np.full(len(cells), -1, np.int64) for kind, cells in mesh.cells.items()}
    for group, material in materials.items():
        if group not in mesh.cell_sets:
            raise MaterialError(
                f"materials: the mesh has no group of cells {quoted(group)}{nearest(group, mesh.cell_sets)}"
            )
        index = used.index(material)
        for kind, rows in mesh.cell_sets[group].items():
            taken = rows[(number[kind][rows] >= 0) & (number[kind][rows] != index)]
            if taken.size:
                other = used[number[kind][taken[0]]].name
                raise MaterialError(
                    f"materials: {taken.size} {kind} cells of group {group!r} have two materials, "
                    f"{other!r} and {material.name!r}; first cell: {taken[0]}"
                )
            number[kind][rows] = index
    missing = {kind: np.flatnonzero(index < 0) for kind, index in number.items() if (index < 0).any()}
    if missing:
        counts = ", ".join(f"{rows.size} {kind}" for kind, rows in missing.items())
        raise MaterialError(f"materials: cells without a material: {counts}; {groups_of(mesh, missing)}")
    return used, number


def groups_of(mesh: Mesh, missing: Mapping[str, IntArray]) -> str:
    """Say in which groups the cells without a material are."""
    groups = [
        group
        for group, by_type in mesh.cell_sets.items()
        if any(np.isin(missing[kind], by_type[kind]).any() for kind in missing if kind in by_type)
    ]
    return f"they are in the groups {', '.join(groups)}: give these a material" if groups else "they are in no group"
