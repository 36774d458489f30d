"""The planar joint: motion in a plane."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.copies import frozen_copies
from floatframe.model.bodies.markers import Place
from floatframe.model.functions.time_functions import TimeFunction
from floatframe.model.joints.axis_frame import axis_in_b, checked_axes, checked_motions, normals_of, turning_frame
from floatframe.model.joints.rows import DOT, MOMENT_B, SLIDE, Row, arm_rows, slide_row, turn_row

__all__ = ["PlanarJoint"]


@frozen_copies
@dataclass(frozen=True, eq=False)
class PlanarJoint:
    """Keeps the point of marker B in a plane of marker A, with parallel normals; three constraints.

    Coordinates: `first` and `second`, the position of the point of B in the plane along the two directions of
    `normals_of(axis)`; `angle` of B about the normal, zero as assembled.
    """

    name: str
    marker_a: Place
    marker_b: Place
    axis: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))  #: normal, in the axes of marker A
    axis_b: Array | None = None  #: in the axes of marker B, (3,); None: as assembled
    #: prescribed motions by coordinate; a number fixes the coordinate
    motions: Mapping[str, TimeFunction] = field(default_factory=dict)

    size = 9  #: components of the unknown wrench
    moment_b = MOMENT_B  #: index at which the moment on B starts in the wrench
    coordinates = ("first", "second", "angle")

    def __post_init__(self) -> None:
        checked_axes(self)
        checked_motions(self)

    def rows(self, A_a: Array, A_b: Array, d: Array) -> tuple[Row, ...]:
        """Return the rows for marker axes A_a, A_b, (3, 3), and r_B - r_A = d, (3,), ground axes, as assembled."""
        axis_b = axis_in_b(self.axis, self.axis_b, A_a, A_b)
        first, second = normals_of(self.axis)
        return (
            *arm_rows(),
            Row(SLIDE, self.axis),
            *(Row(DOT, self.axis, n, part=MOMENT_B) for n in normals_of(axis_b)),
            slide_row(first, self.motions, "first"),
            slide_row(second, self.motions, "second"),
            turn_row(self.axis, turning_frame(self.axis, axis_b, A_a, A_b), MOMENT_B, self.motions, "angle"),
        )
