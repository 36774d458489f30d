"""The prismatic joint (slider): one translation along an axis."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.copies import frozen_copies
from floatframe.model.bodies.markers import Place
from floatframe.model.functions.time_functions import TimeFunction
from floatframe.model.joints.axis_frame import checked_axes, checked_motions, normals_of
from floatframe.model.joints.rows import MOMENT_B, SLIDE, Row, arm_rows, orientation_rows, slide_row

__all__ = ["PrismaticJoint"]


@frozen_copies
@dataclass(frozen=True, eq=False)
class PrismaticJoint:
    """Lets marker B slide along an axis of marker A without rotation; five constraints.

    The point of B stays on the line through the point of A. The fixed orientation is that of the assembled bodies.
    Coordinate `distance`: from the point of A to the point of B, along the axis.
    """

    name: str
    marker_a: Place
    marker_b: Place
    axis: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))  #: in the axes of marker A, (3,)
    #: prescribed motions by coordinate; a number fixes the coordinate
    motions: Mapping[str, TimeFunction] = field(default_factory=dict)

    size = 9  #: components of the unknown wrench
    moment_b = MOMENT_B  #: index at which the moment on B starts in the wrench
    coordinates = ("distance",)

    def __post_init__(self) -> None:
        checked_axes(self)
        checked_motions(self)

    def rows(self, A_a: Array, A_b: Array, d: Array) -> tuple[Row, ...]:
        """Return the rows for marker axes A_a, A_b, (3, 3), and r_B - r_A = d, (3,), ground axes, as assembled."""
        held = (Row(SLIDE, n) for n in normals_of(self.axis))
        return (
            *arm_rows(),
            *held,
            *orientation_rows(A_a.T @ A_b, MOMENT_B),
            slide_row(self.axis, self.motions, "distance"),
        )
