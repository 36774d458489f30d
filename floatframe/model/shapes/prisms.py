"""Boxes, and outlines extruded along an axis."""

from dataclasses import dataclass, field

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.errors import ModelError
from floatframe.model.checked_values import array_of_shape, number, unit_vector
from floatframe.model.shapes.grids import polygon_triangles
from floatframe.model.shapes.piece import Piece
from floatframe.model.shapes.rounds import axes_about, finite_points

__all__ = ["Box", "Extrusion", "box_piece"]

QUADS = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
SIGNS = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)], dtype=float)


@dataclass(frozen=True, eq=False)
class Box:
    """A box about the origin."""

    size: Array  #: edge lengths along x, y, z, (3,) [m]

    def __post_init__(self) -> None:
        object.__setattr__(self, "size", array_of_shape("box: size", self.size, (3,)))
        if self.size.min() <= 0:
            raise ModelError(f"box: size: expected three edges above 0, got {self.size.tolist()}")

    def pieces(self) -> tuple[Piece, ...]:
        """Return the surface of the box."""
        return (box_piece(self.size),)


@dataclass(frozen=True, eq=False)
class Extrusion:
    """An outline extruded along an axis, half to each side: a beam with that section, or a plate with that outline.

    The outline lies in the plane normal to the axis: for axis z its pairs are (x, y), for x (y, z), for y (z, x).
    """

    profile: Array  #: corners of the outline, (n, 2) [m]
    length: float  #: length of the extrusion [m]
    axis: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))  #: axis of the extrusion, (3,)

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "profile", finite_points("extrusion: profile", self.profile, 3))
        put(self, "length", number("extrusion: length", self.length, above=0.0))
        put(self, "axis", unit_vector("extrusion: axis", self.axis))

    def pieces(self) -> tuple[Piece, ...]:
        """Return the surface of the extrusion."""
        outline = self.profile
        x_, y_ = outline.T
        if x_ @ np.roll(y_, -1) - y_ @ np.roll(x_, -1) < 0:
            outline = outline[::-1]
        x, y, z = cyclic_axes(self.axis)
        n, h = len(outline), self.length / 2
        flat = outline[:, :1] * x + outline[:, 1:] * y
        nodes = np.concatenate([flat - h * z, flat + h * z])
        k = np.arange(n)
        following = (k + 1) % n
        sides = np.concatenate(
            [np.stack([k, following, following + n], axis=1), np.stack([k, following + n, k + n], axis=1)]
        )
        cap = polygon_triangles(outline)
        return (Piece(nodes, np.concatenate([sides, cap[:, ::-1], cap + n])),)


def box_piece(size: Array, center: Array | tuple[float, float, float] = (0.0, 0.0, 0.0), color: str = "") -> Piece:
    """Return the surface of a box."""
    nodes = np.asarray(center) + 0.5 * SIGNS * np.asarray(size)
    return Piece(nodes, np.concatenate([QUADS[:, [0, 1, 2]], QUADS[:, [0, 2, 3]]]), color=color)


def cyclic_axes(axis: Array) -> tuple[Array, Array, Array]:
    """Return right-handed axes whose third is the given one: (y, z, x), (z, x, y) or (x, y, z) along an axis."""
    for k in range(3):
        if abs(abs(axis[k]) - 1) < 1e-9:
            x, y = np.eye(3)[(k + 1) % 3], np.eye(3)[(k + 2) % 3]
            return (x, y, np.eye(3)[k]) if axis[k] > 0 else (y, x, -np.eye(3)[k])
    return axes_about(axis)
