"""The universal joint (Cardan, Hooke): two axes that intersect at right angles."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.copies import frozen_copies
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Place
from floatframe.model.functions.time_functions import TimeFunction
from floatframe.model.joints.axis_frame import checked_axes, checked_motions
from floatframe.model.joints.rows import DOT, MOMENT, Row, point_rows, turn_row, turn_row_b

__all__ = ["UniversalJoint"]


@frozen_copies
@dataclass(frozen=True, eq=False)
class UniversalJoint:
    """Joins two points, and keeps an axis of marker A normal to an axis of marker B; four constraints.

    Coordinates, zero as assembled: `angle` of the cross about the axis of A; `angle_b` of B relative to the cross about
    the axis of B.
    """

    name: str
    marker_a: Place
    marker_b: Place
    axis: Array = field(default_factory=lambda: np.array([1.0, 0.0, 0.0]))  #: in the axes of marker A, (3,)
    axis_b: Array = field(default_factory=lambda: np.array([0.0, 1.0, 0.0]))  #: in the axes of marker B, (3,)
    #: prescribed motions by coordinate; a number fixes the coordinate
    motions: Mapping[str, TimeFunction] = field(default_factory=dict)

    size = 6  #: components of the unknown wrench
    moment_b = MOMENT  #: index at which the moment on B starts in the wrench
    coordinates = ("angle", "angle_b")

    def __post_init__(self) -> None:
        checked_axes(self)
        checked_motions(self)

    def rows(self, A_a: Array, A_b: Array, d: Array) -> tuple[Row, ...]:
        """Return the rows for marker axes A_a, A_b, (3, 3), and r_B - r_A = d, (3,), ground axes, as assembled."""
        # angle zero is the assembled position: z of A lies along the axis of B
        z = A_a.T @ A_b @ self.axis_b
        z = z - (z @ self.axis) * self.axis
        if np.linalg.norm(z) < 1e-3:
            raise ModelError(f"joint {self.name!r}: expected axes at about a right angle as placed, got parallel ones")
        z = z / np.linalg.norm(z)
        frame = (np.cross(z, self.axis), z, self.axis_b)
        z_b = A_b.T @ A_a @ self.axis
        z_b = z_b - (z_b @ self.axis_b) * self.axis_b
        z_b = z_b / np.linalg.norm(z_b)
        return (
            *point_rows(),
            Row(DOT, self.axis, self.axis_b, part=MOMENT),
            turn_row(self.axis, frame, MOMENT, self.motions, "angle"),
            turn_row_b(self.axis, self.axis_b, z_b, self.motions, "angle_b"),
        )
