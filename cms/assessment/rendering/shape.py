"""Surfaces for drawing: normals, sharp edges, colours."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fe_models.foundation.arrays import Array, IntArray

__all__ = ["colormap", "rgb_of", "surface_edges", "triangle_normals"]

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


def rgb_of(color: str) -> tuple[float, float, float]:
    """Return red, green and blue from 0 to 1 of a colour such as "#4fa3c7"."""
    from PIL.ImageColor import getrgb

    red, green, blue = getrgb(color)[:3]
    return red / 255, green / 255, blue / 255


@lru_cache(maxsize=1)
def colormap() -> Array:
    """Return the colour map, (256, 3) from 0 to 1: cool to warm, with equal perceived differences (CIE76)."""
    stops = np.array([rgb_of(color) for color in COLOR_STOPS])
    at = np.linspace(0, len(stops) - 1, 256)
    fine = np.stack([np.interp(at, np.arange(len(stops)), stops[:, k]) for k in range(3)], axis=1)
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
