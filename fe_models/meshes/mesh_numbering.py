"""User's names of nodes, elements and sets of a mesh, as the `Numbering` of the body."""

from collections.abc import Mapping

import numpy as np

from fe_models.foundation.arrays import IntArray
from fe_models.meshes.boundary import facets_of
from fe_models.meshes.line_mesh import LineMesh
from fe_models.meshes.mesh import Mesh
from fe_models.meshes.numbering import NO_NUMBERS, NONE, NamedSet, Numbering
from fe_models.meshes.shell_mesh import ShellMesh

__all__ = ["line_numbering", "node_sets", "shell_numbering", "solid_numbering"]

CellSets = Mapping[str, Mapping[str, IntArray]]


def solid_numbering(mesh: Mesh) -> Numbering:
    """Return the numbering of the body of a solid mesh: nodes, cells of the boundary triangles, and sets.

    Groups of faces become sets of their nodes.
    """
    cell_of = facets_of(mesh).cells
    of_faces = {
        group: np.unique(np.concatenate([mesh.faces[kind][rows].ravel() for kind, rows in by_type.items()]))
        for group, by_type in mesh.face_sets.items()
        if any(rows.size for rows in by_type.values())
    }
    return Numbering(
        nodes=mesh.node_numbers,
        elements=cell_numbers(mesh)[cell_of] if mesh.cell_numbers else NO_NUMBERS,
        sets=(
            *node_sets({**of_faces, **mesh.node_sets}),
            *cell_sets(mesh.cell_sets, {kind: len(cells) for kind, cells in mesh.cells.items()}, cell_of),
        ),
    )


def shell_numbering(mesh: ShellMesh, mover: IntArray, cell_of: IntArray) -> Numbering:
    """Return the numbering of the body of a shell.

    Parameters
    ----------
    mesh
        The shell, without its stiffeners.
    mover
        Node that moves each point of the skin, (n_skin,).
    cell_of
        Cell of each triangle of the skin, numbered through all types, (n_tri,).
    """
    return Numbering(
        nodes=np.concatenate([mesh.node_numbers, mesh.node_numbers[mover]]) if mesh.node_numbers.size else NO_NUMBERS,
        on_skin=skin_flags(len(mesh.nodes), len(mover)) if mesh.node_numbers.size else NO_NUMBERS,
        elements=cell_numbers(mesh)[cell_of] if mesh.cell_numbers else NO_NUMBERS,
        sets=(
            *node_sets(mesh.node_sets, mover, len(mesh.nodes)),
            *cell_sets(mesh.cell_sets, {kind: len(cells) for kind, cells in mesh.cells.items()}, cell_of),
        ),
    )


def line_numbering(mesh: LineMesh, mover: IntArray, line_of: IntArray) -> Numbering:
    """Return the numbering of the body of a frame.

    Parameters
    ----------
    mesh
        The lines.
    mover
        Node that moves each point of the skin, (n_skin,).
    line_of
        Line of each triangle of the skin, (n_tri,).
    """
    sets = {group: {"line": rows} for group, rows in mesh.line_sets.items()}
    return Numbering(
        nodes=np.concatenate([mesh.node_numbers, mesh.node_numbers[mover]]) if mesh.node_numbers.size else NO_NUMBERS,
        on_skin=skin_flags(len(mesh.nodes), len(mover)) if mesh.node_numbers.size else NO_NUMBERS,
        elements=mesh.line_numbers[line_of] if mesh.line_numbers.size else NO_NUMBERS,
        sets=(
            *node_sets(mesh.node_sets, mover, len(mesh.nodes)),
            *cell_sets(sets, {"line": len(mesh.lines)}, line_of),
        ),
    )


def skin_flags(n_nodes: int, n_skin: int) -> IntArray:
    """Return 0 for each node, followed by 1 for each skin point, (n_nodes + n_skin,)."""
    return np.repeat(np.arange(2), [n_nodes, n_skin])


def node_sets(sets: Mapping[str, IntArray], mover: IntArray | None = None, n_nodes: int = 0) -> list[NamedSet]:
    """Return node sets with the skin points that follow their nodes."""
    made = []
    for name, nodes in sets.items():
        members = np.unique(nodes)
        if mover is not None:
            members = np.concatenate([members, n_nodes + np.flatnonzero(np.isin(mover, nodes))])
        made.append(NamedSet(name, "nodes", members, len(np.unique(nodes))))
    return made


def cell_sets(sets: CellSets, counts: Mapping[str, int], cell_of: IntArray) -> list[NamedSet]:
    """Return sets of cells as sets of their triangles; cells are numbered over all types."""
    first = dict(zip(counts, np.cumsum([0, *counts.values()]), strict=False))
    made = []
    for name, by_type in sets.items():
        inside = np.zeros(sum(counts.values()), dtype=bool)
        for kind, rows in by_type.items():
            inside[first[kind] + rows] = True
        made.append(NamedSet(name, "elements", np.flatnonzero(inside[cell_of]), int(inside.sum())))
    return made


def cell_numbers(mesh: Mesh | ShellMesh) -> IntArray:
    """Return the numbers of all cells, type by type, (n_cells,); `NONE` for types without numbers."""
    return np.concatenate(
        [mesh.cell_numbers.get(kind, np.full(len(cells), NONE)) for kind, cells in mesh.cells.items()]
    )
