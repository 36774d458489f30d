"""Coordinates of the motion that couplers and user forces see, each with the force that acts to increase it."""

from dataclasses import dataclass, field

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.copies import frozen_copies
from floatframe.bodies.markers import Marker
from floatframe.checked_values import unit_vector
from floatframe.errors import ModelError

__all__ = ["AxialAngle", "AxialDistance", "Coordinate", "JointCoordinate", "PointDistance", "coordinate_words"]


@dataclass(frozen=True)
class JointCoordinate:
    """A coordinate of a joint: its distance or angle, free or prescribed."""

    joint: str  #: name of the joint
    coordinate: str  #: of it, such as "angle"


@frozen_copies
@dataclass(frozen=True, eq=False)
class AxialDistance:
    """Distance of the point of marker B from that of marker A along an axis of A; a force acts at the point of B."""

    marker_a: Marker
    marker_b: Marker
    axis: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))  #: in the axes of marker A, (3,)

    def __post_init__(self) -> None:
        object.__setattr__(self, "axis", unit_vector("AxialDistance: axis", self.axis))


@frozen_copies
@dataclass(frozen=True, eq=False)
class AxialAngle:
    """Angle of marker B about an axis of A, zero as placed; its rate is that of the angular velocity along the axis.

    Made for markers that turn against each other about that axis: where the axis of B tilts by a small angle, value
    and rate differ by its square.
    """

    marker_a: Marker
    marker_b: Marker
    axis: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))  #: in the axes of marker A, (3,)

    def __post_init__(self) -> None:
        object.__setattr__(self, "axis", unit_vector("AxialAngle: axis", self.axis))


@frozen_copies
@dataclass(frozen=True, eq=False)
class PointDistance:
    """Distance of the points of two markers; a force acts along the line between them."""

    marker_a: Marker
    marker_b: Marker


Coordinate = JointCoordinate | AxialDistance | AxialAngle | PointDistance


def coordinate_words(where: str, value: object) -> Coordinate:
    """Return a coordinate as given; `ModelError` if it is none."""
    if not isinstance(value, Coordinate):
        raise ModelError(
            f"{where}: expected a JointCoordinate, AxialDistance, AxialAngle or PointDistance, got {value!r}"
        )
    return value
