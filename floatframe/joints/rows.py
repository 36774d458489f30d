"""The rows of which joints are made: every joint is a short list of them, and the kernels know only rows.

A joint between markers A and B has as unknown the wrench w that acts on A (and its opposite on B), in ground axes:
a force (3), or a force and a moment (6). Each joint has as many rows as unknowns, so that no row of a body depends
on another body and bodies can be eliminated one by one with the exact tangent:

    POINT k    r_A - r_B = 0, component k in ground axes          closes a point
    DOT x y    (A_A x) · (A_B y) - c = 0                          closes an angle
    GAUGE x    (A_A x) · moment = 0                               no moment about a free axis
"""

from dataclasses import dataclass

import numpy as np

from cms.arrays import Array

__all__ = ["DOT", "GAUGE", "POINT", "SPRING", "Row", "point_rows"]

POINT, DOT, GAUGE, SPRING = 0, 1, 2, 3  #: codes of the kinds in the kernels; SPRING rows belong to spring-dampers


@dataclass(frozen=True, eq=False)
class Row:
    """One row of a joint."""

    kind: int
    x: Array  #: direction in the axes of marker A, (3,); for POINT the ground axis
    y: Array  #: direction in the axes of marker B, (3,)
    c: float = 0.0  #: value of the product that is held


def point_rows() -> tuple[Row, ...]:
    """Return the three rows that hold the points of two markers together."""
    return tuple(Row(POINT, axis, np.zeros(3)) for axis in np.eye(3))
