"""Symbols of joints, springs, dampers, bushings and contacts in films, as lines that follow their markers.

    revolute, screw, rolling             a ring about the axis, and the axis
    prismatic, cylindrical, planar       two rails along the axis
    spherical                            three rings
    universal, constant velocity         a cross in a ring
    distance                             a line between the points
    all others, such as fixed            a small square
    spring                               a coil
    damper                               a piston in a cylinder; next to the coil if there is a spring too
    bushing                              two rings round the axis z of A
    contact                              rings round the sphere

A joint with the ground has a small hatched support.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cms.assessment.rendering import Lines
from fe_models.foundation.arrays import Array, IntArray
from floatframe.engine.compiling.markers import MarkerData, find_marker, joint_markers
from floatframe.engine.compiling.pair_forces import bushing_markers
from floatframe.engine.compiling.system import compiled_system
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.bodies.markers import Marker, body_name
from floatframe.model.forces import Bushing, SphereContact, SpringDamper
from floatframe.model.joints.sliding import SlidingJoint
from floatframe.model.rotations import rotation_matrix
from floatframe.model.system import System
from floatframe.results.joint_coordinates import end_motion
from floatframe.results.trajectory import Trajectory

__all__ = ["BUSHING_COLOR", "JOINT_COLOR", "SPRING_COLOR", "glyphs"]

JOINT_COLOR, SPRING_COLOR, BUSHING_COLOR, GROUND_COLOR = "#33414d", "#2a7f62", "#b5651d", "#7b8790"
SIZE = 0.022  #: size of a glyph, relative to the size of the scene
TURNS, POINTS_A_TURN = 7, 14  #: turns of a coil, and points in a turn
ROUND = np.linspace(0.0, 2 * np.pi, 25)
RINGS = ("RevoluteJoint", "ScrewJoint", "RollingDisc")
RAILS = ("PrismaticJoint", "CylindricalJoint", "PlanarJoint")
CROSSES = ("UniversalJoint", "ConstantVelocityJoint")
BALLS = ("SphericalJoint",)
RODS = ("DistanceJoint",)


@dataclass(frozen=True, eq=False)
class Ends:
    """Positions and axes of both markers in all frames."""

    a: Array  #: positions of marker A, (n_frames, 3)
    b: Array  #: positions of marker B, (n_frames, 3)
    axes: Array  #: axes of marker A as columns, (n_frames, 3, 3)
    on_ground: bool  #: whether one of the markers is on the ground


def glyphs(
    system: System, trajectory: Trajectory, rows: IntArray, size: float, magnification: float, up: Array
) -> tuple[Lines, ...]:
    """Return the lines of joints and forces in the rows of a motion; `size` is that of the scene."""
    g = SIZE * size
    found: list[Lines] = []
    for joint in system.joints:
        if isinstance(joint, SlidingJoint):
            continue
        given = (joint.marker_a, joint.marker_b)
        ends = ends_of(system, trajectory, rows, joint_markers(system, joint, compiled_system(system).placed), given,
                       magnification)  # fmt: skip
        found += joint_glyph(type(joint).__name__, getattr(joint, "axis", np.array([0.0, 0.0, 1.0])), ends, g)
        if ends.on_ground:
            found.append(support(ends.a, up, g))
    for force in system.forces:
        if isinstance(force, SpringDamper):
            where = f"force {force.name!r}"
            pair = (find_marker(system, where, force.marker_a), find_marker(system, where, force.marker_b))
            ends = ends_of(system, trajectory, rows, pair, (force.marker_a, force.marker_b), magnification)
            found += spring_glyph(ends, g, has_spring=is_spring(force), has_damper=force.damping > 0)
        elif isinstance(force, Bushing):
            pair = bushing_markers(system, force, compiled_system(system).placed)
            ends = ends_of(system, trajectory, rows, pair, (force.marker_a, force.marker_b), magnification)
            found += bushing_glyph(ends, g)
        elif isinstance(force, SphereContact):
            where = f"force {force.name!r}"
            pair = (find_marker(system, where, force.marker_a), find_marker(system, where, force.marker_b))
            ends = ends_of(system, trajectory, rows, pair, (force.marker_a, force.marker_b), magnification)
            radius = min(float(force.radius_b), 0.2 * size)
            found += [ring(ends.b, ends.axes, np.eye(3)[k], radius, SPRING_COLOR) for k in range(3)]
    return tuple(found)


def is_spring(force: SpringDamper) -> bool:
    """Return whether a spring-damper has a spring."""
    return force.stiffness > 0 or force.characteristic is not None or force.damping == 0


def ends_of(
    system: System,
    trajectory: Trajectory,
    rows: IntArray,
    ends: tuple[MarkerData, MarkerData],
    given: Sequence[object],
    magnification: float,
) -> Ends:
    """Return both markers in all frames; markers on interfaces are displaced with the magnification of the film."""
    places = [place_of(system, trajectory, rows, end, of, magnification) for end, of in zip(ends, given, strict=True)]
    axes = end_motion(system, trajectory, ends[0]).axes[rows]
    return Ends(places[0], places[1], axes, min(end.body for end in ends) < 0)


def place_of(
    system: System, trajectory: Trajectory, rows: IntArray, end: MarkerData, given: object, magnification: float
) -> Array:
    """Return the positions of a marker in the frames, (n_frames, 3)."""
    position = np.array(end_motion(system, trajectory, end).position[rows])
    if isinstance(given, Marker) and given.interface is not None and magnification != 1:
        body = system.body(body_name(given.body))
        assert isinstance(body, FlexibleBody)  # as for any marker at an interface
        motion = trajectory.body(body.name)
        moved = motion.q[rows] @ body.reduced.interface(given.interface).Psi[:3].T
        position += (magnification - 1) * np.einsum("tab,tb->ta", rotation_matrix(motion.p[rows]), moved)
    return position


def joint_glyph(kind: str, axis: Array, ends: Ends, g: float) -> list[Lines]:
    """Return the lines of a joint."""
    if kind in RINGS:
        return [ring(ends.a, ends.axes, axis, g, JOINT_COLOR), stick(ends, axis, -1.3 * g, 1.3 * g)]
    if kind in BALLS:
        return [ring(ends.a, ends.axes, np.eye(3)[k], 0.8 * g, JOINT_COLOR) for k in range(3)]
    if kind in CROSSES:
        across = normals(axis)
        return [ring(ends.a, ends.axes, axis, g, JOINT_COLOR), *(stick(ends, e, -g, g) for e in across)]
    if kind in RAILS:
        side = normals(axis)[0]
        return [stick(ends, axis, -3 * g, 3 * g, 0.6 * s * g * side) for s in (-1, 1)]
    if kind in RODS:
        return [polyline(np.stack([ends.a, ends.b], axis=1), JOINT_COLOR, 2.2)]
    x, y, z = np.eye(3)
    corners = 0.6 * g * np.array([x + y, y - x, -x - y, x - y, x + y])
    square = local(ends.a, ends.axes, corners)
    return [polyline(square, JOINT_COLOR), stick(ends, z, -0.6 * g, 0.6 * g)]


def spring_glyph(ends: Ends, g: float, *, has_spring: bool, has_damper: bool) -> list[Lines]:
    """Return a coil between the markers, a cylinder with a piston, or both next to each other."""
    d = ends.b - ends.a
    length = np.linalg.norm(d, axis=1)[:, None]
    e = np.divide(d, length, out=np.zeros_like(d), where=length > 0)
    helper = np.eye(3)[int(np.argmin(np.abs(e).mean(axis=0)))]
    side = np.cross(e, helper)
    side = np.divide(side, np.linalg.norm(side, axis=1)[:, None], out=np.zeros_like(side), where=length > 0)
    other = np.cross(e, side)
    radius = np.minimum(0.55 * g, 0.15 * length)
    both = has_spring and has_damper
    found = []

    def at(along: Array, across: Array, depth: Array, shift: float) -> Array:
        """Return points at fractions of the length and of the radius, (n_frames, n, 3)."""
        return (
            ends.a[:, None]
            + along[None, :, None] * d[:, None]
            + (across + shift)[None, :, None] * (radius * side)[:, None]
            + depth[None, :, None] * (radius * other)[:, None]
        )

    if has_spring:
        turn = np.linspace(0.0, 2 * np.pi * TURNS, TURNS * POINTS_A_TURN + 1)
        along = np.r_[0.0, np.linspace(0.14, 0.86, len(turn)), 1.0]
        swing, depth = np.r_[0.0, np.sin(turn), 0.0], np.r_[0.0, np.cos(turn), 0.0]
        found.append(polyline(at(along, swing, depth, 1.2 if both else 0.0), SPRING_COLOR))
    if has_damper:
        shift = -1.2 if both else 0.0
        for along_, across in (
            ([0.0, 0.3], [0, 0]), ([0.62, 0.3, 0.3, 0.62], [0.7, 0.7, -0.7, -0.7]), ([0.5, 0.5], [0.55, -0.55]),
            ([0.5, 1.0], [0, 0]),
        ):  # fmt: skip
            x, y = np.array(along_), np.array(across, dtype=float)
            found.append(polyline(at(x, y, np.zeros(len(x)), shift), SPRING_COLOR))
    if both:
        for share in (0.0, 1.0):
            x = np.full(2, share)
            found.append(polyline(at(x, np.array([-1.2, 1.2]), np.zeros(2), 0.0), SPRING_COLOR))
    return found


def bushing_glyph(ends: Ends, g: float) -> list[Lines]:
    """Return two rings round the z axis of A, and the line between the markers."""
    rings = [ring(ends.a, ends.axes, np.eye(3)[2], share * g, BUSHING_COLOR, 2.0) for share in (1.15, 0.6)]
    return [*rings, polyline(np.stack([ends.a, ends.b], axis=1), BUSHING_COLOR)]


def support(at: Array, up: Array, g: float) -> Lines:
    """Return a triangle on a hatched line below a point on the ground."""
    up = up / np.linalg.norm(up)
    side = normals(up)[0] if abs(up[0]) > 0.9 else np.array([1.0, 0.0, 0.0]) - up[0] * up
    side /= np.linalg.norm(side)
    low = -2.2 * up
    base = [low + s * side for s in (-1.5, 1.5)]
    points = [np.zeros(3), low - side, low + side, *base]
    segments = [[0, 1], [0, 2], [3, 4]]
    for s in np.linspace(-1.3, 1.3, 6):
        segments.append([len(points), len(points) + 1])
        points += [low + s * side, low + (s - 0.4) * side - 0.5 * up]
    local_points = g * np.array(points)
    return Lines(np.array(segments), at[:, None] + local_points[None], color=GROUND_COLOR, width=1.3)


def normals(axis: Array) -> tuple[Array, Array]:
    """Return two unit vectors normal to an axis and to each other."""
    e = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    x = np.cross(e, np.eye(3)[int(np.argmin(np.abs(e)))])
    x /= np.linalg.norm(x)
    return x, np.cross(e, x)


def local(at: Array, axes: Array, points: Array) -> Array:
    """Return points given in the axes of a marker in ground axes, (n_frames, n, 3)."""
    return np.asarray(at[:, None] + np.einsum("tab,nb->tna", axes, points))


def ring(at: Array, axes: Array, axis: Array, radius: float, color: str, width: float = 1.7) -> Lines:
    """Return a circle about an axis of a marker."""
    x, y = normals(axis)
    points = radius * (np.outer(np.cos(ROUND), x) + np.outer(np.sin(ROUND), y))
    return polyline(local(at, axes, points), color, width)


def stick(ends: Ends, axis: Array, first: float, last: float, shift: Array | None = None) -> Lines:
    """Return a line along an axis of marker A."""
    e = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    points = np.array([first * e, last * e]) + (0.0 if shift is None else shift)
    return polyline(local(ends.a, ends.axes, points), JOINT_COLOR, 1.7)


def polyline(points: Array, color: str, width: float = 1.7) -> Lines:
    """Return a line through points, (n_frames, n, 3)."""
    n = points.shape[1]
    return Lines(np.stack([np.arange(n - 1), np.arange(1, n)], axis=1), points, color=color, width=width)
