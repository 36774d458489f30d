"""The spherical joint: two markers have a common point."""

from dataclasses import dataclass

from fe_models.foundation.arrays import Array
from fe_models.foundation.copies import frozen_copies
from floatframe.model.bodies.markers import Place
from floatframe.model.joints.rows import NO_MOMENT, Row, point_rows

__all__ = ["SphericalJoint"]


@frozen_copies
@dataclass(frozen=True, eq=False)
class SphericalJoint:
    """Holds the point of marker B at the point of marker A; three constraints."""

    name: str
    marker_a: Place
    marker_b: Place

    size = 3  #: components of the unknown wrench: force
    moment_b = NO_MOMENT  #: no moment acts
    coordinates = ()

    def rows(self, A_a: Array, A_b: Array, d: Array) -> tuple[Row, ...]:
        """Return the rows; axes and positions of the markers do not matter."""
        return point_rows()
