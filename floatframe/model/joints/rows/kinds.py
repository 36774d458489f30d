"""The meaning of each kind of joint row, as one record that all other code uses.

The unknown of a joint between markers A and B is a wrench in ground axes: the force F on A (with the opposite force on
B), the moment M on A, and the moment N whose opposite acts on B. A joint has as many rows as unknowns. No row of a body
therefore depends on another body, and bodies can be eliminated one by one with the exact tangent. With E = A_A x, Z =
A_A z, D = A_B y, Y = A_B u, d = r_B - r_A, and f(t) the prescribed motion of a row (a constant c if there is none):

    held      POINT x      r_A - r_B = 0, along x in ground axes       closes a point
              DOT x y      E · D = c                                   closes an angle
              TURN x z y   (E cos f + Z sin f) · D = 0                 turns D to the angle f(t) from Z towards -E
              SLIDE x      E · d = f                                   distance along an axis of A
              DISTANCE     |d| = f                                     distance of the points
              SCREW x z y  E · d = c th                                th the angle of D from Z, about the axis E
              TURN_B       TURN with A and B exchanged and -f          turns about an axis of B
              RIM_HEIGHT   Z · (d + rho) = 0                           a disc touches the plane normal to Z of A
              EQUAL_TURN   E · Y - Z · D = 0                           shafts x × z of A and y × u of B turn equally
              ROLL x       E · (velocity of the rim at the contact) = 0   held as a velocity: it rolls
    wrench    GAUGE x      E · part = 0                                none along what is free, part one of F, M, N
              PUSH x       E · F + Q = 0                               force Q(s, s_dot, F, t) along a free distance
              TWIST x z y  axis · part + Q = 0                         torque Q(th, th_dot, F, t) about a free angle
              GAUGE_B y    D · part = 0                                the same about an axis of B
              THREAD x     E · (N + c F) = 0                           of a screw
              ARM x        M - N - d × F = 0, along x in ground axes   forces on A and B balance about one point
              ROD x        F - mu d = 0, along x in ground axes        force along the line of the points
              TWIST_B      TWIST about an axis of B
              BISECTOR x   part · (E × (Z + D)) = 0                    moment along the bisector of the shafts Z, D
              RIM x        N - rho × F = 0, along x in ground axes     the force acts at the rim of a disc on B

Rows of a deforming line, LINE, LINE_TURN (held) and LINE_FREE (wrench), are in kernels/joints/deformed_line.py.

rho is the vector from the centre of a disc (axis y in B, radius c) to the point of its rim nearest to the plane, see
kernels/joints/rolling.py. Force elements have their own rows, PART. The held row of a coordinate coupler is COUPLE, or
RELEASED while the coupler is not engaged. SPAN is the distance between two points as a coordinate. LAW_LENGTH,
LAW_ANGLE and LAW_RATE are constraints of public elements.

Joints whose points coincide need one moment (N = M); in the others the force acts at the point of B, and they have ARM
rows.

A kind is defined by its entry in `ROW_KINDS` and its formulas in kernels/joints/row_formulas.py. All other code reads
from here whether a row is a constraint, which unit it has and how its coordinate is measured.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fe_models.foundation.arrays import IntArray

__all__ = [
    "ARM",
    "BISECTOR",
    "COUPLE",
    "DISTANCE",
    "DOT",
    "EQUAL_TURN",
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
    "RowKind",
    "is_held",
    "is_held_length",
    "is_held_position",
    "is_held_velocity",
    "kind_of",
]

#: codes of the kinds of rows in the kernels; SPRING rows belong to spring-dampers
POINT, DOT, GAUGE, SPRING, TURN, SLIDE, DISTANCE, SCREW, GAUGE_B, THREAD, ARM, ROD, PUSH, TWIST = range(14)
RIM_HEIGHT, ROLL, RIM, COUPLE, PART, SPAN, TURN_B, TWIST_B, LINE, LINE_TURN, LINE_FREE = range(14, 25)
EQUAL_TURN, BISECTOR, LAW_LENGTH, LAW_ANGLE, LAW_RATE, RELEASED = range(25, 31)
NOTHING, POSITION, VELOCITY = range(3)  #: quantity that a row constrains
FORCE, MOMENT, MOMENT_B = 0, 3, 6  #: indices at which force F and moments M, N start in the unknown wrench
NO_MOMENT = -1  #: replaces an index if no moment acts


@dataclass(frozen=True)
class RowKind:
    """The meaning of a kind of row."""

    code: int  #: code in the kernels
    name: str  #: description of its effect
    holds: int = NOTHING  #: NOTHING (the row defines the wrench), POSITION or VELOCITY
    #: whether the constrained quantity is a length (VELOCITY: length per time) rather than an angle
    is_length: bool = False
    is_angle: bool = False  #: whether the measured coordinate is an angle
    can_yield: bool = False  #: whether redundant rows of this kind share reactions if the system requests it
    is_loaded: bool = False  #: whether forces act along the coordinate
    is_free: bool = False  #: whether the row leaves a coordinate free, along which a force may act


ROW_KINDS = (
    RowKind(POINT, "closes a point", POSITION, is_length=True, can_yield=True),
    RowKind(DOT, "closes an angle", POSITION, can_yield=True),
    RowKind(GAUGE, "no force along what is free", is_free=True),
    RowKind(SPRING, "force of a spring-damper"),
    RowKind(TURN, "turns about an axis of A", POSITION),
    RowKind(SLIDE, "distance along an axis of A", POSITION, is_length=True, can_yield=True),
    RowKind(DISTANCE, "distance of the points", POSITION, is_length=True),
    RowKind(SCREW, "distance follows the angle", POSITION, is_length=True),
    RowKind(GAUGE_B, "no moment about an axis of B", is_free=True),
    RowKind(THREAD, "no work of moment and force of a screw"),
    RowKind(ARM, "wrenches on A and B balance"),
    RowKind(ROD, "force along the line of the points"),
    RowKind(PUSH, "force along a free distance", is_loaded=True),
    RowKind(TWIST, "torque about a free angle", is_angle=True, is_loaded=True),
    RowKind(RIM_HEIGHT, "a disc touches a plane", POSITION, is_length=True),
    RowKind(ROLL, "the rim does not slip", VELOCITY, is_length=True),
    RowKind(RIM, "the force acts at the rim"),
    RowKind(COUPLE, "coordinates are coupled", POSITION),
    RowKind(PART, "part of a force element"),
    RowKind(SPAN, "distance of two points as a coordinate"),
    RowKind(TURN_B, "turns about an axis of B", POSITION),
    RowKind(TWIST_B, "torque about an axis of B", is_angle=True, is_loaded=True),
    RowKind(LINE, "stays on a deformed line", POSITION, is_length=True),
    RowKind(LINE_TURN, "keeps its direction to a deformed line", POSITION),
    RowKind(LINE_FREE, "no force along a deformed line"),
    RowKind(EQUAL_TURN, "two shafts turn equally", POSITION),
    RowKind(BISECTOR, "moment along the bisector of two shafts"),
    RowKind(LAW_LENGTH, "an element holds a length", POSITION, is_length=True),
    RowKind(LAW_ANGLE, "an element holds an angle or a number", POSITION),
    RowKind(LAW_RATE, "an element holds a velocity", VELOCITY, is_length=True),
    RowKind(RELEASED, "no force of a coupler that is not engaged"),
)

HOLDS = np.array([kind.holds for kind in ROW_KINDS])
IS_LENGTH = np.array([kind.is_length for kind in ROW_KINDS])


def kind_of(code: int) -> RowKind:
    """Return the record of a kind."""
    return ROW_KINDS[int(code)]


def is_held(codes: IntArray) -> NDArray[np.bool_]:
    """Return which rows constrain a position or a velocity, from their codes, (n,)."""
    return HOLDS[codes] != NOTHING


def is_held_position(codes: IntArray) -> NDArray[np.bool_]:
    """Return which rows constrain a position, from their codes, (n,)."""
    return HOLDS[codes] == POSITION


def is_held_velocity(codes: IntArray) -> NDArray[np.bool_]:
    """Return which rows constrain only a velocity, from their codes, (n,)."""
    return HOLDS[codes] == VELOCITY


def is_held_length(codes: IntArray) -> NDArray[np.bool_]:
    """Return which rows constrain a length, from their codes, (n,)."""
    return (HOLDS[codes] == POSITION) & IS_LENGTH[codes]
