"""Joint coordinates during a motion: value, rate, and the force along them."""

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.words import nearest, quoted
from floatframe.engine.compiling.counted_angles import angle_of
from floatframe.engine.compiling.markers import MarkerData, joint_markers, marker_pose, n_q_of
from floatframe.engine.compiling.system import compiled_system
from floatframe.errors import ResultsError
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.joints import Joint
from floatframe.model.joints.rows import MOMENT, SPAN, TWIST_B, RelativePlace, RowCoordinate
from floatframe.model.joints.sliding import SlidingJoint
from floatframe.model.rotations import cross, dot
from floatframe.model.system import System
from floatframe.results.full_turns import through_turns
from floatframe.results.place_motion import PlaceMotion, as_moved, shape_motion, still_place
from floatframe.results.sliding_place import sliding_place
from floatframe.results.small_motions.rows import Rows
from floatframe.results.small_motions.small_motions import SmallMotions
from floatframe.results.trajectory import Trajectory

__all__ = ["CoordinateMotion", "force_rows", "joint_coordinate", "joint_coordinates"]


@dataclass(frozen=True, eq=False)
class CoordinateMotion:
    """A coordinate of a joint over time."""

    t: Array  #: (n_t,) [s]
    value: Array  #: distance, or angle counted through full turns, (n_t,) [m, rad]
    rate: Array  #: (n_t,) [m/s, rad/s]
    #: force or torque of the drive or of joint forces, positive if it acts to increase the coordinate, (n_t,) [N, N m]
    force: Array
    is_angle: bool = False  #: an angle [rad], else a distance [m]


def joint_coordinates(system: System, trajectory: Trajectory) -> dict[str, CoordinateMotion]:
    """Return all coordinates of all joints, by name "joint.coordinate"."""
    return {
        f"{joint.name}.{name}": joint_coordinate(system, trajectory, joint.name, name)
        for joint in system.joints
        for name in joint.coordinates
    }


def joint_coordinate(system: System, trajectory: Trajectory, joint: str, coordinate: str) -> CoordinateMotion:
    """Return a joint coordinate during a motion of the system.

    Raises
    ------
    ResultsError
        If there is no such joint or coordinate, or the motion is of another system.
    """
    names = [each.name for each in system.joints]
    if joint not in names or names != list(trajectory.head.joints):
        raise ResultsError(f"joint_coordinate: no joint {quoted(joint)} in the motion{nearest(joint, names)}")
    found: Joint = system.joints[names.index(joint)]
    if coordinate not in found.coordinates:
        raise ResultsError(
            f"joint_coordinate: joint {joint!r} has no coordinate {coordinate!r}"
            f"{nearest(coordinate, list(found.coordinates))}"
        )
    ends, own = as_placed(system, found, coordinate)
    if isinstance(found, SlidingJoint):
        return sliding_motion(system, trajectory, found, ends[1])
    assert own is not None
    a, b = (end_motion(system, trajectory, end) for end in ends)
    place = RelativePlace(a.axes, b.axes, b.position - a.position)
    slip = b.velocity - a.velocity - cross(a.omega, place.d)
    rate = dot(own.direction(place), own.moves(slip, b.omega - a.omega))
    w = trajectory.source.read("w")[:, trajectory.head.w0[names.index(joint)] :]
    value = own.value(place)
    if own.is_angle:
        value = through_turns(trajectory, f"coordinate {joint}.{coordinate}", angle_of(own, *ends), value, rate)
    return CoordinateMotion(a.t, value, rate, own.force(place, w), own.is_angle)


#: markers and coordinates by joint and name, cached because runs with events need them repeatedly
PLACED: WeakKeyDictionary[System, dict[tuple[str, str], tuple]] = WeakKeyDictionary()


def as_placed(
    system: System, joint: Joint, name: str
) -> tuple[tuple[MarkerData, MarkerData], RowCoordinate | None]:  # fmt: skip
    """Return the markers of a joint and one of its coordinates (None along a deformed line), as assembled."""
    known = PLACED.setdefault(system, {})
    key = joint.name, name
    if key not in known:
        ends = joint_markers(system, joint, compiled_system(system).placed)
        own = None if isinstance(joint, SlidingJoint) else row_coordinate(system, joint, ends, name)
        known[key] = ends, own
    return known[key]


def row_coordinate(system: System, joint: Joint, ends: tuple[MarkerData, MarkerData], name: str) -> RowCoordinate:
    """Return a coordinate of a joint with its directions, as assembled."""
    (r_a, A_a), (r_b, A_b) = (marker_pose(end, compiled_system(system).placed, n_q_of(system)) for end in ends)
    rows = joint.rows(A_a, A_b, r_b - r_a)
    return next(row.coordinate for row in rows if row.coordinate is not None and row.coordinate.name == name)


def force_rows(small: SmallMotions, joint: str, coordinate: str) -> Rows | None:
    """Return the change of the force along a coordinate, -E · dw - w · dE, one row; None along a deformed line.

    E rotates with the marker in which it is fixed, or with the line between the points of a distance.
    """
    found = next(each for each in small.system.joints if each.name == joint)
    if isinstance(found, SlidingJoint):
        return None
    ends = joint_markers(small.system, found, small.compiled.placed)
    own = row_coordinate(small.system, found, ends, coordinate)
    a, b = (small.place(end, joint) for end in ends)
    d = b.position - a.position
    E = own.direction(RelativePlace(a.axes, b.axes, d))
    first = small.wrench(joint).start
    loads = [(slice(first + part, first + part + 3), factor) for part, factor in own.parts]
    w = np.sum([factor * small.work.state.w[place] for place, factor in loads], axis=0)
    rows = small.by_motion(np.zeros((1, small.n_x)))
    for place, factor in loads:
        rows = rows - small.by_wrench(place, factor).turned(E)
    if own.kind == SPAN:
        return rows - (b.moved - a.moved).turned((w - (w @ E) * E) / np.linalg.norm(d))
    holder = b if own.kind == TWIST_B else a
    return rows - holder.turned.turned(np.cross(E, w))


def sliding_motion(
    system: System, trajectory: Trajectory, joint: SlidingJoint, marker_b: MarkerData
) -> CoordinateMotion:
    """Return the position along a deformed line; the force is that of its drive, zero if it slides freely."""
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


def end_motion(system: System, trajectory: Trajectory, end: MarkerData) -> PlaceMotion:
    """Return the motion of a marker, with its axes."""
    if end.body < 0:
        return still_place(trajectory.t, end.shape)
    body = system.bodies[end.body]
    motion = trajectory.body(body.name)
    if isinstance(body, FlexibleBody):
        motion, _ = as_moved(trajectory, body.name, body.reduced)
    return shape_motion(motion, end.shape)
