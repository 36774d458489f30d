"""Refinement of a mesh: every tetrahedron and brick is divided into eight cells and keeps its curvature."""

from functools import cache

import numpy as np

from fe_models.errors import MeshError
from fe_models.foundation.arrays import Array, IntArray
from fe_models.meshes.cell_shapes import CELL_SHAPES, shape_values
from fe_models.meshes.mesh import Mesh

__all__ = ["DIVIDED", "refined_mesh"]

#: cells that can be divided: tetrahedra and bricks of any order
DIVIDED = tuple(name for name, shape in CELL_SHAPES.items() if shape.dim == 3 and len(shape.corners) in (4, 8))
PARTS = 64  #: corner weights are integer multiples of 1/64: a quarter in each direction


def refined_mesh(mesh: Mesh) -> Mesh:
    """Return the mesh with every edge halved; the surface keeps its curvature, and groups of cells keep their names.

    (1) identify the nodes of the parts by their weights over the corners of the old cell, which neighbours share;
        coincident nodes on two sides of a crack therefore stay separate
    (2) compute their positions with the shape functions of the old cell

    Faces, and groups of faces and nodes, are dropped.

    Raises
    ------
    MeshError
        If the mesh has other cells than `DIVIDED`.
    """
    others = [kind for kind in mesh.cells if kind not in DIVIDED]
    if others:
        raise MeshError(f"refine: expected cells of {', '.join(DIVIDED)}, got {', '.join(others)}")
    keys, places, sizes = [], [], {}
    for kind, rows in mesh.cells.items():
        weights, points, parts = division(kind)
        corners = np.where(weights > 0, rows[:, None, : weights.shape[1]] * (PARTS + 1) + weights, -1)  # (1)
        corners = np.sort(corners, axis=2)
        keys.append(np.pad(corners, ((0, 0), (0, 0), (8 - corners.shape[2], 0)), constant_values=-1).reshape(-1, 8))
        values = shape_values(kind, points)[0]
        places.append(np.einsum("pn,cnx->cpx", values, mesh.nodes[rows]).reshape(-1, 3))  # (2)
        sizes[kind] = (len(rows), len(points), parts)
    _, first, number = np.unique(np.concatenate(keys), axis=0, return_index=True, return_inverse=True)
    number = number.ravel()
    cells, start = {}, 0
    for kind, (n_cells, n_points, parts) in sizes.items():
        local = number[start : start + n_cells * n_points].reshape(n_cells, n_points)
        start += n_cells * n_points
        cells[kind] = local[:, parts].reshape(n_cells * len(parts), -1)
    sets = {
        group: {
            kind: (len(sizes[kind][2]) * rows[:, None] + np.arange(len(sizes[kind][2]))).ravel()
            for kind, rows in by_type.items()
        }
        for group, by_type in mesh.cell_sets.items()
    }
    return Mesh(np.concatenate(places)[first], cells, cell_sets=sets, source=f"{mesh.source}, every edge halved")


@cache
def division(kind: str) -> tuple[IntArray, Array, IntArray]:
    """Return the subdivision of a cell type into eight cells.

    Returns
    -------
    weights, points, parts
        Weights of the corners at the nodes of the parts, in units of 1/64, (n_points, n_corners); their reference
        coordinates, (n_points, 3); the nodes of each part, (n_parts, n_nodes).
    """
    shape = CELL_SHAPES[kind]
    corners = np.array(shape.corners, dtype=float)
    pieces = []
    for piece in tetrahedron_pieces() if len(corners) == 4 else brick_pieces():
        middles = [piece[list(parents)].mean(axis=0) for parents in shape.middles]
        pieces.append(np.vstack([piece, *middles]))
    every = np.rint(8 * np.concatenate(pieces)).astype(np.int64)
    points, parts = np.unique(every, axis=0, return_inverse=True)
    reference = points / 8
    linear = shape_values("tetra" if len(corners) == 4 else "hexahedron", reference)[0]
    weights = np.rint(PARTS * linear).astype(np.int64)
    return weights, reference, parts.reshape(len(pieces), -1)


def brick_pieces() -> list[Array]:
    """Return the corners of the eight bricks in the unit cube."""
    corners = np.array(CELL_SHAPES["hexahedron"].corners, dtype=float)
    return [(corner + corners) / 2 for corner in corners]


def tetrahedron_pieces() -> list[Array]:
    """Return the corners of the eight tetrahedra in the unit tetrahedron: four at its corners, four between."""
    corners = np.array(CELL_SHAPES["tetra"].corners, dtype=float)
    pieces = [(corner + corners) / 2 for corner in corners]

    def middle(i: int, j: int) -> Array:
        return np.asarray((corners[i] + corners[j]) / 2)

    start, end = middle(0, 2), middle(1, 3)  # end points of one diagonal of the octahedron
    ring = [middle(0, 1), middle(1, 2), middle(2, 3), middle(0, 3)]
    for k in range(4):
        piece = np.array([start, end, ring[k], ring[(k + 1) % 4]])
        if np.linalg.det(piece[1:] - piece[0]) < 0:
            piece = piece[[0, 1, 3, 2]]
        pieces.append(piece)
    return pieces
