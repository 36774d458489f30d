"""Markers of joints during a motion, and the directions of joint coordinates as placed."""

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from floatframe.engine.compiling.markers import MarkerData, joint_markers, marker_pose, n_q_of
from floatframe.engine.compiling.system import compiled_system
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.bodies.marker_shape import interface_shape
from floatframe.model.bodies.markers import body_name
from floatframe.model.joints import Joint
from floatframe.model.joints.rows import RowCoordinate
from floatframe.model.joints.sliding import SlidingJoint, line_triad
from floatframe.model.rotations import cross, dot, left_jacobian, rotated, rotation_matrix
from floatframe.model.system import System
from floatframe.results.place_motion import PlaceMotion, as_moved, shape_motion, still_place
from floatframe.results.trajectory import Trajectory

__all__ = ["SlidingPlace", "as_placed", "end_motion", "sliding_place"]


# the coordinate of a sliding joint during a motion: the position of B along the deformed line -------------------------


MOST = 30


@dataclass(frozen=True, eq=False)
class SlidingPlace:
    """Position of marker B along a deformed line over time."""

    s: Array  #: distance from marker A along the undeformed line, (n_t,) [m]
    rate: Array  #: rate of s, (n_t,) [m/s]
    tangent: Array  #: unit tangent of the deformed line, ground axes, (n_t, 3)
    #: derivative of the line's rotation by its deformed arc length (by s, divided by |dr/ds|), ground axes, (n_t, 3)
    #: [1/m]
    turning: Array


def sliding_place(system: System, trajectory: Trajectory, joint: SlidingJoint, end: PlaceMotion) -> SlidingPlace:
    """Return the position of marker B along the line, from its motion, as in kernels/joints/deformed_line.py."""
    name = body_name(joint.marker_a.body)
    body = system.body(name)
    assert isinstance(body, FlexibleBody)
    motion, reduced = as_moved(trajectory, name, body.reduced)
    points = np.array([reduced.interface(station).position for station in joint.stations])
    places, triad = line_triad(f"joint {joint.name!r}", points, joint.normal)
    e = triad[:, 0]
    shapes = [interface_shape(reduced, i, is_stiffened=body.is_stiffened) for i in joint.stations]
    deformed = [shape.deformation(motion.q) for shape in shapes]
    rates = [shape.rates(motion.q, motion.q_dot, motion.q_ddot)[0] for shape in shapes]
    R = rotation_matrix(motion.p)
    x = rotated(np.swapaxes(R, 1, 2), end.position - motion.r)
    v = rotated(np.swapaxes(R, 1, 2), end.velocity - motion.v) - cross(motion.omega_B, x)
    line = Line(places, e, np.array(deformed), np.array(rates))
    s = (x - points[0]) @ e
    for _ in range(MOST):  # Gauss-Newton: the joint keeps the gap at zero
        t = e + line.displacement(s, 1)
        gap = x - points[0] - s[:, None] * e - line.displacement(s, 0)
        change = dot(gap, t) / dot(t, t)
        s = s + change
        if np.abs(change).max(initial=0.0) <= 1e-14 * places[-1]:
            break
    t = e + line.displacement(s, 1)
    size = np.linalg.norm(t, axis=1)
    rate = dot(t, v - line.displacement(s, 0, of_rates=True)) / size**2
    tangent = rotated(R, t / size[:, None])
    angle, by_s = line.rotation(s)
    turning = rotated(R @ left_jacobian(angle), by_s)
    return SlidingPlace(s, rate, tangent, turning / size[:, None])


@dataclass(frozen=True, eq=False)
class Line:
    """Cubic polynomials through the stations of a line over time, in body axes."""

    places: Array  #: undeformed positions of the stations along the line, (n,)
    e: Array  #: unit vector along the undeformed line, (3,)
    deformed: Array  #: displacement and rotation of the stations, (n, n_t, 6)
    rates: Array  #: rates of `deformed`, (n, n_t, 6)

    def piece(self, s: Array) -> tuple[IntArray, Array, Array]:
        """Return, for each time, index and length of the interval that contains s, and the distance from its start."""
        j = np.clip(np.searchsorted(self.places[1:-1], s, side="left"), 0, len(self.places) - 2)
        h = self.places[j + 1] - self.places[j]
        return j, h, s - self.places[j]

    def displacement(self, s: Array, order: int, *, of_rates: bool = False) -> Array:
        """Return the displacement D at s, or its derivative by s of the given order, (n_t, 3)."""
        table = self.rates if of_rates else self.deformed
        j, h, along = self.piece(s)
        x = np.clip(along / h, 0.0, 1.0)
        over = along - x * h
        a = [x**2 * (3 - 2 * x), 6 * x * (1 - x) / h, (6 - 12 * x) / h**2][order]
        b_1 = [h * x * (1 - x) ** 2, 1 + x * (3 * x - 4), (6 * x - 4) / h][order]
        b_2 = [h * x**2 * (x - 1), x * (3 * x - 2), (6 * x - 2) / h][order]
        if order == 0:
            b_1, b_2 = b_1 + np.minimum(over, 0.0), b_2 + np.maximum(over, 0.0)
        elif order == 2:
            inside = over == 0
            a, b_1, b_2 = a * inside, b_1 * inside, b_2 * inside
        times = np.arange(len(s))
        first, second = table[j, times], table[j + 1, times]
        own = a[:, None] * (second[:, :3] - first[:, :3]) + (first[:, :3] if order == 0 else 0.0)
        return np.asarray(own + np.cross(b_1[:, None] * first[:, 3:] + b_2[:, None] * second[:, 3:], self.e))

    def rotation(self, s: Array) -> tuple[Array, Array]:
        """Return the rotation vector of the line at s and its derivative by s, (n_t, 3) each."""
        j, h, along = self.piece(s)
        w = np.clip(along / h, 0.0, 1.0)
        times = np.arange(len(s))
        first, second = (self.deformed[k, times, 3:] @ self.e for k in (j, j + 1))
        twist, inside = first + w * (second - first), (along >= 0) & (along <= h)
        value = np.cross(self.e, self.displacement(s, 1)) + twist[:, None] * self.e
        return value, np.cross(self.e, self.displacement(s, 2)) + (inside * (second - first) / h)[:, None] * self.e


# joint coordinates ----------------------------------------------------------------------------------------------------


#: markers and coordinates by joint and name; cached because runs with events need them repeatedly
PLACED: WeakKeyDictionary[System, dict[tuple[str, str], tuple]] = WeakKeyDictionary()


def as_placed(
    system: System, joint: Joint, name: str
) -> tuple[tuple[MarkerData, MarkerData], RowCoordinate | None]:  # fmt: skip
    """Return the assembled markers of a joint and one of its coordinates (None along a deformed line)."""
    known = PLACED.setdefault(system, {})
    key = joint.name, name
    if key not in known:
        ends = joint_markers(system, joint, compiled_system(system).placed)
        own = None if isinstance(joint, SlidingJoint) else row_coordinate(system, joint, ends, name)
        known[key] = ends, own
    return known[key]


def row_coordinate(system: System, joint: Joint, ends: tuple[MarkerData, MarkerData], name: str) -> RowCoordinate:
    """Return an assembled joint coordinate with its directions."""
    (r_a, A_a), (r_b, A_b) = (marker_pose(end, compiled_system(system).placed, n_q_of(system)) for end in ends)
    rows = joint.rows(A_a, A_b, r_b - r_a)
    return next(row.coordinate for row in rows if row.coordinate is not None and row.coordinate.name == name)


def end_motion(system: System, trajectory: Trajectory, end: MarkerData, connection: str = "") -> PlaceMotion:
    """Return the motion of a marker, with its axes; a marker on the ground moves with that side of its connection."""
    if end.body < 0:
        ground = trajectory.ground(connection)
        return still_place(trajectory.t, end.shape) if ground is None else shape_motion(ground, end.shape)
    body = system.bodies[end.body]
    motion = trajectory.body(body.name)
    if isinstance(body, FlexibleBody):
        motion, _ = as_moved(trajectory, body.name, body.reduced)
    return shape_motion(motion, end.shape)
