"""The picture of an element: shapes fixed to its markers, parts stretched between two markers, arrows.

`Element.drawn()` returns a tuple of these; markers are given by their indices in `Element.markers`.
"""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.errors import ModelError
from floatframe.model.checked_values import number
from floatframe.model.shapes.piece import Piece
from floatframe.model.shapes.rounds import revolved
from floatframe.model.shapes.shape import Shape, color_of
from floatframe.model.shapes.sweeps import carried_axes, swept

__all__ = ["STRETCHED", "Arrow", "MarkerShapes", "Stretched", "StretchedPiece"]

Z = np.array([0.0, 0.0, 1.0])
SPRING, OUTER, INNER = "#2a7f62", "#5d6f80", "#b9c3cc"
TURNS, A_TURN, WIRE = 7, 20, 8  #: numbers for a coil: turns, points per turn, points around the wire
STRETCH, FIRST, SECOND = "stretch", "first", "second"  #: ways in which a part follows its two markers


@dataclass(frozen=True, eq=False)
class MarkerShapes:
    """A shape in the axes of a marker of the element, or in ground axes."""

    shape: Shape
    marker: int | None = 0  #: index in `Element.markers`; None: fixed to the ground, such as a road or track
    is_default: bool = False  #: whether the shape is hidden if the body of its marker has its own shapes
    is_in_metres: bool = False  #: whether its numbers are in metres, whatever the units of the system


@dataclass(frozen=True, eq=False)
class Stretched:
    """A part between two markers: "coil", "strut" (a rod in a cylinder), "rod" (of constant thickness) or "line"."""

    kind: str = "coil"
    first: int = 0  #: index of the marker at its start
    second: int = 1  #: index of the marker at its end
    radius: float | None = None  #: radius of the part [m]; None: 0.06 of the assembled length
    color: str | None = None  #: colour; None: the default colour for its kind

    def __post_init__(self) -> None:
        if self.kind not in STRETCHED:
            raise ModelError(f"drawn: kind: expected one of {', '.join(STRETCHED)}, got {self.kind!r}")
        if self.radius is not None:
            object.__setattr__(self, "radius", number("drawn: radius", self.radius, above=0.0))
        if self.color is not None:
            object.__setattr__(self, "color", color_of(self.color))

    def pieces(self, length: float) -> "tuple[StretchedPiece, ...]":
        """Return the pieces of the part for an assembled length [m]."""
        return STRETCHED[self.kind](self.radius or 0.06 * length, length, self.color)


@dataclass(frozen=True, eq=False)
class Arrow:
    """An arrow at a marker for three outputs of the element, with proportional length."""

    #: names of the components in `ElementLaw.outputs`; None: the element's force on the marker's body
    outputs: tuple[str, str, str] | None = None
    marker: int = 0  #: index of the marker at which it starts
    is_in_marker_axes: bool = False  #: whether the components are in marker axes rather than ground axes
    #: outputs with the start position in ground axes; None: the position of the marker
    at: tuple[str, str, str] | None = None
    color: str = "#c2452d"


@dataclass(frozen=True, eq=False)
class StretchedPiece:
    """A piece of a part between two markers, drawn along z from the first marker.

    "stretch": z runs from 0 to 1 and is multiplied by the distance. "first", "second": z is a length from that marker
    towards the other.
    """

    piece: Piece
    follows: str


def coil(radius: float, length: float, color: str | None) -> tuple[StretchedPiece, ...]:
    """Return a coiled wire."""
    turn = np.linspace(0.0, 2 * np.pi * TURNS, TURNS * A_TURN + 1)
    along = np.linspace(0.06, 0.94, len(turn)) * length
    points = np.stack([radius * np.cos(turn), radius * np.sin(turn), along], axis=1)
    ends = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.03 * length]])
    points = np.concatenate([ends, points, np.array([0.0, 0.0, length]) - ends[::-1]])
    circle = 2 * np.pi * np.arange(WIRE) / WIRE
    wire = min(0.14 * radius, 0.02 * length) * np.stack([np.cos(circle), np.sin(circle)], axis=1)
    piece = swept(wire, points, carried_axes(points))
    nodes = piece.nodes / np.array([1.0, 1.0, length])
    return (StretchedPiece(Piece(nodes, piece.triangles, color=color or SPRING), STRETCH),)


def strut(radius: float, length: float, color: str | None) -> tuple[StretchedPiece, ...]:
    """Return a cylinder at the first marker and its rod at the second."""
    outer = revolved(tube_profile(0.8 * radius, 0.58 * length), Z, around=28, color=color or OUTER)
    inner = revolved(tube_profile(0.32 * radius, 0.62 * length), Z, around=20, color=INNER)
    return StretchedPiece(outer, FIRST), StretchedPiece(inner, SECOND)


def rod(radius: float, length: float, color: str | None) -> tuple[StretchedPiece, ...]:
    """Return a round bar."""
    return (StretchedPiece(revolved(tube_profile(radius, 1.0), Z, around=20, color=color or OUTER), STRETCH),)


def line(radius: float, length: float, color: str | None) -> tuple[StretchedPiece, ...]:
    """Return a straight line."""
    piece = Piece(np.array([[0.0, 0, 0], [0, 0, 1.0]]), segments=np.array([[0, 1]]), color=color or OUTER)
    return (StretchedPiece(piece, STRETCH),)


def tube_profile(radius: float, length: float) -> Array:
    """Return the profile of a closed cylinder."""
    return np.array([(0.0, 0.0), (radius, 0.0), (radius, length), (0.0, length)])


STRETCHED = {"coil": coil, "strut": strut, "rod": rod, "line": line}
