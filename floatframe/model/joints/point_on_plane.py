"""A point of one body on a plane of another."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.copies import frozen_copies
from floatframe.model.bodies.markers import Place
from floatframe.model.functions.time_functions import TimeFunction
from floatframe.model.joints.axis_frame import checked_axes, checked_motions, normals_of
from floatframe.model.joints.rows import NO_MOMENT, SLIDE, Row, arm_rows, slide_row

__all__ = ["PointOnPlane"]


@frozen_copies
@dataclass(frozen=True, eq=False)
class PointOnPlane:
    """Keeps the point of marker B on a plane through the point of marker A; one constraint.

    Coordinates: `first` and `second`, the position of the point of B in the plane along the two directions of
    `normals_of(axis)`.
    """

    name: str
    marker_a: Place
    marker_b: Place
    axis: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))  #: normal, in the axes of marker A
    #: prescribed motions by coordinate; a number fixes the coordinate
    motions: Mapping[str, TimeFunction] = field(default_factory=dict)

    size = 6  #: components of the unknown wrench
    moment_b = NO_MOMENT  #: index at which the moment on B starts in the wrench
    coordinates = ("first", "second")

    def __post_init__(self) -> None:
        checked_axes(self)
        checked_motions(self)

    def rows(self, A_a: Array, A_b: Array, d: Array) -> tuple[Row, ...]:
        """Return the rows for marker axes A_a, A_b, (3, 3), and r_B - r_A = d, (3,), ground axes, as assembled."""
        first, second = normals_of(self.axis)
        free = (slide_row(first, self.motions, "first"), slide_row(second, self.motions, "second"))
        return (*arm_rows(), Row(SLIDE, self.axis), *free)
