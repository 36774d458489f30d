"""Joints place the bodies for which no position is given.

A body without a position begins where its mesh is drawn. Its joints then move it to the nearest pose that fulfils them:

    (1) The next body is the one with the most directions fixed by joints to placed bodies. Placed from the beginning
        are the ground, bodies with a position, bodies with a joint to the ground itself (the joint is where their
        marker is drawn), and the first body of a connected part without any of these.
    (2) orientation     the given one; a body without one takes the smallest rotation that fulfils the first joint with
                        `axis_b` or `rotation`
    (3) position        the shortest translation d with n · (r_B + d - r_A) = f, in the least-squares sense, for the
                        directions n that its joints to placed bodies fix; f is 0, or a prescribed distance at t = 0

Whatever the joints leave free stays as drawn: a distance along an axis, an angle, a body supported only by springs. A
joint with one marker is at this marker and demands no pose. Joints that close loops can stay open; the start of a run
closes them (initial.py).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.markers import MarkerData, find_marker
from floatframe.errors import ModelError
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.bodies.ground import GROUND
from floatframe.model.bodies.markers import Marker, Place, body_name
from floatframe.model.bodies.mean_axes import FrameMotion
from floatframe.model.joints import Joint
from floatframe.model.joints.axis_frame import normals_of
from floatframe.model.joints.rows import DOT, POINT, SCREW, SLIDE, Row
from floatframe.model.joints.sliding import SlidingJoint
from floatframe.model.rotations import euler_parameters, rotation_matrix
from floatframe.model.state import State
from floatframe.model.system import Body, System

__all__ = ["held_directions", "placed_bodies", "placed_state"]

AT_JOINT = 1e-9  #: gap of a joint, relative to the size of the system, up to which a body keeps its position
PARALLEL = 1e-9  #: sine of an angle up to which axes count as parallel
OPPOSITE = 1e-8  #: length of the sum of two unit vectors up to which they count as opposite: root of its roundoff


@dataclass(frozen=True, eq=False)
class Link:
    """A joint between two given markers, from the point of view of one of its bodies."""

    joint: Joint
    own: MarkerData  #: marker on this body
    other: MarkerData
    is_b: bool  #: whether the marker on this body is marker B


@dataclass(frozen=True, eq=False)
class PlacedBodies:
    """The placed bodies of a system, and how many directions joints fix for bodies without a given position."""

    bodies: tuple[Body, ...]
    n_held: Mapping[str, int]  #: number of fixed directions, 0 to 3, by the name of a body without a given position


def placed_bodies(system: System) -> tuple[Body, ...]:
    """Return the bodies of a system after joints have placed those without a position; computed once for a system."""
    return system.derived(place_bodies).bodies


def held_directions(system: System) -> Mapping[str, int]:
    """Return the number of directions (0 to 3) that joints fix for each body without a given position, by name."""
    return system.derived(place_bodies).n_held


def place_bodies(system: System) -> PlacedBodies:
    """Return the bodies of a system after joints have placed those without a position."""
    bodies = [body if body.position is not None else replace(body, position=np.zeros(3)) for body in system.bodies]
    waiting = {i for i, body in enumerate(system.bodies) if body.position is None}
    names = [body.name for body in bodies]
    drawn = waiting & on_ground(system)
    waiting -= drawn
    n_held = {names[i]: 3 for i in sorted(drawn)}
    links = links_of(system) if waiting else []
    length = length_of(bodies, links) if waiting else 1.0
    done = {-1, *range(len(bodies))} - waiting
    rank = dict.fromkeys(sorted(waiting), 0)  # number of directions that joints to placed bodies fix
    for i in waiting:
        rank[i] = rank_of(bodies, links[i], done)
    while rank:
        i = max(rank, key=lambda k: (rank[k], -k))  # (1)
        bodies[i] = placed(bodies, i, [link for link in links[i] if link.other.body in done], length)
        n_held[names[i]] = rank.pop(i)
        done.add(i)
        for k in {link.other.body for link in links[i]} & set(rank):
            rank[k] = rank_of(bodies, links[k], done)
    return PlacedBodies(tuple(bodies), n_held)


def on_ground(system: System) -> set[int]:
    """Return the bodies that a joint connects to the ground itself, without a marker of the ground."""
    ends = [(joint.marker_a, joint.marker_b) for joint in system.joints]
    held = {body_name(b.body) for pair in ends for a, b in (pair, pair[::-1]) if is_ground(a) and isinstance(b, Marker)}
    return {i for i, body in enumerate(system.bodies) if body.name in held}


def is_ground(end: Place) -> bool:
    """Whether the end of a joint is the ground, without a marker."""
    return not isinstance(end, Marker) and body_name(end) == GROUND.name


def links_of(system: System) -> list[list[Link]]:
    """Return, for each body, its joints between two given markers."""
    links: list[list[Link]] = [[] for _ in system.bodies]
    for joint in system.joints:
        if isinstance(joint, SlidingJoint) or not all(isinstance(m, Marker) for m in (joint.marker_a, joint.marker_b)):
            continue
        a, b = (find_marker(system, f"joint {joint.name!r}: marker_{k}", getattr(joint, f"marker_{k}")) for k in "ab")
        if a.body >= 0:
            links[a.body].append(Link(joint, a, b, is_b=False))
        if b.body >= 0:
            links[b.body].append(Link(joint, b, a, is_b=True))
    return links


def length_of(bodies: list[Body], links: list[list[Link]]) -> float:
    """Return the largest distance of a marker from the origin of its body, or between two bodies; 1 if all are 0."""
    arms = [float(np.linalg.norm(link.own.shape.position)) for each in links for link in each]
    extent = float(np.linalg.norm(np.ptp([body.drawn_position for body in bodies], axis=0)))
    return max([extent, *arms]) or 1.0


def rank_of(bodies: list[Body], links: list[Link], done: set[int]) -> int:
    """Return the number of independent directions in which placed bodies fix a body."""
    rows = [n for link in links if link.other.body in done for n in held(bodies, link)[0]]
    return int(np.linalg.matrix_rank(np.array(rows), tol=1e-6)) if rows else 0


def rows_of(bodies: list[Body], link: Link) -> tuple[Row, ...]:
    """Return the rows of a joint at the present poses; none if they are undefined, as for a rod of zero length."""
    own, other = pose(bodies, link.own), pose(bodies, link.other)
    (r_a, A_a), (r_b, A_b) = (other, own) if link.is_b else (own, other)
    try:
        return link.joint.rows(A_a, A_b, r_b - r_a)
    except ModelError:
        return ()


def held(bodies: list[Body], link: Link) -> tuple[Array, Array]:
    """Return the directions in which a joint fixes a distance, ground axes, (n, 3), and these distances, (n,)."""
    _, A = pose(bodies, link.other if link.is_b else link.own)
    rows = rows_of(bodies, link)
    screws = [row for row in rows if row.kind == SCREW]  # distance along the axis at the angle zero
    found = [(row.x, 0.0) for row in rows if row.kind == POINT]
    found += [(A @ np.cross(row.x, row.z), 0.0) for row in screws]
    for row in rows:
        if row.kind == SLIDE and not (screws and row.motion):
            found.append((A @ row.x, 0.0 if row.motion is None else row.motion(0.0)))
    return np.array([n for n, _ in found]).reshape(-1, 3), np.array([f for _, f in found])


def pose(bodies: list[Body], marker: MarkerData) -> tuple[Array, Array]:
    """Return position, (3,), and axes, (3, 3), of a marker in ground axes."""
    if marker.body < 0:
        return marker.shape.position, marker.shape.triad
    at = motion_at_start(bodies[marker.body])
    R = rotation_matrix(at.p)
    rho, axes = marker.shape.pose(at.q)
    return at.r + R @ rho, R @ axes


def placed(bodies: list[Body], i: int, links: list[Link], length: float) -> Body:
    """Return body i after its joints have moved it to the bodies placed before."""
    body = bodies[i]
    moving = list(bodies)
    is_turned = not np.array_equal(body.orientation, [1.0, 0.0, 0.0, 0.0])
    for link in [] if is_turned else links:  # (2)
        turn = asked_rotation(bodies, link)
        if turn is not None:
            p = euler_parameters(turn @ rotation_matrix(body.orientation))
            body = moving[i] = replace(body, orientation=p)
            break
    rows, gaps = [np.zeros((0, 3))], [np.zeros(0)]
    for link in links:
        n, f = held(moving, link)
        rows.append(n)
        gaps.append(n @ (pose(moving, link.other)[0] - pose(moving, link.own)[0]) + (f if link.is_b else -f))
    n, gap = np.concatenate(rows), np.concatenate(gaps)
    if not np.abs(gap).max(initial=0.0) > AT_JOINT * length:
        return body
    return replace(body, position=body.drawn_position + np.linalg.lstsq(n, gap, rcond=1e-9)[0])  # (3)


def asked_rotation(bodies: list[Body], link: Link) -> Array | None:
    """Return the smallest rotation, (3, 3), after which a body satisfies the axes of a joint; None if it already does.

    Two rows E · D = 0 with the same axis E of A keep E parallel to the normal of both axes D of B. Three rows fix all
    axes: the k-th axis E of A is parallel to the axis D of B in the row before.
    """
    rows = [row for row in rows_of(bodies, link) if row.kind == DOT and row.c == 0.0]
    if len(rows) < 2:
        return None
    own, other = pose(bodies, link.own)[1], pose(bodies, link.other)[1]
    A_a, A_b = (other, own) if link.is_b else (own, other)
    x, y = A_a @ np.array([row.x for row in rows]).T, A_b @ np.array([row.y for row in rows]).T  # columns
    if len(rows) == 3:
        turn = x @ np.roll(y, 1, axis=1).T  # rotation of B
        turn = turn if link.is_b else turn.T
        return None if np.abs(turn - np.eye(3)).max() <= PARALLEL else turn
    if len(rows) > 3 or not np.allclose(x[:, 0], x[:, 1], rtol=0, atol=PARALLEL):
        return None
    axes = x[:, 0], np.cross(y[:, 0], y[:, 1])
    there, here = axes if link.is_b else axes[::-1]
    return rotation_between(here, there)


def rotation_between(here: Array, there: Array) -> Array | None:
    """Return the smallest rotation, (3, 3), from one unit vector to another; None if they are parallel.

    It consists of two reflections, first of `here`, then of the direction in the middle; accurate up to half a turn.
    """
    if np.linalg.norm(there - here) <= PARALLEL:
        return None
    middle = here + there
    size = np.linalg.norm(middle)
    middle = middle / size if size > OPPOSITE else normals_of(here)[1]  # half a turn about any normal
    return np.asarray((np.eye(3) - 2 * np.outer(middle, middle)) @ (np.eye(3) - 2 * np.outer(here, here)))


def placed_state(system: System) -> State:
    """Return the state of the placed bodies, in the frames of the engine."""
    motions = [motion_at_start(body) for body in placed_bodies(system)]
    return State(
        r=np.array([motion.r for motion in motions]),
        p=np.array([motion.p for motion in motions]),
        q=np.concatenate([motion.q for motion in motions]),
        u=np.concatenate([each for motion in motions for each in (motion.v, motion.omega, motion.q_dot)]),
    )


def motion_at_start(body: Body) -> FrameMotion:
    """Return the initial motion of the frame in which the engine computes a body, without accelerations."""
    zero = np.zeros(3)
    if not isinstance(body, FlexibleBody):
        none = np.zeros(0)
        return FrameMotion(
            body.drawn_position, body.orientation, none, body.velocity, body.omega_B, none, zero, zero, none
        )
    motion = FrameMotion(
        body.frame_position, euler_parameters(body.frame_orientation), body.q, body.frame_velocity, body.frame_omega,
        body.q_dot, zero, zero, np.zeros_like(body.q),
    )  # fmt: skip
    return motion if body.mean_axes is None else body.mean_axes.to_mean(motion)
