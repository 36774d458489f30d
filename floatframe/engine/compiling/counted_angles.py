"""Angles counted through full turns: of joints, of sensors that request it, and of bushings that can twist far."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.markers import MarkerData, joint_markers, marker_pose, n_q_of
from floatframe.engine.compiling.pair_forces import bushing_markers
from floatframe.engine.kernels.model import Angles
from floatframe.engine.kernels.records import filled
from floatframe.model.forces import Bushing
from floatframe.model.functions.time_functions import TimeFunction
from floatframe.model.joints.rows import TURN, TURN_B, TWIST_B, RowCoordinate
from floatframe.model.joints.sliding import SlidingJoint
from floatframe.model.state import State
from floatframe.model.system import System

__all__ = [
    "AngleOfSensor",
    "CountedAngle",
    "angle_of",
    "angle_records",
    "counted_angles",
    "direction",
    "first_angles",
    "rotation_of",
]

Direction = tuple[float, float, float]
SAME = 1e-9  #: difference of two directions below which they count as equal


@dataclass(frozen=True)
class CountedAngle:
    """An angle between two bodies, given by directions in their frames; see kernels/turns.py."""

    holder: int  #: body that carries the axis x × z, -1 for the ground
    other: int
    x: Direction
    z: Direction
    y: Direction  #: direction fixed in the other body; a positive angle rotates it from z towards -x
    sign: float = 1.0
    #: component 0, 1 or 2 of the rotation vector of a bushing (its components are consecutive), -1 for a plain angle
    part: int = -1

    def is_same(self, angle: "CountedAngle") -> bool:
        """Whether two descriptions measure the same angle."""
        own, others = ((a.holder, a.other, a.sign, a.part) for a in (self, angle))
        directions = ((*a.x, *a.y, *a.z) for a in (self, angle))
        return own == others and all(abs(p - q) <= SAME for p, q in zip(*directions, strict=True))


@runtime_checkable
class AngleOfSensor(Protocol):
    """A sensor that measures an angle through full turns."""

    def counted_angle(self, system: System) -> CountedAngle:
        """Return the angle that the sensor measures; `ModelError` if one of its markers does not exist."""


def angle_of(coordinate: RowCoordinate, a: MarkerData, b: MarkerData) -> CountedAngle:
    """Return the angle coordinate between two markers as a counted angle."""
    holder, other = (b, a) if coordinate.kind == TWIST_B else (a, b)
    x, z = (holder.shape.triad @ each for each in (coordinate.x, coordinate.z))
    y = other.shape.triad @ coordinate.y
    sign = -1.0 if coordinate.kind == TWIST_B else 1.0
    return CountedAngle(holder.body, other.body, direction(x), direction(z), direction(y), sign)


def direction(x: Sequence[float] | Array) -> Direction:
    """Return three numbers as a tuple."""
    return float(x[0]), float(x[1]), float(x[2])


def counted_angles(system: System, placed: State) -> list[tuple[CountedAngle, TimeFunction | None]]:
    """Return the angles of a system without duplicates, each with the function that prescribes it, or None."""
    found: list[tuple[CountedAngle, TimeFunction | None]] = []
    between: dict[tuple[int, int, float], list[CountedAngle]] = {}  # angles between the same two bodies
    n_q = n_q_of(system)

    def add(angle: CountedAngle, motion: TimeFunction | None) -> None:
        alike = between.setdefault((angle.holder, angle.other, angle.sign), [])
        if not any(angle.is_same(known) for known in alike):
            alike.append(angle)
            found.append((angle, motion))

    for joint in system.joints:
        if isinstance(joint, SlidingJoint) or not joint.coordinates:
            continue
        a, b = joint_markers(system, joint, placed)
        (r_a, A_a), (r_b, A_b) = (marker_pose(end, placed, n_q) for end in (a, b))
        for row in joint.rows(A_a, A_b, r_b - r_a):
            if row.coordinate is not None and row.coordinate.is_angle:
                add(angle_of(row.coordinate, a, b), row.motion if row.kind in (TURN, TURN_B) else None)
    for sensor in system.sensors:
        if isinstance(sensor, AngleOfSensor):
            add(sensor.counted_angle(system), None)
    for force in system.forces:
        if isinstance(force, Bushing) and force.counts_turns:
            found += [(angle, None) for angle in rotation_of(*bushing_markers(system, force, placed))]
    return found


def rotation_of(a: MarkerData, b: MarkerData) -> list[CountedAngle]:
    """Return the three components of the rotation vector of marker b relative to marker a."""
    x, _, z = a.shape.triad.T
    return [
        CountedAngle(a.body, b.body, direction(x), direction(z), direction(y), part=k)
        for k, y in enumerate(b.shape.triad.T)
    ]


def first_angles(system: System, n_angles: int) -> list[int]:
    """Return, for each bushing, the index of its first counted angle, or -1 if its turns are not counted."""
    counting = [force.counts_turns for force in system.forces if isinstance(force, Bushing)]
    first = n_angles - 3 * sum(counting)  # angles of bushings are the last ones
    return [first + 3 * sum(counting[:k]) if counts else -1 for k, counts in enumerate(counting)]


def angle_records(angles: list[CountedAngle]) -> Angles:
    """Return the angles in the arrays of the kernels."""
    parts = ("holder", "other", "x", "z", "y", "sign", "part")
    return filled(Angles(), **{name: [getattr(angle, name) for angle in angles] for name in parts})
