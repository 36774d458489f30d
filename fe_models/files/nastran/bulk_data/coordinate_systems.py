"""Coordinate systems of Nastran (CORD1R to CORD2S) and grid points: positions and displacement axes in basic axes."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from fe_models.errors import MeshError
from fe_models.files.nastran.bulk_data.cards import Card
from fe_models.foundation.arrays import Array

__all__ = ["CoordinateSystem", "GridPoints", "read_grid_points"]

#: smallest sine of the angle between the z axis and the direction to the point that defines the xz plane
SMALLEST_SINE = 1e-6
SYSTEM_CARDS = tuple(f"CORD{kind}{shape}" for kind in "12" for shape in "RCS")


@dataclass(frozen=True, eq=False)
class CoordinateSystem:
    """A rectangular ("R"), cylindrical ("C") or spherical ("S") system, its frame in basic axes."""

    shape: str
    origin: Array  #: origin in basic axes, (3,)
    axes: Array  #: axes x, y, z as columns in basic axes, (3, 3)

    def place(self, coordinates: Array) -> Array:
        """Return the basic position, (3,), of (x, y, z), (r, theta, z) or (r, theta, phi), with angles in degrees."""
        a, b, c = coordinates
        if self.shape == "R":
            local = np.array([a, b, c])
        elif self.shape == "C":
            local = np.array([a * np.cos(np.radians(b)), a * np.sin(np.radians(b)), c])
        else:
            r_xy = a * np.sin(np.radians(b))
            local = np.array([r_xy * np.cos(np.radians(c)), r_xy * np.sin(np.radians(c)), a * np.cos(np.radians(b))])
        return np.asarray(self.origin + self.axes @ local)

    def axes_at(self, point: Array) -> Array:
        """Return the displacement directions at a point as columns in basic axes, (3, 3).

        They turn with the point in cylindrical and spherical systems; on the z axis the radius points along x.
        """
        if self.shape == "R":
            return self.axes
        x, y, z = self.axes.T @ (np.asarray(point, dtype=float) - self.origin)
        r_xy = np.hypot(x, y)
        cos, sin = (x / r_xy, y / r_xy) if r_xy > 0 else (1.0, 0.0)
        around = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])  # columns e_r, e_theta, e_z
        if self.shape == "C":
            return self.axes @ around
        r = np.hypot(r_xy, z)
        up, out = (z / r, r_xy / r) if r > 0 else (1.0, 0.0)
        e_r = out * around[:, 0] + up * around[:, 2]
        e_theta = up * around[:, 0] - out * around[:, 2]
        return self.axes @ np.stack([e_r, e_theta, around[:, 1]], axis=1)


BASIC = CoordinateSystem("R", np.zeros(3), np.eye(3))


@dataclass(frozen=True, eq=False)
class GridPoints:
    """Grid points of a model."""

    positions: dict[int, Array] = field(default_factory=dict)  #: position of each grid point in basic axes, (3,)
    #: displacement axes of a grid point as columns, (3, 3); grid points with basic axes are omitted
    axes: dict[int, Array] = field(default_factory=dict)
    #: coordinate systems by id; 0 is the basic system
    systems: dict[int, CoordinateSystem] = field(default_factory=dict)


def read_grid_points(cards: Iterable[Card], *, only_positions: bool = False) -> GridPoints:
    """Return the grid points of GRID and GRDSET cards in the systems of CORD cards.

    Repeated cards with the same fields count once. With `only_positions`, displacement axes (CD) and systems that no
    position depends on are ignored.

    Raises
    ------
    MeshError
        If two cards with the same number differ, a system or a grid point is missing or its definition depends on
        itself, or the points of a system lie on one line.
    """
    resolver = _Resolver(tuple(cards))
    if not only_positions:
        return resolver.all()
    return GridPoints({number: resolver.place(number, card.where) for number, card in resolver.grids.items()})


class _Resolver:
    """Resolver of systems and grid points that refer to each other; each is computed when it is needed."""

    def __init__(self, cards: tuple[Card, ...]) -> None:
        self.grids: dict[int, Card] = {}
        self.definitions: dict[int, tuple[Card, int]] = {}  # id -> card, first field of it
        self.done: dict[int, CoordinateSystem] = {0: BASIC}
        self.places: dict[int, Array] = {}
        self.open: list[str] = []
        self.default_cp = self.default_cd = 0
        for card in cards:
            if card.name == "GRID":
                old = self.grids.setdefault(card.integer(1), card)
                if old.fields[:8] != card.fields[:8] and not _alike(old, card):
                    raise MeshError(f"{card.where} {card.text(1)}: is defined otherwise at {old.where}; keep one")
            elif card.name == "GRDSET":
                self.default_cp, self.default_cd = card.integer(2, 0), card.integer(6, 0)
            elif card.name in SYSTEM_CARDS:
                firsts = (1, 5) if card.name[4] == "1" and card.text(5) else (1,)
                for first in firsts:
                    old_card, _ = self.definitions.setdefault(card.integer(first), (card, first))
                    if old_card is not card and not _alike(old_card, card):
                        raise MeshError(
                            f"{card.where} {card.text(first)}: is defined otherwise at {old_card.where}; keep one"
                        )

    def all(self) -> GridPoints:
        """Compute all grid points and systems."""
        axes = {}
        for number, card in self.grids.items():
            place = self.place(number, card.where)
            cd = card.integer(6, self.default_cd)
            if cd > 0:
                axes[number] = self.system(cd, card.where).axes_at(place)
        for number, (card, _) in self.definitions.items():
            self.system(number, card.where)
        return GridPoints(self.places, axes, self.done)

    def place(self, number: int, asked_by: str) -> Array:
        """Return the position of a grid point."""
        if number not in self.places:
            if number not in self.grids:
                raise MeshError(f"{asked_by}: needs grid point {number}, which is not defined")
            card = self.grids[number]
            self._enter(f"GRID {number}", card)
            given = np.array([card.real(k, 0.0) for k in (3, 4, 5)])
            system = self.system(card.integer(2, self.default_cp), card.where)
            self.places[number] = given if system is BASIC else system.place(given)
            self.open.pop()
        return self.places[number]

    def system(self, number: int, asked_by: str) -> CoordinateSystem:
        """Return a coordinate system, and compute it if necessary."""
        if number not in self.done:
            if number not in self.definitions:
                raise MeshError(f"{asked_by}: needs coordinate system {number}, which is not defined")
            card, first = self.definitions[number]
            self._enter(f"{card.name} {number}", card)
            if card.name[4] == "1":
                A, B, C = (self.place(card.integer(first + k), card.where) for k in (1, 2, 3))
            else:
                given = np.array([card.real(k, 0.0) for k in range(3, 12)]).reshape(3, 3)
                reference = self.system(card.integer(2, 0), card.where)
                A, B, C = (reference.place(point) for point in given)
            self.done[number] = CoordinateSystem(card.name[5], A, _axes(card, number, A, B, C))
            self.open.pop()
        return self.done[number]

    def _enter(self, name: str, card: Card) -> None:
        if name in self.open:
            raise MeshError(f"{card.where}: {name} is defined by itself, by way of {' and '.join(self.open)}")
        self.open.append(name)


def _axes(card: Card, number: int, A: Array, B: Array, C: Array) -> Array:
    """Return axes as columns, (3, 3), with z from A to B and with C in the xz plane."""
    z, in_plane = B - A, C - A
    y = np.cross(z, in_plane)
    if not np.linalg.norm(y) > SMALLEST_SINE * np.linalg.norm(z) * np.linalg.norm(in_plane):
        raise MeshError(f"{card.where} {number}: its points lie on one line; expected A, B on z, C in the xz plane")
    z, y = z / np.linalg.norm(z), y / np.linalg.norm(y)
    return np.stack([np.cross(y, z), y, z], axis=1)


def _alike(card: Card, other: Card) -> bool:
    """Return whether two cards have the same content, however their numbers are written."""
    if card.name != other.name:
        return False
    for k in range(1, max(len(card.fields), len(other.fields)) + 1):
        if card.text(k) != other.text(k):
            try:
                if card.real(k, 0.0) != other.real(k, 0.0):
                    return False
            except MeshError:
                return False
    return True
