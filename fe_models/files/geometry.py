"""The geometry beside matrices: nodes with numbers and groups, with their solid cells where all of them are known."""

from pathlib import Path

import numpy as np

from fe_models.foundation.arrays import IntArray
from fe_models.meshes.cells.raw_mesh import LINES, RawMesh, mesh_from_raw, require_nodes
from fe_models.meshes.mesh import FACE_TYPES, SOLID_TYPES, Mesh
from fe_models.meshes.node_cloud import NodeCloud

__all__ = ["geometry_from_raw"]


def geometry_from_raw(raw: RawMesh, path: Path, digest: str) -> Mesh | NodeCloud:
    """Return the mesh of a file of solids; of shells, beams, mixed or unknown elements their nodes and groups.

    Geometry selects surface nodes of solids, and any nodes of the others.

    Parameters
    ----------
    raw
        Content of the file.
    path, digest
        Name of the file and its sha256, for the record and the messages.

    Raises
    ------
    MeshError
        If there are no nodes, or what is known of the mesh is impossible.
    """
    kinds = {block.kind for block in raw.blocks if len(block.nodes)}
    lone = kinds - {"vertex"}
    if lone and lone <= {*SOLID_TYPES, *FACE_TYPES} and lone & {*SOLID_TYPES}:
        return mesh_from_raw(raw, path, digest)
    known = tuple(block for block in raw.blocks if block.kind in (*SOLID_TYPES, *FACE_TYPES, *LINES))
    nodes, blocks = require_nodes(f"mesh {path}", RawMesh(raw.nodes, known, node_numbers=raw.node_numbers))
    node_sets = {name: np.unique(members) for name, members in raw.node_sets.items()}
    of_lines: dict[str, list[IntArray]] = {}
    faces: dict[str, dict[str, list[IntArray]]] = {}
    for block in blocks:
        for group, rows in block.groups.items():
            if block.kind in LINES:
                of_lines.setdefault(group, []).append(block.nodes[rows].ravel())
            elif block.kind in FACE_TYPES:
                faces.setdefault(group, {}).setdefault(block.kind, []).append(block.nodes[rows])
    for group, parts in of_lines.items():
        node_sets.setdefault(group, np.unique(np.concatenate(parts)))
    return NodeCloud(
        nodes,
        node_sets,
        {group: {kind: np.concatenate(parts) for kind, parts in by.items()} for group, by in faces.items()},
        source=str(path),
        digest=digest,
        included=raw.included,
        node_numbers=np.zeros(0, np.int64) if raw.node_numbers is None else raw.node_numbers,
        notes=raw.notes,
    )
