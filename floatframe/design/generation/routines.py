"""Routines that can be generated: their inputs, and their outputs as terms."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy import cross

from fe_models.foundation.arrays import Array
from floatframe.design.generation.elastic import MarkerPlace, MarkerRates
from floatframe.design.generation.graph import (
    ADD,
    CONSTANT,
    COS,
    DIV,
    MUL,
    NEG,
    SIN,
    STUMPFF,
    SUB,
    Graph,
    Operations,
    Scalar,
    Terms,
    operations,
    reachable,
    terms,
)
from floatframe.design.generation.joint_forces import spring_forces
from floatframe.design.generation.links import ROUNDING, Frame, Link, TreeTerms, symbols_of, without_rounding
from floatframe.design.generation.modes import ElasticMarker
from floatframe.design.generation.recursions import (
    Recursion,
    forward_dynamics,
    inverse_dynamics,
    mass_matrix,
    shifted_moments,
    turned_moment,
)
from floatframe.design.generation.rotation_series import expanded
from floatframe.engine.tree.recursion import newton_euler
from floatframe.engine.tree.recursion.nodes import FIXED, ROTATION, SCREW

__all__ = [
    "ROUTINES",
    "Output",
    "Routine",
    "carried_inwards",
    "derivative",
    "jacobian",
    "position_seeds",
    "routine_of",
    "seeds_of",
]


# derivatives of terms, as terms of the same graph ---------------------------------------------------------------------


def derivative(graph: Graph, terms: Sequence[Scalar], seed: Mapping[Scalar, Scalar]) -> dict[int, Scalar]:
    """Return the nonzero derivatives by the index of their term; terms must follow their arguments.

    seed: derivatives of the symbols.
    """
    dot: dict[int, Scalar] = {symbol.index: change for symbol, change in seed.items()}
    for term in terms:
        moved = [dot.get(arg.index) for arg in term.args]
        if term.index in dot or not any(moved):
            continue
        changes = [graph.zero if each is None else each for each in moved]
        a, da = term.args[0], changes[0]
        b, db = (term.args[1], changes[1]) if len(changes) > 1 else (graph.zero, graph.zero)
        if term.kind == ADD:
            change = da + db
        elif term.kind == SUB:
            change = da - db
        elif term.kind == MUL:
            change = da * b + a * db
        elif term.kind == DIV:
            change = (da - term * db) / b
        elif term.kind == NEG:
            change = -da
        elif term.kind == SIN:
            change = graph.cos(a) * da
        elif term.kind == STUMPFF:  # dc_k/dx = (k c_k+2 - c_k+1) / 2
            k = int(term.value)
            change = 0.5 * (k * graph.stumpff(k + 2, a) - graph.stumpff(k + 1, a)) * da
        else:
            assert term.kind == COS
            change = -(graph.sin(a) * da)
        if not change.is_constant(0.0):
            dot[term.index] = change
    return dot


def jacobian(graph: Graph, outputs: Terms, seeds: Sequence[Mapping[Scalar, Scalar]]) -> Terms:
    """Return the derivatives of outputs, (m,), along seeds, (m, n)."""
    order = reachable(outputs)
    out = np.full((len(outputs), len(seeds)), graph.zero, dtype=object)
    for j, seed in enumerate(seeds):
        dot = derivative(graph, order, seed)
        for i, term in enumerate(outputs):
            out[i, j] = dot.get(term.index, graph.zero)
    return out


def seeds_of(graph: Graph, symbols: Sequence[Scalar]) -> list[dict[Scalar, Scalar]]:
    """Return the seeds of derivatives by symbols."""
    return [{symbol: graph.one} for symbol in symbols]


def position_seeds(tree: TreeTerms) -> list[dict[Scalar, Scalar]]:
    """Return the seeds of derivatives by positions along the rates: R exp(dz) for rotations, p' = p (0, e) / 2."""
    graph = tree.graph
    seeds: list[dict[Scalar, Scalar]] = [{} for _ in tree.v]
    for link in tree.links:
        x = tree.x[link.x0 :]
        if link.kind == ROTATION:
            w, p_x, p_y, p_z = x[:4]
            for j, row in enumerate(((-p_x, w, p_z, -p_y), (-p_y, -p_z, w, p_x), (-p_z, p_y, -p_x, w))):
                seeds[link.v0 + j] = {x[i]: 0.5 * change for i, change in enumerate(row)}
        else:
            for j in range(link.n_z):
                seeds[link.v0 + j] = {x[j]: graph.one}
        if link.modes is not None:
            for j in range(link.modes.n):
                seeds[link.modes.v0 + j] = {tree.x[link.modes.x0 + j]: graph.one}
    return seeds


# routines -------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Output:
    """One array of results."""

    name: str
    values: Terms  #: terms, in the shape of the array
    meaning: str


@dataclass(frozen=True, eq=False)
class Routine:
    """A function to be written in a language."""

    name: str
    inputs: tuple[tuple[str, int, str], ...]  #: name, length, meaning
    outputs: tuple[Output, ...]
    graph: Graph
    meaning: str
    asked: tuple[int, int]  #: additions and multiplications of the same recursion without simplification
    has_series: bool  #: whether elastic rotations are polynomials, which are valid up to 4 rad

    @property
    def values(self) -> list[Scalar]:
        """Return the terms of all outputs in order, by rows."""
        return [value for output in self.outputs for value in output.values.ravel()]

    @property
    def operations(self) -> Operations:
        """Return the operations of one call."""
        return operations(self.values)


def force_output(name: str, values: Terms) -> Output:
    """Return forces along rates as an output."""
    return Output(name, values, "forces along the rates [N, N m]")


def needed_forces(recursion: Recursion) -> Terms:
    """Return the forces along the rates for a motion, without those of springs and dampers, (n,)."""
    tree = recursion.tree
    return np.asarray(inverse_dynamics(recursion, tree.v, tree.a) - spring_forces(tree))


def inverse(tree: TreeTerms) -> list[Output]:
    """Return the forces for a motion."""
    return [force_output("force", needed_forces(Recursion(tree)))]


def residual(tree: TreeTerms) -> list[Output]:
    """Return the residual of the equations of motion."""
    given = symbols_of(tree.graph, "force", len(tree.v))
    force = needed_forces(Recursion(tree))
    return [Output("residual", force - given, "M z_ddot + h - force [N, N m]")]


def mass(tree: TreeTerms) -> list[Output]:
    """Return the mass matrix."""
    return [Output("mass_matrix", mass_matrix(Recursion(tree)), "M, symmetric [kg, kg m, kg m2]")]


def forward(tree: TreeTerms) -> list[Output]:
    """Return the accelerations under forces."""
    given = symbols_of(tree.graph, "force", len(tree.v))
    acceleration = forward_dynamics(Recursion(tree), given + spring_forces(tree))
    return [Output("acceleration", acceleration, "z_ddot [m/s2, rad/s2]")]


def derivatives(tree: TreeTerms) -> list[Output]:
    """Return the derivatives, by the motion, of the forces for a motion."""
    recursion = Recursion(tree)
    force = needed_forces(recursion)
    return [
        Output("by_z", jacobian(tree.graph, force, position_seeds(tree)), "force by z along the rates"),
        Output("by_z_dot", jacobian(tree.graph, force, seeds_of(tree.graph, list(tree.v))), "force by z_dot"),
        Output("by_z_ddot", mass_matrix(recursion), "force by z_ddot: the mass matrix"),
    ]


def sensitivity(tree: TreeTerms) -> list[Output]:
    """Return the derivatives, by parameters, of the forces for a motion."""
    force = needed_forces(Recursion(tree))
    by = jacobian(tree.graph, force, seeds_of(tree.graph, tree.parameters))
    return [Output("by_parameters", by, "force by parameters, (rates, parameters)")]


Motion = tuple[Terms, Terms, Terms, Terms]  #: r, R_GN, v, omega of a frame, in ground axes


def carried(graph: Graph, tree: TreeTerms, motion: Motion, marker: ElasticMarker) -> Motion:
    """Return the motion of a marker on a flexible body from the motion of the body."""
    (r, R, v, omega), place = motion, MarkerPlace(graph, marker, tree.x)
    rates = MarkerRates(place, tree.v, np.full(len(tree.v), graph.zero, dtype=object))
    p = R @ place.rho
    return r + p, R @ place.E, v + cross(omega, p) + R @ rates.d_dot, omega + R @ rates.nu


def placed_nodes(recursion: Recursion) -> list[Motion]:
    """Return the motions of all node frames."""
    tree, zero = recursion.tree, recursion.zeros(3)
    nodes, work, _, marker_work = recursion.motion(tree.v, recursion.zeros(len(tree.v)), zero)
    markers, started = marker_work.markers, recursion.at_rest(recursion.zeros(len(tree.v)), tree.v, zero)[1]
    ground = zero, terms(tree.graph, np.eye(3)), zero, zero
    placed: list[tuple[Motion, Terms]] = []  # motion of a point, arm to the origin of the node
    for k, link in enumerate(recursion.links):
        (r, R, v, omega), arm = placed[link.parent] if link.parent >= 0 else (ground, zero)
        arm, m = arm + R @ work.p[k], nodes.above[k]
        if m >= 0 or k in recursion.last:
            r, v, arm = r + arm, v + cross(omega, arm), zero
        if m >= 0:
            v, omega = v + R @ markers.rho_dot[m], omega + R @ markers.spin[m]
        R, m = R @ work.R[k], nodes.own[k]
        _, turned, slid = recursion.call(newton_euler.joint_motion)(nodes, started, k, zero, zero, zero)
        v, omega = v + R @ slid, omega + R @ turned
        if m >= 0:
            R = R @ work.R_own[k].T
            p, omega = R @ markers.rho[m], omega - R @ markers.spin[m]
            r, v = r - p, v - cross(omega, p) - R @ markers.rho_dot[m]
        placed.append(((r, R, v, omega), arm))
    return [placed[k][0] for k in recursion.last]


def placed_frame(tree: TreeTerms, frame: Frame, placed: Sequence[Motion]) -> Motion:
    """Return the motion of a frame on a body."""
    motion = placed[frame.node]
    if frame.marker is not None:
        motion = carried(tree.graph, tree, motion, frame.marker)
    r, R, v, omega = motion
    arm = R @ frame.origin
    return r + arm, R @ frame.axes, v + cross(omega, arm), omega


def kinematics(tree: TreeTerms) -> list[Output]:
    """Return positions, axes and velocities of the frames of all bodies, in ground axes."""
    placed = placed_nodes(Recursion(tree, is_divided=True))
    meanings = {
        "position": "origins of the body frames, (bodies, 3) [m]",
        "axes": "R_GB of the bodies, (bodies, 3, 3)",
        "velocity": "of the origins, (bodies, 3) [m/s]",
        "angular_velocity": "ground axes, (bodies, 3) [rad/s]",
    }
    columns = zip(*(placed_frame(tree, frame, placed) for frame in tree.frames), strict=True)
    outputs = [Output(name, np.stack(each), text) for (name, text), each in zip(meanings.items(), columns, strict=True)]
    if tree.interfaces:
        names = ", ".join(frame.name for frame in tree.interfaces)
        columns = zip(*(placed_frame(tree, frame, placed) for frame in tree.interfaces), strict=True)
        outputs += [
            Output(f"interface_{name}", np.stack(each), f"the same of the interfaces {names}")
            for name, each in zip(meanings, columns, strict=True)
        ]
    return outputs


@dataclass(frozen=True)
class Kind:
    """The function, inputs and meaning of a routine."""

    make: Callable[[TreeTerms], list[Output]]
    inputs: tuple[str, ...]
    meaning: str
    is_force: bool = True  #: whether the outputs follow only from the forces along the rates


MOTION = ("z", "z_dot", "z_ddot")
ROUTINES = {
    "inverse": Kind(inverse, MOTION, "Inverse dynamics: the forces for a motion"),
    "residual": Kind(residual, (*MOTION, "force"), "Residual of the equations of motion"),
    "mass": Kind(mass, ("z",), "Mass matrix"),
    "forward": Kind(forward, ("z", "z_dot", "force"), "Forward dynamics: accelerations under forces"),
    "kinematics": Kind(kinematics, ("z", "z_dot"), "Positions and velocities of all bodies", is_force=False),
    "jacobian": Kind(derivatives, MOTION, "Derivatives of the forces of a motion"),
    "sensitivity": Kind(sensitivity, MOTION, "Derivatives of the forces of a motion by parameters"),
}
INPUTS = {
    "z": "positions [m, rad, 1]",
    "z_dot": "rates",
    "z_ddot": "rates of the rates",
    "force": "forces along the rates [N, N m]",
    "parameters": "parameters that remain symbols",
}


def written_out(graph: Graph, outputs: Sequence[Output]) -> tuple[Output, ...]:
    """Return outputs without the series of rotations, which the languages do not have."""
    values = expanded(graph, [value for output in outputs for value in output.values.ravel()])
    results, first = [], 0
    for output in outputs:
        part = np.array(values[first : first + output.values.size], dtype=object)
        results.append(replace(output, values=part.reshape(output.values.shape)))
        first += output.values.size
    return tuple(results)


def routine_of(tree: TreeTerms, what: str, name: str) -> Routine:
    """Return the routine with a name in `ROUTINES`."""
    kind = ROUTINES[what]
    if kind.is_force:
        tree = carried_inwards(tree)
    before = tuple(tree.graph.asked)
    made = kind.make(tree)
    asked = (tree.graph.asked[0] - before[0], tree.graph.asked[1] - before[1])
    has_series = any(term.kind == STUMPFF for term in reachable(v for each in made for v in each.values.ravel()))
    outputs = written_out(tree.graph, made)
    sizes = dict.fromkeys(INPUTS, len(tree.v)) | {"z": len(tree.x), "parameters": len(tree.parameters)}
    wanted = (*kind.inputs, *(("parameters",) if tree.parameters else ()))
    inputs = tuple((each, sizes[each], INPUTS[each]) for each in wanted)
    return Routine(name, inputs, outputs, tree.graph, kind.meaning, asked, has_series)


# transfer of masses towards the root of a tree: other moments of the bodies, the same forces along all rates ----------
# A part of the mass of a node can be assigned to the parent if it moves with the inner frame of the joint in the same
# way as with the outer frame. These parts of the mass m, first moment s and second moment P = ∫ c cᵀ dm are
#
#         hinge        the mass on its axis: m, s_z, P_zz
#         screw        only P_zz, a direction along the axis without position
#         slider       P, because its directions do not rotate relative to the parent
#         rotation     m, at its centre
#         fixed        all
#         marker that moves with modes   none
#
# Moments that reach the ground vanish. A body on a hinge keeps seven of its ten parameters. Reactions in joints differ
# from those of the original tree; only forces along the rates, and all results that follow from them, are the same.
#
# A rigid body at the tip of the tree, on a hinge or screw, may be symmetric about its axis, such as a wheel:
#
#     s_x = s_y = 0,  P_xx = P_yy,  P_xy = P_xz = P_yz = 0,
#
# It then has the same moments in a frame that does not rotate with it, so that no force depends on its angle.


def carried_inwards(tree: TreeTerms) -> TreeTerms:
    """Return a tree in which moments of mass that a joint does not move belong to the parent: the forces stay the same.

    A tree with a moment that is a symbol is returned unchanged.
    """
    links = list(tree.links)
    moments = [value for link in links for value in (link.mass, *link.s, *link.P.ravel())]
    if any(value.kind != CONSTANT for value in moments):
        return tree
    for k in range(len(links) - 1, -1, -1):
        link = links[k]
        moved = with_moments(link, taken_along(tree.graph, link))
        links[k] = cleaned(tree.graph, less(link, moved), link)
        if link.parent >= 0:
            s, P = shifted_moments(moved.mass, link.A @ moved.s, turned_moment(link.A, moved.P), link.r)
            above = links[link.parent]
            links[link.parent] = with_moments(above, (above.mass + moved.mass, above.s + s, above.P + P))
    return replace(tree, links=rounded(links))


def with_moments(link: Link, moments: tuple) -> Link:
    """Return a node with other moments."""
    return replace(link, mass=moments[0], s=moments[1], P=moments[2])


def less(link: Link, moved: Link) -> Link:
    """Return a node without the transferred moments."""
    return with_moments(link, (link.mass - moved.mass, link.s - moved.s, link.P - moved.P))


def taken_along(graph: Graph, link: Link) -> tuple:
    """Return the parts of m, s, P that move with the inner frame of the joint, in its axes at joint position zero."""
    s, P = terms(graph, np.zeros(3)), terms(graph, np.zeros((3, 3)))
    if link.above is not None or link.own is not None:
        return graph.zero, s, P
    if link.kind == FIXED:
        return link.mass, link.s, link.P
    if link.kind == ROTATION:
        return link.mass, s, P
    if link.kind == SCREW and not link.turn.is_constant(0.0):
        P[2, 2] = link.P[2, 2]
        if not link.slide.is_constant(0.0):
            return graph.zero, s, P
        s[2] = link.s[2]
        return link.mass, s, P
    return graph.zero, s, link.P


def cleaned(graph: Graph, link: Link, before: Link) -> Link:
    """Return a node in which rounding errors of moments are zero; `before` has the moments before the transfer."""
    s, P = (terms(graph, without_rounding(values_of(now), float(np.abs(values_of(was)).max())))
            for now, was in ((link.s, before.s), (link.P, before.P)))  # fmt: skip
    return with_moments(link, (link.mass, s, P))


def values_of(numbers: Terms) -> Array:
    """Return an array of constant terms as an array of numbers."""
    return np.array([each.value for each in numbers.ravel()]).reshape(numbers.shape)


def rounded(links: list[Link]) -> tuple[Link, ...]:
    """Return the nodes; `is_round` marks rigid, axisymmetric nodes that carry no other node with modes or mass."""
    counts = [False] * len(links)
    out = list(links)
    for k in range(len(links) - 1, -1, -1):
        link = links[k]
        if link.kind == SCREW and not counts[k] and link.modes is None and is_round(link):
            out[k] = replace(link, is_round=True)
        if link.parent >= 0 and (counts[k] or link.n_z or link.has_moments or link.modes is not None):
            counts[link.parent] = True
    return tuple(out)


def is_round(link: Link) -> bool:
    """Return whether the moments of a node are symmetric about its third axis."""
    (x, y), P = link.s[:2], link.P
    if not all(value.is_constant(0.0) for value in (x, y, P[0, 1], P[0, 2], P[1, 2])):
        return False
    return abs(P[0, 0].value - P[1, 1].value) <= ROUNDING * abs(P[0, 0].value)
