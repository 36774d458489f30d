"""Geometry of a surface for drawing: sharp edges, and normals smoothed between them."""

from functools import lru_cache

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fe_models.foundation.arrays import Array, IntArray

__all__ = ["colormap", "smooth_neighbours", "surface_edges", "triangle_normals"]

FEATURE_ANGLE = np.deg2rad(35.0)  #: angle between normals above which an edge is sharp
COLOR_STOPS = ("#3b6fb6", "#4fa3c7", "#8fcfb0", "#e6e28a", "#f2a65a", "#d6513f", "#9b1d3c")


def triangle_normals(nodes: Array, triangles: IntArray) -> Array:
    """Return unit normals, (n_triangles, 3); zero for a triangle without area."""
    by_axis = np.ascontiguousarray(nodes.T)  # operations on columns are several times faster than np.cross on rows
    a, b, c = (by_axis.take(triangles[:, k], axis=1) for k in range(3))
    u, v = b - a, c - a
    normals = np.stack([u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]])
    length = np.sqrt((normals**2).sum(axis=0))
    return np.divide(normals, length, out=np.zeros_like(normals), where=length > 0).T


def surface_edges(nodes: Array, triangles: IntArray) -> tuple[IntArray, IntArray, NDArray[np.bool_]]:
    """Return all edges of a surface, and the edges that are sharp, free, or shared by more than two triangles.

    Returns
    -------
    tuple
        Nodes of the edges, (n_edges, 2); the two triangles at each edge (a free edge has the same one twice), (n_edges,
        2); and whether it is sharp, (n_edges,).
    """
    ends = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    if len(ends) == 0:
        return ends, ends, np.zeros(0, bool)
    owner = np.tile(np.arange(len(triangles)), 3)
    order = np.lexsort((ends[:, 1], ends[:, 0]))
    ends, owner = ends[order], owner[order]
    start = np.flatnonzero(np.r_[True, (ends[1:] != ends[:-1]).any(axis=1)])
    count = np.diff(np.r_[start, len(ends)])
    beside = np.stack([owner[start], owner[start + count - 1]], axis=1)
    normals = triangle_normals(nodes, triangles)
    angle_cos = np.einsum("ea,ea->e", normals[beside[:, 0]], normals[beside[:, 1]])
    return ends[start], beside, (count != 2) | (angle_cos < np.cos(FEATURE_ANGLE))


def smooth_neighbours(nodes: Array, triangles: IntArray) -> sp.csr_array:
    """Return the matrix that sums, for each triangle, area normals of neighbours at less than the feature angle.

    It is (n_triangles, n_triangles), with entries 0 and 1, and includes the triangle itself.
    """
    n = len(triangles)
    corner = sp.csr_array((np.ones(3 * n), (np.repeat(np.arange(n), 3), triangles.ravel())), shape=(n, len(nodes)))
    touch = sp.coo_array(corner @ corner.T)
    normals = triangle_normals(nodes, triangles)
    rows, columns = touch.row, touch.col
    near = np.einsum("ea,ea->e", normals[rows], normals[columns]) > np.cos(FEATURE_ANGLE)
    near |= rows == columns
    return sp.csr_array((np.ones(near.sum()), (rows[near], columns[near])), shape=(n, n))


@lru_cache(maxsize=1)
def colormap() -> Array:
    """Return the colour map, (256, 3) from 0 to 1: cool to warm, with equal perceived differences (CIE76)."""
    from matplotlib.colors import LinearSegmentedColormap

    fine = LinearSegmentedColormap.from_list("", COLOR_STOPS)(np.linspace(0, 1, 2048))[:, :3]
    steps = np.linalg.norm(np.diff(cie_lab(fine), axis=0), axis=1)
    travelled = np.r_[0.0, np.cumsum(steps)]
    wanted = np.linspace(0, travelled[-1], 256)
    return np.stack([np.interp(wanted, travelled, fine[:, k]) for k in range(3)], axis=1)


def cie_lab(rgb: Array) -> Array:
    """Return L*, a*, b* (D65) for sRGB colours, (n, 3)."""
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    xyz = linear @ np.array([[0.4124, 0.2126, 0.0193], [0.3576, 0.7152, 0.1192], [0.1805, 0.0722, 0.9505]])
    ratio = xyz / np.array([0.9505, 1.0, 1.089])
    f = np.where(ratio > (6 / 29) ** 3, np.cbrt(ratio), ratio * (29 / 6) ** 2 / 3 + 4 / 29)
    return np.stack([116 * f[:, 1] - 16, 500 * (f[:, 0] - f[:, 1]), 200 * (f[:, 1] - f[:, 2])], axis=1)
