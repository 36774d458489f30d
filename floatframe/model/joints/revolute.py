"""The revolute joint (hinge): two markers share a point and an axis."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.copies import frozen_copies
from floatframe.model.bodies.markers import Place
from floatframe.model.functions.time_functions import TimeFunction
from floatframe.model.joints.axis_frame import axis_in_b, checked_axes, checked_motions, normals_of, turning_frame
from floatframe.model.joints.rows import DOT, MOMENT, Row, point_rows, turn_row

__all__ = ["RevoluteJoint"]


@frozen_copies
@dataclass(frozen=True, eq=False)
class RevoluteJoint:
    """Allows one rotation between two markers, about an axis; five constraints.

    The axis is given in the axes of marker A (the ground axes, if A is on the ground with the default triad). On B it
    is the same line as assembled, unless `axis_b` gives it in the axes of marker B. Coordinate `angle`: of B about the
    axis, zero as assembled.
    """

    name: str
    marker_a: Place
    marker_b: Place
    axis: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))  #: in the axes of marker A, (3,)
    axis_b: Array | None = None  #: in the axes of marker B, (3,); None: as assembled
    #: prescribed motions by coordinate; a number fixes the coordinate
    motions: Mapping[str, TimeFunction] = field(default_factory=dict)

    size = 6  #: components of the unknown wrench
    moment_b = MOMENT  #: index at which the moment on B starts in the wrench
    coordinates = ("angle",)

    def __post_init__(self) -> None:
        checked_axes(self)
        checked_motions(self)

    def rows(self, A_a: Array, A_b: Array, d: Array) -> tuple[Row, ...]:
        """Return the rows for marker axes A_a, A_b, (3, 3), and r_B - r_A = d, (3,), ground axes, as assembled."""
        axis_b = axis_in_b(self.axis, self.axis_b, A_a, A_b)
        frame = turning_frame(self.axis, axis_b, A_a, A_b)
        held = (Row(DOT, self.axis, n, part=MOMENT) for n in normals_of(axis_b))
        return (*point_rows(), *held, turn_row(self.axis, frame, MOMENT, self.motions, "angle"))
