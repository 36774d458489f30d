"""The revolute joint (hinge): two markers share a point and an axis."""

from dataclasses import dataclass, field

import numpy as np

from cms.arrays import Array
from floatframe.arrays import unit_vector
from floatframe.joints.rows import DOT, GAUGE, Row, point_rows
from floatframe.markers import Place

__all__ = ["RevoluteJoint"]


@dataclass(frozen=True, eq=False)
class RevoluteJoint:
    """Leaves one rotation between two markers, about an axis; five constraints.

    The axis is given in the axes of marker A (those of the ground, if A is on the ground with the default triad).
    On B it is the same line as placed, unless `axis_b` gives it in the axes of marker B.
    """

    name: str
    marker_a: Place
    marker_b: Place
    axis: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))  #: in the axes of marker A, (3,)
    axis_b: Array | None = None  #: in the axes of marker B, (3,); None: as placed

    size = 6  #: components of the reaction: force, moment (none about the axis)

    def __post_init__(self) -> None:
        object.__setattr__(self, "axis", unit_vector(f"joint {self.name!r}: axis", self.axis))
        if self.axis_b is not None:
            object.__setattr__(self, "axis_b", unit_vector(f"joint {self.name!r}: axis_b", self.axis_b))

    def rows(self, A_a: Array, A_b: Array) -> tuple[Row, ...]:
        """Return the rows for marker axes A_a, A_b, (3, 3) in ground axes, as placed."""
        axis_b = A_b.T @ A_a @ self.axis if self.axis_b is None else self.axis_b
        normals = normals_of(axis_b)
        return (*point_rows(), *(Row(DOT, self.axis, n) for n in normals), Row(GAUGE, self.axis, np.zeros(3)))


def normals_of(axis: Array) -> tuple[Array, Array]:
    """Return two unit vectors normal to the axis and to each other, each (3,)."""
    helper = np.eye(3)[int(np.argmin(np.abs(axis)))]
    first = np.cross(axis, helper)
    first /= np.linalg.norm(first)
    return first, np.cross(axis, first)
