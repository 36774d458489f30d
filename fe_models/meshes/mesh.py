"""The mesh of one body: nodes, solid cells, and groups for materials and interfaces."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array, IntArray, frozen
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import FrozenMapping, checked_fields, frozen_copies

__all__ = [
    "FACE_TYPES", "SOLID_TYPES", "Mesh", "drop_unused_nodes", "freeze_mesh", "require_members", "require_nodes",
    "used_nodes",
]  # fmt: skip

#: meshio names and node order
SOLID_TYPES = (
    "tetra",
    "tetra10",
    "hexahedron",
    "hexahedron20",
    "hexahedron27",
    "wedge",
    "wedge15",
    "pyramid",
    "pyramid13",
)
FACE_TYPES = ("triangle", "triangle6", "quad", "quad8", "quad9")


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class Mesh:
    """Nodes and cells of one body, in the node order of meshio (VTK).

    Parameters
    ----------
    nodes
        Positions of the nodes, (n_nodes, 3), in the length unit of the model.
    cells
        Solid cells by type in `SOLID_TYPES`, (n_cells, nodes per cell).
    cell_sets
        Rows of `cells` of each group, by cell type.
    faces
        Two-dimensional cells by type; they only serve to select nodes.
    face_sets
        Rows of `faces` of each group, by face type.
    node_sets
        Nodes of each group.
    source
        File it was read from, or how it was made.
    digest
        sha256 of that file.
    included
        sha256 of each file that the source includes.
    node_numbers
        Numbers of the nodes in the file, (n_nodes,); empty: none.
    cell_numbers
        Numbers of the cells in the file, (n_cells,), by cell type.
    notes
        Descriptions of what the reader left out or changed.
    origin
        Origin of the mesh by label, such as the size of a geometry.
    """

    nodes: Array
    cells: Mapping[str, IntArray]
    cell_sets: Mapping[str, Mapping[str, IntArray]] = field(default_factory=dict)
    faces: Mapping[str, IntArray] = field(default_factory=dict)
    face_sets: Mapping[str, Mapping[str, IntArray]] = field(default_factory=dict)
    node_sets: Mapping[str, IntArray] = field(default_factory=dict)
    source: str = ""
    digest: str = ""
    included: Mapping[str, str] = field(default_factory=dict, kw_only=True)
    node_numbers: IntArray = field(default_factory=lambda: np.zeros(0, np.int64))
    cell_numbers: Mapping[str, IntArray] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    origin: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        freeze_mesh(self)

    @property
    def n_cells(self) -> int:
        """Number of solid cells."""
        return sum(len(cells) for cells in self.cells.values())


# fields of meshes of all kinds ----------------------------------------------------------------------------------------


def freeze_mesh(mesh: Any) -> None:
    """Make the fields of a new mesh read-only: coordinates, vectors, indices, groups and notes."""
    for each in fields(mesh):
        value = getattr(mesh, each.name)
        if each.name == "notes":
            value = tuple(value)
        elif each.name in ("nodes", "orientations", "offsets"):
            value = None if value is None else frozen(value)
        else:
            value = frozen_indices(value)
        object.__setattr__(mesh, each.name, value)


def frozen_indices(value: Any) -> Any:
    """Return read-only indices, in mappings of any depth; words stay as they are."""
    if isinstance(value, Mapping):
        return FrozenMapping({key: frozen_indices(part) for key, part in value.items()})
    return value if isinstance(value, str) else frozen(value, np.int64)


def require_nodes(where: str, nodes: Array, error: type[Exception]) -> None:
    """Raise an error unless the nodes of a mesh are finite coordinates, (n_nodes, 3)."""
    if nodes.ndim != 2 or nodes.shape[1] != 3 or not len(nodes):
        raise error(f"{where}: nodes: expected (n_nodes, 3), got {nodes.shape}")
    if not np.isfinite(nodes).all():
        raise error(f"{where}: nodes: expected finite coordinates, got NaN or infinity")


def require_members(where: str, members: Iterable[tuple[str, IntArray, int]], error: type[Exception]) -> None:
    """Raise an error unless indices lie in their ranges; members: name, indices, and size of the range."""
    for what, rows, size in members:
        if rows.size and (rows.min() < 0 or rows.max() >= size):
            raise error(f"{where}: {what}: expected 0..{size - 1}, got {rows.min()}..{rows.max()}")


# nodes that belong to no solid cell, which would make the stiffness singular ------------------------------------------


def used_nodes(mesh: Mesh) -> np.ndarray:
    """Return whether each node belongs to a solid cell, (n_nodes,) bool."""
    used = np.zeros(len(mesh.nodes), dtype=bool)
    for cells in mesh.cells.values():
        used[cells] = True
    return used


def drop_unused_nodes(mesh: Mesh) -> Mesh:
    """Return the mesh without nodes that belong to no solid cell; everything is renumbered.

    Faces with such a node are dropped too; groups that become empty are kept. `Mesh.notes` reports the numbers. A mesh
    without unused nodes is returned unchanged.

    Parameters
    ----------
    mesh
        A solid mesh.
    """
    used = used_nodes(mesh)
    n_unused = int((~used).sum())
    if n_unused == 0:
        return mesh
    place = np.full(len(used), -1)
    place[used] = np.arange(used.sum())
    faces: dict[str, IntArray] = {}
    face_place: dict[str, IntArray] = {}
    for kind, rows in mesh.faces.items():
        whole = used[rows].all(axis=1)
        face_place[kind] = np.where(whole, np.cumsum(whole) - 1, -1)
        if whole.any():
            faces[kind] = place[rows[whole]]
    face_sets: dict[str, dict[str, IntArray]] = {}
    for group, by_type in mesh.face_sets.items():
        kept = {kind: face_place[kind][rows] for kind, rows in by_type.items()}
        face_sets[group] = {kind: rows[rows >= 0] for kind, rows in kept.items() if (rows >= 0).any()}
    node_sets = {group: place[nodes] for group, nodes in mesh.node_sets.items()}
    node_sets = {group: nodes[nodes >= 0] for group, nodes in node_sets.items()}
    n_faces = sum(len(rows) for rows in mesh.faces.values()) - sum(len(rows) for rows in faces.values())
    empty = [group for group, by_type in face_sets.items() if not by_type and mesh.face_sets[group]]
    empty += [group for group, nodes in node_sets.items() if not nodes.size and mesh.node_sets[group].size]
    note = f"{n_unused} nodes that belong to no solid cell were dropped"
    note += f", with {n_faces} faces on them" if n_faces else ""
    note += f"; groups that became empty: {', '.join(empty)}" if empty else ""
    return replace(
        mesh,
        nodes=mesh.nodes[used],
        cells={kind: place[cells] for kind, cells in mesh.cells.items()},
        faces=faces,
        face_sets=face_sets,
        node_sets=node_sets,
        node_numbers=mesh.node_numbers[used] if mesh.node_numbers.size else mesh.node_numbers,
        notes=(*mesh.notes, note),
    )
