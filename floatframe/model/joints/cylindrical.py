"""The cylindrical joint: translation along an axis and rotation about it."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.copies import frozen_copies
from floatframe.model.bodies.markers import Place
from floatframe.model.functions.time_functions import TimeFunction
from floatframe.model.joints.axis_frame import axis_in_b, checked_axes, checked_motions, normals_of, turning_frame
from floatframe.model.joints.rows import DOT, MOMENT_B, SLIDE, Row, arm_rows, slide_row, turn_row

__all__ = ["CylindricalJoint"]


@frozen_copies
@dataclass(frozen=True, eq=False)
class CylindricalJoint:
    """Lets marker B slide along an axis and rotate about it; four constraints.

    The point of B stays on the line through the point of A. Coordinates: `distance` between the points along the axis;
    `angle` of B about it, zero as assembled.
    """

    name: str
    marker_a: Place
    marker_b: Place
    axis: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))  #: in the axes of marker A, (3,)
    axis_b: Array | None = None  #: in the axes of marker B, (3,); None: as assembled
    #: prescribed motions by coordinate; a number fixes the coordinate
    motions: Mapping[str, TimeFunction] = field(default_factory=dict)

    size = 9  #: components of the unknown wrench
    moment_b = MOMENT_B  #: index at which the moment on B starts in the wrench
    coordinates = ("distance", "angle")

    def __post_init__(self) -> None:
        checked_axes(self)
        checked_motions(self)

    def rows(self, A_a: Array, A_b: Array, d: Array) -> tuple[Row, ...]:
        """Return the rows for marker axes A_a, A_b, (3, 3), and r_B - r_A = d, (3,), ground axes, as assembled."""
        axis_b = axis_in_b(self.axis, self.axis_b, A_a, A_b)
        frame = turning_frame(self.axis, axis_b, A_a, A_b)
        return (
            *arm_rows(),
            *(Row(SLIDE, n) for n in normals_of(self.axis)),
            *(Row(DOT, self.axis, n, part=MOMENT_B) for n in normals_of(axis_b)),
            slide_row(self.axis, self.motions, "distance"),
            turn_row(self.axis, frame, MOMENT_B, self.motions, "angle"),
        )
