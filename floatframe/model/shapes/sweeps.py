"""Outlines swept along a curve: bent tubes, rails."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.errors import ModelError
from floatframe.model.checked_values import number
from floatframe.model.shapes.grids import grid_triangles
from floatframe.model.shapes.piece import Piece
from floatframe.model.shapes.rounds import finite_points

__all__ = ["Line", "Tube", "along", "points_3", "swept"]


# sweeps ---------------------------------------------------------------------------------------------------------------


AROUND = 16  #: number of nodes around the circle of a tube


@dataclass(frozen=True, eq=False)
class Tube:
    """A round bar along a line of points."""

    points: Array  #: points on the centre line, (n, 3) [m]
    radius: float  #: radius of the tube [m]
    is_closed: bool = False  #: whether the last point is connected to the first

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", points_3("tube: points", self.points))
        object.__setattr__(self, "radius", number("tube: radius", self.radius, above=0.0))

    def pieces(self) -> tuple[Piece, ...]:
        """Return the surface of the tube."""
        angle = 2 * np.pi * np.arange(AROUND) / AROUND
        circle = self.radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        axes = carried_axes(self.points, is_closed=self.is_closed)
        return (swept(circle, self.points, axes, is_closed=self.is_closed),)


def swept(outline: Array, points: Array, axes: Array, *, is_closed: bool = False, has_caps: bool = True) -> Piece:
    """Return an outline, (m, 2), swept along a curve.

    Parameters
    ----------
    outline
        Anticlockwise when the curve comes towards the viewer.
    points, axes
        Points of the curve, (n, 3), and directions of both outline axes, (n, 3, 2).
    """
    m, n = len(outline), len(points)
    nodes = (points[:, None] + np.einsum("nak,mk->nma", axes, outline)).reshape(-1, 3)
    triangles = grid_triangles(n, m, closes_n=is_closed, closes_m=True)[:, ::-1]
    if has_caps and not is_closed:
        fan = np.stack([np.zeros(m - 2, np.int64), np.arange(1, m - 1), np.arange(2, m)], axis=1)
        triangles = np.concatenate([triangles, fan[:, ::-1], fan + (n - 1) * m])
    return Piece(nodes, triangles)


def along(points: Array, *, is_closed: bool = False) -> Array:
    """Return the unit tangent of a line of points at each point, (n, 3)."""
    if is_closed:
        d = np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)
    else:
        steps = np.diff(points, axis=0)
        steps = steps / np.maximum(np.linalg.norm(steps, axis=1, keepdims=True), 1e-300)
        d = np.concatenate([steps[:1], steps[:-1] + steps[1:], steps[-1:]])
    return np.asarray(d / np.maximum(np.linalg.norm(d, axis=1, keepdims=True), 1e-300))


def carried_axes(points: Array, *, is_closed: bool = False) -> Array:
    """Return two axes normal to a line of points with minimal rotation about it, (n, 3, 2)."""
    d = along(points, is_closed=is_closed)
    x = np.cross(d[0], np.eye(3)[int(np.argmin(np.abs(d[0])))])
    found = []
    for direction in d:
        x = x - (x @ direction) * direction
        x = x / np.linalg.norm(x)
        found.append(np.stack([x, np.cross(direction, x)], axis=1))
    return np.array(found)


def points_3(where: str, values: Any) -> Array:
    """Return finite points, (n, 3), read-only, without equal consecutive points."""
    points = finite_points(where, values, 2, 3, "points [x, y, z]")
    if np.linalg.norm(np.diff(points, axis=0), axis=1).min() == 0:
        k = int(np.linalg.norm(np.diff(points, axis=0), axis=1).argmin())
        raise ModelError(f"{where}: points {k + 1} and {k + 2} are the same, {points[k].tolist()}; remove one")
    return points


# a line of points: a cable, a wire, an outline ------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Line:
    """Straight lines from point to point."""

    points: Array  #: points of the line, (n, 3) [m]
    is_closed: bool = False  #: whether the last point is connected to the first

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", points_3("line: points", self.points))

    def pieces(self) -> tuple[Piece, ...]:
        """Return the line segments."""
        n = len(self.points)
        ends = np.stack([np.arange(n), np.arange(1, n + 1) % n], axis=1)
        return (Piece(self.points, segments=ends if self.is_closed else ends[:-1]),)
