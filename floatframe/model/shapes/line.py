"""A line of points: a cable, a wire, an outline."""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.model.shapes.piece import Piece
from floatframe.model.shapes.sweeps import points_3

__all__ = ["Line"]


@dataclass(frozen=True, eq=False)
class Line:
    """Straight lines from point to point."""

    points: Array  #: (n, 3) [m]
    is_closed: bool = False  #: whether the last point is connected to the first

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", points_3("line: points", self.points, 2))

    def pieces(self) -> tuple[Piece, ...]:
        """Return its lines."""
        n = len(self.points)
        ends = np.stack([np.arange(n), np.arange(1, n + 1) % n], axis=1)
        return (Piece(self.points, segments=ends if self.is_closed else ends[:-1]),)
