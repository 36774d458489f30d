"""Skin of a shell: a point above and a point below each node, for each smooth patch of cells at the node."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from fe_models.elements.shells.elements import ShellCells
from fe_models.foundation.arrays import Array, IntArray, frozen

__all__ = ["ShellSkin", "cell_edges", "make_shell_skin"]

#: cosine of the largest angle between the normals of two cells that share skin points
SMOOTH = np.cos(np.deg2rad(40.0))


@dataclass(frozen=True, eq=False)
class ShellSkin:
    """Points on the top and bottom faces that follow their nodes rigidly, two for each of n patches of corners."""

    points: Array  #: positions of the top points, then of the bottom points, (2 n, 3) [m]
    mover: IntArray  #: mesh node that each point follows, (2 n,)
    triangles: IntArray  #: triangles between points, normals outward, (n_tri, 3)
    cell_of: IntArray  #: cell of each triangle, numbered over all types, (n_tri,)
    patch: tuple[IntArray, ...]  #: patch of each corner, (n_cells, c), for each cell type

    @property
    def n_patches(self) -> int:
        """Number of patches: half of the number of points."""
        return len(self.points) // 2


@dataclass(frozen=True, eq=False)
class CellEdges:
    """Edges of all cells; corners are numbered successively, by cell type and cell."""

    corners: IntArray  #: corner at the start and at the end of each edge, (n_edges, 2)
    nodes: IntArray  #: nodes at the start and at the end of each edge, (n_edges, 2)
    cell: IntArray  #: cell of each edge, numbered over all types, (n_edges,)
    first: IntArray  #: first edge of each pair of coinciding edges without a third edge, (n_pairs,)
    second: IntArray  #: second edge of each pair, (n_pairs,)
    count: IntArray  #: number of edges between the same two nodes, including the edge itself, (n_edges,)


def cell_edges(cells: tuple[IntArray, ...]) -> CellEdges:
    """Return the edges of cells, and the pairs of coinciding edges."""
    corners, nodes, owner = [], [], []
    first_corner = first_cell = 0
    for rows in cells:
        n, c = rows.shape
        numbers = first_corner + np.arange(n * c).reshape(n, c)
        corners.append(np.stack([numbers, np.roll(numbers, -1, axis=1)], axis=2).reshape(-1, 2))
        nodes.append(np.stack([rows, np.roll(rows, -1, axis=1)], axis=2).reshape(-1, 2))
        owner.append(first_cell + np.repeat(np.arange(n), c))
        first_corner, first_cell = first_corner + n * c, first_cell + n
    ends = np.concatenate(nodes)
    _, group, count = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True, return_counts=True)
    group = group.ravel()
    order = np.argsort(group, kind="stable")
    start = np.cumsum(count) - count
    pairs = start[count == 2]
    return CellEdges(np.concatenate(corners), ends, np.concatenate(owner), order[pairs], order[pairs + 1], count[group])


def make_shell_skin(nodes: Array, groups: tuple[ShellCells, ...]) -> ShellSkin:
    """Return the skin of all cells.

    (1) corners of neighbouring cells at a node share their points if the cells have the same thickness, offset and
        side of the normal, and meet at less than 40 degrees; folds, joints of three cells and steps remain sharp
    (2) the points are the mean of the corners of the middle surface, plus and minus half of the thickness along the
        mean normal
    (3) triangles cover both faces, and the rim along every edge where the skin ends

    Parameters
    ----------
    nodes
        Nodes of the mesh, (n_nodes, 3).
    groups
        Cells of each type.
    """
    edges = cell_edges(tuple(group.cells for group in groups))
    normal = np.concatenate([group.planes.R[:, :, 2] for group in groups])
    t = np.concatenate([group.t for group in groups])
    sizes = [group.cells.size for group in groups]
    node_of = np.concatenate([group.cells.ravel() for group in groups])
    cell_of = np.concatenate([np.repeat(np.arange(len(g.cells)), g.cells.shape[1]) for g in groups])
    starts = np.cumsum([0, *(len(group.cells) for group in groups)])
    cell_of = cell_of + np.repeat(starts[:-1], sizes)
    middle = np.concatenate([group.planes.corners.reshape(-1, 3) for group in groups])
    offset = np.einsum("na,na->n", middle - nodes[node_of], normal[cell_of])
    a, b = edges.first, edges.second
    cell_a, cell_b = edges.cell[a], edges.cell[b]
    offsets = offset[edges.corners[a]], offset[edges.corners[b][:, ::-1]]
    is_smooth = (  # (1)
        (edges.nodes[a] == edges.nodes[b][:, ::-1]).all(axis=1)
        & (np.einsum("na,na->n", normal[cell_a], normal[cell_b]) > SMOOTH)
        & np.isclose(t[cell_a], t[cell_b], rtol=1e-9, atol=0)
        & (np.abs(offsets[0] - offsets[1]).max(axis=1, initial=0) < 0.5 * t[cell_a])
    )
    joined = np.concatenate(
        [np.stack([edges.corners[a[is_smooth], k], edges.corners[b[is_smooth], 1 - k]], axis=1) for k in range(2)]
    )
    n_corners = len(node_of)
    graph = sp.coo_array((np.ones(len(joined)), (joined[:, 0], joined[:, 1])), shape=(n_corners, n_corners))
    n_patches, labels = sp.csgraph.connected_components(graph, directed=False)
    patch: IntArray = np.asarray(labels, dtype=np.int64)
    mean = sp.csr_array((np.ones(n_corners), (patch, np.arange(n_corners))), shape=(n_patches, n_corners))
    count = np.bincount(patch, minlength=n_patches)[:, None]
    n = mean @ normal[cell_of]  # (2)
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    half = (mean @ t[cell_of])[:, None] / count / 2 * n
    center = mean @ middle / count
    mover = np.zeros(n_patches, np.int64)
    mover[patch] = node_of
    by_type: list[IntArray] = [
        rows.reshape(g.cells.shape) for rows, g in zip(np.split(patch, np.cumsum(sizes)[:-1]), groups, strict=True)
    ]
    is_end = np.ones(len(edges.nodes), dtype=bool)  # (3)
    is_end[a[is_smooth]] = is_end[b[is_smooth]] = False
    rim = patch[edges.corners[is_end]]
    low = rim + n_patches
    triangles: list[IntArray] = [
        np.stack([low[:, 0], low[:, 1], rim[:, 1]], axis=1),
        np.stack([low[:, 0], rim[:, 1], rim[:, 0]], axis=1),
    ]
    rim_cells = edges.cell[is_end]
    behind: list[IntArray] = [rim_cells, rim_cells]
    for rows, first_cell in zip(by_type, starts, strict=False):
        own = first_cell + np.arange(len(rows))
        faces = [rows] if rows.shape[1] == 3 else [rows[:, [0, 1, 2]], rows[:, [0, 2, 3]]]
        for face in faces:
            triangles += [face, face[:, ::-1] + n_patches]
            behind += [own, own]
    return ShellSkin(
        frozen(np.concatenate([center + half, center - half])),
        frozen(np.concatenate([mover, mover]), np.int64),
        frozen(np.concatenate(triangles), np.int64),
        frozen(np.concatenate(behind), np.int64),
        tuple(frozen(rows, np.int64) for rows in by_type),
    )
