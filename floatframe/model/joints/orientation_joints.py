"""Joints that constrain an orientation: fixed, constant-orientation, universal and constant-velocity joints.

Evaluated in `floatframe.engine.kernels.joints.row_formulas`, `floatframe.engine.kernels.joints.constant_velocity`.
"""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array, GivenArray, GivenArrayOrNone, given
from fe_models.foundation.records import checked_fields, frozen_copies
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Place
from floatframe.model.joints.axis_frame import (
    AxisJoint,
    GivenMotions,
    axis_in_b,
    checked_axes,
    checked_rotation,
    given_motions,
    normals_of,
)
from floatframe.model.joints.joint import MOVES_IN_A, SIDE_B, Column, Joint
from floatframe.model.joints.rows import (
    DOT,
    FORCE,
    GAUGE,
    MOMENT,
    Row,
    orientation_rows,
    point_rows,
    turn_row,
    turn_row_b,
)
from floatframe.model.joints.rows.kinds import BISECTOR, EQUAL_TURN

__all__ = ["ConstantOrientation", "ConstantVelocityJoint", "FixedJoint", "UniversalJoint"]


# the fixed joint: two markers have the same position and orientation --------------------------------------------------


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class FixedJoint(Joint):
    """Fixes marker B to marker A; six constraints.

    The fixed orientation is that of the assembled bodies, unless `rotation` is given.

    Parameters
    ----------
    name
        Name of the joint, unique in the system.
    marker_a, marker_b
        The two markers; a body, or its name, is attached where the other marker is.
    rotation
        Fixed rotation R_AB from marker axes B to A, (3, 3); None: as assembled.
    """

    name: str
    marker_a: Place
    marker_b: Place
    rotation: GivenArrayOrNone = given(None)

    size = 6  #: components of the unknown wrench: force, moment
    moment_b = MOMENT  #: index at which the moment on B starts in the wrench

    def __post_init__(self) -> None:
        checked_rotation(self)

    def rows(self, A_a: Array, A_b: Array, d: Array) -> tuple[Row, ...]:
        """Return the rows for the assembled axes of the markers, (3, 3), and d = r_B - r_A, (3,), in ground axes."""
        R_AB = A_a.T @ A_b if self.rotation is None else self.rotation
        return (*point_rows(), *orientation_rows(R_AB))

    def columns(self, A_a: Array, A_b: Array) -> tuple[Column, ...]:
        """Return no columns: the joint allows no motion."""
        return ()


# the constant-orientation joint: two bodies move without relative rotation --------------------------------------------


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class ConstantOrientation(Joint):
    """Fixes the orientation of marker B relative to marker A; three constraints.

    The fixed orientation is that of the assembled bodies, unless `rotation` is given.

    Parameters
    ----------
    name
        Name of the joint, unique in the system.
    marker_a, marker_b
        The two markers; a body, or its name, is attached where the other marker is.
    rotation
        Fixed rotation R_AB from marker axes B to A, (3, 3); None: as assembled.
    """

    name: str
    marker_a: Place
    marker_b: Place
    rotation: GivenArrayOrNone = given(None)

    size = 6  #: components of the unknown wrench
    moment_b = MOMENT  #: index at which the moment on B starts in the wrench

    def __post_init__(self) -> None:
        checked_rotation(self)

    def rows(self, A_a: Array, A_b: Array, d: Array) -> tuple[Row, ...]:
        """Return the rows for the assembled axes of the markers, (3, 3), and d = r_B - r_A, (3,), in ground axes."""
        R_AB = A_a.T @ A_b if self.rotation is None else self.rotation
        return (*(Row(GAUGE, axis, part=FORCE) for axis in np.eye(3)), *orientation_rows(R_AB))

    def columns(self, A_a: Array, A_b: Array) -> tuple[Column, ...]:
        """Return three distances along the axes of A."""
        return MOVES_IN_A


# the universal joint (Cardan, Hooke): two axes that intersect at right angles -----------------------------------------


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class UniversalJoint(AxisJoint):
    """Joins two points, and keeps an axis of marker A normal to an axis of marker B; four constraints.

    Coordinates, zero as assembled: `angle` of the cross about the axis of A; `angle_b` of B relative to the cross about
    the axis of B.

    Parameters
    ----------
    name
        Name of the joint, unique in the system.
    marker_a, marker_b
        The two markers; a body, or its name, is attached where the other marker is.
    axis
        Direction of the axis, in the axes of marker A, (3,).
    axis_b
        Direction of the axis on B, in the axes of marker B, (3,).
    motions
        Prescribed motions by coordinate; a number fixes the coordinate.
    """

    name: str
    marker_a: Place
    marker_b: Place
    axis: GivenArray = given((1.0, 0.0, 0.0))
    axis_b: GivenArray = given((0.0, 1.0, 0.0))
    motions: GivenMotions = given_motions()

    size = 6  #: components of the unknown wrench
    moment_b = MOMENT  #: index at which the moment on B starts in the wrench
    coordinates = ("angle", "angle_b")

    def rows(self, A_a: Array, A_b: Array, d: Array) -> tuple[Row, ...]:
        """Return the rows for the assembled axes of the markers, (3, 3), and d = r_B - r_A, (3,), in ground axes."""
        # angle zero is the assembled position: z of A lies along the axis of B
        z = A_a.T @ A_b @ self.axis_b
        z = z - (z @ self.axis) * self.axis
        if np.linalg.norm(z) < 1e-3:
            raise ModelError(f"joint {self.name!r}: expected axes at about a right angle as placed, got parallel axes")
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

    def columns(self, A_a: Array, A_b: Array) -> tuple[Column, ...]:
        """Return the angle of the cross about the axis of A, and the angle of B about its own axis."""
        return (Column("angle", alpha=self.axis), Column("angle_b", alpha=self.axis_b, side=SIDE_B))


# the constant-velocity joint (Rzeppa, tripod): two shafts at any angle that rotate at equal speed ---------------------


@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class ConstantVelocityJoint(Joint):
    """Joins two points, and makes the shafts through them rotate equally at any angle between them; four constraints.

    B only rotates relative to A about axes normal to the bisector of both shafts. The angular velocities of the shafts
    about their own axes are therefore equal at every instant. The two deflections of the shafts are free. In the
    assembled position the shafts must be at less than 135 degrees from a straight line.

    Parameters
    ----------
    name
        Name of the joint, unique in the system.
    marker_a, marker_b
        The two markers; a body, or its name, is attached where the other marker is.
    axis
        Shaft of A, in the axes of marker A, (3,).
    axis_b
        Shaft of B, pointing away from A, in the axes of marker B, (3,); None: collinear as assembled.
    """

    name: str
    marker_a: Place
    marker_b: Place
    axis: GivenArray = given((0.0, 0.0, 1.0))
    axis_b: GivenArrayOrNone = given(None)

    size = 6  #: components of the unknown wrench: force and moment
    moment_b = MOMENT  #: index at which the moment on B starts in the wrench

    def __post_init__(self) -> None:
        checked_axes(self)

    def rows(self, A_a: Array, A_b: Array, d: Array) -> tuple[Row, ...]:
        """Return the rows for the assembled axes of the markers, (3, 3), and d = r_B - r_A, (3,), in ground axes."""
        axis_b = axis_in_b(self.axis, self.axis_b, A_a, A_b)
        along, across = A_a @ self.axis, A_b @ axis_b
        cosine = float(along @ across)
        if cosine < -np.sqrt(0.5):
            raise ModelError(
                f"joint {self.name!r}: expected shafts less than 135 degrees from one line as placed, got "
                f"{np.degrees(np.arccos(max(cosine, -1.0))):.6g}; axis_b must point away from A"
            )
        x, z = normals_of(self.axis)  # x × z is along the axis of A
        turn = np.cross(along, across)  # as assembled, B is A rotated about this axis from shaft to shaft
        in_b = [A_b.T @ (v * cosine + np.cross(turn, v) + turn * (turn @ v) / (1 + cosine)) for v in (A_a @ x, A_a @ z)]
        held = Row(EQUAL_TURN, x, in_b[0], z=z, u=in_b[1])
        return (*point_rows(), held, *(Row(BISECTOR, e, axis_b, z=self.axis, part=MOMENT) for e in (x, z)))
