"""Removal of nodes that belong to no solid cell; they would make the stiffness singular."""

from dataclasses import replace

import numpy as np

from fe_models.foundation.arrays import IntArray
from fe_models.meshes.mesh import Mesh

__all__ = ["drop_unused_nodes", "used_nodes"]


def used_nodes(mesh: Mesh) -> np.ndarray:
    """Return which nodes belong to a solid cell, (n_nodes,) bool."""
    used = np.zeros(len(mesh.nodes), dtype=bool)
    for cells in mesh.cells.values():
        used[cells] = True
    return used


def drop_unused_nodes(mesh: Mesh) -> Mesh:
    """Return the mesh without the nodes that belong to no solid cell, with everything renumbered.

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
