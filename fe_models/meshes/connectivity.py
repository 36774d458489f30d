"""Connections between the cells of a mesh: parts, hinges, overlaps, and coincident nodes."""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import IntArray
from fe_models.meshes.boundary import CORNERS, boundary_facets, facets_of, first_of_equal_rows
from fe_models.meshes.mesh import Mesh, used_nodes

__all__ = ["Connectivity", "coincident_nodes", "connectivity"]


@dataclass(frozen=True, eq=False)
class Connectivity:
    """Connected parts of a mesh, and faulty connections between cells."""

    part_cells: tuple[int, ...]  #: number of cells of each part, largest first; parts have no node in common
    part_node: tuple[int, ...]  #: one node of each part
    #: number of parts without a common facet; more than `part_cells` if parts meet at a node or an edge
    n_facet_parts: int
    n_overlapping: int  #: number of facets that belong to more than two cells
    n_mismatched: int  #: number of facets on which two cells meet with different middle nodes
    n_transitions: int  #: number of quadrilateral facets that touch a triangular facet of another cell


def connectivity(mesh: Mesh) -> Connectivity:
    """Find the connected parts of a mesh, and faulty connections between its cells.

    Parameters
    ----------
    mesh
        Any solid mesh.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    n_nodes = len(mesh.nodes)
    first = np.concatenate([np.repeat(cells[:, 0], cells.shape[1] - 1) for cells in mesh.cells.values()])
    other = np.concatenate([cells[:, 1:].ravel() for cells in mesh.cells.values()])
    links = coo_array((np.ones(first.size, np.int8), (first, other)), shape=(n_nodes, n_nodes))
    _, part_of_node = connected_components(links, directed=False)
    part_of_cell = np.concatenate([part_of_node[cells[:, 0]] for cells in mesh.cells.values()])
    parts, count = np.unique(part_of_cell, return_counts=True)
    order = np.argsort(-count, kind="stable")
    heads = np.concatenate([cells[:, 0] for cells in mesh.cells.values()])
    part_node = [int(heads[np.argmax(part_of_cell == part)]) for part in parts[order][:10]]

    facets = facets_of(mesh)
    pairs = facets.pairs
    n_cells = mesh.n_cells
    neighbours = coo_array((np.ones(len(pairs), np.int8), (pairs[:, 0], pairs[:, 1])), shape=(n_cells, n_cells))
    n_facet_parts, _ = connected_components(neighbours, directed=False)
    return Connectivity(
        tuple(int(c) for c in count[order]),
        tuple(part_node),
        int(n_facet_parts),
        facets.n_overlapping,
        facets.n_mismatched,
        _transitions(mesh),
    )


def _transitions(mesh: Mesh) -> int:
    """Return the number of boundary quadrilaterals that contain a boundary triangle of three of their corners."""
    facets = boundary_facets(mesh)
    triangles = [np.sort(rows[:, :3], axis=1) for kind, rows in facets.items() if CORNERS[kind] == 3]
    quads = [rows[:, :4] for kind, rows in facets.items() if CORNERS[kind] == 4]
    if not triangles or not quads:
        return 0
    quad = np.concatenate(quads)
    halves = np.sort(np.concatenate([np.delete(quad, k, axis=1) for k in range(4)]), axis=1)
    tri = np.concatenate(triangles)
    classes, _ = first_of_equal_rows(np.concatenate([halves, tri]))
    return int(np.isin(classes[: len(halves)], classes[len(halves) :]).reshape(4, -1).any(axis=0).sum())


def coincident_nodes(mesh: Mesh, distance: float) -> IntArray:
    """Return the used nodes with another used node within the distance [m], ascending, (n,)."""
    from scipy.spatial import cKDTree

    nodes = np.flatnonzero(used_nodes(mesh))
    apart, _ = cKDTree(mesh.nodes[nodes]).query(mesh.nodes[nodes], k=2, distance_upper_bound=max(distance, 1e-300))
    return nodes[np.isfinite(apart[:, 1])]
