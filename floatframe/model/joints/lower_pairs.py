"""The six lower pairs: revolute, prismatic, screw, cylindrical, spherical and planar joints.

Evaluated in `floatframe.engine.kernels.joints.row_formulas`.
"""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array, GivenArray, GivenArrayOrNone, given
from fe_models.foundation.records import checked_fields, frozen_copies
from fe_models.foundation.units import LENGTH, Quantity
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Place
from floatframe.model.checked_values import number
from floatframe.model.joints.axis_frame import (
    AxisJoint,
    GivenMotions,
    axis_in_b,
    checked_axes,
    checked_motions,
    given_motions,
    normals_of,
    turning_frame,
)
from floatframe.model.joints.joint import SIDE_B, TURNS_IN_B, Column, Joint
from floatframe.model.joints.rows import (
    DOT,
    FORCE,
    MOMENT,
    MOMENT_B,
    NO_MOMENT,
    PUSH,
    SCREW,
    SLIDE,
    THREAD,
    TURN,
    TWIST,
    Row,
    RowCoordinate,
    arm_rows,
    orientation_rows,
    point_rows,
    slide_row,
    turn_row,
)

__all__ = ["CylindricalJoint", "PlanarJoint", "PrismaticJoint", "RevoluteJoint", "ScrewJoint", "SphericalJoint"]


# the revolute joint (hinge): two markers share a point and an axis ----------------------------------------------------


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class RevoluteJoint(AxisJoint):
    """Allows one rotation between two markers, about an axis; five constraints.

    The axis is given in the axes of marker A (the ground axes, if A is on the ground with the default triad). On B it
    is the same line as assembled, unless `axis_b` gives it in the axes of marker B. Coordinate `angle`: of B about the
    axis, zero as assembled.

    Parameters
    ----------
    name
        Name of the joint, unique in the system.
    marker_a, marker_b
        The two markers; a body, or its name, is attached where the other marker is.
    axis
        Direction of the axis, in the axes of marker A, (3,).
    axis_b
        The same direction in the axes of marker B, (3,); None: as assembled.
    motions
        Prescribed motions by coordinate; a number fixes the coordinate.
    """

    name: str
    marker_a: Place
    marker_b: Place
    axis: GivenArray = given((0.0, 0.0, 1.0))
    axis_b: GivenArrayOrNone = given(None)
    motions: GivenMotions = given_motions()

    size = 6  #: components of the unknown wrench
    moment_b = MOMENT  #: index at which the moment on B starts in the wrench
    coordinates = ("angle",)

    def rows(self, A_a: Array, A_b: Array, d: Array) -> tuple[Row, ...]:
        """Return the rows for the assembled axes of the markers, (3, 3), and d = r_B - r_A, (3,), in ground axes."""
        axis_b = axis_in_b(self.axis, self.axis_b, A_a, A_b)
        frame = turning_frame(self.axis, axis_b, A_a, A_b)
        held = (Row(DOT, self.axis, n, part=MOMENT) for n in normals_of(axis_b))
        return (*point_rows(), *held, turn_row(self.axis, frame, MOMENT, self.motions, "angle"))

    def columns(self, A_a: Array, A_b: Array) -> tuple[Column, ...]:
        """Return the angle about the axis of A."""
        return (Column("angle", alpha=self.axis),)


# the prismatic joint (slider): one translation along an axis ----------------------------------------------------------


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class PrismaticJoint(AxisJoint):
    """Lets marker B slide along an axis of marker A without rotation; five constraints.

    The point of B stays on the line through the point of A. The fixed orientation is that of the assembled bodies.
    Coordinate `distance`: from the point of A to the point of B, along the axis.

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

    size = 9  #: components of the unknown wrench
    moment_b = MOMENT_B  #: index at which the moment on B starts in the wrench
    coordinates = ("distance",)

    def rows(self, A_a: Array, A_b: Array, d: Array) -> tuple[Row, ...]:
        """Return the rows for the assembled axes of the markers, (3, 3), and d = r_B - r_A, (3,), in ground axes."""
        held = (Row(SLIDE, n) for n in normals_of(self.axis))
        return (
            *arm_rows(),
            *held,
            *orientation_rows(A_a.T @ A_b, MOMENT_B),
            slide_row(self.axis, self.motions, "distance"),
        )

    def columns(self, A_a: Array, A_b: Array) -> tuple[Column, ...]:
        """Return the distance along the axis of A."""
        return (Column("distance", tau=self.axis, unit="m"),)


# the screw joint: rotation about an axis, and translation along it in a fixed ratio -----------------------------------


METRE = Quantity(1.0, LENGTH)


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class ScrewJoint(Joint):
    """Lets marker B rotate about an axis and slide along it by `lead` for each turn; five constraints.

    The point of B stays on the line through the point of A. Coordinates: `angle` of B about the axis, zero as
    assembled; `distance` = lead angle/(2 pi) between the points along the axis. The points must coincide as assembled.

    Parameters
    ----------
    name
        Name of the joint, unique in the system.
    marker_a, marker_b
        The two markers; a body, or its name, is attached where the other marker is.
    axis
        Direction of the axis, in the axes of marker A, (3,).
    axis_b
        The same direction in the axes of marker B, (3,); None: as assembled.
    lead
        Distance along the axis per turn; positive for a right-handed screw [m].
    motions
        Prescribed motions by coordinate; a number fixes the coordinate.
    """

    name: str
    marker_a: Place
    marker_b: Place
    axis: GivenArray = given((0.0, 0.0, 1.0))
    axis_b: GivenArrayOrNone = given(None)
    lead: float = METRE
    motions: GivenMotions = given_motions()

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
        """Return the rows for the assembled axes of the markers, (3, 3), and d = r_B - r_A, (3,), in ground axes."""
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

    def columns(self, A_a: Array, A_b: Array) -> tuple[Column, ...]:
        """Return the angle about the axis of A, which moves B by lead/(2 pi) along it."""
        slope = self.lead / (2 * np.pi)
        return (Column("angle", tau=slope * self.axis, alpha=self.axis, factors=(("distance", 1 / slope),)),)


# the cylindrical joint: translation along an axis and rotation about it -----------------------------------------------


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class CylindricalJoint(AxisJoint):
    """Lets marker B slide along an axis and rotate about it; four constraints.

    The point of B stays on the line through the point of A. Coordinates: `distance` between the points along the axis;
    `angle` of B about it, zero as assembled.

    Parameters
    ----------
    name
        Name of the joint, unique in the system.
    marker_a, marker_b
        The two markers; a body, or its name, is attached where the other marker is.
    axis
        Direction of the axis, in the axes of marker A, (3,).
    axis_b
        The same direction in the axes of marker B, (3,); None: as assembled.
    motions
        Prescribed motions by coordinate; a number fixes the coordinate.
    """

    name: str
    marker_a: Place
    marker_b: Place
    axis: GivenArray = given((0.0, 0.0, 1.0))
    axis_b: GivenArrayOrNone = given(None)
    motions: GivenMotions = given_motions()

    size = 9  #: components of the unknown wrench
    moment_b = MOMENT_B  #: index at which the moment on B starts in the wrench
    coordinates = ("distance", "angle")

    def rows(self, A_a: Array, A_b: Array, d: Array) -> tuple[Row, ...]:
        """Return the rows for the assembled axes of the markers, (3, 3), and d = r_B - r_A, (3,), in ground axes."""
        axis_b = axis_in_b(self.axis, self.axis_b, A_a, A_b)
        frame = turning_frame(self.axis, axis_b, A_a, A_b)
        return (
            *arm_rows(),
            *(Row(SLIDE, n) for n in normals_of(self.axis)),
            *(Row(DOT, self.axis, n, part=MOMENT_B) for n in normals_of(axis_b)),
            slide_row(self.axis, self.motions, "distance"),
            turn_row(self.axis, frame, MOMENT_B, self.motions, "angle"),
        )

    def columns(self, A_a: Array, A_b: Array) -> tuple[Column, ...]:
        """Return the distance along the axis of A, and the angle about it."""
        return (Column("distance", tau=self.axis, unit="m"), Column("angle", alpha=self.axis))


# the spherical joint: two markers have a common point -----------------------------------------------------------------


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class SphericalJoint(Joint):
    """Holds the point of marker B at the point of marker A; three constraints.

    Parameters
    ----------
    name
        Name of the joint, unique in the system.
    marker_a, marker_b
        The two markers; a body, or its name, is attached where the other marker is.
    """

    name: str
    marker_a: Place
    marker_b: Place

    size = 3  #: components of the unknown wrench: force
    moment_b = NO_MOMENT  #: no moment acts

    def rows(self, A_a: Array, A_b: Array, d: Array) -> tuple[Row, ...]:
        """Return the rows; axes and positions of the markers do not matter."""
        return point_rows()

    def columns(self, A_a: Array, A_b: Array) -> tuple[Column, ...]:
        """Return three rotations of B."""
        return TURNS_IN_B


# the planar joint: motion in a plane ----------------------------------------------------------------------------------


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class PlanarJoint(AxisJoint):
    """Keeps the point of marker B in a plane of marker A, with parallel normals; three constraints.

    Coordinates: `first` and `second`, the position of the point of B in the plane along the two directions of
    `normals_of(axis)`; `angle` of B about the normal, zero as assembled.

    Parameters
    ----------
    name
        Name of the joint, unique in the system.
    marker_a, marker_b
        The two markers; a body, or its name, is attached where the other marker is.
    axis
        Normal, in the axes of marker A.
    axis_b
        The same direction in the axes of marker B, (3,); None: as assembled.
    motions
        Prescribed motions by coordinate; a number fixes the coordinate.
    """

    name: str
    marker_a: Place
    marker_b: Place
    axis: GivenArray = given((0.0, 0.0, 1.0))
    axis_b: GivenArrayOrNone = given(None)
    motions: GivenMotions = given_motions()

    size = 9  #: components of the unknown wrench
    moment_b = MOMENT_B  #: index at which the moment on B starts in the wrench
    coordinates = ("first", "second", "angle")

    def rows(self, A_a: Array, A_b: Array, d: Array) -> tuple[Row, ...]:
        """Return the rows for the assembled axes of the markers, (3, 3), and d = r_B - r_A, (3,), in ground axes."""
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

    def columns(self, A_a: Array, A_b: Array) -> tuple[Column, ...]:
        """Return two distances in the plane of A, and the angle about its normal at the point of B."""
        first, second = normals_of(self.axis)
        normal = axis_in_b(self.axis, self.axis_b, A_a, A_b)
        return (
            Column("first", tau=first, unit="m"),
            Column("second", tau=second, unit="m"),
            Column("angle", alpha=normal, side=SIDE_B),
        )
