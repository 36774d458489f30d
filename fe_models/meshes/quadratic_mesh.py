"""Conversion of a mesh to second-order cells, and the interpolation from old nodes to new nodes."""

import numpy as np
import scipy.sparse as sp

from fe_models.foundation.arrays import IntArray
from fe_models.meshes.cell_shapes import CELL_SHAPES, facet_tables
from fe_models.meshes.mesh import Mesh

__all__ = ["FIRST_ORDER", "quadratic_mesh", "tetrahedra_of"]

FIRST_ORDER = ("tetra", "hexahedron", "wedge", "pyramid")  #: solid cell types with corner nodes only
#: second-order cell type for each first-order type; its field contains the field of the first-order cell
RAISED = {"tetra": "tetra10", "hexahedron": "hexahedron27"}


def quadratic_mesh(mesh: Mesh) -> tuple[Mesh, sp.csr_array]:
    """Return a mesh of tetrahedra or bricks with middle nodes on straight edges.

    Returns
    -------
    tuple
        The mesh, whose first nodes are the old ones; and the matrix that interpolates values at the old nodes to all
        nodes, (n_new_nodes, n_nodes).
    """
    n, cells, parents = len(mesh.nodes), {}, []
    for kind, rows in mesh.cells.items():
        middles = CELL_SHAPES[RAISED[kind]].middles
        keys = np.full((len(rows), len(middles), 8), -1)
        for k, corners in enumerate(middles):
            keys[:, k, : len(corners)] = np.sort(rows[:, list(corners)], axis=1)
        parents.append(keys.reshape(-1, 8))
        cells[RAISED[kind]] = (rows, len(middles))
    found, number = np.unique(np.concatenate(parents), axis=0, return_inverse=True)
    number, start = number.ravel(), 0
    raised: dict[str, IntArray] = {}
    for kind, (rows, n_middles) in cells.items():
        stop = start + len(rows) * n_middles
        raised[kind] = np.hstack([rows, n + number[start:stop].reshape(len(rows), n_middles)])
        start = stop
    is_parent = found >= 0
    weights = is_parent / is_parent.sum(axis=1, keepdims=True)
    at = np.nonzero(is_parent)
    between = sp.csr_array((weights[at], (at[0], found[at])), shape=(len(found), n))
    P = sp.vstack([sp.eye_array(n), between], format="csr")
    return Mesh(P @ mesh.nodes, raised), P


def tetrahedra_of(mesh: Mesh) -> tuple[Mesh, sp.csr_array, IntArray]:
    """Return the mesh with every brick, wedge and pyramid divided into tetrahedra that meet at its centre.

    Four-node faces are divided from their node with the lowest number, so that neighbours agree.

    Returns
    -------
    tuple
        The mesh; the matrix that interpolates values at the old nodes to all nodes, (n_new_nodes, n_nodes); and the old
        cell of each tetrahedron, numbered through all types, (n_tetra,).
    """
    n = len(mesh.nodes)
    parts, owner, centres = [], [], [sp.eye_array(n, format="csr")]
    first_node, first_cell = n, 0
    for kind, rows in mesh.cells.items():
        numbers = first_cell + np.arange(len(rows))
        first_cell += len(rows)
        if kind == "tetra":
            parts.append(rows)
            owner.append(numbers)
            continue
        centre = first_node + np.arange(len(rows))
        first_node += len(rows)
        c = rows.shape[1]
        at = np.repeat(np.arange(len(rows)), c), rows.ravel()
        centres.append(sp.csr_array((np.full(rows.size, 1 / c), at), shape=(len(rows), n)))
        for local in (facet for table in facet_tables(kind).values() for facet in table):
            face = rows[:, local]
            if face.shape[1] == 4:
                turn = (face.argmin(axis=1)[:, None] + np.arange(4)) % 4
                face = np.take_along_axis(face, turn, axis=1)
            for triangle in ([0, 2, 1], [0, 3, 2])[: face.shape[1] - 2]:  # orientation as seen from inside
                parts.append(np.column_stack([face[:, triangle], centre]))
                owner.append(numbers)
    P = sp.vstack(centres, format="csr")
    return Mesh(P @ mesh.nodes, {"tetra": np.concatenate(parts)}), P, np.concatenate(owner)
