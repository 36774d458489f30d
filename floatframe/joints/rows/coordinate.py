"""A coordinate between two markers: how it is measured, and the force along it.

With axes A_a, A_b and the point of B at d from that of A, in ground axes, E the direction of the coordinate:

    PUSH     E = A_a x            value E · d             rate E · (v_B - v_A - omega_A × d)
    TWIST    E = A_a (x × z)      value atan2(S, C)       rate E · (omega_B - omega_A)
    TWIST_B  E = A_b (x × z)      value -atan2(S, C)      rate the same
    SPAN     E = d/|d|            value |d|               rate E · (v_B - v_A - omega_A × d)

S = -X · Y, C = Z · Y with X, Z the directions x, z of the marker with the axis and Y the direction y of the other. The
generalised force along it is -E · (part of the wrench); where an angle and a distance follow each other (a screw),
-E · (N + slope F) or -E · (F + N/slope). All of it for stacks: vectors along the last axis. The kernels have the same
formulas compiled, in kernels/joints/relative_motion.py.
"""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.joints.rows.kinds import FORCE, PUSH, SPAN, TWIST_B, kind_of
from floatframe.rotations import cross, dot

__all__ = ["ZERO", "RelativePlace", "RowCoordinate"]

ZERO = np.zeros(3)


class RelativePlace(NamedTuple):
    """Where two markers are, ground axes."""

    A_a: Array  #: axes of A, (..., 3, 3)
    A_b: Array  #: axes of B, (..., 3, 3)
    d: Array  #: from the point of A to that of B, (..., 3)


@dataclass(frozen=True, eq=False)
class RowCoordinate:
    """A coordinate between two markers."""

    name: str  #: in its joint
    kind: int  #: PUSH, TWIST, TWIST_B or SPAN
    x: Array = field(default_factory=lambda: ZERO)  #: axis of a distance; else normal to the axis x × z, (3,)
    y: Array = field(default_factory=lambda: ZERO)  #: direction of the other marker, (3,)
    z: Array = field(default_factory=lambda: ZERO)  #: direction of the one with the axis, from which y turns, (3,)
    parts: tuple[tuple[int, float], ...] = ((FORCE, 1.0),)  #: of the wrench that act along it, and their factors

    @property
    def is_angle(self) -> bool:
        """Whether it is an angle, else a distance."""
        return kind_of(self.kind).is_angle

    def direction(self, place: RelativePlace) -> Array:
        """Return E, (..., 3)."""
        if self.kind == PUSH:
            return place.A_a @ self.x
        if self.kind == SPAN:
            return place.d / np.sqrt(dot(place.d, place.d))[..., None]
        return (place.A_b if self.kind == TWIST_B else place.A_a) @ cross(self.x, self.z)

    def value(self, place: RelativePlace) -> Array:
        """Return the value, (...,); an angle between -pi and pi."""
        if not self.is_angle:
            return dot(self.direction(place), place.d)
        A, B = (place.A_b, place.A_a) if self.kind == TWIST_B else (place.A_a, place.A_b)
        angle = np.arctan2(-dot(A @ self.x, B @ self.y), dot(A @ self.z, B @ self.y))
        return np.asarray(-angle if self.kind == TWIST_B else angle)

    def moves(self, slip: Array, turning: Array) -> Array:
        """Return what changes it by its part along E: the slip v_B - v_A - omega_A × d, or omega_B - omega_A."""
        return turning if self.is_angle else slip

    def force(self, place: RelativePlace, w: Array) -> Array:
        """Return the force or torque that acts to increase it, (...,), of the wrench w, (..., size)."""
        own = np.sum([factor * w[..., part : part + 3] for part, factor in self.parts], axis=0)
        return -dot(own, self.direction(place))
