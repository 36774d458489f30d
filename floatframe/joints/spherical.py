"""The spherical joint: two markers share a point."""

from dataclasses import dataclass

from cms.arrays import Array
from floatframe.joints.rows import Row, point_rows
from floatframe.markers import Place

__all__ = ["SphericalJoint"]


@dataclass(frozen=True, eq=False)
class SphericalJoint:
    """Holds the point of marker B at the point of marker A; three constraints."""

    name: str
    marker_a: Place
    marker_b: Place

    size = 3  #: components of the reaction: force

    def rows(self, A_a: Array, A_b: Array) -> tuple[Row, ...]:
        """Return the rows; the axes of the markers do not matter."""
        return point_rows()
