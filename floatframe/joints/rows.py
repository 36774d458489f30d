"""The rows of which joints are made: every joint is a short list of them, and the kernels know only rows.

A joint between markers A and B has as unknown a wrench in ground axes: the force F on A (and its opposite on B), the
moment M on A, the moment N whose opposite acts on B. It has as many rows as unknowns, so that no row of a body depends
on another body and bodies can be eliminated one by one with the exact tangent. With E = A_A x, Z = A_A z, D = A_B y,
d = r_B - r_A and f(t) the prescribed motion of a row (constant c without):

    held      POINT x      r_A - r_B = 0, along x in ground axes       closes a point
              DOT x y      E · D = c                                   closes an angle
              TURN x z y   (E cos f + Z sin f) · D = 0                 turns D to the angle f(t) from Z towards -E
              SLIDE x      E · d = f                                   distance along an axis of A
              DISTANCE     |d| = f                                     distance of the points
              SCREW x z y  E · d = c th                                th the angle of D from Z, about the axis E
              TURN_B       TURN with A and B exchanged and -f          turns about an axis of B
              RIM_HEIGHT   Z · (d + rho) = 0                           a disc touches the plane normal to Z of A
              ROLL x       E · (velocity of the rim at the contact) = 0   held as a velocity: it rolls
    wrench    GAUGE x      E · part = 0                                none along what is free, part one of F, M, N
              PUSH x       E · F + Q = 0                               force Q(s, s_dot, F, t) along a free distance
              TWIST x z y  axis · part + Q = 0                         torque Q(th, th_dot, F, t) about a free angle
              GAUGE_B y    D · part = 0                                the same about an axis of B
              THREAD x     E · (N + c F) = 0                           of a screw
              ARM x        M - N - d × F = 0, along x in ground axes   forces on A and B balance about one point
              ROD x        F - mu d = 0, along x in ground axes        force along the line of the points
              TWIST_B      TWIST about an axis of B
              RIM x        N - rho × F = 0, along x in ground axes     the force acts at the rim of a disc on B

Rows of a line that deforms, LINE, LINE_TURN (held) and LINE_FREE (wrench), are in kernels/connections/deformed_line.py.

rho leads from the centre of a disc (axis y in B, radius c) to the point of its rim nearest to the plane, see
connections/rolling.py. Force elements have rows of their own, PART; the held row of a coordinate coupler is COUPLE.

Joints whose points coincide need one moment (N = M), the others take the force at the point of B and have ARM rows.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.functions.time_functions import TimeFunction

__all__ = [
    "ARM",
    "COUPLE",
    "DISTANCE",
    "DOT",
    "FORCE",
    "GAUGE",
    "GAUGE_B",
    "HELD",
    "HELD_DISTANCES",
    "HELD_VELOCITIES",
    "LINE",
    "LINE_FREE",
    "LINE_TURN",
    "MOMENT",
    "MOMENT_B",
    "NO_MOMENT",
    "PART",
    "POINT",
    "PUSH",
    "RIM",
    "RIM_HEIGHT",
    "ROD",
    "ROLL",
    "SCREW",
    "SLIDE",
    "SPAN",
    "SPRING",
    "THREAD",
    "TURN",
    "TURN_B",
    "TWIST",
    "TWIST_B",
    "Row",
    "arm_rows",
    "loaded_row",
    "orientation_rows",
    "point_rows",
    "slide_row",
    "turn_row",
    "turn_row_b",
]

#: codes of the kinds in the kernels; SPRING rows belong to spring-dampers
POINT, DOT, GAUGE, SPRING, TURN, SLIDE, DISTANCE, SCREW, GAUGE_B, THREAD, ARM, ROD, PUSH, TWIST = range(14)
RIM_HEIGHT, ROLL, RIM, COUPLE, PART, SPAN, TURN_B, TWIST_B, LINE, LINE_TURN, LINE_FREE = range(14, 25)
#: rows that hold something; the others say what the wrench is
HELD = (POINT, DOT, TURN, SLIDE, DISTANCE, SCREW, RIM_HEIGHT, ROLL, COUPLE, TURN_B, LINE, LINE_TURN)
HELD_DISTANCES = (POINT, SLIDE, DISTANCE, SCREW, RIM_HEIGHT, LINE)  #: those in the unit of length
HELD_VELOCITIES = (ROLL,)  #: those that hold a velocity and no position
FORCE, MOMENT, MOMENT_B = 0, 3, 6  #: where the parts F, M, N begin in the unknown wrench
NO_MOMENT = -1  #: in place of a part: nothing acts there

ZERO = np.zeros(3)


@dataclass(frozen=True, eq=False)
class Row:
    """One row of a joint."""

    kind: int
    x: Array = field(default_factory=lambda: ZERO)  #: direction in the axes of marker A, (3,); POINT, ARM, ROD: ground
    y: Array = field(default_factory=lambda: ZERO)  #: direction in the axes of marker B, (3,)
    c: float = 0.0  #: value that is held, or slope of a screw
    z: Array = field(default_factory=lambda: ZERO)  #: second direction in the axes of marker A, (3,)
    part: int = FORCE  #: of the wrench: FORCE, MOMENT or MOMENT_B; of DOT: where its reaction is
    motion: TimeFunction | None = None  #: prescribed motion of the held quantity; None: c
    coordinate: str = ""  #: of the joint to which the row belongs, "" for none


def point_rows() -> tuple[Row, ...]:
    """Return the three rows that hold the points of two markers together."""
    return tuple(Row(POINT, axis) for axis in np.eye(3))


def arm_rows() -> tuple[Row, ...]:
    """Return the three rows that balance the wrenches on two markers that are apart."""
    return tuple(Row(ARM, axis) for axis in np.eye(3))


def orientation_rows(R_AB: Array, part: int = MOMENT) -> tuple[Row, ...]:
    """Return the three rows that hold the rotation from marker axes B to A.

    x_A·y' = y_A·z' = z_A·x' = 0 with the axes x', y', z' fixed in B that coincide with x_A, y_A, z_A.
    """
    in_b = R_AB.T  # columns: the axes of A as they lie in B
    x, y, z = np.eye(3)
    return tuple(Row(DOT, a, b, part=part) for a, b in ((x, in_b[:, 1]), (y, in_b[:, 2]), (z, in_b[:, 0])))


def slide_row(axis: Array, motions: Mapping[str, TimeFunction], name: str) -> Row:
    """Return the row of a free distance along an axis of A: prescribed, or without force."""
    if name in motions:
        return Row(SLIDE, axis, motion=motions[name], coordinate=name)
    return Row(GAUGE, axis, part=FORCE, coordinate=name)


def turn_row(axis: Array, frame: tuple[Array, Array, Array], part: int, motions: Mapping, name: str) -> Row:
    """Return the row of a free angle about an axis of A: prescribed, or without moment.

    frame: two directions of A, normal to the axis with x × z along it, and the direction of B that is along z at
    angle zero.
    """
    x, z, y = frame
    if name in motions:
        return Row(TURN, x, y, z=z, motion=motions[name], coordinate=name)
    return Row(GAUGE, axis, y, z=z, part=part, coordinate=name)


def turn_row_b(axis: Array, axis_b: Array, z: Array, motions: Mapping, name: str) -> Row:
    """Return the row of a free angle about an axis of B: prescribed, or without moment.

    z: direction of B, normal to its axis, that is along the axis of A at angle zero.
    """
    if name in motions:
        return Row(TURN_B, np.cross(z, axis_b), axis, z=z, part=MOMENT, motion=motions[name], coordinate=name)
    return Row(GAUGE_B, axis, axis_b, z=z, part=MOMENT, coordinate=name)


def loaded_row(row: Row) -> Row:
    """Return the row of a free coordinate with forces along it, in place of the one without."""
    if row.kind == GAUGE_B:
        return replace(row, kind=TWIST_B, x=np.cross(row.z, row.y), y=row.x)
    if row.part == FORCE:
        return replace(row, kind=PUSH)
    return replace(row, kind=TWIST, x=np.cross(row.z, row.x))
