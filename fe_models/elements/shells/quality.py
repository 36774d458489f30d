"""Quality of flat cells: area, convexity, warp."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fe_models.foundation.arrays import Array, IntArray

__all__ = ["WARP_LIMIT", "CellQuality", "cell_quality"]

WARP_LIMIT = 20.0  #: angle between the two halves of a quad above which the cell is rejected [degree]
FLAT = 1e-9  #: area divided by the square of the cell size, below which the cell has no area


@dataclass(frozen=True, eq=False)
class CellQuality:
    """Quality measures of the cells of one type."""

    area: Array  #: area of each cell, (n,) [m²]
    is_degenerate: NDArray[np.bool_]  #: whether a cell has no area, (n,) bool
    is_folded: NDArray[np.bool_]  #: whether a quad has an inner angle of 180 degrees or more, (n,) bool
    warp: Array  #: largest angle between two halves of a quad, for both diagonals, (n,) [degree]
    aspect: Array  #: longest side divided by shortest side, (n,)


def cell_quality(nodes: Array, cells: IntArray) -> CellQuality:
    """Measure the quality of cells with three or four nodes, (n, 3) or (n, 4)."""
    X = nodes[cells]
    c = cells.shape[1]
    sides = np.roll(X, -1, axis=1) - X
    length = np.linalg.norm(sides, axis=2)
    # normals of the triangle at each corner, whose length is twice its area
    corner_normals = np.cross(np.roll(sides, 1, axis=1), sides)
    if c == 3:
        vector = corner_normals[:, 0] / 2
    else:
        vector = np.cross(X[:, 2] - X[:, 0], X[:, 3] - X[:, 1]) / 2
    area = np.linalg.norm(vector, axis=1)
    size = length.max(axis=1)
    is_degenerate = area <= FLAT * size**2
    unit = vector / np.where(area > 0, area, 1.0)[:, None]
    if c == 3:
        is_folded, warp = np.zeros(len(cells), dtype=bool), np.zeros(len(cells))
    else:
        along = np.einsum("nca,na->nc", corner_normals, unit)
        is_folded = ~is_degenerate & (along.min(axis=1) <= FLAT * size**2)
        length_of = np.linalg.norm(corner_normals, axis=2)
        cosine = np.stack(
            [
                np.einsum("na,na->n", corner_normals[:, i], corner_normals[:, j])
                / np.maximum(length_of[:, i] * length_of[:, j], np.finfo(float).tiny)
                for i, j in ((0, 2), (1, 3))
            ],
            axis=1,
        )
        warp = np.degrees(np.arccos(np.clip(cosine.min(axis=1), -1.0, 1.0)))
    return CellQuality(
        area, is_degenerate, is_folded, warp, size / np.maximum(length.min(axis=1), np.finfo(float).tiny)
    )
