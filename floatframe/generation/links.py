"""The tree of a system for expressions: nodes of docs/recursive.md §1 with numbers and symbols for what they hold.

Numbers that vanish but for rounding (cos 90°, products with it) are zero here: entries of rotation matrices within
4 ulp of a whole number, lengths and moments below 4 ulp of the largest of their kind.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.words import quoted
from floatframe.bodies.rigid_body import RigidBody
from floatframe.errors import ModelError
from floatframe.generation.graph import Graph, Scalar
from floatframe.identification.inertial_parameters import INERTIAL, parameters_of
from floatframe.relative.recursion.expansion import Expansion

__all__ = ["GRAVITY", "Link", "TreeTerms", "parameter_names", "terms", "tree_terms", "without_rounding"]

GRAVITY = ("gravity/x", "gravity/y", "gravity/z")
ROUNDING = 4 * np.finfo(float).eps


@dataclass(frozen=True, eq=False)
class Link:
    """A node: its joint, and the moments of what it carries in its own frame; arrays hold terms."""

    parent: int
    kind: int
    is_near: bool
    x0: int
    v0: int
    n_z: int
    slide: Scalar
    turn: Scalar
    A: Array  #: inner frame of the joint in the parent, (3, 3)
    r: Array  #: its origin, (3,) [m]
    body: int  #: -1 for none
    mass: Scalar
    s: Array  #: first moment, (3,) [kg m]
    P: Array  #: second moment, integral of c cᵀ over mass, (3, 3) [kg m²]

    @property
    def has_moments(self) -> bool:
        """Whether it carries anything: a body, or what was counted to a node without one."""
        return not all(value.is_constant(0.0) for value in (self.mass, *self.s, *self.P.ravel()))


@dataclass(frozen=True, eq=False)
class TreeTerms:
    """A tree with its graph: what the recursions work on."""

    graph: Graph
    links: tuple[Link, ...]
    gravity: Array  #: (3,) [m/s²]
    x: Array  #: symbols of the positions, (n_z,)
    v: Array  #: of the rates, (n,)
    a: Array  #: of the accelerations, (n,)
    parameters: tuple[Scalar, ...]  #: symbols in the place of numbers
    parameter_names: tuple[str, ...]
    parameter_values: tuple[float, ...]
    frames: tuple[tuple[int, Array, Array], ...]  #: of each body: its node, and its frame in that, axes and origin


def terms(graph: Graph, numbers: Array) -> Array:
    """Return an array of terms of numbers and terms."""
    out = np.empty(np.shape(numbers), dtype=object)
    for place, value in np.ndenumerate(np.asarray(numbers, dtype=object)):
        out[place] = graph.scalar(value)
    return out


def whole(R: Array) -> Array:
    """Return an array of 0, 1, -1 and other numbers with those that are whole but for rounding made whole."""
    near = np.round(R)
    return np.asarray(np.where(np.abs(R - near) < ROUNDING, near, R) + 0.0)


def without_rounding(x: Array, size: float) -> Array:
    """Return numbers with those that are rounding errors of a size made zero."""
    return np.asarray(np.where(np.abs(x) < ROUNDING * size, 0.0, x))


def parameter_names(expansion: Expansion) -> dict[str, float]:
    """Return names and values of all numbers that can be symbols: inertial parameters of bodies, gravity."""
    found = {}
    for body in expansion.system.bodies:
        if isinstance(body, RigidBody):
            names = (f"{body.name}/{each}" for each in INERTIAL)
            found |= dict(zip(names, map(float, parameters_of(body)), strict=True))
    return found | dict(zip(GRAVITY, map(float, expansion.compiled.model.gravity), strict=True))


def chosen(patterns: Sequence[str], values: dict[str, float]) -> tuple[str, ...]:
    """Return the names that patterns match, in their own order; a body or "gravity" stands for all of its own."""
    wanted = set()
    for pattern in patterns:
        matched = {name for name in values if fnmatchcase(name, pattern) or name.rsplit("/", 1)[0] == pattern}
        if not matched:
            some = ", ".join(list(values)[:11])
            raise ModelError(
                f"generate: parameters: {quoted(pattern)} is the name of no parameter, body or pattern; there are "
                f"{some}, ..., {', '.join(GRAVITY)}"
            )
        wanted |= matched
    return tuple(name for name in values if name in wanted)


def second_moment(J: Array) -> Array:
    """Return the integral of c cᵀ from an inertia tensor, (3, 3), of numbers or terms."""
    half = 0.5 * (J[0, 0] + J[1, 1] + J[2, 2])
    P = -J
    for k in range(3):
        P[k, k] = half - J[k, k]
    return P


def tree_terms(expansion: Expansion, parameters: Sequence[str] = ()) -> TreeTerms:
    """Return a tree of rigid bodies as terms, parameters of some names as symbols.

    Raises
    ------
    ModelError
        If a body is flexible, or a pattern of `parameters` matches nothing.
    """
    graph, nodes, system = Graph(), expansion.nodes, expansion.system
    for body in system.bodies:
        if not isinstance(body, RigidBody):
            raise ModelError(
                f"generate: body {body.name!r}: expected rigid bodies, got a flexible one; freeze its modes "
                "(frozen_bodies), or take relative_model"
            )
    values = parameter_names(expansion)
    names = chosen(parameters, values)
    symbols = {name: graph.symbol(f"parameters[{k}]") for k, name in enumerate(names)}
    length = float(np.abs(nodes.r).max(initial=0.0))
    links = []
    frames: list[tuple[int, Array, Array]] = [(-1, np.eye(3), np.zeros(3))] * len(system.bodies)
    for k in range(len(nodes.parent)):
        body = int(nodes.body[k])
        mass, s, P = 0.0, np.zeros(3), np.zeros((3, 3))
        if body >= 0:
            F, origin = expansion.frame_of[body]
            F, origin = whole(F), without_rounding(origin, length)
            frames[body] = (k, terms(graph, F.T), terms(graph, without_rounding(-F.T @ origin, length)))
            own = [f"{system.bodies[body].name}/{each}" for each in INERTIAL]
            if any(name in symbols for name in own):
                phi = terms(graph, [symbols.get(name, values[name]) for name in own])
                mass, s, P = moments_in_node(graph, phi, F, origin)
            else:
                mass, s, J = float(nodes.mass[k]), nodes.s[k], nodes.J[k]
                P = without_rounding(second_moment(J), np.abs(J).max(initial=0.0))
                s = without_rounding(s, max(np.abs(s).max(), mass * length))
        links.append(
            Link(
                int(nodes.parent[k]), int(nodes.kind[k]), bool(nodes.is_near[k]), int(nodes.x0[k]), int(nodes.v0[k]),
                int(nodes.n_z[k]), graph.constant(whole(nodes.slide[k])),
                graph.constant(whole(nodes.turn[k])),
                terms(graph, whole(nodes.A[k])), terms(graph, without_rounding(nodes.r[k], length)), body,
                graph.scalar(mass), terms(graph, s), terms(graph, P),
            )
        )  # fmt: skip
    gravity = [symbols.get(name, values[name]) for name in GRAVITY]
    return TreeTerms(
        graph, tuple(links), terms(graph, gravity),
        *(symbols_of(graph, name, n) for name, n in (
            ("z", expansion.n_x), ("z_dot", expansion.n_v), ("z_ddot", expansion.n_v))),
        tuple(symbols.values()), names, tuple(values[name] for name in names), tuple(frames),
    )  # fmt: skip


def symbols_of(graph: Graph, name: str, n: int) -> Array:
    """Return the symbols name[0] to name[n - 1]."""
    return np.array([graph.symbol(f"{name}[{k}]") for k in range(n)], dtype=object)


def moments_in_node(graph: Graph, phi: Array, F: Array, origin: Array) -> tuple[Scalar, Array, Array]:
    """Return mass, first and second moment in the frame F, origin of a node, of parameters of the body, (10,)."""
    m, S = phi[0], phi[1:4]
    xx, xy, xz, yy, yz, zz = phi[4:]
    P = second_moment(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], dtype=object))
    c, Ft = terms(graph, origin), terms(graph, F.T)
    s = S - m * c
    moved = np.empty((3, 3), dtype=object)
    for i in range(3):
        for j in range(i, 3):
            moved[i, j] = moved[j, i] = P[i, j] - S[i] * c[j] - c[i] * s[j]
    turned = Ft @ moved @ Ft.T
    for i in range(3):
        for j in range(i):
            turned[i, j] = turned[j, i]
    return m, Ft @ s, turned
