"""Polygons of cross-sections: area moments and triangles of the cap."""

import numpy as np

from fe_models.errors import SectionError
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["circle_points", "ring_cap", "triangulate_polygon"]

NOT_SIMPLE = "section: outline: expected a simple polygon, anticlockwise in (y, z)"


def circle_points(radius: float, n: int) -> Array:
    """Return n points on a circle, anticlockwise from the y axis, (n, 2)."""
    angle = 2 * np.pi * np.arange(n) / n
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def ring_cap(n: int) -> IntArray:
    """Return the triangles between an outer loop 0..n-1 and an inner loop n..2n-1, (2 n, 3), anticlockwise."""
    i = np.arange(n)
    j = (i + 1) % n
    return np.concatenate([np.stack([i, j, n + j], axis=1), np.stack([i, n + j, n + i], axis=1)])


def triangulate_polygon(points: Array) -> IntArray:
    """Return triangles of a simple anticlockwise polygon by cutting ears, (n - 2, 3).

    An ear is a convex corner whose triangle holds no other vertex.

    Raises
    ------
    SectionError
        If the polygon is not simple or runs clockwise.
    """
    rest = list(range(len(points)))
    triangles = []
    while len(rest) > 3:
        for k in range(len(rest)):
            a, b, c = rest[k - 1], rest[k], rest[(k + 1) % len(rest)]
            others = [p for p in rest if p not in (a, b, c)]
            if _area(points[a], points[b], points[c]) > 0 and not _any_inside(points[[a, b, c]], points[others]):
                triangles.append((a, b, c))
                rest.pop(k)
                break
        else:
            if _is_flat(points, rest):
                break
            raise SectionError(NOT_SIMPLE)
    if len(rest) == 3:
        triangles.append((rest[0], rest[1], rest[2]))
    areas = [_area(*points[list(triangle)]) for triangle in triangles]
    y, z = np.asarray(points).T
    whole = float(y @ np.roll(z, -1) - z @ np.roll(y, -1)) / 2
    if not whole > 0 or min(areas) < -1e-12 * whole or abs(sum(areas) - whole) > 1e-9 * whole:
        raise SectionError(NOT_SIMPLE)
    return np.array(triangles, dtype=np.int64).reshape(-1, 3)


def _area(a: Array, b: Array, c: Array) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2


def _is_flat(points: Array, rest: list[int]) -> bool:
    size = float(np.ptp(points, axis=0).max()) ** 2
    return all(abs(_area(points[rest[0]], points[rest[1]], points[p])) <= 1e-12 * size for p in rest)


def _any_inside(triangle: Array, points: Array) -> bool:
    """Whether a point lies inside the triangle or on its edges."""
    a, b, c = triangle
    size = _area(a, b, c)
    return any(min(_area(a, b, p), _area(b, c, p), _area(c, a, p)) >= -1e-12 * size for p in points)
