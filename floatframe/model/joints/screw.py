"""The screw joint: rotation about an axis, and translation along it in a fixed ratio."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.copies import frozen_copies
from fe_models.foundation.units import LENGTH, Quantity
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Place
from floatframe.model.checked_values import number
from floatframe.model.functions.time_functions import TimeFunction
from floatframe.model.joints.axis_frame import axis_in_b, checked_axes, checked_motions, normals_of, turning_frame
from floatframe.model.joints.rows import (
    DOT,
    FORCE,
    MOMENT_B,
    PUSH,
    SCREW,
    SLIDE,
    THREAD,
    TURN,
    TWIST,
    Row,
    RowCoordinate,
    arm_rows,
)

__all__ = ["ScrewJoint"]

METRE = Quantity(1.0, LENGTH)


@frozen_copies
@dataclass(frozen=True, eq=False)
class ScrewJoint:
    """Lets marker B rotate about an axis and slide along it by `lead` for each turn; five constraints.

    The point of B stays on the line through the point of A. Coordinates: `angle` of B about the axis, zero as
    assembled; `distance` = lead angle/(2 pi) between the points along the axis. The points must coincide as assembled.
    """

    name: str
    marker_a: Place
    marker_b: Place
    axis: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))  #: in the axes of marker A, (3,)
    axis_b: Array | None = None  #: in the axes of marker B, (3,); None: as assembled
    lead: float = METRE  #: distance along the axis per turn; positive for a right-handed screw [m]
    #: prescribed motions by coordinate; a number fixes the coordinate
    motions: Mapping[str, TimeFunction] = field(default_factory=dict)

    size = 9  #: components of the unknown wrench
    moment_b = MOMENT_B  #: index at which the moment on B starts in the wrench
    coordinates = ("angle", "distance")

    def __post_init__(self) -> None:
        checked_axes(self)
        lead = number(f"joint {self.name!r}: lead", self.lead)
        if lead == 0:
            raise ModelError(f"joint {self.name!r}: lead: expected a number other than zero; use a revolute joint")
        object.__setattr__(self, "lead", lead)
        checked_motions(self)

    def rows(self, A_a: Array, A_b: Array, d: Array) -> tuple[Row, ...]:
        """Return the rows for marker axes A_a, A_b, (3, 3), and r_B - r_A = d, (3,), ground axes, as assembled."""
        axis_b = axis_in_b(self.axis, self.axis_b, A_a, A_b)
        x, z, y = turning_frame(self.axis, axis_b, A_a, A_b)
        slope = self.lead / (2 * np.pi)
        if len(self.motions) > 1:
            raise ModelError(f"joint {self.name!r}: motions: expected angle or distance, which follows it, got both")
        angle = RowCoordinate("angle", TWIST, x, y, z, parts=((MOMENT_B, 1.0), (FORCE, slope)))
        distance = RowCoordinate("distance", PUSH, self.axis, parts=((FORCE, 1.0), (MOMENT_B, 1 / slope)))
        other = angle if "distance" in self.motions else distance  # it depends on the coordinate of the last row
        if "distance" in self.motions:
            drive = Row(SLIDE, self.axis, motion=self.motions["distance"], coordinate=distance)
        elif "angle" in self.motions:
            drive = Row(TURN, x, y, z=z, motion=self.motions["angle"], coordinate=angle)
        else:
            drive = Row(THREAD, self.axis, y, c=slope, z=z, coordinate=angle)
        return (
            *arm_rows(),
            *(Row(SLIDE, n) for n in normals_of(self.axis)),
            *(Row(DOT, self.axis, n, part=MOMENT_B) for n in normals_of(axis_b)),
            Row(SCREW, x, y, c=slope, z=z, coordinate=other),
            drive,
        )
