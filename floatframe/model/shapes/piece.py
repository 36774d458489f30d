"""A piece of a drawing: triangles, or lines, of one colour."""

from dataclasses import dataclass, field, replace

import numpy as np

from fe_models.foundation.arrays import Array, IntArray

__all__ = ["Piece", "joined", "shifted"]


@dataclass(frozen=True, eq=False)
class Piece:
    """Triangles or lines of one colour, in the axes of the object that carries them."""

    nodes: Array  #: nodes of the piece, (n, 3) [m]
    #: node indices of each triangle, anticlockwise when seen from outside
    triangles: IntArray = field(default_factory=lambda: np.zeros((0, 3), np.int64))
    segments: IntArray = field(default_factory=lambda: np.zeros((0, 2), np.int64))  #: node indices of line segments
    color: str = ""  #: colour "#rrggbb"; "": the colour of the shape or of its carrier
    opacity: float = 1.0
    is_ground: bool = False  #: whether the piece is ignored for the size of the picture


def shifted(piece: Piece, position: Array, R: Array) -> Piece:
    """Return the piece rotated by R, (3, 3), then moved by position, (3,)."""
    return replace(piece, nodes=piece.nodes @ np.asarray(R).T + np.asarray(position))


def joined(pieces: list[Piece]) -> Piece:
    """Return several pieces as one piece with the colour of the first."""
    starts = np.cumsum([0, *(len(piece.nodes) for piece in pieces)])
    return replace(
        pieces[0],
        nodes=np.concatenate([piece.nodes for piece in pieces]),
        triangles=np.concatenate([piece.triangles + s for piece, s in zip(pieces, starts, strict=False)]),
        segments=np.concatenate([piece.segments + s for piece, s in zip(pieces, starts, strict=False)]),
    )
