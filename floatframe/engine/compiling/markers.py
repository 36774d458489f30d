"""Markers as positions on their bodies, and their poses at the start."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cms.errors import BodyError
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.words import nearest, quoted
from floatframe.engine.compiling.bodies import body_n_q, integers, offsets
from floatframe.engine.kernels.records import flat
from floatframe.errors import ModelError
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.bodies.ground import GROUND
from floatframe.model.bodies.marker_shape import MarkerShape, interface_shape
from floatframe.model.bodies.markers import Marker, body_name
from floatframe.model.joints import Joint
from floatframe.model.rotations import rotation_matrix
from floatframe.model.state import State
from floatframe.model.system import System

__all__ = [
    "MarkerData",
    "find_body",
    "find_marker",
    "joint_markers",
    "least_size",
    "marker_bending",
    "marker_pose",
    "marker_shapes",
    "marker_with_pose",
    "n_q_of",
    "same_markers",
]

GROUND_INDEX = -1
#: distance between a node and a reference point, relative to the size of the body, below which they coincide
SAME_PLACE = 1e-9


@dataclass(frozen=True, eq=False)
class MarkerData:
    """A marker resolved to a body index and a position."""

    body: int  #: index of the body, -1 for the ground
    shape: MarkerShape


def least_size(markers: Sequence[MarkerData], radii: Array) -> float:
    """Return the smallest size of the bodies that carry the markers: radius of gyration, or arm of a marker."""
    arms: dict[int, float] = {}
    for marker in markers:
        if marker.body >= 0:
            arm = float(np.linalg.norm(marker.shape.position))
            arms[marker.body] = max(arm, arms.get(marker.body, float(radii[marker.body])))
    return min((arm for arm in arms.values() if arm > 0.0), default=0.0)


def n_q_of(system: System) -> IntArray:
    """Return the number of modes of each body, (n_b,)."""
    return integers([body_n_q(body) for body in system.bodies])


def find_body(system: System, where: str, name: str) -> int:
    """Return the index of a body, -1 for the ground; `ModelError` suggests the closest name if it does not exist."""
    if name == GROUND.name:
        return GROUND_INDEX
    index = system.derived(index_of_bodies)
    if name not in index:
        raise ModelError(f"{where}: no body {quoted(name)}{nearest(name, [GROUND.name, *index])}")
    return index[name]


def index_of_bodies(system: System) -> dict[str, int]:
    """Return the index of each body by its name."""
    return {body.name: i for i, body in enumerate(system.bodies)}


def find_marker(system: System, where: str, marker: Marker) -> MarkerData:
    """Return a marker with its position in the body frame."""
    if not isinstance(marker, Marker):
        raise ModelError(f"{where}: expected a Marker, got {marker!r}")
    index = find_body(system, where, body_name(marker.body))
    body = system.bodies[index] if index >= 0 else None
    triad = np.eye(3) if marker.triad is None else marker.triad
    if not isinstance(body, FlexibleBody):
        if marker.interface is not None:
            raise ModelError(
                f"{where}: body {body_name(marker.body)!r} is not flexible and has no interface "
                f"{marker.interface!r}; give a position"
            )
        if marker.address is not None and marker.position is None:
            raise ModelError(
                f"{where}: body {body_name(marker.body)!r} is not flexible: it has no {marker.address.kind} "
                f"{getattr(marker, marker.address.kind)!r}; give a position"
            )
        position = np.zeros(3) if marker.position is None else marker.position
        return MarkerData(index, MarkerShape(position, triad))
    choices = [interface.name for interface in body.reduced.interfaces]
    if marker.node is not None:
        marker = replace(marker, node=None, interface=interface_at_node(body, where, marker.node))
    if marker.interface is None:
        place = "position" if marker.address is None else marker.address.kind
        raise ModelError(
            f"{where}: a marker on the flexible body {body.name!r} needs an interface and no {place} (sensors and "
            f"channels alone take these); choices: {', '.join(choices)}"
        )
    if marker.interface not in choices:
        raise ModelError(
            f"{where}: flexible body {body.name!r} has no interface {marker.interface!r}"
            f"{nearest(marker.interface, choices)}"
        )
    shape = interface_shape(body.moved, marker.interface, is_stiffened=body.is_stiffened)
    return MarkerData(index, replace(shape, triad=shape.triad @ triad))


def interface_at_node(body: FlexibleBody, where: str, node: int | str) -> str:
    """Return the interface at a node: the node is its only member, or lies at the reference point as its member.

    Raises
    ------
    ModelError
        If there is no such node, or no interface is there: joints and forces need its modes and unit loads.
    """
    reduced = body.reduced
    try:
        row = int(reduced.numbering.rows_of_node(f"{where}: body {body.name!r}", node)[0])
    except BodyError as error:
        raise ModelError(str(error)) from error
    tolerance = SAME_PLACE * float(np.linalg.norm(np.ptp(reduced.nodes, axis=0)))
    alone = [each.name for each in reduced.interfaces if each.members.tolist() == [row]]
    near = [
        each.name
        for each in reduced.interfaces
        if row in each.members and np.linalg.norm(each.position - reduced.nodes[row]) <= tolerance
    ]
    found = alone or near
    if not found:
        names = ", ".join(each.name for each in reduced.interfaces) or "it has none"
        raise ModelError(
            f"{where}: node {node} of body {body.name!r} is not an interface, and joints and forces need its static "
            f'modes: add it to the job ([interfaces.NAME] kind = "rigid", nodes = [{node}]), or take one of: {names}'
        )
    return found[0]


def joint_markers(system: System, joint: Joint, placed: State) -> tuple[MarkerData, MarkerData]:
    """Return both markers of a joint; a body for which none is given gets one at the position of the other marker."""
    where = f"joint {joint.name!r}"
    given_a, given_b = joint.marker_a, joint.marker_b
    if isinstance(given_a, Marker):
        a = find_marker(system, f"{where}: marker_a", given_a)
        if isinstance(given_b, Marker):
            b = find_marker(system, f"{where}: marker_b", given_b)
        else:
            b = marker_as_placed(system, f"{where}: marker_b", body_name(given_b), a, placed)
    elif isinstance(given_b, Marker):
        b = find_marker(system, f"{where}: marker_b", given_b)
        a = marker_as_placed(system, f"{where}: marker_a", body_name(given_a), b, placed)
    else:
        raise ModelError(f"{where}: expected a Marker at one end at least, got two bodies; give the joint's position")
    if a.body == b.body:
        name = GROUND.name if a.body < 0 else system.bodies[a.body].name
        raise ModelError(f"{where}: expected markers on two bodies, got both on {name!r}")
    return a, b


def marker_as_placed(system: System, where: str, name: str, other: MarkerData, placed: State) -> MarkerData:
    """Return a marker on a body at the position of another marker, with the axes of the body."""
    r_P, _ = marker_pose(other, placed, n_q_of(system))
    marker = marker_with_pose(system, where, name, (r_P, np.eye(3)), placed)
    return replace(marker, shape=replace(marker.shape, triad=np.eye(3)))


def marker_with_pose(system: System, where: str, name: str, pose: tuple[Array, Array], placed: State) -> MarkerData:
    """Return a marker on a body with an assembled position and axes, both given in ground axes."""
    index = find_body(system, where, name)
    r_P, A_P = pose
    if index < 0:
        return MarkerData(index, MarkerShape(r_P, A_P))
    body = system.bodies[index]
    if isinstance(body, FlexibleBody):
        choices = ", ".join(interface.name for interface in body.reduced.interfaces)
        raise ModelError(
            f"{where}: joints and forces act on a flexible body only at its interfaces; give a Marker on {name!r} at "
            f"one of: {choices}"
        )
    R = rotation_matrix(placed.p[index])
    return MarkerData(index, MarkerShape(R.T @ (r_P - placed.r[index]), R.T @ A_P))


def marker_pose(marker: MarkerData, state: State, n_q: IntArray) -> tuple[Array, Array]:
    """Return position (3,) and axes (3, 3) of a marker in ground axes."""
    i = marker.body
    if i < 0:
        return marker.shape.position, marker.shape.triad
    q0 = offsets(n_q)
    rho, axes = marker.shape.pose(state.q[q0[i] : q0[i + 1]])
    R = rotation_matrix(state.p[i])
    return state.r[i] + R @ rho, R @ axes


def marker_shapes(markers: list[MarkerShape]) -> tuple[list[int], Array]:
    """Return all mode shapes of the markers as one flat array, and the index of each marker's shapes (-1 for none)."""
    start: list[int] = []
    parts: list[Array] = []
    n = 0
    for marker in markers:
        start.append(-1 if marker.psi is None else n)
        if marker.psi is not None:
            parts.append(marker.psi)
            n += marker.psi.size
    return start, flat(parts)


def same_markers(markers: Sequence[MarkerData], bend0: Sequence[int], line: IntArray) -> list[int]:
    """Return for each marker an earlier one whose place deforms in the same way, -1 for none; none of them slides."""
    known: dict[tuple[object, ...], int] = {}
    same = []
    for m, (body, shape) in enumerate((marker.body, marker.shape) for marker in markers):
        if shape.psi is None or line[m] >= 0:
            same.append(-1)
            continue
        other = known.setdefault((body, bend0[m], shape.position.tobytes(), shape.psi.tobytes()), m)
        same.append(other if other < m else -1)
    return same


def marker_bending(markers: list[MarkerShape]) -> tuple[list[int], Array]:
    """Return the matrices K_P [l, 6, k] of all interfaces as a flat array, and the index for each marker (-1: none)."""
    start: list[int] = []
    known: dict = {}
    parts: list[Array] = []
    n = 0
    for marker in markers:
        if marker.bend is None or marker.bend.size == 0:
            start.append(-1)
            continue
        key = marker.bend.__array_interface__["data"][0], marker.bend.shape
        if key not in known:
            known[key] = n
            parts.append(np.moveaxis(marker.bend, 2, 0))
            n += marker.bend.size
        start.append(known[key])
    return start, flat(parts)
