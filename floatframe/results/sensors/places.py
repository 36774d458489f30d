"""Sensors of places: position, velocity, acceleration and rotation of markers, angles, elastic displacement.

A place on a flexible body is an interface, or the kept node nearest to a position (in mesh axes of the body frame B).
"""

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from fe_models.foundation.arrays import Array
from fe_models.foundation.copies import frozen_copies
from floatframe.bodies.flexible_body import FlexibleBody
from floatframe.bodies.marker_shape import MarkerShape
from floatframe.bodies.markers import Marker, body_name
from floatframe.checked_values import unit_vector
from floatframe.compiling.counted_angles import CountedAngle, angle_of
from floatframe.compiling.markers import MarkerData, find_body, find_marker
from floatframe.errors import ModelError
from floatframe.joints.rows import TWIST, RowCoordinate
from floatframe.results.full_turns import through_turns
from floatframe.results.joint_coordinates import end_motion
from floatframe.results.place_motion import PlaceMotion, angle_and_rate, node_motion, normals_of_axis
from floatframe.results.sensors.measurement import Measurement, unit_words, vector_columns
from floatframe.results.trajectory import Trajectory
from floatframe.system import System

__all__ = [
    "PLACE_QUANTITIES",
    "AngleSensor",
    "DisplacementSensor",
    "PlaceSensor",
    "is_at_node",
    "nearest_node",
    "place_motion",
]

FAR = 0.1  #: of the size of a body: from a node that is meant to stand for a position

PLACE_QUANTITIES = {
    "position": "length",
    "velocity": "speed",
    "acceleration": "acceleration",
    "rotation-vector": "angle",
    "angular-velocity": "angular speed",
}


def place_motion(system: System, trajectory: Trajectory, where: str, marker: Marker) -> PlaceMotion:
    """Return the motion of a marker; on a flexible body a position stands for the kept node nearest to it.

    Raises
    ------
    ModelError
        If the marker names what does not exist.
    """
    if is_at_node(system, marker):
        assert marker.position is not None  # so it is
        body = system.body(body_name(marker.body))
        assert isinstance(body, FlexibleBody)
        return node_motion(trajectory, body.name, body.reduced, nearest_node(body, marker.position))
    return end_motion(system, trajectory, find_marker(system, where, marker))


def is_at_node(system: System, marker: Marker) -> bool:
    """Whether a marker stands for a kept node of a flexible body, with the axes of its frame."""
    name = body_name(marker.body)
    body = next((each for each in system.bodies if each.name == name), None)
    return isinstance(body, FlexibleBody) and marker.position is not None


def frame_marker(system: System, where: str, marker: Marker) -> MarkerData:
    """Return a marker with the axes of the file's frame of a flexible body, undeformed, as the engine has the body."""
    name = body_name(marker.body)
    body = system.body(name)
    assert isinstance(body, FlexibleBody)
    axes = body.moved.frame.axes.T @ body.reduced.frame.axes
    return MarkerData(find_body(system, where, name), MarkerShape(np.zeros(3), axes))


def nearest_node(body: FlexibleBody, position: Array) -> int:
    """Return the index of the kept node nearest to a position in mesh axes, as the mesh was drawn.

    Raises
    ------
    ModelError
        If the position is farther from it than a tenth of the body, and than nodes are from each other.
    """
    frame, nodes = body.reduced.frame, body.reduced.nodes
    local = (np.asarray(position, dtype=float) - frame.origin) @ frame.axes
    away = np.linalg.norm(nodes - local, axis=1)
    nearest = int(np.argmin(away))
    size = float(np.linalg.norm(np.ptp(nodes, axis=0)))
    if away[nearest] > FAR * size and len(nodes) > 1:
        spacing = float(cKDTree(nodes).query(nodes, k=2)[0][:, 1].max())
        if away[nearest] > spacing:
            x, y, z = frame.origin + frame.axes @ nodes[nearest]
            raise ModelError(
                f"flexible body {body.name!r}: position {np.asarray(position).tolist()} is {away[nearest]:.3g} away "
                f"from its nearest kept node, [{x:.4g}, {y:.4g}, {z:.4g}]; the body has a size of {size:.3g}: give a "
                "position in the axes and units of its mesh, at a node that the file keeps"
            )
    return nearest


@frozen_copies
@dataclass(frozen=True, eq=False)
class PlaceSensor:
    """Position, velocity, acceleration, rotation vector or angular velocity of a marker.

    In ground axes; with `relative_to` as that marker sees it: in its axes, from its point, its own motion taken away.
    """

    name: str
    marker: Marker
    quantity: str = "position"  #: one of PLACE_QUANTITIES
    relative_to: Marker | None = None

    def __post_init__(self) -> None:
        if self.quantity not in PLACE_QUANTITIES:
            raise ModelError(
                f"sensor {self.name!r}: quantity: expected one of {', '.join(PLACE_QUANTITIES)}, got {self.quantity!r}"
            )

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return x, y, z and size over time."""
        where = f"sensor {self.name!r}: marker"
        place = place_motion(system, trajectory, where, self.marker)
        if self.relative_to is None:
            values = absolute(place, self.quantity)
        else:
            seen_from = place_motion(system, trajectory, f"sensor {self.name!r}: relative_to", self.relative_to)
            values = relative(place, seen_from, self.quantity)
        columns, units = vector_columns(values, unit_words(system.units, PLACE_QUANTITIES[self.quantity]))
        return Measurement(self.name, trajectory.t, columns, units)


def absolute(place: PlaceMotion, quantity: str) -> Array:
    """Return a quantity of a place in ground axes, (n_t, 3)."""
    if quantity == "rotation-vector":
        return np.asarray(Rotation.from_matrix(place.axes).as_rotvec())
    return np.asarray(
        {
            "position": place.position,
            "velocity": place.velocity,
            "acceleration": place.acceleration,
            "angular-velocity": place.omega,
        }[quantity]
    )


def relative(place: PlaceMotion, other: PlaceMotion, quantity: str) -> Array:
    """Return a quantity of a place as another place sees it, in the axes of that, (n_t, 3)."""
    d = place.position - other.position
    if quantity == "position":
        seen = d
    elif quantity == "velocity":
        seen = place.velocity - other.velocity - np.cross(other.omega, d)
    elif quantity == "angular-velocity":
        seen = place.omega - other.omega
    elif quantity == "rotation-vector":
        turned = np.einsum("tba,tbc->tac", other.axes, place.axes)
        return np.asarray(Rotation.from_matrix(turned).as_rotvec())
    else:  # acceleration: of the point against the axes that turn
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
class AngleSensor:
    """The angle by which marker B has turned against marker A about an axis of A, with all its turns.

    A run counts the turns of the sensors that its system has, step by step; a sensor made later goes by the rates at
    the outputs, and refuses where these are too far apart.
    """

    name: str
    marker_a: Marker
    marker_b: Marker
    axis: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))  #: in the axes of marker A, (3,)

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
        """Return the angle as a run counts its turns: that of the bodies, undeformed."""
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
class DisplacementSensor:
    """Elastic displacement of an interface or node of a flexible body, in axes of its frame B, all modes included."""

    name: str
    marker: Marker  #: an interface, or a position that stands for the nearest kept node

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return x, y, z and size over time."""
        name = body_name(self.marker.body)
        body = next((each for each in system.bodies if each.name == name), None)
        if not isinstance(body, FlexibleBody):
            find_marker(system, f"sensor {self.name!r}: marker", self.marker)  # names an unknown body
            raise ModelError(f"sensor {self.name!r}: body {name!r} is not flexible; it has no elastic displacement")
        if self.marker.position is not None:
            moved = trajectory.body(name).q @ body.reduced.Phi[nearest_node(body, self.marker.position)].T
        else:
            end = find_marker(system, f"sensor {self.name!r}: marker", self.marker)
            moved = end.shape.deformation(trajectory.body(name).q)[:, :3]
        columns, units = vector_columns(moved, system.units.length_symbol)
        return Measurement(self.name, trajectory.t, columns, units)
