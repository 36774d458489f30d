"""Surfaces as shown in a page: thinned to a number of nodes, with normals that are split at sharp edges."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from cms.assessment.rendering.shape import surface_edges
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["ShownSurface", "shown_surface"]

FEATURE_ANGLE = 35.0  #: angle between triangles above which thinning keeps an edge [degrees]
TRIES = 6  #: attempts of thinning, because each removes fewer triangles than requested
ENOUGH = 1.15  #: ratio of nodes to desired nodes at which thinning stops


@dataclass(frozen=True, eq=False)
class ShownSurface:
    """A surface of selected nodes of a body."""

    rows: IntArray  #: rows of the shown nodes in the body, (n,)
    corner: IntArray  #: for each corner point with its own normal, the drawn node at its position, (n_corners,)
    triangles: IntArray  #: corner points of each triangle, (n_triangles, 3)
    edges: IntArray  #: shown nodes at the ends of sharp edges, (n_edges, 2)
    n_nodes: int  #: number of nodes of the complete surface
    n_triangles: int  #: number of triangles of the complete surface


def shown_surface(nodes: Array, triangles: IntArray, most: int) -> ShownSurface:
    """Return a surface with at most about `most` nodes, which are original nodes so that their modes are exact.

    Parameters
    ----------
    nodes, triangles
        Nodes, (n, 3), and triangles, (n_triangles, 3), of the surface.
    most
        Largest number of shown nodes.
    """
    rows, local = np.unique(triangles, return_inverse=True)
    local = local.reshape(-1, 3)
    n_nodes, n_triangles = len(rows), len(triangles)
    at_edge = np.ones(n_nodes, bool)
    if n_nodes > most:
        ends, _, is_sharp = surface_edges(nodes[rows], local)
        at_edge[:] = False
        at_edge[ends[is_sharp]] = True
        kept, local = thinned(nodes[rows], local, most)
        rows, at_edge = rows[kept], at_edge[kept]
    corner, split = broken_at_edges(nodes[rows], local, at_edge)
    ends, _, is_sharp = surface_edges(nodes[rows], local)
    is_sharp &= at_edge[ends].all(axis=1)
    return ShownSurface(rows, corner, split, ends[is_sharp], n_nodes, n_triangles)


def thinned(nodes: Array, triangles: IntArray, most: int) -> tuple[IntArray, IntArray]:
    """Return rows of the remaining nodes and their triangles; nodes are removed where the surface is flattest.

    Nodes are deleted and never moved (`vtkDecimatePro`).
    """
    import pyvista as pv

    mesh = pv.PolyData(nodes, faces=np.insert(triangles, 0, 3, axis=1).ravel())
    mesh.point_data["row"] = np.arange(len(nodes))
    for _ in range(TRIES):
        share = 1.0 - most / mesh.n_points
        for keeps_form in (True, False):  # holes and thin walls can be thinned only if their form may change
            fewer = mesh.decimate_pro(
                min(share * 1.02, 0.99), feature_angle=FEATURE_ANGLE, preserve_topology=keeps_form,
                splitting=False, boundary_vertex_deletion=not keeps_form,
            )  # fmt: skip
            if fewer.n_points < 0.98 * mesh.n_points:
                break
        else:
            break
        mesh = fewer
        if mesh.n_points <= ENOUGH * most:
            break
    kept = np.asarray(mesh.point_data["row"], dtype=np.int64)
    left = mesh.faces.reshape(-1, 4)[:, 1:]
    used, local = np.unique(left, return_inverse=True)
    return kept[used], local.reshape(-1, 3)


def broken_at_edges(
    nodes: Array, triangles: IntArray, at_edge: NDArray[np.bool_] | None = None
) -> tuple[IntArray, IntArray]:
    """Return the node of each corner point, and triangles of corner points: smooth neighbours share them.

    Corners of triangles at a node are one point if a chain of edges that are not sharp connects the triangles.

    Parameters
    ----------
    at_edge
        Nodes between which an edge may be sharp, (n_nodes,), because thinning roughens smooth surfaces; None: all.
    """
    n = len(triangles)
    ends, beside, is_sharp = surface_edges(nodes, triangles)
    if at_edge is not None:
        is_sharp = is_sharp & at_edge[ends].all(axis=1)
    smooth = ~is_sharp & (beside[:, 0] != beside[:, 1])
    first, second, ends = beside[smooth, 0], beside[smooth, 1], ends[smooth]
    pairs = []
    for end in (0, 1):
        at_first = (triangles[first] == ends[:, end : end + 1]).argmax(axis=1)
        at_second = (triangles[second] == ends[:, end : end + 1]).argmax(axis=1)
        pairs.append(np.stack([3 * first + at_first, 3 * second + at_second], axis=1))
    joined = np.concatenate(pairs)
    graph = sp.coo_array((np.ones(len(joined)), (joined[:, 0], joined[:, 1])), shape=(3 * n, 3 * n))
    count, point = connected_components(graph, directed=False)
    corner = np.zeros(count, np.int64)
    corner[point] = triangles.ravel()
    return corner, point.reshape(-1, 3).astype(np.int64)
