"""A coordinate between two markers: its value and rate, and the force along it.

With marker axes A_a, A_b, the point of B at d from that of A, in ground axes, and the direction E of the coordinate:

    PUSH     E = A_a x            value E · d             rate E · (v_B - v_A - omega_A × d)
    TWIST    E = A_a (x × z)      value atan2(S, C)       rate E · (omega_B - omega_A)
    TWIST_B  E = A_b (x × z)      value -atan2(S, C)      rate the same
    SPAN     E = d/|d|            value |d|               rate E · (v_B - v_A - omega_A × d)

S = -X · Y and C = Z · Y, where X, Z are the directions x, z of the marker that has the axis, and Y is the direction y
of the other marker. The generalised force along the coordinate is -E · (part of the wrench). If an angle and a distance
depend on each other (a screw), it is -E · (N + slope F) or -E · (F + N/slope). All functions accept stacks, with
vectors along the last axis. The kernels in kernels/joints/relative_motion.py contain the same formulas, compiled.
"""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.model.joints.rows.kinds import FORCE, PUSH, SPAN, TWIST_B, kind_of
from floatframe.model.rotations import cross, dot

__all__ = ["ZERO", "RelativePlace", "RowCoordinate"]

ZERO = np.zeros(3)


class RelativePlace(NamedTuple):
    """Relative position of two markers, in ground axes."""

    A_a: Array  #: axes of A, (..., 3, 3)
    A_b: Array  #: axes of B, (..., 3, 3)
    d: Array  #: vector from the point of A to the point of B, (..., 3)


@dataclass(frozen=True, eq=False)
class RowCoordinate:
    """A coordinate between two markers."""

    name: str  #: name of the coordinate in its joint
    kind: int  #: PUSH, TWIST, TWIST_B or SPAN
    #: axis of a distance; for an angle, a direction normal to the axis x × z, (3,)
    x: Array = field(default_factory=lambda: ZERO)
    y: Array = field(default_factory=lambda: ZERO)  #: direction fixed in the other marker, (3,)
    #: direction in the marker with the axis, from which the angle of y is measured, (3,)
    z: Array = field(default_factory=lambda: ZERO)
    #: parts of the wrench that act along the coordinate, with their factors
    parts: tuple[tuple[int, float], ...] = ((FORCE, 1.0),)

    @property
    def is_angle(self) -> bool:
        """Whether the coordinate is an angle; otherwise it is a distance."""
        return kind_of(self.kind).is_angle

    def direction(self, place: RelativePlace) -> Array:
        """Return the direction E of the coordinate, (..., 3)."""
        if self.kind == PUSH:
            return place.A_a @ self.x
        if self.kind == SPAN:
            return place.d / np.sqrt(dot(place.d, place.d))[..., None]
        return (place.A_b if self.kind == TWIST_B else place.A_a) @ cross(self.x, self.z)

    def value(self, place: RelativePlace) -> Array:
        """Return the value of the coordinate, (...,); angles are between -pi and pi."""
        if not self.is_angle:
            return dot(self.direction(place), place.d)
        A, B = (place.A_b, place.A_a) if self.kind == TWIST_B else (place.A_a, place.A_b)
        angle = np.arctan2(-dot(A @ self.x, B @ self.y), dot(A @ self.z, B @ self.y))
        return np.asarray(-angle if self.kind == TWIST_B else angle)

    def moves(self, slip: Array, turning: Array) -> Array:
        """Return the motion that changes the coordinate: v_B - v_A - omega_A × d, or omega_B - omega_A for an angle."""
        return turning if self.is_angle else slip

    def force(self, place: RelativePlace, w: Array) -> Array:
        """Return the force or torque, (...,), positive if it increases the coordinate, from wrench w, (..., size)."""
        own = np.sum([factor * w[..., part : part + 3] for part, factor in self.parts], axis=0)
        return -dot(own, self.direction(place))
