"""Triangles of grids, fans and closed polygons."""

import numpy as np

from fe_models.foundation.arrays import Array, IntArray

__all__ = ["grid_triangles", "polygon_triangles"]


def grid_triangles(n: int, m: int, *, closes_n: bool = False, closes_m: bool = False) -> IntArray:
    """Return triangles of a grid of n x m nodes, row by row, closed in one direction, in both, or open.

    They are anticlockwise when seen from the side to which (along n) x (along m) points.
    """
    i, j = np.meshgrid(np.arange(n if closes_n else n - 1), np.arange(m if closes_m else m - 1), indexing="ij")
    a, b = i * m + j, (i + 1) % n * m + j
    c, d = (i + 1) % n * m + (j + 1) % m, i * m + (j + 1) % m
    quads = np.stack([a, b, c, d], axis=-1).reshape(-1, 4)
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def polygon_triangles(points: Array) -> IntArray:
    """Return triangles of a simple anticlockwise polygon, (n, 2), by ear clipping."""
    left = list(range(len(points)))
    found = []
    while len(left) > 3:
        for k in range(len(left)):
            a, b, c = left[k - 1], left[k], left[(k + 1) % len(left)]
            if turn(points[a], points[b], points[c]) <= 0:
                continue
            others = [p for p in left if p not in (a, b, c)]
            if not any(is_within(points[p], points[a], points[b], points[c]) for p in others):
                break
        else:
            k = 0  # a polygon without an ear intersects itself or is degenerate: any corner may be used
            a, b, c = left[-1], left[0], left[1]
        found.append((a, b, c))
        left.pop(k)
    found.append((left[0], left[1], left[2]))
    return np.array(found)


def turn(a: Array, b: Array, c: Array) -> float:
    """Return twice the area of a triangle, positive if it is anticlockwise."""
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def is_within(p: Array, a: Array, b: Array, c: Array) -> bool:
    """Whether a point lies in an anticlockwise triangle, including its edges."""
    return turn(a, b, p) >= 0 and turn(b, c, p) >= 0 and turn(c, a, p) >= 0
