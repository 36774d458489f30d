"""Charts of joints: each joint coordinate is a column, a screw of marker B relative to A (docs/relative.md §2)."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.model.joints import (
    ConstantOrientation,
    CylindricalJoint,
    FixedJoint,
    PlanarJoint,
    PrismaticJoint,
    RevoluteJoint,
    ScrewJoint,
    SphericalJoint,
    UniversalJoint,
)
from floatframe.model.joints.axis_frame import axis_in_b, normals_of

__all__ = ["CHARTS", "FREE", "SIDE_A", "SIDE_B", "Column", "chart_of"]

SIDE_A, SIDE_B = 0, 1
ZERO = np.zeros(3)


@dataclass(frozen=True, eq=False)
class Column:
    """One coordinate: at unit rate B moves by a screw that is fixed in A (through its point) or in B."""

    name: str  #: name of the coordinate, "" if the joint gives it none
    #: velocity of the point of B relative to A at unit rate, axes of A, (3,)
    tau: Array = field(default_factory=lambda: ZERO)
    #: angular velocity of B relative to A at unit rate, axes of A or B, (3,)
    alpha: Array = field(default_factory=lambda: ZERO)
    side: int = SIDE_A
    unit: str = "rad"  #: unit of the coordinate
    #: factor to a second coordinate of the same freedom (for a screw, angle = 1/slope distance)
    factors: tuple[tuple[str, float], ...] = ()


def turns_in_b() -> tuple[Column, ...]:
    """Return three columns of free rotation, fixed in B."""
    return tuple(Column(f"turn {axis}", alpha=e, side=SIDE_B) for axis, e in zip("xyz", np.eye(3), strict=True))


def moves_in_a() -> tuple[Column, ...]:
    """Return three columns of free translation along the axes of A."""
    return tuple(Column(axis, tau=e, unit="m") for axis, e in zip("xyz", np.eye(3), strict=True))


def revolute(joint: RevoluteJoint, A_a: Array, A_b: Array) -> tuple[Column, ...]:
    """Return the chart: the angle about the axis of A."""
    return (Column("angle", alpha=joint.axis),)


def prismatic(joint: PrismaticJoint, A_a: Array, A_b: Array) -> tuple[Column, ...]:
    """Return the chart: the distance along the axis of A."""
    return (Column("distance", tau=joint.axis, unit="m"),)


def cylindrical(joint: CylindricalJoint, A_a: Array, A_b: Array) -> tuple[Column, ...]:
    """Return the chart: the distance along the axis of A, and the angle about it."""
    return (Column("distance", tau=joint.axis, unit="m"), Column("angle", alpha=joint.axis))


def screw(joint: ScrewJoint, A_a: Array, A_b: Array) -> tuple[Column, ...]:
    """Return the chart: the angle about the axis of A, which moves B by lead/(2 pi) along it."""
    slope = joint.lead / (2 * np.pi)
    return (Column("angle", tau=slope * joint.axis, alpha=joint.axis, factors=(("distance", 1 / slope),)),)


def universal(joint: UniversalJoint, A_a: Array, A_b: Array) -> tuple[Column, ...]:
    """Return the chart: the angle of the cross about the axis of A, and the angle of B about its own axis."""
    return (Column("angle", alpha=joint.axis), Column("angle_b", alpha=joint.axis_b, side=SIDE_B))


def planar(joint: PlanarJoint, A_a: Array, A_b: Array) -> tuple[Column, ...]:
    """Return the chart: two distances in the plane of A, and the angle about its normal at the point of B."""
    first, second = normals_of(joint.axis)
    normal = axis_in_b(joint.axis, joint.axis_b, A_a, A_b)
    return (
        Column("first", tau=first, unit="m"),
        Column("second", tau=second, unit="m"),
        Column("angle", alpha=normal, side=SIDE_B),
    )


def spherical(joint: SphericalJoint, A_a: Array, A_b: Array) -> tuple[Column, ...]:
    """Return the chart: three rotations of B."""
    return turns_in_b()


def fixed(joint: FixedJoint, A_a: Array, A_b: Array) -> tuple[Column, ...]:
    """Return the empty chart of a joint without motion."""
    return ()


def constant_orientation(joint: ConstantOrientation, A_a: Array, A_b: Array) -> tuple[Column, ...]:
    """Return the chart: three distances along the axes of A."""
    return moves_in_a()


#: function that gives the chart of each joint type; joints of other types remain constraints
CHARTS: dict[type, Callable[[Any, Array, Array], tuple[Column, ...]]] = {
    RevoluteJoint: revolute,
    PrismaticJoint: prismatic,
    CylindricalJoint: cylindrical,
    ScrewJoint: screw,
    UniversalJoint: universal,
    PlanarJoint: planar,
    SphericalJoint: spherical,
    FixedJoint: fixed,
    ConstantOrientation: constant_orientation,
}

#: chart of an unconnected body: translation along ground axes, rotation about its own axes
FREE = (*moves_in_a(), *turns_in_b())


def chart_of(joint: object, A_a: Array, A_b: Array) -> tuple[Column, ...] | None:
    """Return the columns of a joint for assembled marker axes A_a, A_b, (3, 3); None if it has no chart."""
    chart = CHARTS.get(type(joint))
    return None if chart is None else chart(joint, A_a, A_b)
