"""Consistent orientation of the normals of all cells of a wall."""

from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from fe_models.elements.shells.skin import cell_edges
from fe_models.foundation.arrays import IntArray
from fe_models.meshes.shell_mesh import ShellMesh

__all__ = ["orient_normals"]


def orient_normals(mesh: ShellMesh) -> ShellMesh:
    """Return the mesh with normals of neighbouring cells on the same side; the nodes of some cells are reversed.

    Two cells are neighbours if they are the only two cells on an edge. In each connected part the first cell keeps its
    normal, and the others follow. A part that cannot be oriented, such as a Möbius strip, keeps one seam. An edge of
    three walls connects nothing: each wall keeps the normal of its own first cell.

    Parameters
    ----------
    mesh
        Shell mesh; any orientation of its cells.
    """
    kinds = list(mesh.cells)
    edges = cell_edges(tuple(mesh.cells[kind] for kind in kinds))
    n = mesh.n_cells
    first, second = edges.cell[edges.first], edges.cell[edges.second]
    is_flip = (edges.nodes[edges.first] == edges.nodes[edges.second]).all(axis=1)
    keys = np.concatenate([first * n + second, second * n + first])
    order = np.argsort(keys, kind="stable")
    keys, flips = keys[order], np.tile(is_flip, 2)[order]
    graph = sp.csr_array((np.ones(len(keys)), (keys // n, keys % n)), shape=(n, n))
    _, part = sp.csgraph.connected_components(graph, directed=False)
    turned = np.zeros(n, dtype=bool)
    for start in np.unique(part, return_index=True)[1]:
        visited, before = sp.csgraph.breadth_first_order(graph, start, directed=False)
        parents = before[visited[1:]].astype(np.int64)
        turns = flips[np.searchsorted(keys, parents * n + visited[1:])]
        for cell, parent, turn in zip(visited[1:].tolist(), parents.tolist(), turns.tolist(), strict=True):
            turned[cell] = turned[parent] ^ turn
    if not turned.any():
        return mesh
    starts = np.cumsum([0, *(len(mesh.cells[kind]) for kind in kinds)])
    cells: dict[str, IntArray] = {}
    for kind, begin, end in zip(kinds, starts[:-1], starts[1:], strict=True):
        rows = np.array(mesh.cells[kind])
        mine = turned[begin:end]
        rows[mine] = rows[mine][:, [0, *range(rows.shape[1] - 1, 0, -1)]]
        cells[kind] = rows
    return replace(mesh, cells=cells, notes=(*mesh.notes, f"the nodes of {int(turned.sum())} cells were reversed"))
