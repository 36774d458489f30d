"""Sensors of points: position, velocity, acceleration and rotation of markers, angles, elastic displacement.

A point on a flexible body is an interface, a kept node (by number, or by position as the mesh was drawn), or the mean
of the nodes of an element or set.
"""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from cms.body.address import Address, FoundNodes
from cms.errors import BodyError
from fe_models.foundation.arrays import Array, GivenArray, given
from fe_models.foundation.records import checked_fields, frozen_copies
from floatframe.engine.compiling.counted_angles import CountedAngle, angle_of
from floatframe.engine.compiling.markers import MarkerData, find_body, find_marker
from floatframe.errors import ModelError
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.bodies.marker_shape import MarkerShape, interface_shape, is_turning, node_shape
from floatframe.model.bodies.markers import Marker, body_name
from floatframe.model.checked_values import unit_vector
from floatframe.model.joints.rows import TWIST, RowCoordinate
from floatframe.model.rotations import rotation_exp, rotation_log
from floatframe.model.system import System
from floatframe.results.full_turns import through_turns
from floatframe.results.joint_coordinates import end_motion
from floatframe.results.place_motion import PlaceMotion, angle_and_rate, node_motion, normals_of_axis
from floatframe.results.sensors.linear_columns import differentiated
from floatframe.results.sensors.measurement import Measurement, unit_words, vector_columns
from floatframe.results.small_motions.rows import LinearColumns
from floatframe.results.small_motions.small_motions import SmallMotions, SmallPlace
from floatframe.results.trajectory import Trajectory

__all__ = [
    "PLACE_QUANTITIES",
    "AngleSensor",
    "DisplacementSensor",
    "PlaceSensor",
    "found_at",
    "found_nodes",
    "is_at_node",
    "node_marker",
    "place_motion",
    "require_turning",
    "small_place",
]

ROUNDING_OF_MOTION = 1e-12  #: magnitude, relative to the system, below which a length or an angle is a rounding error

TURNING = ("rotation-vector", "angular-velocity")  #: quantities that describe the axes of a point
PLACE_QUANTITIES = {
    "position": "length",
    "velocity": "speed",
    "acceleration": "acceleration",
    "rotation-vector": "angle",
    "angular-velocity": "angular speed",
}


def place_motion(system: System, trajectory: Trajectory, where: str, marker: Marker) -> PlaceMotion:
    """Return the motion of a marker; on a flexible body, a position or node number refers to a kept node.

    Raises
    ------
    ModelError
        If the marker refers to an object that does not exist.
    """
    if is_at_node(system, marker):
        body, found = found_nodes(system, where, marker)
        return node_motion(trajectory, body.name, body.reduced, found.rows)
    return end_motion(system, trajectory, find_marker(system, where, marker))


def small_place(small: SmallMotions, where: str, marker: Marker) -> SmallPlace:
    """Return the linearised motion of a marker; on a flexible body, a position refers to kept nodes.

    A node whose rotation is not kept rotates with the frame of its body's file.

    Raises
    ------
    ModelError
        If the marker refers to an object that does not exist.
    """
    if not is_at_node(small.system, marker):
        return small.place(find_marker(small.system, where, marker))
    body, found = found_nodes(small.system, where, marker)
    place = small.place(node_marker(small.system, where, marker))
    frame = small.frame_place(body.name)
    seen = node_shape(body.reduced, found.rows, is_stiffened=body.is_stiffened)
    axes = frame.axes @ seen.pose(small.now.body(body.name).q[0])[1]
    turns = is_turning(body.reduced, found.rows)
    return replace(place, axes=axes, rotation=place.rotation if turns else frame.rotation)


def is_at_node(system: System, marker: Marker) -> bool:
    """Return whether a marker is at kept nodes of a flexible body, with axes of the body frame."""
    name = body_name(marker.body)
    body = next((each for each in system.bodies if each.name == name), None)
    return isinstance(body, FlexibleBody) and marker.address is not None


def found_nodes(system: System, where: str, marker: Marker) -> tuple[FlexibleBody, FoundNodes]:
    """Return a marker's flexible body and the kept nodes at which it is; `ModelError` if there are none."""
    body = system.body(body_name(marker.body))
    assert isinstance(body, FlexibleBody)  # ensured by `is_at_node`
    assert marker.address is not None
    return body, found_at(body, where, marker.address)


def found_at(body: FlexibleBody, where: str, address: Address, *, of_stress: bool = False) -> FoundNodes:
    """Return the kept nodes at an address; `ModelError` states the nearest ones if there are none."""
    try:
        return address.find(body.reduced, where, of_stress=of_stress, body=body.name)
    except BodyError as error:
        raise ModelError(str(error)) from error


def node_marker(system: System, where: str, marker: Marker) -> MarkerData:
    """Return the marker at kept nodes of a flexible body, in the engine's frame (mean axes)."""
    body, found = found_nodes(system, where, marker)
    shape = node_shape(body.moved, found.rows, is_stiffened=body.is_stiffened)
    return MarkerData(find_body(system, where, body.name), shape)


def require_turning(system: System, where: str, marker: Marker) -> None:
    """Raise `ModelError` for a node whose rotations were not kept, because only its frame would be measured."""
    if not is_at_node(system, marker):
        return
    body, found = found_nodes(system, where, marker)
    if not is_turning(body.reduced, found.rows):
        raise ModelError(
            f"{where}: {found.asked} of flexible body {body.name!r} keeps no rotation; keep it "
            f"(keep = [...] in the [body] of its job, keep= in Python), or take an interface: "
            f"{', '.join(interface.name for interface in body.reduced.interfaces) or 'it has none'}"
        )


def frame_marker(system: System, where: str, marker: Marker) -> MarkerData:
    """Return a marker with the axes of a flexible body's file frame, given in the engine's frame."""
    name = body_name(marker.body)
    body = system.body(name)
    assert isinstance(body, FlexibleBody)
    axes = body.moved.frame.axes.T @ body.reduced.frame.axes
    return MarkerData(find_body(system, where, name), MarkerShape(np.zeros(3), axes))


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class PlaceSensor:
    """Position, velocity, acceleration, rotation vector or angular velocity of a marker: x, y, z, size.

    In ground axes; with `relative_to`, relative to that marker and in its axes, with its own motion subtracted.

    Parameters
    ----------
    name
        Name of the sensor, unique in the system.
    marker
        Marker that is observed.
    quantity
        "position", "velocity", "acceleration", "rotation-vector" or "angular-velocity".
    relative_to
        Marker relative to which it is observed; None: the ground.
    """

    name: str
    marker: Marker
    quantity: Literal["position", "velocity", "acceleration", "rotation-vector", "angular-velocity"] = "position"
    relative_to: Marker | None = None

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return x, y, z and size over time."""
        where = f"sensor {self.name!r}: marker"
        if self.quantity in TURNING:
            for key, marker in (("marker", self.marker), ("relative_to", self.relative_to)):
                if marker is not None:
                    require_turning(system, f"sensor {self.name!r}: {key}", marker)
        place = place_motion(system, trajectory, where, self.marker)
        if self.relative_to is None:
            values = absolute(place, self.quantity)
        else:
            seen_from = place_motion(system, trajectory, f"sensor {self.name!r}: relative_to", self.relative_to)
            values = relative(place, seen_from, self.quantity)
        columns, units = vector_columns(values, unit_words(system.units, PLACE_QUANTITIES[self.quantity]))
        return Measurement(self.name, trajectory.t, columns, units)

    def linear(self, small: SmallMotions) -> LinearColumns:
        """Return x, y, z and size as linear functions of small motions, in axes that rotate with the steady motion.

        Raises
        ------
        ModelError
            For a rotation vector relative to the ground in a steady rotation, which differences cannot see to grow.
        """
        if self.quantity == "rotation-vector" and self.relative_to is None and small.is_turning:
            raise ModelError(
                f"sensor {self.name!r}: a rotation vector relative to the ground grows without limit in a steady "
                "rotation and is not linear about it; give relative_to = a body that rotates with the system"
            )
        return differentiated(self.measure, small)


def absolute(place: PlaceMotion, quantity: str) -> Array:
    """Return a quantity of a point in ground axes, (n_t, 3)."""
    if quantity == "rotation-vector":
        return rotation_log(place.axes)
    return np.asarray(
        {
            "position": place.position,
            "velocity": place.velocity,
            "acceleration": place.acceleration,
            "angular-velocity": place.omega,
        }[quantity]
    )


def relative(place: PlaceMotion, other: PlaceMotion, quantity: str) -> Array:
    """Return a quantity of a point relative to another point, in the axes of the latter, (n_t, 3)."""
    d = place.position - other.position
    if quantity == "position":
        seen = d
    elif quantity == "velocity":
        seen = place.velocity - other.velocity - np.cross(other.omega, d)
    elif quantity == "angular-velocity":
        seen = place.omega - other.omega
    elif quantity == "rotation-vector":
        return rotation_log(np.swapaxes(other.axes, -1, -2) @ place.axes)
    else:  # acceleration of the point relative to the rotating axes
        alpha = np.zeros_like(d) if other.alpha is None else other.alpha
        slip = place.velocity - other.velocity - np.cross(other.omega, d)
        seen = (
            place.acceleration
            - other.acceleration
            - np.cross(alpha, d)
            - np.cross(other.omega, np.cross(other.omega, d))
            - 2 * np.cross(other.omega, slip)
        )
    return np.asarray(np.einsum("tba,tb->ta", other.axes, seen))


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class AngleSensor:
    """The rotation angle of marker B relative to marker A about an axis of A, counted through full turns.

    A run counts the turns for the sensors of its system in every step. A sensor defined later follows the rates at the
    outputs, and raises an error if these are too far apart.

    Parameters
    ----------
    name
        Name of the sensor, unique in the system.
    marker_a
        Marker A, from which the angle is counted.
    marker_b
        Marker B, whose angle is measured.
    axis
        Direction of the axis, in the axes of marker A, (3,).
    """

    name: str
    marker_a: Marker
    marker_b: Marker
    axis: GivenArray = given((0.0, 0.0, 1.0))

    def __post_init__(self) -> None:
        object.__setattr__(self, "axis", unit_vector(f"sensor {self.name!r}: axis", self.axis))

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return the angle over time."""
        a, b = (
            place_motion(system, trajectory, f"sensor {self.name!r}: {key}", marker)
            for key, marker in (("marker_a", self.marker_a), ("marker_b", self.marker_b))
        )
        value, rate = angle_and_rate(a, b, *normals_of_axis(self.axis))
        angle = through_turns(trajectory, f"sensor {self.name!r}", self.counted_angle(system), value, rate)
        return Measurement(self.name, trajectory.t, {"angle": angle}, {"angle": "rad"})

    def counted_angle(self, system: System) -> CountedAngle:
        """Return the angle that a run counts through full turns, between undeformed bodies."""
        ends = [
            frame_marker(system, where, marker) if is_at_node(system, marker) else find_marker(system, where, marker)
            for marker, where in (
                (self.marker_a, f"sensor {self.name!r}: marker_a"),
                (self.marker_b, f"sensor {self.name!r}: marker_b"),
            )
        ]
        x, y = normals_of_axis(self.axis)
        return angle_of(RowCoordinate("angle", TWIST, x=-y, z=x, y=x), *ends)


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class DisplacementSensor:
    """Elastic displacement (x, y, z, size) of an interface or node of a flexible body in body axes, from all modes.

    It is relative to the body frame of the modal file: in mean axes, less than relative to a clamped end. With
    `relative_to`, a place of the same body, it is what an observer at that place sees, who moves and rotates with it.

    Parameters
    ----------
    name
        Name of the sensor, unique in the system.
    marker
        An interface, or a kept node by number or position.
    relative_to
        Place of the same body relative to which it is observed, such as a clamped end; None: the body frame.
    """

    name: str
    marker: Marker
    relative_to: Marker | None = None

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return x, y, z and size over time."""
        body, shape = self.shape_of(system, "marker", self.marker)
        q = trajectory.body(body.name).q
        moved = shape.deformation(q)[:, :3]
        if self.relative_to is not None:
            require_turning(system, f"sensor {self.name!r}: relative_to", self.relative_to)
            other, seen_from = self.shape_of(system, "relative_to", self.relative_to)
            if other.name != body.name:
                raise ModelError(
                    f"sensor {self.name!r}: relative_to: expected a place of body {body.name!r}, got one of "
                    f"{other.name!r}; a position sensor with relative_to observes another body"
                )
            base, arm = seen_from.deformation(q), shape.position - seen_from.position
            moved = np.einsum("tba,tb->ta", rotation_exp(base[:, 3:]), arm + moved - base[:, :3]) - arm
        columns, units = vector_columns(moved, system.units.length_symbol)
        return Measurement(self.name, trajectory.t, columns, units)

    def shape_of(self, system: System, key: str, marker: Marker) -> tuple[FlexibleBody, MarkerShape]:
        """Return the body and the shape of a marker of the sensor, in the frame of the body's file."""
        name, where = body_name(marker.body), f"sensor {self.name!r}: {key}"
        if is_at_node(system, marker):
            body, found = found_nodes(system, where, marker)
            return body, node_shape(body.reduced, found.rows, is_stiffened=False)
        find_marker(system, where, marker)  # raises for an unknown body or interface
        of_system = next((each for each in system.bodies if each.name == name), None)
        if not isinstance(of_system, FlexibleBody):
            raise ModelError(f"sensor {self.name!r}: body {name!r} is not flexible; it has no elastic displacement")
        assert marker.interface is not None  # ensured by `find_marker`
        return of_system, interface_shape(of_system.reduced, marker.interface, is_stiffened=of_system.is_stiffened)
