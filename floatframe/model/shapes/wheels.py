"""Wheels with tyre, rim and spokes, and railway wheels with tread and flange; marks make their rotation visible."""

from dataclasses import dataclass, field

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.errors import ModelError
from floatframe.model.checked_values import number, unit_vector
from floatframe.model.shapes.piece import Piece, joined
from floatframe.model.shapes.prisms import box_piece
from floatframe.model.shapes.rounds import axes_about, revolved

__all__ = ["RailWheel", "Wheel"]

TYRE, TREAD, RIM, HUB, MARK = "#30343a", "#24272b", "#c4cbd2", "#8d98a3", "#f2f4f6"
STEEL, TREAD_STEEL = "#6f7a85", "#aab3bb"


@dataclass(frozen=True, eq=False)
class Wheel:
    """A tyre with rim, hub and spokes about its axis, with its centre at the origin."""

    radius: float  #: radius of the tread [m]
    width: float  #: width of the tyre [m]
    rim_radius: float | None = None  #: radius of the rim [m]; None: 0.64 of the radius
    n_spokes: int = 5  #: number of spokes, 0 to 60
    axis: Array = field(default_factory=lambda: np.array([0.0, 1.0, 0.0]))  #: axis of rotation, (3,)

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "radius", number("wheel: radius", self.radius, above=0.0))
        put(self, "width", number("wheel: width", self.width, above=0.0))
        put(self, "axis", unit_vector("wheel: axis", self.axis))
        if self.rim_radius is not None:
            put(self, "rim_radius", number("wheel: rim_radius", self.rim_radius, above=0.0))
            if self.rim_radius >= self.radius:
                raise ModelError(f"wheel: rim_radius: expected less than the radius {self.radius:g}, "
                                 f"got {self.rim_radius:g}")  # fmt: skip
        if isinstance(self.n_spokes, bool) or not isinstance(self.n_spokes, int) or not 0 <= self.n_spokes <= 60:
            raise ModelError(f"wheel: n_spokes: expected a whole number from 0 to 60, got {self.n_spokes!r}")

    def pieces(self) -> tuple[Piece, ...]:
        """Return tyre with grooves and a mark on both sides, rim, spokes and hub."""
        R, w = self.radius, self.width / 2
        r = 0.64 * R if self.rim_radius is None else self.rim_radius
        h = R - r
        side = [(r, 0.78), (r + 0.06 * h, 0.9), (r + 0.5 * h, 1.0), (R - 0.2 * h, 0.95), (R - 0.05 * h, 0.84)]
        tyre = [(a, b * w) for a, b in side]
        tyre = [(a, -b) for a, b in tyre] + tread(R, 0.72 * w, 0.05 * h) + tyre[::-1]
        barrel = [(r, -0.8 * w), (r, 0.8 * w), (0.93 * r, 0.78 * w), (0.89 * r, 0.0), (0.93 * r, -0.78 * w)]
        hub = [(0.0, -0.42 * w), (0.2 * r, -0.42 * w), (0.2 * r, 0.42 * w), (0.0, 0.42 * w)]
        found = [
            revolved(np.array(tyre), self.axis, around=64, color=TYRE),
            revolved(np.array(barrel), self.axis, is_closed=True, color=RIM),
            revolved(np.array(hub), self.axis, color=HUB),
        ]
        if self.n_spokes:
            found.append(self.spokes(r, w))
        marks = [arc_mark(self.axis, r + 0.55 * h, 0.1 * h, s * 1.005 * w, 0.25) for s in (-1, 1)]
        return (*found, joined(marks))

    def spokes(self, r: float, w: float) -> Piece:
        """Return the spokes of the wheel."""
        thickness = max(0.1, 0.9 / self.n_spokes) * r * 0.4
        spoke = box_piece(np.array([0.75 * r, thickness, 0.34 * w]), (0.54 * r, 0.0, 0.0), RIM)
        return around(spoke, self.axis, self.n_spokes)


@dataclass(frozen=True, eq=False)
class RailWheel:
    """A railway wheel: conical tread with flange, web, hub, and marks that show its rotation."""

    radius: float  #: radius of the tread at the origin [m]
    flange_side: int = 1  #: 1: flange at the end to which the axis points, -1: at the other end, 0: no flange
    width: float | None = None  #: width of the wheel [m]; None: 0.3 of the radius
    flange_height: float | None = None  #: height of the flange [m]; None: 0.06 of the radius
    conicity: float = 0.05  #: conicity of the drawn tread
    axis: Array = field(default_factory=lambda: np.array([0.0, 1.0, 0.0]))  #: axis of rotation, (3,)

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "radius", number("rail-wheel: radius", self.radius, above=0.0))
        for name, share in (("width", 0.3), ("flange_height", 0.06)):
            given = getattr(self, name)
            put(self, name, share * self.radius if given is None else number(f"rail-wheel: {name}", given, above=0.0))
        put(self, "conicity", number("rail-wheel: conicity", self.conicity, at_least=0.0))
        put(self, "axis", unit_vector("rail-wheel: axis", self.axis))
        if self.flange_side not in (-1, 0, 1):
            raise ModelError(f"rail-wheel: flange_side: expected 1, -1 or 0, got {self.flange_side!r}")

    def pieces(self) -> tuple[Piece, ...]:
        """Return tyre with flange, web with hub, and marks on both sides."""
        assert self.width is not None  # __post_init__ has set it
        assert self.flange_height is not None
        R, w, f, s = self.radius, self.width, self.flange_height, self.flange_side or 1
        out, at_flange, inside = -0.5 * w, 0.28 * w, 0.5 * w
        cone = self.conicity
        tread_ = [(R + cone * w * 0.1 - cone * (0 - out) * 1.5, out), (R, 0.0), (R + cone * at_flange, at_flange)]
        if self.flange_side:
            tread_ += [(R + 0.5 * f, 0.33 * w), (R + 0.95 * f, 0.37 * w), (R + f, 0.41 * w), (R + 0.8 * f, 0.46 * w)]
        else:
            tread_ += [(R + cone * inside, inside)]
        tyre = [(0.86 * R, out), *tread_, (R, inside), (0.86 * R, inside)]
        half = [(0.0, 0.62), (0.2, 0.62), (0.24, 0.2), (0.8, 0.16), (0.87, 0.3)]
        web = [(a * R, -b * w) for a, b in half] + [(a * R, b * w) for a, b in half[::-1]]
        turned = [(np.array(points) * np.array([1.0, s]))[::s] for points in (tyre, web)]
        found = [
            revolved(turned[0], self.axis, is_closed=True, around=72, color=TREAD_STEEL),
            revolved(turned[1], self.axis, color=STEEL),
        ]
        marks = [
            arc_mark(self.axis, 0.93 * R, 0.05 * R, side * 0.508 * w, 0.16, phase=k * np.pi / 2)
            for k in range(4)
            for side in (-1, 1)
        ]
        return (*found, joined(marks))


def tread(R: float, half: float, depth: float) -> list[tuple[float, float]]:
    """Return the profile of a tread with three grooves."""
    found = [(R, -half)]
    for middle in (-0.5 * half, 0.0, 0.5 * half):
        a, b = middle - 0.06 * half, middle + 0.06 * half
        found += [(R, a), (R - depth, a), (R - depth, b), (R, b)]
    return [*found, (R, half)]


def around(piece: Piece, axis: Array, n: int) -> Piece:
    """Return a piece drawn radially along x and axially along z, repeated about an axis."""
    x, y, z = axes_about(axis)
    copies = []
    for k in range(n):
        angle = 2 * np.pi * k / n
        radial, tangent = np.cos(angle) * x + np.sin(angle) * y, np.cos(angle) * y - np.sin(angle) * x
        copies.append(Piece(piece.nodes @ np.stack([radial, tangent, z]), piece.triangles, color=piece.color))
    return joined(copies)


def arc_mark(axis: Array, r: float, half: float, place: float, angle: float, phase: float = 0.0) -> Piece:
    """Return a flat piece of a ring normal to an axis, visible from both sides."""
    x, y, z = axes_about(axis)
    turns = phase + np.linspace(-angle / 2, angle / 2, 5)
    ring = np.cos(turns)[:, None] * x + np.sin(turns)[:, None] * y
    nodes = np.concatenate([(r - half) * ring, (r + half) * ring]) + place * z
    k = np.arange(4)
    front = np.concatenate([np.stack([k, k + 5, k + 6], axis=1), np.stack([k, k + 6, k + 1], axis=1)])
    return Piece(nodes, front if place > 0 else front[:, ::-1], color=MARK)
