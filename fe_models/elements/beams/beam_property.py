"""Section, material and beam theory of groups of lines."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from fe_models.body.material import Material, require_isotropic
from fe_models.elements.beams.section_properties import SectionProperties
from fe_models.elements.beams.sections import Section
from fe_models.errors import SectionError
from fe_models.foundation.arrays import IntArray
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.records import checked_fields
from fe_models.foundation.words import nearest, quoted
from fe_models.meshes.line_mesh import LineMesh

__all__ = ["BeamProperty", "assign_properties", "section_of"]


@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class BeamProperty:
    """Section, material and beam theory of a group of lines.

    Parameters
    ----------
    section
        Cross section of the beams.
    material
        Material of the beams.
    offset
        Offset of the centroid from the line, local (y, z) [m].
    orientation
        Vector towards local y; None: taken from the mesh; if the mesh has none, z points up.
    shear
        Whether sections shear (Timoshenko); False: they stay normal to the axis (Euler-Bernoulli).
    rotary_inertia
        Whether there is rotary inertia in bending; torsion has its inertia in any case.
    added_mass
        Additional mass per length, without stiffness [kg/m].
    """

    section: Section
    material: Material
    offset: tuple[float, float] = (0.0, 0.0)
    orientation: tuple[float, float, float] | None = None
    shear: bool = True
    rotary_inertia: bool = True
    added_mass: float = 0.0

    def __post_init__(self) -> None:
        require_isotropic("beam property", self.material)
        for name, size in (("offset", 2), ("orientation", 3)):
            value = getattr(self, name)
            if value is not None and (np.shape(value) != (size,) or not np.isfinite(value).all()):
                raise SectionError(f"beam property: {name}: expected {size} finite numbers, got {value}")
        if not 0 <= self.added_mass < np.inf:
            raise SectionError(f"beam property: added_mass: expected zero or more, got {self.added_mass}")


def section_of(item: BeamProperty) -> SectionProperties:
    """Return the section properties for the material; shear deformation is removed if the property says so."""
    section = item.section.properties(item.material.nu)
    return section if item.shear else replace(section, A_sy=np.inf, A_sz=np.inf)


def assign_properties(
    mesh: LineMesh, properties: BeamProperty | Mapping[str, BeamProperty]
) -> tuple[tuple[BeamProperty, ...], IntArray]:
    """Return the properties in use, and the property index of each line, (n_lines,)."""
    if isinstance(properties, BeamProperty):
        return (properties,), np.zeros(len(mesh.lines), np.int64)
    number = np.full(len(mesh.lines), -1, np.int64)
    used = tuple(dict.fromkeys(properties.values()))
    for group, item in properties.items():
        if group not in mesh.line_sets:
            raise SectionError(
                f"sections: the mesh has no group of lines {quoted(group)}{nearest(group, mesh.line_sets)}"
            )
        rows, index = mesh.line_sets[group], used.index(item)
        taken = rows[(number[rows] >= 0) & (number[rows] != index)]
        if taken.size:
            raise SectionError(f"sections: {taken.size} lines of group {group!r} have two, first line {taken[0]}")
        number[rows] = index
    missing = np.flatnonzero(number < 0)
    if missing.size:
        groups = [group for group, rows in mesh.line_sets.items() if np.isin(missing, rows).any()]
        where = f"they are in the groups {', '.join(groups)}" if groups else "they are in no group"
        raise SectionError(f"sections: {missing.size} lines have none, first line {missing[0]}; {where}")
    return used, number
