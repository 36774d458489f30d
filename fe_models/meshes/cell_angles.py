"""Angles between neighbouring faces of solid cells; small or nearly straight angles make poor elements."""

from functools import cache

import numpy as np

from fe_models.foundation.arrays import IntArray
from fe_models.meshes.cell_shapes import CELL_SHAPES
from fe_models.meshes.mesh import Mesh

__all__ = ["face_angles"]

_CHUNK = 20_000  #: number of cells processed at a time


def face_angles(mesh: Mesh) -> tuple[float, float]:
    """Return the smallest and the largest angle between two faces of a cell that share an edge [degrees].

    The angle is measured at both ends of every edge, between the straight edges to other corners. It is 70.5 for a
    regular tetrahedron and 90 for a cube. Both are NaN for a mesh without solid cells. Coincident corners count as
    angle 0.
    """
    smallest, largest = np.inf, -np.inf
    for kind, cells in mesh.cells.items():
        i, j, k, m = _corners(kind).T
        for begin in range(0, len(cells), _CHUNK):
            X = mesh.nodes[cells[begin : begin + _CHUNK]]
            edge = X[:, j] - X[:, i]
            first, second = np.cross(edge, X[:, k] - X[:, i]), np.cross(edge, X[:, m] - X[:, i])
            sine = np.linalg.norm(np.cross(first, second), axis=-1)
            cosine = (first * second).sum(axis=-1)
            angles = np.arctan2(sine, cosine)
            smallest, largest = min(smallest, float(angles.min())), max(largest, float(angles.max()))
    return (float(np.degrees(smallest)), float(np.degrees(largest))) if np.isfinite(smallest) else (np.nan, np.nan)


@cache
def _corners(kind: str) -> IntArray:
    """Return rows i, j, k, m, (n, 4): edge i-j, and the other neighbours of i on the two faces of the edge."""
    beside: dict[tuple[int, int], list[int]] = {}
    for facet in CELL_SHAPES[kind].facets:
        n = len(facet)
        for a in range(n):
            before, here, after = facet[a - 1], facet[a], facet[(a + 1) % n]
            beside.setdefault((here, after), []).append(before)
            beside.setdefault((here, before), []).append(after)
    return np.array([[i, j, *neighbours] for (i, j), neighbours in beside.items()])
