"""Thickness and material, layers, or stiffness per area, and offset of groups of cells."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fe_models.body.material import (
    AnisotropicMaterial,
    AnyMaterial,
    Material,
    OrthotropicMaterial,
    cells_of_groups,
    counts_of,
    groups_of,
    require_isotropic,
)
from fe_models.errors import ShellError
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.records import checked_fields
from fe_models.meshes.shell_mesh import ShellMesh

__all__ = [
    "AnyShellProperty",
    "LaminateProperty",
    "Layer",
    "ShellProperty",
    "StiffnessProperty",
    "assign_shell_properties",
    "symmetric",
]

#: largest asymmetry of a stiffness matrix scaled to a unit diagonal, and largest eigenvalue that counts as zero
ROUNDING = 1e-9


@dataclass(frozen=True)
@checked_fields(ArgumentError)
class ShellProperty:
    """Thickness, material and offset of a group of cells.

    Parameters
    ----------
    thickness
        Thickness [m].
    material
        Material of the shell.
    offset
        Distance of the middle surface from the nodes, along the normal of the cell [m].
    added_mass
        Additional mass per area, without stiffness, distributed through the thickness [kg/m²].
    bending_ratio
        Bending stiffness relative to that of a plate of this thickness (ribs, honeycomb).
    shear_ratio
        Transverse shear stiffness relative to that of a plate of this thickness.

    Raises
    ------
    ShellError
        Unless the thickness is positive, the added mass is not negative, and all numbers are finite.
    """

    thickness: float
    material: Material
    offset: float = 0.0
    added_mass: float = 0.0
    bending_ratio: float = 1.0
    shear_ratio: float = 1.0

    def __post_init__(self) -> None:
        require_isotropic("shell property", self.material)
        _require_numbers("shell property", self, ("thickness", "offset", "added_mass"))
        _require_ratios("shell property", self)
        if not self.thickness > 0:
            raise ShellError(f"shell property: thickness: expected a length above zero, got {self.thickness}")
        if self.added_mass < 0:
            raise ShellError(f"shell property: added_mass: expected zero or more, got {self.added_mass}")

    @property
    def materials(self) -> tuple[AnyMaterial, ...]:
        """Material as a tuple with one entry, in the form used for layers."""
        return (self.material,)


@dataclass(frozen=True)
@checked_fields(ArgumentError)
class Layer:
    """One layer of a laminate.

    Parameters
    ----------
    material
        Material of the layer.
    thickness
        Thickness [m].
    angle
        Angle of material axis 1 from the layup direction, right-handed about the normal [degree].

    Raises
    ------
    ShellError
        Unless the thickness is positive and the angle finite, or if the material has its own axes.
    """

    material: AnyMaterial
    thickness: float
    angle: float = 0.0

    def __post_init__(self) -> None:
        _require_numbers("layer", self, ("thickness", "angle"))
        if not self.thickness > 0:
            raise ShellError(f"layer: thickness: expected a length above zero, got {self.thickness}")
        material = self.material
        if isinstance(material, AnisotropicMaterial):
            raise ShellError(
                f"layer: material {material.name!r} is anisotropic; layers are isotropic (Material) or orthotropic "
                "(OrthotropicMaterial)"
            )
        if isinstance(material, OrthotropicMaterial) and not np.array_equal(material.axes, np.eye(3)):
            raise ShellError(
                f"layer: material {material.name!r} has axes of its own; the angle of a layer is measured from the "
                "direction of the layup: use a material without axes"
            )


@dataclass(frozen=True)
@checked_fields(ArgumentError)
class LaminateProperty:
    """Layers and offset of a group of cells.

    Parameters
    ----------
    layers
        Layers from the bottom to the top, along the normal of the cell.
    direction
        Direction in mesh axes; its projection onto a cell is the first layup axis.
    offset
        Distance of the middle surface from the nodes, along the normal of the cell [m].
    added_mass
        Additional mass per area, without stiffness, distributed through the thickness [kg/m²].
    bending_ratio
        Bending stiffness relative to that of the layer; 1 if there are several layers.
    shear_ratio
        Transverse shear stiffness relative to that of the layers.

    Raises
    ------
    ShellError
        Unless there are layers, the direction is not zero, and all numbers are finite.
    """

    layers: tuple[Layer, ...]
    direction: tuple[float, float, float]
    offset: float = 0.0
    added_mass: float = 0.0
    bending_ratio: float = 1.0
    shear_ratio: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "layers", tuple(self.layers))
        if not self.layers or not all(isinstance(layer, Layer) for layer in self.layers):
            raise ShellError(f"laminate: layers: expected one Layer or more, got {self.layers!r}")
        object.__setattr__(self, "direction", _direction("laminate", self.direction))
        _require_numbers("laminate", self, ("offset", "added_mass"))
        _require_ratios("laminate", self)
        if self.bending_ratio != 1 and len(self.layers) > 1:
            raise ShellError(
                f"laminate: bending_ratio: expected 1 with several layers, got {self.bending_ratio}; it does not "
                "determine their coupling of membrane and bending"
            )
        if self.added_mass < 0:
            raise ShellError(f"laminate: added_mass: expected zero or more, got {self.added_mass}")

    @property
    def thickness(self) -> float:
        """Thickness of all layers together [m]."""
        return sum(layer.thickness for layer in self.layers)

    @property
    def materials(self) -> tuple[AnyMaterial, ...]:
        """Distinct materials of the layers."""
        return tuple(dict.fromkeys(layer.material for layer in self.layers))


@dataclass(frozen=True)
@checked_fields(ArgumentError)
class StiffnessProperty:
    """Stiffness and mass per area, and offset of a group of cells, for sections whose layers are not known.

    The thickness is nominal. It is used for the stress, N/t + 12 z M/t³ and 3 Q/(2 t) (1 - 4 z²/t²), and for the skin.
    The mass has no rotary inertia.

    Parameters
    ----------
    thickness
        Nominal thickness [m].
    stiffness
        Rows of [[A, B], [B, D]], which maps eps_x eps_y gamma_xy kappa_x kappa_y kappa_xy to N_x N_y N_xy M_x M_y M_xy.
    shear_stiffness
        Rows of H, which maps gamma_xz gamma_yz to Q_x Q_y [N/m].
    direction
        Direction in mesh axes; its projection onto a cell is x.
    offset
        Distance of the middle surface from the nodes, along the normal of the cell [m].
    added_mass
        Mass per area [kg/m²].

    Raises
    ------
    ShellError
        Unless both matrices are symmetric and positive definite, the direction is not zero, the thickness is positive,
        the mass is not negative, and all numbers are finite.
    """

    thickness: float
    stiffness: tuple[tuple[float, ...], ...]
    shear_stiffness: tuple[tuple[float, ...], ...]
    direction: tuple[float, float, float]
    offset: float = 0.0
    added_mass: float = 0.0

    def __post_init__(self) -> None:
        for name, n in (("stiffness", 6), ("shear_stiffness", 2)):
            matrix = _positive_matrix(f"stiffness of a shell: {name}", getattr(self, name), n)
            object.__setattr__(self, name, tuple(tuple(row) for row in matrix.tolist()))
        object.__setattr__(self, "direction", _direction("stiffness of a shell", self.direction))
        _require_numbers("stiffness of a shell", self, ("thickness", "offset", "added_mass"))
        if not self.thickness > 0:
            raise ShellError(f"stiffness of a shell: thickness: expected a length above zero, got {self.thickness}")
        if self.added_mass < 0:
            raise ShellError(f"stiffness of a shell: added_mass: expected zero or more, got {self.added_mass}")

    @property
    def materials(self) -> tuple[AnyMaterial, ...]:
        """None, because the matrices contain the elasticity."""
        return ()


AnyShellProperty = ShellProperty | LaminateProperty | StiffnessProperty


def symmetric(layers: Sequence[Layer]) -> tuple[Layer, ...]:
    """Return the layers from bottom to middle, then their mirror image: [0, 90] gives [0, 90, 90, 0].

    Parameters
    ----------
    layers
        Half of the layup, from the bottom to the middle surface.
    """
    return (*layers, *reversed(layers))


def _require_numbers(where: str, item: object, names: tuple[str, ...]) -> None:
    for name in names:
        value = getattr(item, name)
        if isinstance(value, bool) or not isinstance(value, int | float | np.number) or not np.isfinite(value):
            raise ShellError(f"{where}: {name}: expected a finite number, got {value!r}")


def _direction(where: str, given: object) -> tuple[float, ...]:
    direction = np.asarray(given)
    if direction.shape != (3,) or direction.dtype.kind not in "iuf" or not np.isfinite(direction).all():
        raise ShellError(f"{where}: direction: expected three finite numbers, got {given!r}")
    if not np.linalg.norm(direction) > 0:
        raise ShellError(f"{where}: direction: expected a vector that is not zero, such as (1, 0, 0)")
    return tuple(float(x) for x in direction)


def _positive_matrix(where: str, given: object, n: int) -> Array:
    """Return a matrix, (n, n), after checking that it is symmetric and positive definite.

    Its units differ from row to row, so the test for rounding scales it to a unit diagonal.
    """
    matrix = np.array(given, dtype=float)
    if matrix.shape != (n, n) or not np.isfinite(matrix).all():
        raise ShellError(f"{where}: expected {n} rows of {n} finite numbers, got {given!r}")
    diagonal = np.diag(matrix)
    if not (diagonal > 0).all():
        raise ShellError(f"{where}: expected a positive definite matrix, got the diagonal {diagonal.tolist()}")
    scaled = matrix / np.sqrt(np.outer(diagonal, diagonal))
    if np.abs(scaled - scaled.T).max() > ROUNDING:
        raise ShellError(f"{where}: expected a symmetric matrix, got {given!r}")
    least = float(np.linalg.eigvalsh((scaled + scaled.T) / 2)[0])
    if not least > ROUNDING:
        raise ShellError(f"{where}: expected a positive definite matrix, got the scaled eigenvalue {least:.3g}")
    return np.asarray((matrix + matrix.T) / 2)


def _require_ratios(where: str, item: object) -> None:
    for name in ("bending_ratio", "shear_ratio"):
        _require_numbers(where, item, (name,))
        if not getattr(item, name) > 0:
            raise ShellError(f"{where}: {name}: expected a number above zero, got {getattr(item, name)}")


def assign_shell_properties(
    mesh: ShellMesh, properties: AnyShellProperty | Mapping[str, AnyShellProperty]
) -> tuple[tuple[AnyShellProperty, ...], dict[str, IntArray]]:
    """Return the properties in use and, for each cell type, the property index of each cell.

    Parameters
    ----------
    mesh
        The mesh; its `cell_sets` name the groups.
    properties
        One property for all cells, or one for each group name. Groups may overlap if they have the same property.

    Raises
    ------
    ShellError
        If a group is unknown, or cells have no property or two properties.
    """
    if isinstance(properties, AnyShellProperty):
        return (properties,), {kind: np.zeros(len(cells), np.int64) for kind, cells in mesh.cells.items()}

    def clash(kind: str, row: int, *_: AnyShellProperty) -> str:
        return f"two thicknesses or materials, first {mesh.cell_name(kind, row)}; make the groups disjoint"

    used, number, missing = cells_of_groups("shells", mesh, properties, clash, ShellError)
    if missing:
        raise ShellError(
            f"shells: cells without a thickness: {counts_of(missing)}; {groups_of(mesh.cell_sets, missing, 'one')}; "
            "cells outside the body are left out by "
            'read_shell_mesh(groups=...) or, in a job, accept = ["left-out"]'
        )
    return used, number
