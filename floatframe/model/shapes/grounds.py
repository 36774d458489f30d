"""Surroundings of machines: a plane with a grid, uneven ground, a road along a curve, a railway track."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.errors import ModelError
from floatframe.model.checked_values import array_of_shape, number, unit_vector
from floatframe.model.shapes.grids import grid_triangles
from floatframe.model.shapes.piece import Piece, joined
from floatframe.model.shapes.prisms import box_piece
from floatframe.model.shapes.sweeps import along, points_3, swept

__all__ = ["Plane", "Road", "Terrain", "Track"]

ASPHALT, PAINT, SOIL, RAIL, SLEEPER, BED = "#8a9097", "#f3f4f2", "#b7b9a8", "#7d6d63", "#b0a596", "#c2bdb4"
MOST_SLEEPERS = 1200
#: head, web and foot of a rail relative to its height; the origin is the centre of the top of the head
RAIL_OUTLINE = np.array(
    [(-0.21, -0.02), (-0.18, 0.0), (0.18, 0.0), (0.21, -0.02), (0.21, -0.2), (0.06, -0.26), (0.05, -0.84),
     (0.43, -0.93), (0.43, -1.0), (-0.43, -1.0), (-0.43, -0.93), (-0.05, -0.84), (-0.06, -0.26), (-0.21, -0.2)]
)[::-1]  # fmt: skip


@dataclass(frozen=True, eq=False)
class Plane:
    """A flat, unlimited ground with a grid."""

    normal: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))  #: upward normal, (3,)
    step: float | None = None  #: distance between grid lines [m]; None: a round number that suits the machine

    def __post_init__(self) -> None:
        object.__setattr__(self, "normal", unit_vector("plane: normal", self.normal))
        if self.step is not None:
            object.__setattr__(self, "step", number("plane: step", self.step, above=0.0))

    def pieces(self) -> tuple[Piece, ...]:
        """Return no pieces, because the extent of the drawn plane depends on the moving bodies."""
        return ()


@dataclass(frozen=True, eq=False)
class Terrain:
    """Uneven ground: heights over a grid."""

    x: Array  #: increasing x coordinates of the grid, (n,) [m]
    y: Array  #: increasing y coordinates of the grid, (m,) [m]
    z: Array  #: heights, (n, m) [m]

    def __post_init__(self) -> None:
        put = object.__setattr__
        for name in ("x", "y"):
            values = array_of_shape(f"terrain: {name}", getattr(self, name), (np.size(getattr(self, name)),))
            if len(values) < 2 or np.diff(values).min() <= 0:
                raise ModelError(f"terrain: {name}: expected two or more rising numbers")
            put(self, name, values)
        put(self, "z", array_of_shape("terrain: z", self.z, (len(self.x), len(self.y))))

    def pieces(self) -> tuple[Piece, ...]:
        """Return the surface of the terrain."""
        X, Y = np.meshgrid(self.x, self.y, indexing="ij")
        nodes = np.stack([X, Y, self.z], axis=-1).reshape(-1, 3)
        return (Piece(nodes, grid_triangles(len(self.x), len(self.y)), color=SOIL, is_ground=True),)


@dataclass(frozen=True, eq=False)
class Road:
    """A road along a curve on its surface, with painted edges and a broken centre line."""

    points: Array  #: points on the centre line of the surface, (n, 3) [m]
    width: float  #: width of the road [m]
    up: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))  #: upward direction, (3,)
    is_painted: bool = True  #: whether lines are painted on the road

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "points", points_3("road: points", self.points))
        put(self, "width", number("road: width", self.width, above=0.0))
        put(self, "up", unit_vector("road: up", self.up))

    def pieces(self) -> tuple[Piece, ...]:
        """Return the surface and the painted lines of the road."""
        w, line, lift = self.width / 2, min(0.12, 0.02 * self.width), 2e-4 * self.width
        found = [band(self.points, self.up, -w, w, 0.0, ASPHALT)]
        if self.is_painted:
            edges = [band(self.points, self.up, s * (w - 3 * line), s * (w - 2 * line), lift, PAINT) for s in (-1, 1)]
            dash = 0.5 * self.width
            pieces = [
                band(part, self.up, -line / 2, line / 2, lift, PAINT) for part in dashes(self.points, dash, 2.0 * dash)
            ]
            found.append(joined([*edges, *pieces]))
        return tuple(found)


@dataclass(frozen=True, eq=False)
class Track:
    """Two rails on sleepers along a curve; its points lie midway between the tops of the rails."""

    points: Array  #: points of the track centre line, (n, 3) [m]
    gauge: float  #: distance between the centres of the rail heads [m]
    cant: Array | None = None  #: height of the left rail above the right one [m], for the whole track or for each point
    up: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))  #: upward direction, (3,)
    rail_height: float | None = None  #: height of the rails [m]; None: 0.115 of the gauge
    sleeper_distance: float | None = None  #: distance between sleepers [m]; None: 0.4 of the gauge

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "points", points_3("track: points", self.points))
        put(self, "gauge", number("track: gauge", self.gauge, above=0.0))
        put(self, "up", unit_vector("track: up", self.up))
        for name, share in (("rail_height", 0.115), ("sleeper_distance", 0.4)):
            given = getattr(self, name)
            put(self, name, share * self.gauge if given is None else number(f"track: {name}", given, above=0.0))
        cant = cants(self.cant, len(self.points))
        put(self, "cant", cant)
        if np.abs(cant).max() >= self.gauge:
            raise ModelError(f"track: cant: expected less than the gauge {self.gauge:g}")

    def pieces(self) -> tuple[Piece, ...]:
        """Return both rails, the sleepers and the ballast."""
        assert self.rail_height is not None  # __post_init__ has set it
        h, gauge = self.rail_height, self.gauge
        axes = self.axes
        outline = h * RAIL_OUTLINE
        rails = [swept(outline, self.points + 0.5 * s * gauge * axes[:, :, 0], axes) for s in (-1, 1)]
        sleepers = self.sleepers(axes)
        bed = np.array([(-1.05, -1.9), (1.05, -1.9), (0.9, -1.35), (-0.9, -1.35)]) * np.array([gauge, h])
        ballast = swept(bed, self.points, axes)
        return tuple(
            Piece(piece.nodes, piece.triangles, color=color, is_ground=True)
            for piece, color in ((joined(rails), RAIL), (sleepers, SLEEPER), (ballast, BED))
        )

    @property
    def axes(self) -> Array:
        """Directions to the left and up, with cant, at each point, (n, 3, 2)."""
        assert self.cant is not None  # __post_init__ has set it
        d = along(self.points)
        left = np.cross(self.up, d)
        left /= np.linalg.norm(left, axis=1, keepdims=True)
        above = np.cross(d, left)
        angle = np.arcsin(self.cant / self.gauge)[:, None]
        return np.stack([np.cos(angle) * left + np.sin(angle) * above, np.cos(angle) * above - np.sin(angle) * left], 2)

    def sleepers(self, axes: Array) -> Piece:
        """Return a box under the rails at every sleeper distance; a long track shows fewer."""
        assert self.rail_height is not None  # __post_init__ has set it
        assert self.sleeper_distance is not None
        way = way_of(self.points)
        count = min(int(way[-1] / self.sleeper_distance) + 1, MOST_SLEEPERS)
        at = np.linspace(0.0, way[-1], count)
        middle = np.stack([np.interp(at, way, self.points[:, k]) for k in range(3)], axis=1)
        left = np.stack([np.interp(at, way, axes[:, k, 0]) for k in range(3)], axis=1)
        above = np.stack([np.interp(at, way, axes[:, k, 1]) for k in range(3)], axis=1)
        h = self.rail_height
        size = np.array([min(0.17 * self.gauge, 0.6 * self.sleeper_distance), 1.7 * self.gauge, 0.7 * h])
        box = box_piece(size, (0.0, 0.0, -1.35 * h))
        nodes = middle[:, None] + np.einsum(
            "sak,nk->sna", np.stack([np.cross(left, above), left, above], axis=2), box.nodes
        )
        starts = 8 * np.arange(count)
        return Piece(nodes.reshape(-1, 3), (box.triangles[None] + starts[:, None, None]).reshape(-1, 3))


def cants(given: Any, n: int) -> Array:
    """Return the cant at each point, (n,)."""
    if given is None or np.ndim(given) == 0:
        return np.full(n, 0.0 if given is None else number("track: cant", given))
    return array_of_shape("track: cant", given, (n,))


def way_of(points: Array) -> Array:
    """Return the arc length of a line at each of its points, (n,)."""
    return np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))]


def band(points: Array, up: Array, right: float, left: float, lift: float, color: str) -> Piece:
    """Return a strip along a curve, between two distances to the left of it."""
    d = along(points)
    side = np.cross(up, d)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    edges = [points + min(right, left) * side + lift * up, points + max(right, left) * side + lift * up]
    nodes = np.stack(edges, axis=1).reshape(-1, 3)
    return Piece(nodes, grid_triangles(len(points), 2), color=color, is_ground=True)


def dashes(points: Array, length: float, step: float, most: int = 600) -> list[Array]:
    """Return pieces of a line with a given length at every step."""
    way = way_of(points)
    step = max(step, way[-1] / most)
    found = []
    for start in np.arange(0.0, way[-1], step):
        end = min(start + length, way[-1])
        inside = way[(way > start) & (way < end)]
        at = np.r_[start, inside, end]
        if end - start > 1e-6 * length:
            found.append(np.stack([np.interp(at, way, points[:, k]) for k in range(3)], axis=1))
    return found
