"""The recursions of the engine evaluated with terms; every sum and product is simplified when it is created.

Positions, motions and forces come from the kernels of engine/tree/recursion, which are called with terms (`Traced`).
Only flexible bodies and their markers have equations of their own (elastic.py), which need fewer products because they
contain no tables and no branches.

A node of the engine rotates by A E, where A usually only exchanges axes. Here A and E are two nodes; the first is fixed
and has no mass. A marker that moves with modes is a further node before them. A and E stay in one node if A contains
more than one angle.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import FunctionType, SimpleNamespace
from typing import Any

import numpy as np
from numpy import cross

from floatframe.design.generation.elastic import MarkerPlace, MarkerRates, ModalForces, ModalMoments
from floatframe.design.generation.graph import Graph, Scalar, Terms, terms
from floatframe.design.generation.links import Link, TreeTerms
from floatframe.engine.kernels.records import Size, zeros
from floatframe.engine.tree.recursion import entry, newton_euler
from floatframe.engine.tree.recursion.nodes import FIXED, ROTATION, SCREW, NodeWork

__all__ = ["Recursion", "forward_dynamics", "inverse_dynamics", "mass_matrix", "shifted_moments", "turned_moment"]

DENSE = 6  #: largest number of products with A for which A and E are two nodes


class Traced:
    """Calls kernels with terms, so that their results become expressions of the graph.

    A kernel is a function of Python that numba compiles. Without numba it accepts arrays of any objects. Here it calls
    other kernels without numba as well, and functions of `math` that accept terms.

    given: functions that replace kernels wherever they are called, by the names of the kernels.
    """

    def __init__(self, graph: Graph, given: Mapping[str, Callable]) -> None:
        self.given = given
        self.known: dict[Callable, Callable] = {}
        self.math = SimpleNamespace(sin=lambda x: graph.sin(graph.scalar(x)), cos=lambda x: graph.cos(graph.scalar(x)))

    def __call__(self, kernel: Any) -> Callable:
        """Return a kernel as a Python function that accepts terms."""
        source = kernel.py_func
        if source.__name__ in self.given:
            return self.given[source.__name__]
        if source not in self.known:
            space: dict[str, Any] = {"math": self.math}
            self.known[source] = FunctionType(source.__code__, space)
            for name in source.__code__.co_names:
                value = source.__globals__.get(name)
                if name != "math" and value is not None:
                    space[name] = self(value) if hasattr(value, "py_func") else value
        return self.known[source]


def n_products(R: Terms) -> int:
    """Return the number of products needed to rotate a vector by a matrix."""
    return sum(not any(value.is_constant(whole) for whole in (0.0, 1.0, -1.0)) for value in R.ravel())


def divided(tree: TreeTerms, is_divided: bool) -> tuple[list[Link], list[int]]:
    """Return the nodes of a tree divided for terms, and the last new node for each original node."""
    graph, one, zero = tree.graph, terms(tree.graph, np.eye(3)), terms(tree.graph, np.zeros(3))
    links: list[Link] = []
    last: list[int] = []
    for link in tree.links:
        parent = -1 if link.parent < 0 else last[link.parent]
        fixed = replace(
            link, kind=FIXED, n_z=0, mass=graph.zero, s=zero, P=terms(graph, np.zeros((3, 3))), modes=None,
            own=None,
        )  # fmt: skip
        if link.above is not None:
            links.append(replace(fixed, parent=parent, A=one))
            parent, fixed = len(links) - 1, replace(fixed, above=None)
        turns = link.kind == ROTATION or (link.kind == SCREW and link.slide.is_constant(0.0))
        if is_divided or parent < 0 or not turns or n_products(link.A) <= DENSE:
            links.append(replace(fixed, parent=parent))
            link, parent = replace(link, A=one, r=zero), len(links) - 1
        last.append(len(links))
        links.append(replace(link, parent=parent, above=None))
    return links, last


class Recursion:
    """The nodes of a tree at its positions, with their motions and forces.

    is_divided: whether A and E are always two nodes, which pays if few vectors are transformed.
    """

    def __init__(self, tree: TreeTerms, *, is_divided: bool = False) -> None:
        graph = self.graph = tree.graph
        self.tree = tree
        self.links, self.last = links, _ = divided(tree, is_divided)
        self.x, self.places, self.moments = tree.x.copy(), {}, {}
        sizes = [0 if link.modes is None else 6 + link.modes.n for link in links]
        n, fields = len(links), "parent kind is_near n_z x0 v0 slide turn A r mass s P".split()
        self.nodes = SimpleNamespace(
            **{name: np.array([getattr(link, name) for link in links]) for name in fields}, F=self.ones(),
            body=np.arange(n), n_q=np.maximum(np.array(sizes) - 6, 0), u0=np.cumsum([0, *sizes]),
            vq=[link.modes.v0 if link.modes else 0 for link in links], above=np.full(n, -1), own=np.full(n, -1),
        )  # fmt: skip
        for k, link in enumerate(links):
            if link.is_round and link.slide.is_constant(0.0):
                self.x[link.x0] = graph.zero  # no force depends on this angle
            for m, marker, of in ((2 * k, link.above, self.nodes.above), (2 * k + 1, link.own, self.nodes.own)):
                if marker is not None:
                    of[k], self.places[m] = m, MarkerPlace(graph, marker, tree.x)
            if link.modes is not None:
                self.moments[k] = found = ModalMoments.of(graph, link.modes, tree.x)
                self.nodes.s[k], self.nodes.P[k] = link.s + found.s, link.P + found.second
        self.call = Traced(graph, {name: getattr(self, name) for name in (
            "own_marker", "marker_rates", "add_modal_forces", "flexible_wrench",
            "matrix_of_euler_parameters")})  # fmt: skip
        rest = self.zeros(len(tree.v))
        self.placed = self.arguments(rest, rest, tree.gravity)
        self.call(entry.place_in_parent)(*self.placed)

    def zeros(self, *shape: int) -> Terms:
        """Return an array of zeros."""
        return np.full(shape, self.graph.zero, dtype=object)

    def ones(self) -> Any:
        """Return one identity matrix for each node."""
        return terms(self.graph, np.tile(np.eye(3), (len(self.links), 1, 1)))

    def arguments(self, v: Terms, a: Terms, gravity: Terms) -> tuple[Any, Any, None, Any]:
        """Return arguments for kernels: nodes and working arrays."""
        names = {size.name for each in NodeWork() for size in each.shape if isinstance(size, Size)}
        sizes = dict.fromkeys(sorted(names), 0) | {"nodes": len(self.links), "rates": len(v)}
        arrays: Any = (self.zeros(*each.shape) for each in zeros(NodeWork(), sizes))
        given: Any = {"x": self.x, "v": v, "a": a, "gravity": gravity}
        work = NodeWork(*arrays)._replace(A=self.nodes.A.copy(), rho=self.nodes.r.copy(), R_own=self.ones(), **given)
        fields = "rho", "rho_dot", "spin", "rho_ddot", "nu_dot"
        markers = {name: self.zeros(2 * len(self.links), 3) for name in fields}
        for m, place in self.places.items():
            markers["rho"][m] = place.rho
        bodies = SimpleNamespace(residual=self.zeros(self.nodes.u0[-1]))
        return self.nodes, work, None, SimpleNamespace(markers=SimpleNamespace(**markers), bodies=bodies)

    def motion(self, v: Terms, a: Terms, gravity: Terms) -> tuple[Any, Any, None, Any]:
        """Return arguments for kernels with a motion of the placed nodes and their markers."""
        nodes, work, _, marker_work = self.at_rest(v, a, gravity)
        for m, place in self.places.items():
            rates, markers = MarkerRates(place, v, a), marker_work.markers
            markers.rho_dot[m], markers.spin[m] = rates.d_dot, rates.nu
            markers.rho_ddot[m], markers.nu_dot[m] = rates.d_ddot, rates.nu_dot
        return nodes, work, None, marker_work

    def at_rest(self, v: Terms, a: Terms, gravity: Terms) -> tuple[Any, Any, None, Any]:
        """Return arguments for kernels with a motion of the placed nodes, but markers at rest."""
        nodes, work, _, marker_work = self.arguments(v, a, gravity)
        placed = {name: getattr(self.placed[1], name) for name in ("A", "rho", "R", "p", "R_own")}
        return nodes, work._replace(**placed), None, marker_work

    def moved_by(self, rate: int, k: int) -> Any:
        """Return the working arrays after a unit acceleration of one rate of node k alone."""
        a = self.zeros(len(self.tree.v))
        a[rate] = self.graph.one
        made = self.at_rest(self.zeros(len(a)), a, self.zeros(3))
        self.call(newton_euler.move_node)(*made, k)
        return made[1]

    def forces_of(self, k: int, wrench: tuple[Terms, Terms]) -> Terms:
        """Return the forces along all rates for a wrench on node k alone."""
        rest = self.zeros(len(self.tree.v))
        made = self.at_rest(rest, rest, self.zeros(3))
        made[1].f[k], made[1].t[k] = wrench
        while k >= 0:
            self.call(newton_euler.pass_to_parent)(*made, k)
            k = self.links[k].parent
        return made[1].force

    # kernels that are replaced

    def matrix_of_euler_parameters(self, p: Terms) -> Terms:
        """Return the rotation matrix of Euler parameters of length one."""
        w, x, y, z = p[:4]
        X, Y, Z = 2.0 * x, 2.0 * y, 2.0 * z
        return terms(self.graph, [
            [1.0 - (Y * y + Z * z), X * y - Z * w, X * z + Y * w],
            [X * y + Z * w, 1.0 - (X * x + Z * z), Y * z - X * w],
            [X * z - Y * w, Y * z + X * w, 1.0 - (X * x + Y * y)],
        ])  # fmt: skip

    def own_marker(self, model: None, marker_work: Any, m: int) -> Terms:
        """Return the rotation of a marker."""
        return self.places[m].E

    def marker_rates(self, model: None, marker_work: Any, m: int) -> tuple[Terms, Terms]:
        """Return rho_ddot and nu_dot of a marker, its second rates in the body."""
        return marker_work.markers.rho_ddot[m], marker_work.markers.nu_dot[m]

    def add_modal_forces(
        self, model: None, marker_work: Any, m: int, f: Terms, t: Terms, sign: float, out: Terms
    ) -> None:  # fmt: skip
        """Add sign times the modal forces of a wrench on a marker."""
        out += sign * self.places[m].modal_forces(np.array(f), np.array(t))

    def flexible_wrench(self, nodes: Any, work: Any, model: None, marker_work: Any, k: int) -> tuple[Terms, Terms]:
        """Return force and moment of a flexible body, and write its modal forces."""
        modes, u0 = self.links[k].modes, nodes.u0[k] + 6
        assert modes is not None
        forces = ModalForces(modes, self.moments[k], work.x, work.v, work.a)
        (f, t), (f_q, t_q) = self.call(newton_euler.rigid_wrench)(nodes, work, k), forces.wrench(work.omega[k])
        marker_work.bodies.residual[u0 : u0 + modes.n] = forces.modal(work.acc[k], work.omega[k], work.U_spin[k])
        return f + f_q, t + t_q


def inverse_dynamics(recursion: Recursion, v: Terms, a: Terms) -> Terms:
    """Return the forces along all rates for a motion, (n,), by recursive Newton-Euler (docs/recursive.md §2)."""
    made = recursion.motion(v, a, recursion.tree.gravity)
    recursion.call(newton_euler.newton_euler)(*made)
    return made[1].force


def turned_moment(R: Terms, P: Terms) -> Terms:
    """Return R P Rᵀ for a symmetric P; entries below the diagonal equal those above."""
    half = R @ P
    out = np.empty((3, 3), dtype=object)
    for i in range(3):
        for j in range(i, 3):
            out[i, j] = out[j, i] = half[i] @ R[j]
    return out


def shifted_moments(m: Scalar, s: Terms, P: Terms, r: Terms) -> tuple[Terms, Terms]:
    """Return first and second moments about another point, from which r leads to the present point."""
    s_r = s + m * r
    out = np.empty((3, 3), dtype=object)
    for i in range(3):
        for j in range(i, 3):
            out[i, j] = out[j, i] = P[i, j] + r[i] * s[j] + s_r[i] * r[j]
    return s_r, out


def mass_matrix(recursion: Recursion) -> Terms:
    """Return the mass matrix, (n, n), by composite bodies (docs/recursive.md §3), in node frames.

    (1) m, s, P of each subtree; for a flexible body also the wrench of each mode and the modal mass matrix of the
        subtree
    (2) the wrench of each rate, f = m a + alpha × s, t = s × a + (tr P) alpha - P alpha, where the kernel moves the
        node by the rate alone
    (3) the forces of that wrench along the rates of the node and of all nodes between it and the ground, by the kernel
        that passes a wrench on to the parent
    """
    links, n = recursion.links, len(recursion.tree.v)
    bodies = [Composite(recursion, k) for k in range(len(links))]
    M = recursion.zeros(n, n)
    for k in range(len(links) - 1, -1, -1):
        link, body, modes, rows = links[k], bodies[k], links[k].modes, []
        for row in range(link.v0, link.v0 + link.n_z):
            work = recursion.moved_by(row, k)
            rows.append((row, wrench(body.m, body.s, body.P, work.acc[k], work.alpha[k])))
        held = range(0)
        if modes is not None:
            held = range(modes.v0, modes.v0 + modes.n)
            M[modes.rates, modes.rates], wrenches = body.modal_block(recursion.places.get(2 * k + 1))
            rows += zip(held, wrenches, strict=True)
        for row, needed in rows:
            force = recursion.forces_of(k, needed)
            for column in range(n):
                if column not in held and M[row, column].is_constant(0.0):
                    M[row, column] = M[column, row] = force[column]
        if link.parent >= 0:
            bodies[link.parent].carry(recursion, k, body)
    return M


def wrench(m: Scalar, s: Terms, P: Terms, v: Terms, w: Terms) -> tuple[Terms, Terms]:
    """Return the wrench for an acceleration of a body with given moments."""
    return m * v + cross(w, s), cross(s, v) + (P[0, 0] + P[1, 1] + P[2, 2]) * w - P @ w


class Composite:
    """Mass, first and second moment of a subtree in the node frame; for a flexible body also those of its modes."""

    def __init__(self, recursion: Recursion, k: int) -> None:
        nodes, modes = recursion.nodes, recursion.links[k].modes
        self.m, self.s, self.P = nodes.mass[k], nodes.s[k], nodes.P[k]
        if modes is not None:
            self.H = modes.M  #: modal mass matrix at fixed frame, (n, n)
            #: force and moment for unit accelerations of the modes, (n, 3) each
            self.f, self.t = recursion.moments[k].first, recursion.moments[k].B

    def modal_block(self, own: MarkerPlace | None) -> tuple[Terms, list[tuple[Terms, Terms]]]:
        """Return the modal mass matrix if the marker of the joint is fixed, and the wrench of each mode."""
        if own is None:
            return self.H, list(zip(self.f, self.t, strict=True))
        shift, turn = own.columns()
        back = [(cross(w, own.d) - v, -w) for v, w in zip(shift, turn, strict=True)]
        wrenches = []
        for (v, w), f, t in zip(back, self.f, self.t, strict=True):
            f_own, t_own = wrench(self.m, self.s, self.P, v, w)
            wrenches.append((f + f_own, t + t_own))
        H = self.H.copy()
        for i, (f, t) in enumerate(wrenches):
            for j, (v, w) in enumerate(back[: i + 1]):
                H[i, j] = H[j, i] = H[i, j] + v @ f + w @ t + back[i][0] @ self.f[j] + back[i][1] @ self.t[j]
        return H, wrenches

    def carry(self, recursion: Recursion, k: int, body: "Composite") -> None:
        """Add the composite body of child k."""
        nodes, (_, work, _, marker_work) = recursion.nodes, recursion.placed
        m, s, P = body.m, body.s, body.P
        if nodes.own[k] >= 0:
            s, P = shifted_moments(m, s, P, -marker_work.markers.rho[nodes.own[k]])
            s, P = work.R_own[k].T @ s, turned_moment(work.R_own[k].T, P)
        s, P = work.R[k] @ s, turned_moment(work.R[k], P)
        if nodes.above[k] >= 0:
            self.carry_on_modes(recursion.places[nodes.above[k]], m, s, P)
        s, P = shifted_moments(m, s, P, work.p[k])
        self.m, self.s, self.P = self.m + m, self.s + s, self.P + P

    def carry_on_modes(self, place: MarkerPlace, m: Scalar, s: Terms, P: Terms) -> None:
        """Add the contribution of a subtree at a marker to the modes, with moments about the marker."""
        columns = list(zip(*place.columns(), strict=True))
        H, f_modes, t_modes = self.H.copy(), self.f.copy(), self.t.copy()
        for i, (v, w) in enumerate(columns):
            f, t = wrench(m, s, P, v, w)
            f_modes[i], t_modes[i] = f_modes[i] + f, t_modes[i] + t + cross(place.rho, f)
            for j, (v_j, w_j) in enumerate(columns[: i + 1]):
                H[i, j] = H[j, i] = H[i, j] + v_j @ f + w_j @ t
        self.H, self.f, self.t = H, f_modes, t_modes


def rates_of(link: Link) -> list[int]:
    """Return the rates of the joint of a node, followed by the rates of the modes of its body."""
    modes = [] if link.modes is None else list(range(link.modes.v0, link.modes.v0 + link.modes.n))
    return [*range(link.v0, link.v0 + link.n_z), *modes]


def solved(tree: TreeTerms, M: Terms, right: Terms) -> Terms:
    """Return M⁻¹ right, (n,), by M = Lᵀ D L from the tips inwards, without fill-in."""
    order = [rate for link in tree.links for rate in rates_of(link)]
    H, y, graph = M.copy(), right.copy(), tree.graph
    inverse: dict[int, Scalar] = {}
    L = np.full(M.shape, graph.zero, dtype=object)
    for place in range(len(order) - 1, -1, -1):
        k = order[place]
        inverse[k] = graph.one / H[k, k]
        rows = [i for i in order[:place] if not H[k, i].is_constant(0.0)]
        for i in rows:
            L[k, i] = H[k, i] * inverse[k]
        for here, i in enumerate(rows):
            y[i] = y[i] - L[k, i] * y[k]
            for j in rows[: here + 1]:
                H[i, j] = H[j, i] = H[i, j] - L[k, i] * H[k, j]
    for place, k in enumerate(order):
        y[k] = y[k] * inverse[k]
        for i in order[:place]:
            y[k] = y[k] - L[k, i] * y[i]
    return y


def forward_dynamics(recursion: Recursion, force: Terms) -> Terms:
    """Return the accelerations for given forces along the rates, (n,)."""
    tree = recursion.tree
    h = inverse_dynamics(recursion, tree.v, recursion.zeros(len(tree.v)))
    return solved(tree, mass_matrix(recursion), force - h)
