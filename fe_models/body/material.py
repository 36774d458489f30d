"""Linear elastic materials (isotropic, orthotropic, anisotropic) and their assignment to cells."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fe_models.errors import MaterialError
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.records import checked_fields
from fe_models.foundation.words import nearest, quoted
from fe_models.meshes.mesh import Mesh

__all__ = [
    "AnisotropicMaterial",
    "AnyMaterial",
    "Material",
    "OrthotropicMaterial",
    "assign_materials",
    "cells_of_groups",
    "counts_of",
    "groups_of",
    "material_words",
    "require_isotropic",
]

#: largest asymmetry of an elasticity matrix, relative to its largest entry; covers the rounding of printed digits
SYMMETRY = 1e-9


@dataclass(frozen=True)
@checked_fields(ArgumentError)
class Material:
    """Isotropic, linear elastic material.

    Parameters
    ----------
    name
        Name of the material, for messages and the record.
    E
        Young's modulus [Pa].
    nu
        Poisson's ratio [-].
    rho
        Density [kg/m³].

    Raises
    ------
    MaterialError
        Unless E > 0, rho >= 0 and -1 < nu < 0.5, and all three are finite.
    """

    name: str
    E: float
    nu: float
    rho: float

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
        if self.rho < 0:
            raise MaterialError(f"{where}: rho: expected a density of zero or more, got {self.rho:g}")
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

    @property
    def stiffness(self) -> Array:
        """Matrix that maps strain to stress, (6, 6) [Pa], rows xx yy zz yz xz xy, engineering shear strains."""
        C = np.diag([2 * self.mu] * 3 + [self.mu] * 3)
        C[:3, :3] += self.lam
        return C


@dataclass(frozen=True)
@checked_fields(ArgumentError)
class OrthotropicMaterial:
    """Orthotropic, linear elastic material: three planes of symmetry normal to its axes 1, 2, 3.

    Pairs have the order 12, 13, 23. nu_12 is the contraction along 2 under stress along 1, so that nu_12 / E_1 = nu_21
    / E_2.

    Parameters
    ----------
    name
        Name of the material, for messages and the record.
    young
        Young's moduli E_1, E_2, E_3 [Pa].
    shear
        Shear moduli G_12, G_13, G_23 [Pa].
    poisson
        Poisson's ratios nu_12, nu_13, nu_23 [-].
    rho
        Density [kg/m³].
    axes
        Material axes 1, 2, 3 as rows, in mesh axes.

    Raises
    ------
    MaterialError
        Unless all numbers are finite, the moduli are positive, the density is not negative, the axes are orthonormal
        and right-handed, and the stiffness is positive definite.
    """

    name: str
    young: tuple[float, float, float]
    shear: tuple[float, float, float]
    poisson: tuple[float, float, float]
    rho: float
    axes: tuple[tuple[float, float, float], ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

    def __post_init__(self) -> None:
        where = f"material {self.name!r}"
        for key in ("young", "shear", "poisson"):
            object.__setattr__(self, key, _three(f"{where}: {key}", getattr(self, key)))
        _set_axes_and_density(where, self)
        for key in ("young", "shear"):
            if min(getattr(self, key)) <= 0:
                raise MaterialError(f"{where}: {key}: expected moduli above zero, got {_listed(getattr(self, key))}")
        least = np.linalg.eigvalsh(_normalised(self.compliance[:3, :3])).min()
        if not least > 0:
            nu_12, nu_13, nu_23 = self.poisson
            raise MaterialError(
                f"{where}: poisson: with E = {_listed(self.young)} and nu_12, nu_13, nu_23 = {nu_12:g}, {nu_13:g}, "
                f"{nu_23:g} some strains would have negative energy; expected |nu_ij| < sqrt(E_i / E_j) and more. Is "
                "nu_12 the contraction along 2 under stress along 1?"
            )

    @property
    def E(self) -> float:
        """Largest Young's modulus [Pa]."""
        return max(self.young)

    @property
    def compliance(self) -> Array:
        """Matrix that maps stress to strain in material axes, (6, 6) [1/Pa], rows 11 22 33 23 13 12, shear doubled."""
        (E_1, E_2, E_3), (nu_12, nu_13, nu_23) = self.young, self.poisson
        S = np.diag([1 / E_1, 1 / E_2, 1 / E_3, 1 / self.shear[2], 1 / self.shear[1], 1 / self.shear[0]])
        S[0, 1] = S[1, 0] = -nu_12 / E_1
        S[0, 2] = S[2, 0] = -nu_13 / E_1
        S[1, 2] = S[2, 1] = -nu_23 / E_2
        return np.asarray(S)

    @property
    def stiffness(self) -> Array:
        """Matrix that maps strain to stress in mesh axes, (6, 6) [Pa], rows xx yy zz yz xz xy, engineering shear."""
        C = np.linalg.inv(self.compliance)
        T = _stress_turn(np.array(self.axes).T)
        C = T @ ((C + C.T) / 2) @ T.T
        return np.asarray((C + C.T) / 2)


@dataclass(frozen=True)
@checked_fields(ArgumentError)
class AnisotropicMaterial:
    """Linear elastic material without any symmetry: 21 constants.

    Parameters
    ----------
    name
        Name of the material, for messages and the record.
    elasticity
        Maps strain to stress in the material axes, rows 11 22 33 23 13 12, engineering shear strains [Pa].
    rho
        Density [kg/m³].
    axes
        Material axes 1, 2, 3 as rows, in mesh axes.

    Raises
    ------
    MaterialError
        Unless all numbers are finite, the density is not negative, the axes are orthonormal and right-handed, and the
        elasticity is symmetric and positive definite.
    """

    name: str
    elasticity: tuple[tuple[float, ...], ...]
    rho: float
    axes: tuple[tuple[float, float, float], ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

    def __post_init__(self) -> None:
        where = f"material {self.name!r}"
        C = np.asarray(self.elasticity)
        if C.shape != (6, 6) or C.dtype.kind not in "iuf" or not np.isfinite(C).all():
            raise MaterialError(f"{where}: elasticity: expected six rows of six finite numbers, got {C.shape}")
        object.__setattr__(self, "elasticity", tuple(tuple(float(x) for x in row) for row in C))
        _set_axes_and_density(where, self)
        if np.abs(C - C.T).max() > SYMMETRY * np.abs(C).max():
            i, j = np.unravel_index(int(np.abs(C - C.T).argmax()), C.shape)
            raise MaterialError(
                f"{where}: elasticity: expected a symmetric matrix, got {C[i, j]:g} in row {i + 1}, column {j + 1} and "
                f"{C[j, i]:g} across"
            )
        if np.diag(C).min() <= 0 or not np.linalg.eigvalsh(_normalised(C)).min() > 0:
            raise MaterialError(
                f"{where}: elasticity: some strains would have no energy or less (it is not positive "
                "definite). Is the order of rows and columns 11 22 33 23 13 12?"
            )

    @property
    def E(self) -> float:
        """Largest Young's modulus along the material axes [Pa]."""
        return float(1 / np.diag(np.linalg.inv(np.array(self.elasticity)))[:3].min())

    @property
    def stiffness(self) -> Array:
        """Matrix that maps strain to stress in mesh axes, (6, 6) [Pa], rows xx yy zz yz xz xy, engineering shear."""
        T = _stress_turn(np.array(self.axes).T)
        C = T @ np.array(self.elasticity) @ T.T
        return np.asarray((C + C.T) / 2)


def _set_axes_and_density(where: str, material: "OrthotropicMaterial | AnisotropicMaterial") -> None:
    """Convert axes and density to numbers; raise `MaterialError` if they are invalid."""
    object.__setattr__(material, "axes", tuple(_three(f"{where}: axes", row) for row in material.axes))
    rho = material.rho
    if isinstance(rho, bool) or not isinstance(rho, int | float | np.number) or not rho >= 0:
        raise MaterialError(f"{where}: rho: expected a density of zero or more, got {rho!r}")
    object.__setattr__(material, "rho", float(rho))
    axes = np.array(material.axes)
    is_triad = axes.shape == (3, 3) and np.abs(axes @ axes.T - np.eye(3)).max() < 1e-6 and np.linalg.det(axes) > 0
    if not is_triad:
        given = np.array2string(axes, precision=4)
        raise MaterialError(f"{where}: axes: expected three rows, orthonormal and right-handed, got {given}")


AnyMaterial = Material | OrthotropicMaterial | AnisotropicMaterial


def material_words(material: AnyMaterial) -> str:
    """Return the constants of a material as one line for the provenance."""
    if isinstance(material, Material):
        return f"E = {material.E!r}, nu = {material.nu!r}, rho = {material.rho!r}"
    axes = f"axes {[list(row) for row in material.axes]}"
    if isinstance(material, AnisotropicMaterial):
        C = [list(row) for row in material.elasticity]
        return f"anisotropic, stress by strain 11 22 33 23 13 12 = {C}, rho = {material.rho!r}, {axes}"
    return (
        f"orthotropic, E = {list(material.young)}, G_12, G_13, G_23 = {list(material.shear)}, nu_12, nu_13, nu_23 = "
        f"{list(material.poisson)}, rho = {material.rho!r}, {axes}"
    )


def require_isotropic(where: str, material: object) -> None:
    """Raise `MaterialError` unless the material is isotropic, for elements that need isotropic materials."""
    if isinstance(material, OrthotropicMaterial | AnisotropicMaterial):
        kind = "orthotropic" if isinstance(material, OrthotropicMaterial) else "anisotropic"
        raise MaterialError(f"{where}: material {material.name!r} is {kind}; expected an isotropic one (Material)")


def _three(where: str, values: Sequence[float]) -> tuple[float, float, float]:
    array = np.asarray(values)
    if array.shape != (3,) or array.dtype.kind not in "iuf" or not np.isfinite(array).all():
        raise MaterialError(f"{where}: expected three finite numbers, got {values!r}")
    x, y, z = (float(value) for value in array)
    return x, y, z


def _listed(values: tuple[float, ...]) -> str:
    return ", ".join(f"{value:g}" for value in values)


def _normalised(S: Array) -> Array:
    """Return a symmetric matrix scaled to a unit diagonal."""
    d = np.sqrt(np.diag(S))
    return np.asarray(S / np.outer(d, d))


def _stress_turn(R: Array) -> Array:
    """Return T, (6, 6), which transforms stress from the axes R (columns) to mesh axes, rows xx yy zz yz xz xy.

    sigma_ij = R_ik R_jl s_kl. Equal strain energy then gives the stiffness in mesh axes as T C Tᵀ.
    """
    pairs = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))
    T = np.empty((6, 6))
    for row, (i, j) in enumerate(pairs):
        for column, (k, m) in enumerate(pairs):
            T[row, column] = R[i, k] * R[j, m] + (R[i, m] * R[j, k] if k != m else 0.0)
    return T


def assign_materials(
    mesh: Mesh, materials: AnyMaterial | Mapping[str, AnyMaterial]
) -> tuple[tuple[AnyMaterial, ...], dict[str, IntArray]]:
    """Return the materials in use and, for each cell type, the material index of each cell.

    Parameters
    ----------
    mesh
        The mesh; its `cell_sets` name the groups.
    materials
        One material for all cells, or one material for each group name. Groups may overlap if they have the same
        material.

    Returns
    -------
    tuple
        The materials, and for each cell type the indices into them, (n_cells,).

    Raises
    ------
    MaterialError
        If a group is unknown, or cells have no material or two materials.
    """
    if isinstance(materials, AnyMaterial):
        return (materials,), {kind: np.zeros(len(cells), np.int64) for kind, cells in mesh.cells.items()}
    if not materials:
        raise MaterialError("materials: expected one material, or one for each group of cells; got none")

    def clash(kind: str, row: int, other: AnyMaterial, material: AnyMaterial) -> str:
        return f"two materials, {other.name!r} and {material.name!r}; first cell: {row}"

    used, number, missing = cells_of_groups("materials", mesh, materials, clash, MaterialError)
    if missing:
        raise MaterialError(
            f"materials: cells without a material: {counts_of(missing)}; "
            f"{groups_of(mesh.cell_sets, missing, 'a material')}"
        )
    return used, number


def cells_of_groups(
    where: str,
    mesh: Any,
    given: Mapping[str, Any],
    clash: Callable[[str, int, Any, Any], str],
    error: type[Exception],
) -> tuple[tuple[Any, ...], dict[str, IntArray], dict[str, IntArray]]:
    """Return the items that groups of cells have, for each cell type the indices into them, and the cells without one.

    Parameters
    ----------
    clash
        Function of cell type, row of a cell and its two items: what the cell has, for the message.
    error
        Raised if a group is unknown, or cells have two items.
    """
    used = tuple(dict.fromkeys(given.values()))
    number = {kind: np.full(len(cells), -1, np.int64) for kind, cells in mesh.cells.items()}
    for group, item in given.items():
        if group not in mesh.cell_sets:
            raise error(f"{where}: the mesh has no group of cells {quoted(group)}{nearest(group, mesh.cell_sets)}")
        index = used.index(item)
        for kind, rows in mesh.cell_sets[group].items():
            taken = rows[(number[kind][rows] >= 0) & (number[kind][rows] != index)]
            if taken.size:
                words = clash(kind, taken[0], used[number[kind][taken[0]]], item)
                raise error(f"{where}: {taken.size} {kind} cells of group {group!r} have {words}")
            number[kind][rows] = index
    return used, number, {kind: np.flatnonzero(index < 0) for kind, index in number.items() if (index < 0).any()}


def counts_of(missing: Mapping[str, IntArray]) -> str:
    """Return '3 quad, 2 triangle', the numbers of cells by type."""
    return ", ".join(f"{rows.size} {kind}" for kind, rows in missing.items())


def groups_of(sets: Mapping[str, Mapping[str, IntArray]], missing: Mapping[str, IntArray], what: str) -> str:
    """Name the groups of cells that lack something, such as a material."""
    groups = [
        group
        for group, by_type in sets.items()
        if any(np.isin(missing[kind], by_type[kind]).any() for kind in missing if kind in by_type)
    ]
    return f"they are in the groups {', '.join(groups)}: give these {what}" if groups else "they are in no group"
