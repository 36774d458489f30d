"""The recursions of a tree of rigid bodies over terms: every sum and product is simplified as it is written.

Frames as in docs/recursive.md: A, r the inner frame of a joint in the parent, E, d its outer frame in the inner one.
A vector goes through both one after the other, since A mostly only exchanges axes.

With the second moment P = ∫ c cᵀ dm and U = alpha~ + omega~ omega~, c_ddot = U c for all points of a body, its force
and moment are

    f = m a + U s,    t = s × a + the axial vector of U P - (U P)ᵀ

which needs fewer products than J alpha + omega × J omega.
"""

from collections.abc import Sequence

import numpy as np

from floatframe.generation.graph import Graph, Scalar, Terms
from floatframe.generation.links import Link, TreeTerms, terms
from floatframe.relative.recursion.nodes import ROTATION, SCREW, TRANSLATION

__all__ = ["Joint", "cross", "forward_dynamics", "inverse_dynamics", "joints_of", "mass_matrix", "solved"]


def cross(a: Terms, b: Terms) -> Terms:
    """Return a × b of terms."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]], dtype=object)


class Joint:
    """Where the joint of a node stands: E, (3, 3), and d, (3,), and the motion S by its rates, outer frame."""

    def __init__(self, tree: TreeTerms, link: Link) -> None:
        graph = tree.graph
        self.E, self.d = terms(graph, np.eye(3)), terms(graph, np.zeros(3))
        x = tree.x[link.x0 :]
        if link.kind == SCREW:
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


def rotation_of(graph: Graph, p: Terms) -> Terms:
    """Return the rotation matrix of Euler parameters of length one."""
    w, x, y, z = p
    X, Y, Z = 2.0 * x, 2.0 * y, 2.0 * z
    return terms(graph, [
        [1.0 - (Y * y + Z * z), X * y - Z * w, X * z + Y * w],
        [X * y + Z * w, 1.0 - (X * x + Z * z), Y * z - X * w],
        [X * z - Y * w, Y * z + X * w, 1.0 - (X * x + Y * y)],
    ])  # fmt: skip


def joint_columns(graph: Graph, link: Link, E: Terms) -> Terms:
    """Return the motion (translation, rotation) of the outer frame by each rate, its axes, (n_z, 6)."""
    columns = terms(graph, np.zeros((link.n_z, 6)))
    if link.kind == SCREW:
        columns[0, 2], columns[0, 5] = link.slide, link.turn
    elif link.kind == TRANSLATION:
        columns[:, :3] = terms(graph, np.eye(3)) * link.slide
    elif link.kind == ROTATION:
        columns[:, 3:] = -E if link.is_near else terms(graph, np.eye(3))
    return columns


def joints_of(tree: TreeTerms) -> list[Joint]:
    """Return where all joints stand."""
    return [Joint(tree, link) for link in tree.links]


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
    """Return the axial vector of U P - (U P)ᵀ, P symmetric, (3,)."""
    t = []
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        t.append(P[i, j] * U[k, i] - P[i, k] * U[j, i] + P[j, k] * (U[k, k] - U[j, j]) + P[j, j] * U[k, j]
                 - P[k, k] * U[j, k])  # fmt: skip
    return np.array(t, dtype=object)


def motion_through(link: Link, joint: Joint, v: Terms, a: Terms, omega: Terms, alpha: Terms, acc: Terms) -> tuple:
    """Return omega, alpha, a of the outer frame of a joint from those of its inner one at the same point."""
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
    """Return the forces along all rates that a motion needs, (n,): recursive Newton-Euler (docs/recursive.md §2).

    (1) forward   omega, alpha and a minus gravity of each node, through A, r, d, E
    (2) body      f = m a + U s, t = s × a + axial(U P)
    (3) backward  the wrench along the rates of the joint, then on to the parent
    """
    n, zero = len(tree.links), terms(tree.graph, np.zeros(3))
    base = (zero, zero, -tree.gravity, spin_terms(zero, zero))
    motions: list[tuple] = []
    f, t = [zero] * n, [zero] * n
    for k, (link, joint) in enumerate(zip(tree.links, joints, strict=True)):
        omega, alpha, acc, U = base if link.parent < 0 else motions[link.parent]
        A = link.A.T
        inner = (A @ omega, A @ alpha, A @ (acc + U @ link.r))
        omega, alpha, acc = motion_through(link, joint, v, a, *inner)
        U = spin_terms(omega, alpha)
        motions.append((omega, alpha, acc, U))
        if link.has_moments:
            f[k] = link.mass * acc + U @ link.s
            t[k] = cross(link.s, acc) + axial_of_product(U, link.P)
    force = np.full(len(v), tree.graph.zero, dtype=object)
    for k in range(n - 1, -1, -1):
        link, joint = tree.links[k], joints[k]
        for j in range(link.n_z):
            force[link.v0 + j] = joint.columns[j, :3] @ f[k] + joint.columns[j, 3:] @ t[k]
        if link.parent >= 0:
            f_P, t_P = to_parent(link, joint, f[k], t[k])
            f[link.parent], t[link.parent] = f[link.parent] + f_P, t[link.parent] + t_P
    return force


def to_parent(link: Link, joint: Joint, f: Terms, t: Terms) -> tuple[Terms, Terms]:
    """Return a wrench of the frame of a node in that of its parent."""
    f, t = joint.E @ f, joint.E @ t
    f, t = link.A @ f, link.A @ (t + cross(joint.d, f))
    return f, t + cross(link.r, f)


def turned_moment(R: Terms, P: Terms) -> Terms:
    """Return R P Rᵀ of a symmetric P, the entries below the diagonal those above."""
    half = R @ P
    out = np.empty((3, 3), dtype=object)
    for i in range(3):
        for j in range(i, 3):
            out[i, j] = out[j, i] = half[i] @ R[j]
    return out


def shifted_moments(m: Scalar, s: Terms, P: Terms, r: Terms) -> tuple[Terms, Terms]:
    """Return first and second moment about a point from which r leads to the one before."""
    s_r = s + m * r
    out = np.empty((3, 3), dtype=object)
    for i in range(3):
        for j in range(i, 3):
            out[i, j] = out[j, i] = P[i, j] + r[i] * s[j] + s_r[i] * r[j]
    return s_r, out


def mass_matrix(tree: TreeTerms, joints: Sequence[Joint]) -> Terms:
    """Return the mass matrix, (n, n), by composite bodies (docs/recursive.md §3), in the frames of the nodes.

    (1) m, s, P of each subtree
    (2) the wrench of each rate, f = m v + w × s, t = s × v + (tr P) w - P w, along the rates of its node
    (3) the same along the rates of all nodes above
    """
    links, n = tree.links, len(tree.v)
    m, s, P = ([getattr(link, name) for link in links] for name in ("mass", "s", "P"))
    M = np.full((n, n), tree.graph.zero, dtype=object)
    for k in range(len(links) - 1, -1, -1):
        link, joint = links[k], joints[k]
        trace = P[k][0, 0] + P[k][1, 1] + P[k][2, 2]
        for j in range(link.n_z):
            v, w = joint.columns[j, :3], joint.columns[j, 3:]
            f = m[k] * v + cross(w, s[k])
            t = cross(s[k], v) + trace * w - P[k] @ w
            row, at = link.v0 + j, k
            while at >= 0:
                above = links[at]
                for i in range(above.n_z):
                    column = above.v0 + i
                    if at != k or i >= j:
                        S = joints[at].columns[i]
                        M[row, column] = M[column, row] = S[:3] @ f + S[3:] @ t
                f, t = to_parent(above, joints[at], f, t)
                at = above.parent
        if link.parent >= 0:
            s_in, P_in = shifted_moments(m[k], joint.E @ s[k], turned_moment(joint.E, P[k]), joint.d)
            s_P, P_P = shifted_moments(m[k], link.A @ s_in, turned_moment(link.A, P_in), link.r)
            up = link.parent
            m[up], s[up], P[up] = m[up] + m[k], s[up] + s_P, P[up] + P_P
    return M


def solved(tree: TreeTerms, M: Terms, right: Terms) -> Terms:
    """Return M⁻¹ right, (n,), by M = Lᵀ D L from the tips inwards, which fills nothing in."""
    order = [link.v0 + j for link in tree.links for j in range(link.n_z)]
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
