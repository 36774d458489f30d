"""Quantities computed from a motion: motion of interfaces and points, angles, stress.

The kinematics of a marker are in bodies/marker_shape.py.
"""

from dataclasses import dataclass, fields

import numpy as np

from cms.body.address import Address
from cms.body.reduced_body import ReducedBody
from cms.body.stress import stress_of, von_mises_of
from cms.errors import BodyError
from fe_models.body.kept_nodes import TOLERANCE
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.presentation import presented
from floatframe.errors import ResultsError
from floatframe.model.bodies.marker_shape import (
    BodyFrameMotion,
    MarkerShape,
    MotionInBody,
    interface_shape,
    marker_motion,
    motion_in_body,
    node_shape,
)
from floatframe.model.bodies.mean_axes import FrameMotion, mean_axes
from floatframe.model.rotations import cross, dot, rotation_matrix
from floatframe.results.full_turns import followed_angle
from floatframe.results.recovery import require_same_modes
from floatframe.results.trajectory import BodyMotion, Trajectory

__all__ = [
    "PlaceMotion",
    "angle_and_rate",
    "interface_motion",
    "largest_von_mises",
    "nodal_stress",
    "node_motion",
    "normals_of_axis",
    "point_motion",
    "rotation_angle",
    "shape_motion",
    "still_place",
    "stress_modes",
]


@presented
@dataclass(frozen=True, eq=False)
class PlaceMotion:
    """Motion over time of a point with axes, in ground axes."""

    t: Array  #: output times, (n_t,) [s]
    position: Array  #: position of the point, (n_t, 3) [m]
    velocity: Array  #: velocity of the point, (n_t, 3) [m/s]
    acceleration: Array  #: acceleration of the point, (n_t, 3) [m/s²]
    axes: Array  #: axes at the point as columns, (n_t, 3, 3)
    omega: Array  #: angular velocity of the axes, (n_t, 3) [rad/s]
    alpha: Array | None = None  #: angular acceleration of the axes, (n_t, 3) [rad/s²]; None if they do not rotate


def interface_motion(trajectory: Trajectory, body: str, reduced: ReducedBody, interface: str) -> PlaceMotion:
    """Return the motion of an interface's reference point with its axes.

    Parameters
    ----------
    trajectory
        The motion.
    body
        Name of a flexible body in it.
    reduced
        The reduced body of that flexible body.
    interface
        Name of one of its interfaces.

    Raises
    ------
    ResultsError
        If there is no such body, or `reduced` does not match it.
    BodyError
        If there is no such interface.
    """
    require_same_modes(trajectory, body, reduced)
    motion, moved = as_moved(trajectory, body, reduced)
    is_stiffened = trajectory.entry(body)[1].is_stiffened
    return shape_motion(motion, interface_shape(moved, interface, is_stiffened=is_stiffened))


def shape_motion(motion: BodyMotion, shape: MarkerShape) -> PlaceMotion:
    """Return the motion of a marker on a body, both given in the same frame."""
    return place_of(motion, motion_in_body(shape, motion.q, motion.q_dot, motion.q_ddot))


def still_place(t: Array, shape: MarkerShape) -> PlaceMotion:
    """Return the constant motion of a marker on the ground."""
    still = np.zeros((len(t), 3))
    axes = np.broadcast_to(shape.triad, (len(t), 3, 3))
    return PlaceMotion(t, still + shape.position, still, still, axes, still)


def as_moved(trajectory: Trajectory, body: str, reduced: ReducedBody) -> tuple[BodyMotion, ReducedBody]:
    """Return body motion and reduced body in the engine's frame, in which joint constraints are exact."""
    motion = trajectory.body(body)
    axes = mean_axes(reduced) if trajectory.entry(body)[1].is_stiffened else None
    if axes is None:
        return motion, reduced
    told = FrameMotion(
        motion.r, motion.p, motion.q, motion.v, motion.omega_B, motion.q_dot, motion.v_dot, motion.omega_B_dot,
        motion.q_ddot,
    )  # fmt: skip
    moved = axes.to_mean(told)
    return BodyMotion(motion.t, *(getattr(moved, each.name) for each in fields(moved))), axes.reduced


def node_motion(trajectory: Trajectory, body: str, reduced: ReducedBody, node: int | IntArray) -> PlaceMotion:
    """Return the motion of a kept node (row of `ReducedBody.nodes`), or the mean motion of several kept nodes.

    Its displacement in the body is that of `nodal_displacements`: Phi q, plus ½ Σ q_k q_l g_kl for a stiffened body
    with quadratic modes. Its axes are those of the body frame, rotated by the rotation of the node if this is kept
    (`floatframe.model.bodies.marker_shape.node_shape`).

    Raises
    ------
    ResultsError
        If there is no such body or node, or `reduced` does not match it.
    """
    require_same_modes(trajectory, body, reduced)
    rows = np.atleast_1d(node)
    if not len(rows) or rows.min() < 0 or rows.max() >= len(reduced.nodes):
        raise ResultsError(f"body {body!r}: node: expected rows 0 to {len(reduced.nodes) - 1}, got {node}")
    is_stiffened = trajectory.entry(body)[1].is_stiffened
    return shape_motion(trajectory.body(body), node_shape(reduced, node, is_stiffened=is_stiffened))


def point_motion(
    trajectory: Trajectory,
    body: str,
    point: Array | tuple[float, float, float],
    *,
    reduced: ReducedBody | None = None,
    tolerance: float = TOLERANCE,
    undeformed: bool = False,
) -> PlaceMotion:
    """Return the motion of a point on a body with the axes of its frame; on a flexible body the point follows a node.

    Parameters
    ----------
    trajectory, body
        The motion, and the name of a body.
    point
        Position in the frame of the body, (3,) [m].
    reduced
        For a flexible body: the reduced body of the run. A kept node must be at the point; its motion is returned
        (`node_motion`), as `interface_motion` does for interfaces.
    tolerance
        Largest distance of that node, relative to the size of the body.
    undeformed
        Whether the point of a flexible body moves only with the body frame.

    Raises
    ------
    ResultsError
        If there is no such body; or if it is flexible, and `reduced` is missing or has no kept node at the point.
    """
    if reduced is not None and undeformed:
        raise ResultsError(f"body {body!r}: expected either its reduced body or undeformed=True, got both")
    if reduced is not None:
        place = reduced.frame.origin + reduced.frame.axes @ np.asarray(point, dtype=float)
        try:
            found = Address(position=place, tolerance=tolerance).find(reduced, "point_motion", body=body)
        except BodyError as error:
            raise ResultsError(str(error)) from error
        return node_motion(trajectory, body, reduced, found.rows)
    if trajectory.entry(body)[1].n_q and not undeformed:
        raise ResultsError(
            f"body {body!r} is flexible: a point fixed in its frame does not deform with it; give its modal file, "
            "reduced=, so that the kept node there is used, or undeformed=True for the motion of the frame alone"
        )
    motion = trajectory.body(body)
    shape = MarkerShape(np.asarray(point, dtype=float), np.eye(3))
    return place_of(motion, motion_in_body(shape, motion.q, motion.q_dot, motion.q_ddot))


def place_of(motion: BodyMotion, own: MotionInBody) -> PlaceMotion:
    """Return the absolute motion of a point from its motion relative to the body."""
    body = BodyFrameMotion(
        motion.r, rotation_matrix(motion.p), motion.v, motion.omega_B, motion.v_dot, motion.omega_B_dot
    )
    return PlaceMotion(motion.t, **marker_motion(body, own)._asdict())


def rotation_angle(a: PlaceMotion, b: PlaceMotion, axis: Array | tuple[float, float, float]) -> Array:
    """Return the rotation angle of axes b relative to axes a about an axis fixed in a, (n_t,) [rad].

    It is zero if the axes of both coincide. Full turns are counted by extrapolation of the rate from time to time.

    Raises
    ------
    ResultsError
        If the axis is zero, or the times are too far apart to follow the angle.
    """
    return followed_angle("rotation_angle", a.t, *angle_and_rate(a, b, *normals_of_axis(axis)))


def normals_of_axis(axis: Array | tuple[float, float, float]) -> tuple[Array, Array]:
    """Return two directions x and y normal to an axis, for which x × y is the axis."""
    e = np.asarray(axis, dtype=float)
    size = np.linalg.norm(e)
    if size == 0:
        raise ResultsError("rotation_angle: axis: expected a direction, got the zero vector")
    e = e / size
    helper = np.eye(3)[int(np.argmin(np.abs(e)))]
    x = np.cross(e, helper)
    x /= np.linalg.norm(x)
    return x, np.cross(e, x)


def angle_and_rate(a: PlaceMotion, b: PlaceMotion, x: Array, y: Array) -> tuple[Array, Array]:
    """Return the angle from x of a (towards y) to x of b, between -pi and pi, and its rate, (n_t,).

    With C and S, cosine and sine times a factor: rate = (C Y - S X) · (omega × D) / (C² + S²), ground axes.
    """
    X, Y, D = a.axes @ x, a.axes @ y, b.axes @ x
    C, S = dot(X, D)[..., None], dot(Y, D)[..., None]
    slope = cross(D, C * Y - S * X) / np.maximum(C**2 + S**2, np.finfo(float).tiny)
    return np.arctan2(S, C)[..., 0], dot(slope, b.omega - a.omega)


def nodal_stress(trajectory: Trajectory, body: str, reduced: ReducedBody, i_time: int) -> Array:
    """Return the stress at the kept nodes at an output time, axes of B, (n_kept, 6) [Pa]: xx yy zz yz xz xy.

    All modes including static ones contribute; stresses due to interface loads are exact if the mode set is statically
    complete.

    Parameters
    ----------
    trajectory
        The motion.
    body
        Name of a flexible body in it.
    reduced
        The reduced body of that flexible body, with stress modes.
    i_time
        Index of the output time.

    Raises
    ------
    ResultsError
        If the modal file has no stress modes, or `reduced` does not match the body.
    """
    require_same_modes(trajectory, body, reduced)
    return np.asarray(stress_of(stress_modes(body, reduced), trajectory.body(body).q[i_time]))


def largest_von_mises(
    trajectory: Trajectory, body: str, reduced: ReducedBody, *, rows: IntArray | None = None
) -> tuple[Array, IntArray]:
    """Return the largest von Mises stress of the kept nodes over time, (n_t,) [Pa], and the row of its node, (n_t,).

    Parameters
    ----------
    trajectory
        The motion.
    body
        Name of a flexible body in it.
    reduced
        The reduced body of that flexible body, with stress modes.
    rows
        Rows of the nodes to consider, (n,); None: all.
    """
    require_same_modes(trajectory, body, reduced)
    modes = stress_modes(body, reduced)
    rows = np.arange(len(modes)) if rows is None else np.asarray(rows)
    largest, where = [np.zeros(0)], [np.zeros(0, np.int64)]
    for stress in von_mises_of(modes[rows], trajectory.body(body).q):
        where.append(rows[stress.argmax(axis=1)])
        largest.append(stress.max(axis=1))
    return np.concatenate(largest), np.concatenate(where)


def stress_modes(body: str, reduced: ReducedBody) -> Array:
    """Return the stress modes of a body, (n_kept, 6, n_q); `ResultsError` if its file has none."""
    if reduced.stress is None:
        raise ResultsError(
            f"body {body!r}: its modal file contains no stress modes; reduce it again with stress, from a mesh, "
            "because matrices alone have no stress"
        )
    return reduced.stress
