"""Coordinates of the motion for couplers and user forces; each has a force that acts to increase it."""

from dataclasses import dataclass

from fe_models.foundation.arrays import GivenArray, given
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields, frozen_copies
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker
from floatframe.model.checked_values import unit_vector

__all__ = ["AxialAngle", "AxialDistance", "Coordinate", "JointCoordinateName", "PointDistance", "coordinate_of"]


@presented
@dataclass(frozen=True)
@checked_fields(ModelError)
class JointCoordinateName:
    """Names of a joint and of one of its coordinates, "hub.angle" as text; `JointCoordinate` adds the measurement.

    Parameters
    ----------
    joint
        Name of the joint.
    coordinate
        Name of its coordinate, such as "angle".
    """

    joint: str
    coordinate: str

    @staticmethod
    def of_name(name: str) -> "JointCoordinateName":
        """Return the coordinate for a text "joint.coordinate" or "joint coordinate".

        Raises
        ------
        ModelError
            If the text is not of this form.
        """
        joint, _, coordinate = name.rpartition("." if "." in name else " ")
        if not (joint and coordinate):
            raise ModelError(f"coordinate {name!r}: expected joint.coordinate, such as 'hub.angle'")
        return JointCoordinateName(joint, coordinate)


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class AxialDistance:
    """Distance of marker B's point from marker A's point along an axis of A; its force acts at the point of B.

    Parameters
    ----------
    marker_a
        Marker A.
    marker_b
        Marker B.
    axis
        Direction of the axis, in the axes of marker A, (3,).
    """

    marker_a: Marker
    marker_b: Marker
    axis: GivenArray = given((0.0, 0.0, 1.0))

    def __post_init__(self) -> None:
        object.__setattr__(self, "axis", unit_vector("AxialDistance: axis", self.axis))


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class AxialAngle:
    """Angle of marker B about an axis of A, zero when assembled; its rate is the angular velocity along the axis.

    It is intended for markers that rotate relative to each other about that axis. If the axis of B tilts by a small
    angle, value and rate are inconsistent by the square of this angle.

    Parameters
    ----------
    marker_a
        Marker A.
    marker_b
        Marker B.
    axis
        Direction of the axis, in the axes of marker A, (3,).
    """

    marker_a: Marker
    marker_b: Marker
    axis: GivenArray = given((0.0, 0.0, 1.0))

    def __post_init__(self) -> None:
        object.__setattr__(self, "axis", unit_vector("AxialAngle: axis", self.axis))


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class PointDistance:
    """Distance between the points of two markers; its force acts along the line between them.

    Parameters
    ----------
    marker_a
        Marker A.
    marker_b
        Marker B.
    """

    marker_a: Marker
    marker_b: Marker


Coordinate = JointCoordinateName | AxialDistance | AxialAngle | PointDistance


def coordinate_of(where: str, value: object) -> Coordinate:
    """Return a coordinate, that of a joint as its names alone; `ModelError` if it is not a coordinate."""
    if isinstance(value, str):
        try:
            return JointCoordinateName.of_name(value)
        except ModelError as error:
            raise ModelError(f"{where}: {error}") from None
    if isinstance(value, JointCoordinateName):
        return JointCoordinateName(value.joint, value.coordinate)
    if not isinstance(value, Coordinate):
        raise ModelError(
            f"{where}: expected a coordinate of a joint ('hub.angle', JointCoordinate), AxialDistance, AxialAngle or "
            f"PointDistance, got {value!r}"
        )
    return value
