"""The tree of a system for expressions: the nodes of docs/recursive.md §1, with numbers and symbols.

The node frame is the outer frame of the joint; for a flexible body (`modes.py`), it is this frame while undeformed.

Rounding errors (cos 90° and products with it) are set to zero: entries of rotation matrices within 4 ulp of an integer,
and lengths and moments below 4 ulp of the largest of their kind.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.words import quoted
from floatframe.design.generation.graph import Graph, Scalar, Terms, terms
from floatframe.design.generation.modes import ElasticMarker, Modes, elastic_marker, modes_of
from floatframe.design.identification.inertial_parameters import INERTIAL, parameters_of
from floatframe.engine.tree.recursion.expansion import Expansion, marker_shape
from floatframe.errors import ModelError
from floatframe.model.bodies.added_mass import second_moments
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.bodies.marker_shape import MarkerShape, interface_shape
from floatframe.model.bodies.rigid_body import RigidBody

__all__ = [
    "GRAVITY", "ROUNDING", "Frame", "JointSpring", "Link", "TreeTerms", "parameter_names", "tree_terms",
    "without_rounding",
]  # fmt: skip

GRAVITY = ("gravity/x", "gravity/y", "gravity/z")
ROUNDING = 4 * np.finfo(float).eps


@dataclass(frozen=True, eq=False)
class Link:
    """A node: its joint, and the moments of its body in the node frame; arrays contain terms."""

    parent: int
    kind: int
    is_near: bool
    x0: int
    v0: int
    n_z: int
    slide: Scalar
    turn: Scalar
    A: Terms  #: axes of the inner frame of the joint in the parent, (3, 3)
    r: Terms  #: origin of the inner frame, (3,) [m]
    body: int  #: index of the body; -1 if there is none
    mass: Scalar
    s: Terms  #: first moment, (3,) [kg m]
    P: Terms  #: second moment, the integral of c cᵀ over mass, (3, 3) [kg m²]
    modes: Modes | None = None  #: modes of a flexible body; mass, s, P belong to its undeformed shape
    above: ElasticMarker | None = None  #: marker that carries the joint on a flexible parent, if modes move it
    own: ElasticMarker | None = None  #: marker of a flexible body at its own joint, if modes move it
    is_round: bool = False  #: whether the node is a hinge with an axisymmetric body

    @property
    def has_moments(self) -> bool:
        """Whether the node has a body or moments that were transferred to it."""
        return not all(value.is_constant(0.0) for value in (self.mass, *self.s, *self.P.ravel()))


@dataclass(frozen=True, eq=False)
class Frame:
    """A frame on a body."""

    name: str
    node: int
    marker: ElasticMarker | None  #: marker that carries the frame; None if modes do not move it
    axes: Terms  #: axes in the node frame, or in the marker, (3, 3)
    origin: Terms  #: origin in the node frame, or in the marker, (3,) [m]


@dataclass(frozen=True)
class JointSpring:
    """A linear force along a joint coordinate."""

    position: int  #: index of the coordinate among the positions
    rate: int  #: index of the rate
    stiffness: float  #: [N/m, N m/rad]
    free: float  #: force-free value of the coordinate [m, rad]
    damping: float  #: [N s/m, N m s/rad]
    preload: float  #: [N, N m]


@dataclass(frozen=True, eq=False)
class TreeTerms:
    """A tree with its graph, as input of the recursions."""

    graph: Graph
    links: tuple[Link, ...]
    gravity: Terms  #: (3,) [m/s²]
    x: Terms  #: symbols of the positions, (n_z,)
    v: Terms  #: symbols of the rates, (n,)
    a: Terms  #: symbols of the accelerations, (n,)
    parameters: tuple[Scalar, ...]  #: symbols of the parameters that are not constants
    parameter_names: tuple[str, ...]
    parameter_values: tuple[float, ...]
    frames: tuple["Frame", ...]  #: frames of the files of all bodies
    interfaces: tuple["Frame", ...]  #: interfaces of all flexible bodies
    springs: tuple[JointSpring, ...] = ()  #: linear forces along coordinates


def whole(R: Array) -> Array:
    """Return an array in which entries within rounding errors of 0, 1 or -1 are exact."""
    near = np.round(R)
    return np.asarray(np.where(np.abs(R - near) < ROUNDING, near, R) + 0.0)


def without_rounding(x: Array, size: float) -> Array:
    """Return numbers with rounding errors, relative to a size, replaced by zero."""
    return np.asarray(np.where(np.abs(x) < ROUNDING * size, 0.0, x))


def parameter_names(expansion: Expansion) -> dict[str, float]:
    """Return names and values of all possible parameters: inertial parameters of bodies, and gravity."""
    found: dict[str, float] = {}
    for body in expansion.system.bodies:
        if isinstance(body, RigidBody):
            names = (f"{body.name}/{each}" for each in INERTIAL)
            found |= dict(zip(names, map(float, parameters_of(body)), strict=True))
    return found | dict(zip(GRAVITY, map(float, expansion.compiled.model.gravity), strict=True))


def is_meant(pattern: str, name: str) -> bool:
    """Return whether a name matches a pattern."""
    return name == pattern or fnmatchcase(name, pattern)


def chosen(patterns: Sequence[str], values: dict[str, float]) -> tuple[str, ...]:
    """Return the names that match patterns, in their own order; a body or "gravity" stands for all its parameters."""
    wanted = set()
    for pattern in patterns:
        matched = {name for name in values if is_meant(pattern, name) or is_meant(pattern, name.rsplit("/", 1)[0])}
        if not matched:
            some = ", ".join(list(values)[:11])
            raise ModelError(
                f"generate: parameters: {quoted(pattern)} matches no parameter or body; there are "
                f"{some}, ..., {', '.join(GRAVITY)}"
            )
        wanted |= matched
    return tuple(name for name in values if name in wanted)


def tree_terms(expansion: Expansion, parameters: Sequence[str] = ()) -> TreeTerms:
    """Return a tree of bodies as terms, with selected parameters as symbols.

    Raises
    ------
    ModelError
        If a pattern of `parameters` matches nothing, or names a flexible body.
    """
    graph, nodes = Graph(), expansion.nodes
    values = parameter_names(expansion)
    flexible = [body.name for body in expansion.system.bodies if isinstance(body, FlexibleBody)]
    for pattern in parameters:
        if pattern.split("/")[0] in flexible:
            raise ModelError(
                f"generate: parameters: {quoted(pattern)}: expected rigid bodies or gravity, got a flexible body: its "
                "invariants are numbers in the code"
            )
    names = chosen(parameters, values)
    symbols = {name: graph.symbol(f"parameters[{k}]") for k, name in enumerate(names)}
    length = float(np.abs(nodes.r).max(initial=0.0))
    links = tuple(link_of(graph, expansion, k, symbols, values, length) for k in range(len(nodes.parent)))
    return TreeTerms(
        graph=graph,
        links=links,
        gravity=terms(graph, [symbols.get(name, values[name]) for name in GRAVITY]),
        x=symbols_of(graph, "z", expansion.n_x),
        v=symbols_of(graph, "z_dot", expansion.n_v),
        a=symbols_of(graph, "z_ddot", expansion.n_v),
        parameters=tuple(symbols.values()),
        parameter_names=names,
        parameter_values=tuple(values[name] for name in names),
        frames=tuple(body_frame(graph, expansion, i, length) for i in range(len(expansion.node_of))),
        interfaces=tuple(interface_frames(graph, expansion, length)),
    )


def body_frame(graph: Graph, expansion: Expansion, i: int, length: float) -> Frame:
    """Return the frame of body i in its file; the engine may use mean axes instead."""
    name, node, mean = expansion.system.bodies[i].name, expansion.node_of[i], expansion.compiled.mean_axes[i]
    if mean is not None:
        frame = moving_frame(graph, expansion, i, name, mean.frame, length)
        return replace(frame, origin=frame.origin - frame.axes @ mean.point)
    F, origin = frame_in_body(expansion, i, length)
    return Frame(name, node, None, terms(graph, F.T), terms(graph, without_rounding(-F.T @ origin, length)))


def interface_frames(graph: Graph, expansion: Expansion, length: float) -> list[Frame]:
    """Return all interfaces of all flexible bodies."""
    found = []
    for i, body in enumerate(expansion.system.bodies):
        if isinstance(body, FlexibleBody):
            for interface in body.moved.interfaces:
                shape = interface_shape(body.moved, interface.name, is_stiffened=body.is_stiffened)
                name = f"{body.name}/{interface.name}"
                found.append(moving_frame(graph, expansion, i, name, shape, length))
    return found


def moving_frame(
    graph: Graph, expansion: Expansion, i: int, name: str, shape: MarkerShape, length: float
) -> Frame:  # fmt: skip
    """Return a frame that moves with the modes of body i."""
    marker = elastic_marker(graph, expansion, i, shape, frame_in_body(expansion, i, length), length)
    node, zero = expansion.node_of[i], terms(graph, np.zeros(3))
    if marker.moves:
        return Frame(name, node, marker, marker.axes, zero)
    return Frame(name, node, None, marker.axes, marker.place)


def frame_in_body(expansion: Expansion, i: int, length: float) -> tuple[Array, Array]:
    """Return the axes, (3, 3), and origin, (3,), of the node of body i in the body frame."""
    F, origin = expansion.frame_of[i]
    return whole(F), without_rounding(origin, length)


def link_of(
    graph: Graph, expansion: Expansion, k: int, symbols: dict[str, Scalar], values: dict[str, float], length: float
) -> Link:
    """Return node k as terms.

    symbols, values: parameters by name; length: largest length of the tree, for rounding errors.
    """
    nodes, body = expansion.nodes, int(expansion.nodes.body[k])
    mass, s, P = graph.zero, terms(graph, np.zeros(3)), terms(graph, np.zeros((3, 3)))
    if body >= 0:
        own = [f"{expansion.system.bodies[body].name}/{each}" for each in INERTIAL]
        if any(name in symbols for name in own):
            phi = terms(graph, [symbols.get(name, values[name]) for name in own])
            mass, s, P = moments_in_node(phi, *(terms(graph, each) for each in frame_in_body(expansion, body, length)))
        else:
            size = max(float(np.abs(nodes.s[k]).max()), float(nodes.mass[k]) * length)
            mass, s = graph.constant(float(nodes.mass[k])), terms(graph, without_rounding(nodes.s[k], size))
            P = terms(graph, without_rounding(nodes.P[k], float(np.abs(nodes.J[k]).max())))
    return Link(
        **elastic_parts(graph, expansion, k, length),
        parent=int(nodes.parent[k]),
        kind=int(nodes.kind[k]),
        is_near=bool(nodes.is_near[k]),
        x0=int(nodes.x0[k]),
        v0=int(nodes.v0[k]),
        n_z=int(nodes.n_z[k]),
        slide=graph.constant(float(whole(nodes.slide[k]))),
        turn=graph.constant(float(whole(nodes.turn[k]))),
        body=body,
        mass=mass,
        s=s,
        P=P,
    )


def elastic_parts(graph: Graph, expansion: Expansion, k: int, length: float) -> dict[str, Any]:
    """Return the modes and moving markers of node k, and the inner frame of its joint in the frame of its parent."""
    nodes, compiled = expansion.nodes, expansion.compiled
    A, r = nodes.A[k], nodes.r[k]
    parts: dict[str, Any] = {}

    def marker(i: int, m: int) -> ElasticMarker | None:
        frame = frame_in_body(expansion, i, length)
        made = elastic_marker(graph, expansion, i, marker_shape(compiled, m), frame, length)
        return made if made.moves else None

    if nodes.n_q[k]:
        i = int(nodes.body[k])
        parts["modes"] = modes_of(graph, expansion, i, frame_in_body(expansion, i, length))
        parts["own"] = marker(i, int(nodes.own[k])) if nodes.own[k] >= 0 else None
    if nodes.above[k] >= 0:
        i = int(nodes.body[nodes.parent[k]])
        F, origin = frame_in_body(expansion, i, length)
        A, r = F.T @ A, F.T @ (r - origin)
        parts["above"] = marker(i, int(nodes.above[k]))
        r = r if parts["above"] is None else np.zeros(3)  # the marker contains the position
    return parts | {"A": terms(graph, whole(A)), "r": terms(graph, without_rounding(r, length))}


def symbols_of(graph: Graph, name: str, n: int) -> Terms:
    """Return the symbols name[0] to name[n - 1]."""
    return np.array([graph.symbol(f"{name}[{k}]") for k in range(n)], dtype=object)


def moments_in_node(phi: Terms, F: Terms, c: Terms) -> tuple[Scalar, Terms, Terms]:
    """Return mass, first and second moment in a node with axes F at c, from the parameters of the body, (10,)."""
    m, S = phi[0], phi[1:4]
    xx, xy, xz, yy, yz, zz = phi[4:]
    P = second_moments(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], dtype=object))
    s = S - m * c
    moved = np.empty((3, 3), dtype=object)
    for i in range(3):
        for j in range(i, 3):
            moved[i, j] = moved[j, i] = P[i, j] - S[i] * c[j] - c[i] * s[j]
    turned = F.T @ moved @ F
    for i in range(3):
        for j in range(i):
            turned[i, j] = turned[j, i]
    return m, F.T @ s, turned
