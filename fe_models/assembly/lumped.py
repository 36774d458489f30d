"""Lumped mass of beams and shells: massless elements, and point masses at their nodes.

(1) a beam has half of its mass at each end, on its centroid line; the ends carry no rotary inertia
(2) a shell has m_i = ∫ N_i rho t dA at its corner i, on the surface of its centre of mass, without rotary inertia

The sum of the masses and the centre of mass are those of the elements. Moments of inertia are not: a straight row of
beams has none about its own line.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fe_models.elements.beams.attachments import PointMass
from fe_models.elements.beams.axes import line_geometry
from fe_models.elements.beams.beam_property import BeamProperty, assign_properties, section_of
from fe_models.elements.beams.body import line_orientations
from fe_models.elements.shells.elements import shell_cells
from fe_models.elements.shells.shell_property import (
    AnyShellProperty,
    LaminateProperty,
    StiffnessProperty,
    assign_shell_properties,
)
from fe_models.foundation.arrays import Array, IntArray
from fe_models.meshes.line_mesh import LineMesh
from fe_models.meshes.shell_mesh import ShellMesh

__all__ = ["lumped_beams", "lumped_shells"]


def lumped_beams(
    mesh: LineMesh, properties: BeamProperty | Mapping[str, BeamProperty]
) -> tuple[BeamProperty | dict[str, BeamProperty], list[PointMass]]:
    """Step (1): return the properties without mass, and the point masses.

    Parameters
    ----------
    mesh
        Lines and their groups.
    properties
        One property for all lines, or the property of each group.
    """
    used, of_line = assign_properties(mesh, properties)
    offsets = np.array([item.offset for item in used]).reshape(-1, 2)[of_line]
    geometry = line_geometry(mesh, line_orientations(mesh, used, of_line), offsets)
    per_length = np.array([item.material.rho * section_of(item).A + item.added_mass for item in used])[of_line]
    half = np.repeat((per_length * geometry.length / 2)[:, None], 2, axis=1)
    without = {item: replace(item, material=replace(item.material, rho=0.0), added_mass=0.0) for item in used}
    masses = _point_masses(mesh.lines, half, geometry.levers)
    if isinstance(properties, Mapping):
        return {group: without[item] for group, item in properties.items()}, masses
    return without[properties], masses


def lumped_shells(
    mesh: ShellMesh, properties: AnyShellProperty | Mapping[str, AnyShellProperty]
) -> tuple[AnyShellProperty | dict[str, AnyShellProperty], list[PointMass]]:
    """Step (2): return the properties without mass, and the point masses.

    Parameters
    ----------
    mesh
        Triangles, quads and their groups.
    properties
        One property for all cells, or the property of each group.
    """
    used, of_cell = assign_shell_properties(mesh, properties)
    masses: list[PointMass] = []
    for kind, cells in mesh.cells.items():
        if len(cells):
            made = shell_cells(mesh.nodes, kind, cells, used, of_cell[kind])
            arms = made.planes.corners + made.mass_arms(slice(None))[:, None] - mesh.nodes[cells]
            masses += _point_masses(cells, made.corner_masses(), arms)
    if isinstance(properties, Mapping):
        return {group: _without_mass(item) for group, item in properties.items()}, masses
    return _without_mass(properties), masses


def _without_mass(item: AnyShellProperty) -> AnyShellProperty:
    if isinstance(item, LaminateProperty):
        layers = tuple(replace(layer, material=replace(layer.material, rho=0.0)) for layer in item.layers)
        return replace(item, layers=layers, added_mass=0.0)
    if isinstance(item, StiffnessProperty):
        return replace(item, added_mass=0.0)
    return replace(item, material=replace(item.material, rho=0.0), added_mass=0.0)


def _point_masses(nodes: IntArray, masses: Array, arms: Array) -> list[PointMass]:
    """Return a point mass for each node and arm, from masses (n, c) and arms from the nodes (n, c, 3)."""
    sums: dict[tuple[int, float, float, float], float] = {}
    for node, mass, arm in zip(nodes.ravel().tolist(), masses.ravel().tolist(), arms.reshape(-1, 3), strict=True):
        x, y, z = arm.tolist()
        sums[node, x, y, z] = sums.get((node, x, y, z), 0.0) + mass
    return [PointMass(node, mass, offset=(x, y, z)) for (node, x, y, z), mass in sums.items() if mass]
