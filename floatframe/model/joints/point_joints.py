"""Joints that constrain the position of a point: on a line, on a plane, at a distance.

Evaluated in `floatframe.engine.kernels.joints.row_formulas`.
"""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array, GivenArray, given
from fe_models.foundation.records import checked_fields, frozen_copies
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Place
from floatframe.model.checked_values import number
from floatframe.model.joints.axis_frame import AxisJoint, GivenMotions, checked_motions, given_motions, normals_of
from floatframe.model.joints.joint import Joint
from floatframe.model.joints.rows import DISTANCE, NO_MOMENT, ROD, SLIDE, SPAN, Row, RowCoordinate, arm_rows, slide_row

__all__ = ["DistanceJoint", "PointOnLine", "PointOnPlane"]


# a point of one body on a line of another -----------------------------------------------------------------------------


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class PointOnLine(AxisJoint):
    """Keeps the point of marker B on a line through the point of marker A; two constraints.

    Coordinate `distance`: from the point of A to the point of B, along the line.

    Parameters
    ----------
    name
        Name of the joint, unique in the system.
    marker_a, marker_b
        The two markers; a body, or its name, is attached where the other marker is.
    axis
        Direction of the axis, in the axes of marker A, (3,).
    motions
        Prescribed motions by coordinate; a number fixes the coordinate.
    """

    name: str
    marker_a: Place
    marker_b: Place
    axis: GivenArray = given((0.0, 0.0, 1.0))
    motions: GivenMotions = given_motions()

    size = 6  #: components of the unknown wrench
    moment_b = NO_MOMENT  #: index at which the moment on B starts in the wrench
    coordinates = ("distance",)

    def rows(self, A_a: Array, A_b: Array, d: Array) -> tuple[Row, ...]:
        """Return the rows for the assembled axes of the markers, (3, 3), and d = r_B - r_A, (3,), in ground axes."""
        held = (Row(SLIDE, n) for n in normals_of(self.axis))
        return (*arm_rows(), *held, slide_row(self.axis, self.motions, "distance"))


# a point of one body on a plane of another ----------------------------------------------------------------------------


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class PointOnPlane(AxisJoint):
    """Keeps the point of marker B on a plane through the point of marker A; one constraint.

    Coordinates: `first` and `second`, the position of the point of B in the plane along the two directions of
    `normals_of(axis)`.

    Parameters
    ----------
    name
        Name of the joint, unique in the system.
    marker_a, marker_b
        The two markers; a body, or its name, is attached where the other marker is.
    axis
        Normal, in the axes of marker A.
    motions
        Prescribed motions by coordinate; a number fixes the coordinate.
    """

    name: str
    marker_a: Place
    marker_b: Place
    axis: GivenArray = given((0.0, 0.0, 1.0))
    motions: GivenMotions = given_motions()

    size = 6  #: components of the unknown wrench
    moment_b = NO_MOMENT  #: index at which the moment on B starts in the wrench
    coordinates = ("first", "second")

    def rows(self, A_a: Array, A_b: Array, d: Array) -> tuple[Row, ...]:
        """Return the rows for the assembled axes of the markers, (3, 3), and d = r_B - r_A, (3,), in ground axes."""
        first, second = normals_of(self.axis)
        free = (slide_row(first, self.motions, "first"), slide_row(second, self.motions, "second"))
        return (*arm_rows(), Row(SLIDE, self.axis), *free)


# the distance joint: two points at a constant distance ----------------------------------------------------------------


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class DistanceJoint(Joint):
    """Keeps the points of two markers at a distance, like a massless rod; one constraint.

    Coordinate `distance`.

    Parameters
    ----------
    name
        Name of the joint, unique in the system.
    marker_a, marker_b
        The two markers; a body, or its name, is attached where the other marker is.
    distance
        Constrained distance [m]; None: as assembled.
    motions
        Prescribed motions by coordinate; a number fixes the coordinate.
    """

    name: str
    marker_a: Place
    marker_b: Place
    distance: float | None = None
    motions: GivenMotions = given_motions()

    size = 4  #: components of the unknown wrench
    moment_b = NO_MOMENT  #: index at which the moment on B starts in the wrench
    coordinates = ("distance",)

    def __post_init__(self) -> None:
        if self.distance is not None:
            value = number(f"joint {self.name!r}: distance", self.distance, above=0.0)
            object.__setattr__(self, "distance", value)
        checked_motions(self)

    def rows(self, A_a: Array, A_b: Array, d: Array) -> tuple[Row, ...]:
        """Return the rows for markers assembled with r_B - r_A = d, (3,), in ground axes."""
        distance = float(np.linalg.norm(d)) if self.distance is None else self.distance
        if np.linalg.norm(d) == 0:
            raise ModelError(
                f"joint {self.name!r}: its points coincide as placed, so that the rod has no direction; move one, or "
                "use a spherical joint"
            )
        own = RowCoordinate("distance", SPAN)
        held = Row(DISTANCE, c=distance, motion=self.motions.get("distance"), coordinate=own)
        return (*(Row(ROD, axis) for axis in np.eye(3)), held)
