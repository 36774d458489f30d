"""The recursions of a tree as terms; every sum and product is simplified when it is created.

Frames are those of docs/recursive.md: A, r for the inner frame of a joint in the parent, and E, d for its outer frame
in the inner one. A vector is transformed by A and E separately, because A mostly only exchanges axes; it is transformed
by their product if A contains more than one angle.

With the second moment P = ∫ c cᵀ dm and U = alpha~ + omega~ omega~, all points of a body have c_ddot = U c. Its force
and moment are

    f = m a + U s,    t = s × a + the axial vector of U P - (U P)ᵀ

These need fewer products than J alpha + omega × J omega.
"""

from collections.abc import Sequence

import numpy as np

from floatframe.design.generation.elastic import MarkerPlace, MarkerRates, ModalForces, ModalMoments, cross
from floatframe.design.generation.graph import Graph, Scalar, Terms, terms
from floatframe.design.generation.links import Link, TreeTerms
from floatframe.engine.tree.recursion.nodes import ROTATION, SCREW, TRANSLATION

__all__ = ["Joint", "forward_dynamics", "inverse_dynamics", "joints_of", "mass_matrix", "solved"]


DENSE = 6  #: largest number of products of two matrices that are applied one after the other


def is_vanishing(values: Terms) -> bool:
    """Return whether all values are zero."""
    return all(value.is_constant(0.0) for value in values.ravel())


def n_products(R: Terms) -> int:
    """Return the number of products to rotate a vector by a matrix."""
    return sum(not any(value.is_constant(whole) for whole in (0.0, 1.0, -1.0)) for value in R.ravel())


class Joint:
    """The position of a joint: A, E, (3, 3), d, (3,), and its motion S per rate in the outer frame.

    The frame of a round link stays with the inner one. Where asked (is_whole), A that is not sparse is one with E, and
    an identity beside it: for many vectors that go through both.
    """

    def __init__(self, tree: TreeTerms, link: Link, is_whole: bool) -> None:
        graph = tree.graph
        self.E, self.d = terms(graph, np.eye(3)), terms(graph, np.zeros(3))
        x = tree.x[link.x0 :]
        if link.kind == SCREW:
            if not link.is_round:
                angle = link.turn * x[0]
                c, s = graph.cos(angle), graph.sin(angle)
                self.E = terms(graph, [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
            self.d = terms(graph, [0.0, 0.0, link.slide * x[0]])
        elif link.kind == ROTATION:
            self.E = rotation_of(graph, x[:4])
            if link.is_near:
                self.E = self.E.T
        elif link.kind == TRANSLATION:
            self.d = link.slide * x[:3]
        self.columns = joint_columns(graph, link, self.E)
        self.A = link.A
        if is_whole and link.n_z and is_vanishing(self.d) and n_products(link.A) > DENSE:
            self.A, self.E = terms(graph, np.eye(3)), link.A @ self.E
        #: where the markers at the joint stand in the parent and in the body, moments of that as it is deformed
        self.above = None if link.above is None else MarkerPlace(graph, link.above, tree.x)
        self.own = None if link.own is None else MarkerPlace(graph, link.own, tree.x)
        self.moments = None if link.modes is None else ModalMoments.of(graph, link.modes, tree.x)
        self.s, self.P = link.s, link.P
        if self.moments is not None:
            self.s, self.P = link.s + self.moments.s, link.P + self.moments.second


def rotation_of(graph: Graph, p: Terms) -> Terms:
    """Return the rotation matrix of Euler parameters with length one."""
    w, x, y, z = p
    X, Y, Z = 2.0 * x, 2.0 * y, 2.0 * z
    return terms(graph, [
        [1.0 - (Y * y + Z * z), X * y - Z * w, X * z + Y * w],
        [X * y + Z * w, 1.0 - (X * x + Z * z), Y * z - X * w],
        [X * z - Y * w, Y * z + X * w, 1.0 - (X * x + Y * y)],
    ])  # fmt: skip


def joint_columns(graph: Graph, link: Link, E: Terms) -> Terms:
    """Return the motion (translation, rotation) of the outer frame per rate, in its axes, (n_z, 6)."""
    columns = terms(graph, np.zeros((link.n_z, 6)))
    if link.kind == SCREW:
        columns[0, 2], columns[0, 5] = link.slide, link.turn
    elif link.kind == TRANSLATION:
        columns[:, :3] = terms(graph, np.eye(3)) * link.slide
    elif link.kind == ROTATION:
        columns[:, 3:] = -E if link.is_near else terms(graph, np.eye(3))
    return columns


def joints_of(tree: TreeTerms, *, is_whole: bool = True) -> list[Joint]:
    """Return where all joints stand; is_whole: through which many vectors go."""
    return [Joint(tree, link, is_whole) for link in tree.links]


def spin_terms(omega: Terms, alpha: Terms) -> Terms:
    """Return U = alpha~ + omega~ omega~, (3, 3)."""
    x, y, z = omega
    xx, yy, zz, xy, xz, yz = x * x, y * y, z * z, x * y, x * z, y * z
    return np.array([
        [-(yy + zz), xy - alpha[2], xz + alpha[1]],
        [xy + alpha[2], -(xx + zz), yz - alpha[0]],
        [xz - alpha[1], yz + alpha[0], -(xx + yy)],
    ], dtype=object)  # fmt: skip


def axial_of_product(U: Terms, P: Terms) -> Terms:
    """Return the axial vector of U P - (U P)ᵀ for a symmetric P, (3,)."""
    t = []
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        t.append(P[i, j] * U[k, i] - P[i, k] * U[j, i] + P[j, k] * (U[k, k] - U[j, j]) + P[j, j] * U[k, j]
                 - P[k, k] * U[j, k])  # fmt: skip
    return np.array(t, dtype=object)


def motion_through(link: Link, joint: Joint, v: Terms, a: Terms, omega: Terms, alpha: Terms, acc: Terms) -> tuple:
    """Return omega, alpha, a of the outer frame of a joint from those of the inner frame at the same point."""
    E = joint.E.T
    acc = acc + spin_terms(omega, alpha) @ joint.d
    omega, alpha, acc = E @ omega, E @ alpha, E @ acc
    S = joint.columns
    if not link.n_z:
        return omega, alpha, acc
    rate, second = v[link.v0 : link.v0 + link.n_z], a[link.v0 : link.v0 + link.n_z]
    slid, turned = rate @ S[:, :3], rate @ S[:, 3:]
    acc = acc + 2.0 * cross(omega, slid) + second @ S[:, :3]
    alpha = alpha + cross(omega, turned) + second @ S[:, 3:]
    return omega + turned, alpha, acc


def inverse_dynamics(tree: TreeTerms, v: Terms, a: Terms, joints: Sequence[Joint]) -> Terms:
    """Return the forces along all rates for a motion, (n,), by recursive Newton-Euler (docs/recursive.md §2).

    (1) forward   omega, alpha and a minus gravity of each node, from A, r, d, E
    (2) body      f = m a + U s, t = s × a + axial(U P)
    (3) backward  the wrench is projected on the rates of the joint, and transferred to the parent
    """
    n, zero = len(tree.links), terms(tree.graph, np.zeros(3))
    base = (zero, zero, -tree.gravity, spin_terms(zero, zero))
    motions: list[tuple] = []
    f, t = [zero] * n, [zero] * n
    force = np.full(len(v), tree.graph.zero, dtype=object)
    for k, (link, joint) in enumerate(zip(tree.links, joints, strict=True)):
        motion = inner_motion(link, joint, v, a, base if link.parent < 0 else motions[link.parent])
        motion = motion_through(link, joint, v, a, *motion)
        if joint.own is not None:
            motion = motion_of_body(joint.own, MarkerRates(joint.own, v, a), *motion)
        omega, alpha, acc = motion
        U = spin_terms(omega, alpha)
        motions.append((omega, alpha, acc, U))
        if link.has_moments or link.modes is not None:
            f[k] = link.mass * acc + U @ joint.s
            t[k] = cross(joint.s, acc) + axial_of_product(U, joint.P)
        if link.modes is not None and joint.moments is not None:
            forces = ModalForces(link.modes, joint.moments, tree.x, v, a)
            f_q, t_q = forces.wrench(omega)
            f[k], t[k] = f[k] + f_q, t[k] + t_q
            force[link.modes.rates] = forces.modal(acc, omega, U)
    for k in range(n - 1, -1, -1):
        link, joint = tree.links[k], joints[k]
        f_Q, t_Q = along_joint(link, joint, f[k], t[k], force)
        if link.parent >= 0:
            f_P, t_P = to_parent(link, joint, f_Q, t_Q, force)
            f[link.parent], t[link.parent] = f[link.parent] + f_P, t[link.parent] + t_P
    return force


def inner_motion(link: Link, joint: Joint, v: Terms, a: Terms, above: tuple) -> tuple[Terms, Terms, Terms]:
    """Return omega, alpha, a of the inner frame of a joint from those of the parent, and its U."""
    (omega, alpha, acc, U), A = above, joint.A.T
    if joint.above is None:
        return A @ omega, A @ alpha, A @ (acc + U @ link.r)
    place, rates = joint.above, MarkerRates(joint.above, v, a)
    acc = acc + U @ place.rho + 2.0 * cross(omega, rates.d_dot) + rates.d_ddot
    alpha = alpha + cross(omega, rates.nu) + rates.nu_dot
    E = place.E.T
    return A @ (E @ (omega + rates.nu)), A @ (E @ alpha), A @ (E @ acc)


def motion_of_body(
    place: MarkerPlace, rates: MarkerRates, omega: Terms, alpha: Terms, acc: Terms
) -> tuple[Terms, Terms, Terms]:
    """Return omega, alpha, a of a flexible body from those of its marker at the joint, in the axes of the marker."""
    omega, alpha, acc = place.E @ omega - rates.nu, place.E @ alpha - rates.nu_dot, place.E @ acc
    alpha = alpha - cross(omega, rates.nu)
    acc = acc - (spin_terms(omega, alpha) @ place.d + 2.0 * cross(omega, rates.d_dot) + rates.d_ddot)
    return omega, alpha, acc


def along_joint(link: Link, joint: Joint, f: Terms, t: Terms, force: Terms) -> tuple[Terms, Terms]:
    """Add the forces of a wrench (node frame) along the rates of the joint; return the wrench in the outer frame.

    The wrench also acts on the modes of the body, through the marker at the joint.
    """
    if joint.own is not None:
        own = joint.own
        t = t - cross(own.d, f)
        force[own.rates] = force[own.rates] - own.modal_forces(f, t)
        f, t = own.E.T @ f, own.E.T @ t
    for j in range(link.n_z):
        force[link.v0 + j] = joint.columns[j, :3] @ f + joint.columns[j, 3:] @ t
    return f, t


def to_parent(link: Link, joint: Joint, f: Terms, t: Terms, force: Terms) -> tuple[Terms, Terms]:
    """Return a wrench (outer frame of a joint) in the parent, and add its modal forces on the parent."""
    f, t = joint.E @ f, joint.E @ t
    f, t = joint.A @ f, joint.A @ (t + cross(joint.d, f))
    if joint.above is None:
        return f, t + cross(link.r, f)
    above = joint.above
    f, t = above.E @ f, above.E @ t
    force[above.rates] = force[above.rates] + above.modal_forces(f, t)
    return f, t + cross(above.rho, f)


def turned_moment(R: Terms, P: Terms) -> Terms:
    """Return R P Rᵀ for a symmetric P; entries below the diagonal equal those above."""
    half = R @ P
    out = np.empty((3, 3), dtype=object)
    for i in range(3):
        for j in range(i, 3):
            out[i, j] = out[j, i] = half[i] @ R[j]
    return out


def shifted_moments(m: Scalar, s: Terms, P: Terms, r: Terms) -> tuple[Terms, Terms]:
    """Return first and second moment about another point; r is the vector from it to the present one."""
    s_r = s + m * r
    out = np.empty((3, 3), dtype=object)
    for i in range(3):
        for j in range(i, 3):
            out[i, j] = out[j, i] = P[i, j] + r[i] * s[j] + s_r[i] * r[j]
    return s_r, out


def mass_matrix(tree: TreeTerms, joints: Sequence[Joint]) -> Terms:
    """Return the mass matrix, (n, n), by composite bodies (docs/recursive.md §3), in node frames.

    (1) m, s, P of each subtree; for a flexible body also the wrench of each mode and the modal mass matrix of the
        subtree
    (2) the wrench of each rate, f = m v + w × s, t = s × v + (tr P) w - P w, projected on the rates of its node
    (3) the same wrench, projected on the rates of all nodes above
    """
    links, n = tree.links, len(tree.v)
    bodies = [Composite(link, joint) for link, joint in zip(links, joints, strict=True)]
    M = np.full((n, n), tree.graph.zero, dtype=object)
    for k in range(len(links) - 1, -1, -1):
        link, joint, body = links[k], joints[k], bodies[k]
        rows = [(link.v0 + j, body.wrench(*motion_of_rate(joint, j))) for j in range(link.n_z)]
        held = range(0)
        if link.modes is not None:
            held = range(link.modes.v0, link.modes.v0 + link.modes.n)
            M[link.modes.rates, link.modes.rates], wrenches = body.modal_block(joint)
            rows += zip(held, wrenches, strict=True)
        for row, (f, t) in rows:
            force, at = np.full(n, tree.graph.zero, dtype=object), k
            while at >= 0:
                f, t = along_joint(links[at], joints[at], f, t, force)
                if links[at].parent >= 0:
                    f, t = to_parent(links[at], joints[at], f, t, force)
                at = links[at].parent
            for column in range(n):
                if column not in held and M[row, column].is_constant(0.0):
                    M[row, column] = M[column, row] = force[column]
        if link.parent >= 0:
            bodies[link.parent].carry(link, joint, body)
    return M


def motion_of_rate(joint: Joint, j: int) -> tuple[Terms, Terms]:
    """Return the translation and rotation of the frame of a node per rate j of its joint."""
    v, w = joint.columns[j, :3], joint.columns[j, 3:]
    if joint.own is None:
        return v, w
    w = joint.own.E @ w
    return joint.own.E @ v - cross(w, joint.own.d), w


class Composite:
    """Mass, first and second moment of a subtree in the node frame; for a flexible body also those of its modes."""

    def __init__(self, link: Link, joint: Joint) -> None:
        self.m, self.s, self.P = link.mass, joint.s, joint.P
        if link.modes is not None and joint.moments is not None:
            self.H = link.modes.M  #: by modes, the frame held, (n, n)
            self.f, self.t = joint.moments.first, joint.moments.B  #: wrench by each, (n, 3)

    def wrench(self, v: Terms, w: Terms) -> tuple[Terms, Terms]:
        """Return the wrench of an acceleration."""
        P = self.P
        t = cross(self.s, v) + (P[0, 0] + P[1, 1] + P[2, 2]) * w - P @ w
        return self.m * v + cross(w, self.s), t

    def modal_block(self, joint: Joint) -> tuple[Terms, list[tuple[Terms, Terms]]]:
        """Return the modal mass matrix with the joint fixed, and the wrench of each mode."""
        if joint.own is None:
            return self.H, list(zip(self.f, self.t, strict=True))
        shift, turn = joint.own.columns()
        back = [(cross(w, joint.own.d) - v, -w) for v, w in zip(shift, turn, strict=True)]
        wrenches = []
        for (v, w), f, t in zip(back, self.f, self.t, strict=True):
            f_own, t_own = self.wrench(v, w)
            wrenches.append((f + f_own, t + t_own))
        H = self.H.copy()
        for i, (f, t) in enumerate(wrenches):
            for j, (v, w) in enumerate(back[: i + 1]):
                H[i, j] = H[j, i] = H[i, j] + v @ f + w @ t + back[i][0] @ self.f[j] + back[i][1] @ self.t[j]
        return H, wrenches

    def carry(self, link: Link, joint: Joint, body: "Composite") -> None:
        """Add the subtree of a child."""
        m, s, P = body.m, body.s, body.P
        if joint.own is not None:
            s, P = shifted_moments(m, s, P, -joint.own.d)
            s, P = joint.own.E.T @ s, turned_moment(joint.own.E.T, P)
        s, P = shifted_moments(m, joint.E @ s, turned_moment(joint.E, P), joint.d)
        s, P, r = joint.A @ s, turned_moment(joint.A, P), link.r
        if joint.above is not None:
            s, P, r = joint.above.E @ s, turned_moment(joint.above.E, P), joint.above.rho
            self.carry_on_modes(joint.above, m, s, P)
        s, P = shifted_moments(m, s, P, r)
        self.m, self.s, self.P = self.m + m, self.s + s, self.P + P

    def carry_on_modes(self, place: MarkerPlace, m: Scalar, s: Terms, P: Terms) -> None:
        """Add the contribution of a subtree at a marker to the modes, with moments about the marker."""
        columns = list(zip(*place.columns(), strict=True))
        trace = P[0, 0] + P[1, 1] + P[2, 2]
        H, f_modes, t_modes = self.H.copy(), self.f.copy(), self.t.copy()
        for i, (v, w) in enumerate(columns):
            f, t = m * v + cross(w, s), cross(s, v) + trace * w - P @ w
            f_modes[i], t_modes[i] = f_modes[i] + f, t_modes[i] + t + cross(place.rho, f)
            for j, (v_j, w_j) in enumerate(columns[: i + 1]):
                H[i, j] = H[j, i] = H[i, j] + v_j @ f + w_j @ t
        self.H, self.f, self.t = H, f_modes, t_modes


def rates_of(link: Link) -> list[int]:
    """Return the rates of the joint of a node, followed by the rates of the modes of its body."""
    modes = [] if link.modes is None else list(range(link.modes.v0, link.modes.v0 + link.modes.n))
    return [*range(link.v0, link.v0 + link.n_z), *modes]


def solved(tree: TreeTerms, M: Terms, right: Terms) -> Terms:
    """Return M⁻¹ right, (n,), by M = Lᵀ D L from the tips inwards, which creates no fill-in."""
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


def forward_dynamics(tree: TreeTerms, force: Terms, joints: Sequence[Joint]) -> Terms:
    """Return the accelerations under forces along the rates, (n,)."""
    rest = np.full(len(tree.v), tree.graph.zero, dtype=object)
    h = inverse_dynamics(tree, tree.v, rest, joints)
    return solved(tree, mass_matrix(tree, joints), force - h)
