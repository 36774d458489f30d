"""Joint coordinates over a motion: value, rate, and the force along them."""

from dataclasses import dataclass, replace

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.words import nearest
from floatframe.bodies.flexible_body import FlexibleBody
from floatframe.compiling.markers import MarkerData, joint_markers, marker_pose, n_q_of
from floatframe.compiling.system import compiled_system
from floatframe.errors import ResultsError
from floatframe.joints import Joint, ScrewJoint
from floatframe.joints.rows import DISTANCE, GAUGE_B, MOMENT, MOMENT_B, SLIDE, TURN, TURN_B, Row
from floatframe.joints.sliding import SlidingJoint
from floatframe.results.place_motion import PlaceMotion, interface_motion, point_motion
from floatframe.results.sliding_place import sliding_place
from floatframe.results.trajectory import Trajectory
from floatframe.system import System

__all__ = ["CoordinateMotion", "joint_coordinate", "joint_coordinates"]


@dataclass(frozen=True, eq=False)
class CoordinateMotion:
    """A coordinate of a joint over time."""

    t: Array  #: (n_t,) [s]
    value: Array  #: distance, or angle without jumps, (n_t,) [m, rad]
    rate: Array  #: (n_t,) [m/s, rad/s]
    force: Array  #: force or torque that acts to increase it: of the drive, or of joint forces, (n_t,) [N, N m]
    is_angle: bool = False  #: an angle [rad], else a distance [m]


def joint_coordinates(system: System, trajectory: Trajectory) -> dict[str, CoordinateMotion]:
    """Return all coordinates of all joints by the name "joint.coordinate"."""
    return {
        f"{joint.name}.{name}": joint_coordinate(system, trajectory, joint.name, name)
        for joint in system.joints
        for name in joint.coordinates
    }


def joint_coordinate(system: System, trajectory: Trajectory, joint: str, coordinate: str) -> CoordinateMotion:
    """Return a coordinate of a joint over a motion of the system.

    Raises
    ------
    ResultsError
        If there is no such joint or coordinate, or the motion is one of another system.
    """
    names = [each.name for each in system.joints]
    if joint not in names or names != list(trajectory.head.joints):
        raise ResultsError(f"joint_coordinate: no joint {joint!r} in the motion{nearest(joint, names)}")
    found: Joint = system.joints[names.index(joint)]
    if coordinate not in found.coordinates:
        raise ResultsError(
            f"joint_coordinate: joint {joint!r} has no coordinate {coordinate!r}"
            f"{nearest(coordinate, list(found.coordinates))}"
        )
    placed = compiled_system(system).placed
    ends = joint_markers(system, found, placed)
    if isinstance(found, SlidingJoint):
        return sliding_motion(system, trajectory, found, ends[1])
    (r_a, A_a), (r_b, A_b) = (marker_pose(end, placed, n_q_of(system)) for end in ends)
    row = next(row for row in found.rows(A_a, A_b, r_b - r_a) if row.coordinate == coordinate)
    a, b = (end_motion(system, trajectory, end) for end in ends)
    d = b.position - a.position
    slip = b.velocity - a.velocity - np.cross(a.omega, d)
    w = trajectory.source.read("w")[:, trajectory.head.w0[names.index(joint)] :]
    if row.kind == DISTANCE:
        length = np.linalg.norm(d, axis=1)
        along = d / length[:, None]
        return CoordinateMotion(a.t, length, (along * slip).sum(axis=1), -(w[:, :3] * along).sum(axis=1))
    if isinstance(found, ScrewJoint):
        return screw_motion(found, row, coordinate, a, b, w)
    if row.kind in (GAUGE_B, TURN_B):  # about an axis of B: the angle of A about it, with the other sign
        axis = row.y if row.kind == GAUGE_B else np.cross(row.x, row.z)
        E, Z = b.axes @ axis, b.axes @ row.z
        D = a.axes @ (row.x if row.kind == GAUGE_B else row.y)
        angle = -np.unwrap(np.arctan2(dot(np.cross(E, Z), D), dot(Z, D)))
        return CoordinateMotion(
            a.t, angle, dot(E, b.omega - a.omega), -dot(w[:, MOMENT : MOMENT + 3], E), is_angle=True
        )
    is_angle = row.kind == TURN or (row.kind != SLIDE and bool(np.any(row.z)))
    if not is_angle:
        E = a.axes @ row.x
        return CoordinateMotion(a.t, dot(E, d), dot(E, slip), -dot(w[:, :3], E))
    axis = np.cross(row.x, row.z) if row.kind == TURN else row.x
    E, D = a.axes @ axis, b.axes @ row.y
    Z = a.axes @ row.z
    part = MOMENT_B if found.size == 9 else found.moment_b
    angle = np.unwrap(np.arctan2(dot(np.cross(E, Z), D), dot(Z, D)))
    return CoordinateMotion(a.t, angle, dot(E, b.omega - a.omega), -dot(w[:, part : part + 3], E), is_angle=True)


def sliding_motion(
    system: System, trajectory: Trajectory, joint: SlidingJoint, marker_b: MarkerData
) -> CoordinateMotion:
    """Return the place along a deformed line; the force is that of its drive, zero where it slides freely."""
    b = end_motion(system, trajectory, marker_b)
    place = sliding_place(system, trajectory, joint, b)
    first = trajectory.head.w0[[each.name for each in system.joints].index(joint.name)]
    w = trajectory.source.read("w")[:, first : first + joint.size]
    force = np.zeros(len(b.t))
    if joint.motions:
        force = -dot(w[:, :3], place.tangent)
        if joint.is_aligned:
            force = force - dot(w[:, MOMENT : MOMENT + 3], place.turning)
    return CoordinateMotion(b.t, place.s, place.rate, force)


def screw_motion(
    joint: ScrewJoint, row: Row, coordinate: str, a: PlaceMotion, b: PlaceMotion, w: Array
) -> CoordinateMotion:
    """Return angle or distance of a screw; torque T = -E · (N + slope F) of its drive, or the force T/slope."""
    slope = joint.lead / (2 * np.pi)
    E = a.axes @ joint.axis
    torque = -dot(w[:, MOMENT_B : MOMENT_B + 3] + slope * w[:, :3], E)
    if coordinate == "distance":
        d = b.position - a.position
        slip = b.velocity - a.velocity - np.cross(a.omega, d)
        return CoordinateMotion(a.t, dot(E, d), dot(E, slip), torque / slope)
    Z, D = a.axes @ row.z, b.axes @ row.y
    angle = np.unwrap(np.arctan2(dot(np.cross(E, Z), D), dot(Z, D)))
    return CoordinateMotion(a.t, angle, dot(E, b.omega - a.omega), torque, is_angle=True)


def dot(x: Array, y: Array) -> Array:
    """Return the products of two vectors at each time, (n_t,)."""
    return np.asarray((x * y).sum(axis=1))


def end_motion(system: System, trajectory: Trajectory, end: MarkerData) -> PlaceMotion:
    """Return the motion of a marker, with its axes."""
    if end.body < 0:
        n = len(trajectory.t)
        still = np.zeros((n, 3))
        axes = np.broadcast_to(end.triad, (n, 3, 3))
        return PlaceMotion(trajectory.t, np.tile(end.position, (n, 1)), still, still, axes, still)
    body = system.bodies[end.body]
    if not isinstance(body, FlexibleBody):
        place = point_motion(trajectory, body.name, end.position)
        triad = end.triad
    else:
        interface = next(i for i in body.reduced.interfaces if i.Psi is end.psi)
        place = interface_motion(trajectory, body.name, body.reduced, interface.name)
        triad = interface.triad.T @ end.triad
    return replace(place, axes=place.axes @ triad)
