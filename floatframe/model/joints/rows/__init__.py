"""Rows of joints: the meaning of each kind (`kinds`), their description (`row`), and measured coordinates."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.model.functions.time_functions import TimeFunction
from floatframe.model.joints.rows.coordinate import ZERO, RelativePlace, RowCoordinate
from floatframe.model.joints.rows.kinds import (
    ARM,
    COUPLE,
    DISTANCE,
    DOT,
    FORCE,
    GAUGE,
    GAUGE_B,
    LAW_ANGLE,
    LAW_LENGTH,
    LAW_RATE,
    LINE,
    LINE_FREE,
    LINE_TURN,
    MOMENT,
    MOMENT_B,
    NO_MOMENT,
    NOTHING,
    PART,
    POINT,
    POSITION,
    PUSH,
    RELEASED,
    RIM,
    RIM_HEIGHT,
    ROD,
    ROLL,
    ROW_KINDS,
    SCREW,
    SLIDE,
    SPAN,
    SPRING,
    THREAD,
    TURN,
    TURN_B,
    TWIST,
    TWIST_B,
    VELOCITY,
    RowKind,
    is_held,
    is_held_length,
    is_held_position,
    is_held_velocity,
    kind_of,
)

__all__ = [
    "ARM",
    "COUPLE",
    "DISTANCE",
    "DOT",
    "FORCE",
    "GAUGE",
    "GAUGE_B",
    "LAW_ANGLE",
    "LAW_LENGTH",
    "LAW_RATE",
    "LINE",
    "LINE_FREE",
    "LINE_TURN",
    "MOMENT",
    "MOMENT_B",
    "NOTHING",
    "NO_MOMENT",
    "PART",
    "POINT",
    "POSITION",
    "PUSH",
    "RELEASED",
    "RIM",
    "RIM_HEIGHT",
    "ROD",
    "ROLL",
    "ROW_KINDS",
    "SCREW",
    "SLIDE",
    "SPAN",
    "SPRING",
    "THREAD",
    "TURN",
    "TURN_B",
    "TWIST",
    "TWIST_B",
    "VELOCITY",
    "RelativePlace",
    "Row",
    "RowCoordinate",
    "RowKind",
    "arm_rows",
    "is_held",
    "is_held_length",
    "is_held_position",
    "is_held_velocity",
    "kind_of",
    "loaded_row",
    "orientation_rows",
    "point_rows",
    "slide_row",
    "turn_row",
    "turn_row_b",
]


@dataclass(frozen=True, eq=False)
class Row:
    """One row of a joint."""

    kind: int  #: code, see `ROW_KINDS`
    #: direction in axes of marker A, (3,); for POINT, ARM and ROD in ground axes
    x: Array = field(default_factory=lambda: ZERO)
    y: Array = field(default_factory=lambda: ZERO)  #: direction in the axes of marker B, (3,)
    c: float = 0.0  #: constrained value, or slope of a screw
    z: Array = field(default_factory=lambda: ZERO)  #: second direction in the axes of marker A, (3,)
    u: Array = field(default_factory=lambda: ZERO)  #: second direction in the axes of marker B, (3,)
    part: int = FORCE  #: part of the wrench in the row, FORCE, MOMENT or MOMENT_B; for DOT the part with its reaction
    motion: TimeFunction | None = None  #: prescribed value of the constrained quantity; None: the constant c
    coordinate: RowCoordinate | None = None  #: coordinate of the joint to which the row belongs

    @property
    def coordinate_name(self) -> str:
        """Name of the coordinate; "" if there is none."""
        return "" if self.coordinate is None else self.coordinate.name


def point_rows() -> tuple[Row, ...]:
    """Return three rows that keep the points of two markers together."""
    return tuple(Row(POINT, axis) for axis in np.eye(3))


def arm_rows() -> tuple[Row, ...]:
    """Return three rows that balance the wrench between two markers at different points."""
    return tuple(Row(ARM, axis) for axis in np.eye(3))


def orientation_rows(R_AB: Array, part: int = MOMENT) -> tuple[Row, ...]:
    """Return three rows that fix the rotation R_AB from marker axes B to A.

    They are x_A·y' = y_A·z' = z_A·x' = 0, where the axes x', y', z' fixed in B coincide with x_A, y_A, z_A.
    """
    in_b = R_AB.T  # columns are the axes of A in B
    x, y, z = np.eye(3)
    return tuple(Row(DOT, a, b, part=part) for a, b in ((x, in_b[:, 1]), (y, in_b[:, 2]), (z, in_b[:, 0])))


def slide_row(axis: Array, motions: Mapping[str, TimeFunction], name: str) -> Row:
    """Return the row of a distance along an axis of A, either prescribed or without force."""
    own = RowCoordinate(name, PUSH, axis)
    if name in motions:
        return Row(SLIDE, axis, motion=motions[name], coordinate=own)
    return Row(GAUGE, axis, part=FORCE, coordinate=own)


def turn_row(axis: Array, frame: tuple[Array, Array, Array], part: int, motions: Mapping, name: str) -> Row:
    """Return the row of an angle about an axis of A, either prescribed or without moment.

    frame: two directions of A, normal to the axis, with x × z along it, and the direction of B that is along z at angle
    zero.
    """
    x, z, y = frame
    own = RowCoordinate(name, TWIST, x, y, z, parts=((part, 1.0),))
    if name in motions:
        return Row(TURN, x, y, z=z, part=part, motion=motions[name], coordinate=own)
    return Row(GAUGE, axis, y, z=z, part=part, coordinate=own)


def turn_row_b(axis: Array, axis_b: Array, z: Array, motions: Mapping, name: str) -> Row:
    """Return the row of an angle about an axis of B, either prescribed or without moment.

    z: direction of B, normal to its axis, that is along the axis of A at angle zero.
    """
    own = RowCoordinate(name, TWIST_B, np.cross(z, axis_b), axis, z, parts=((MOMENT, 1.0),))
    if name in motions:
        return Row(TURN_B, own.x, axis, z=z, part=MOMENT, motion=motions[name], coordinate=own)
    return Row(GAUGE_B, axis, axis_b, z=z, part=MOMENT, coordinate=own)


def loaded_row(row: Row) -> Row:
    """Return the row of a free coordinate along which forces act, which replaces the row without force."""
    own = row.coordinate
    assert own is not None
    assert kind_of(row.kind).is_free
    return replace(row, kind=own.kind, x=own.x, y=own.y, z=own.z)
