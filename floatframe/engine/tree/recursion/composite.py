"""Composite bodies: mass matrix of a tree, and matrices of flexible bodies with their subtrees.

In ground axes, for each node k about its own origin, with p from the origin of the parent:

    (1) m, s, J of the subtree with fixed joints and modes: the sum over the body and the subtrees that it carries
    (2) for a flexible body H, (6 + n, 6 + n): its own mass matrix plus Σ Cᵀ I C of the subtrees, C = [shift, above]
    (3) F = I S for each rate of the joint; for a flexible body F = H [S; e] for each rate of joint and modes
    (4) M: components of F along the rates of the node itself, then, shifted, along those of all nodes above

Sources: Walker & Orin (1982); Featherstone (2008), chapter 6.
"""

from floatframe.engine.kernels.body import block, body_forces, column, coupling, modal_block, moved_inertia
from floatframe.engine.kernels.compiler.compilation import loops, small, view
from floatframe.engine.kernels.dense import matrix_at, rows_of
from floatframe.engine.kernels.model import C2, MASS
from floatframe.engine.kernels.vector import (
    add,
    add_block,
    add_column,
    congruent,
    cross,
    dot,
    matrix,
    put,
    put_column,
    put_matrix,
    put_sum,
    scaled,
    sub,
    tilde,
    transposed,
    turned,
    vector,
)
from floatframe.engine.tree.kernels.body_jets import moments_of_body
from floatframe.engine.tree.kernels.spatial import put_blocks, shifted_blocks

__all__ = [
    "add_carried",
    "along",
    "along_rate",
    "body_matrix",
    "body_moments",
    "evaluate_flexible",
    "flexible_column",
    "mass_matrix",
    "moments_in_ground",
    "rigid_blocks",
    "times_inertia",
]


@view
def body_matrix(nodes, work, k):
    """Return H of node k's flexible body, (6 + n, 6 + n), as a view."""
    n = 6 + nodes.n_q[k]
    return matrix_at(work.H, nodes.h0[k], n, n)


@small
def body_moments(nodes, work, model, marker_work, k):
    """Return mass, first moment and inertia of node k's body about its origin, ground axes; zero if there is none."""
    R, zero = work.R_G[k], (0.0, 0.0, 0.0)
    if nodes.n_q[k] > 0:
        return moments_of_body(model, marker_work, nodes.body[k], R)
    if nodes.body[k] >= 0:
        return nodes.mass[k], turned(R, nodes.s[k]), congruent(R, matrix(nodes.J[k]))
    return 0.0, zero, (zero, zero, zero)


@loops
def moments_in_ground(nodes, work, model, marker_work, k):
    """Write mass, s, J of node k's body without its subtree, and H if it is flexible; call after its forces."""
    m, s, J = body_moments(nodes, work, model, marker_work, k)
    work.mass[k] = m
    put(work.s[k], 0, s)
    put_matrix(work.J[k], J)
    if nodes.n_q[k] > 0:
        flexible_mass(nodes, work, model, marker_work, k)


@loops
def flexible_mass(nodes, work, model, marker_work, k):
    """Write H of node k's flexible body without its subtree, ground axes."""
    i, n = nodes.body[k], nodes.n_q[k]
    types, t, q0 = model.body_types, model.bodies.kind[i], nodes.q0[k]
    H = body_matrix(nodes, work, k)
    H[:, :] = 0.0
    A, B, C = rigid_blocks(work.mass[k], vector(work.s[k]), matrix(work.J[k]))
    put_blocks(H, A, B, C)
    first = rows_of(marker_work.bodies.C1, 3, q0, n)
    W, second, R = rows_of(marker_work.bodies.W, 9, q0, n), block(types, t, C2, 3, n), work.R_G[k]
    for j in range(n):
        b, B = turned(R, column(first, j)), turned(R, coupling(second, W, j))
        put(H[6 + j], 0, b)
        put(H[6 + j], 3, B)
        put_column(H, 0, 6 + j, b)
        put_column(H, 3, 6 + j, B)
    modal_block(types, t, n, MASS, 1.0, H)


@small
def times_inertia(m, s, J, v, w):
    """Return force and moment on a composite body (m, s, J) for acceleration v and angular acceleration w."""
    return add(scaled(m, v), cross(w, s)), add(cross(s, v), turned(J, w))


@small
def rigid_blocks(m, s, J):
    """Return blocks A, B, C of a composite body (m, s, J), where f = A v + B w and t = Bᵀ v + C w."""
    return ((m, 0.0, 0.0), (0.0, m, 0.0), (0.0, 0.0, m)), tilde(scaled(-1.0, s)), J


@loops
def add_carried(H, A, B, C, p, above):
    """Add Jᵀ I J to H of a flexible parent, with J = [shift, above] and above (n, 6)."""
    n = above.shape[0]
    A_p, B_p, C_p = shifted_blocks(A, B, C, p)
    add_block(H, 0, 0, A_p)
    add_block(H, 0, 3, B_p)
    add_block(H, 3, 0, transposed(B_p))
    add_block(H, 3, 3, C_p)
    for j in range(n):
        v, w = vector(above[j]), vector(above[j, 3:])
        f, t = add(turned(A, v), turned(B, w)), add(turned(transposed(B), v), turned(C, w))
        for i in range(n):
            H[6 + i, 6 + j] += dot(f, vector(above[i])) + dot(t, vector(above[i, 3:]))
        t = add(t, cross(p, f))
        put_sum(H[6 + j], 0, f)
        put_sum(H[6 + j], 3, t)
        add_column(H, 0, 6 + j, f)
        add_column(H, 3, 6 + j, t)


@loops
def add_to_parent(nodes, work, k):
    """Add the composite body of node k to its parent (1), (2)."""
    above = nodes.parent[k]
    p = sub(vector(work.r_G[k]), vector(work.r_G[above]))
    m, s, J = work.mass[k], vector(work.s[k]), matrix(work.J[k])
    if nodes.n_q[above] > 0:
        H = body_matrix(nodes, work, above)
        A, B, C = rigid_blocks(m, s, J)
        add_carried(H, A, B, C, p, work.above[nodes.c0[k] : nodes.c0[k + 1]])
    s_p, J_p = moved_inertia(m, s, J, p)
    work.mass[above] += m
    put_sum(work.s[above], 0, s_p)
    add_block(work.J[above], 0, 0, J_p)


@small
def along(S, f, t):
    """Return the generalised force of a wrench (f, t) along a motion S."""
    return dot(vector(S), f) + dot(vector(S[3:]), t)


@loops
def go_up(nodes, work, M, k, v, f, t):
    """Write the entries of M for rate v of node k and the rates of all nodes above it (4)."""
    S = work.S
    while True:
        above = nodes.parent[k]
        if above < 0:
            return
        first = nodes.c0[k]
        n, vq = nodes.n_q[above], nodes.vq[above]
        if nodes.above[k] >= 0:
            for j in range(n):
                M[v, vq + j] = along(work.above[first + j], f, t)
        t = add(t, cross(sub(vector(work.r_G[k]), vector(work.r_G[above])), f))
        if n > 0:
            for j in range(n):
                M[v, vq + j] += along(S[vq + j], f, t)
                M[vq + j, v] = M[v, vq + j]
        v0, n_z = nodes.v0[above], nodes.n_z[above]
        for j in range(v0, v0 + n_z):
            M[v, j] = along(S[j], f, t)
            M[j, v] = M[v, j]
        k = above


@loops
def flexible_column(nodes, work, H, k, j):
    """Write F = H [S; e] for rate j of a flexible body (joint rates, then modes) to `local`, its wrench to U.

    Return the number of the rate.
    """
    n, n_z, F = nodes.n_q[k], nodes.n_z[k], work.local
    v = rate_of(nodes, k, j)
    for a in range(6 + n):
        total = H[a, 6 + j - n_z] if j >= n_z else 0.0
        for b in range(6):
            total += H[a, b] * work.S[v, b]
        F[a] = total
    put(work.U[v], 0, vector(F))
    put(work.U[v], 3, vector(F[3:]))
    return v


@small
def rate_of(nodes, k, j):
    """Return the index of rate j of a flexible body, whose joint rates come before its modes."""
    return nodes.v0[k] + j if j < nodes.n_z[k] else nodes.vq[k] + j - nodes.n_z[k]


@loops
def along_rate(nodes, work, k, i):
    """Return the component of F from `flexible_column` along rate i of the same body."""
    n_z, F = nodes.n_z[k], work.local
    total = along(work.S[rate_of(nodes, k, i)], vector(F), vector(F[3:]))
    return total + F[6 + i - n_z] if i >= n_z else total


@loops
def flexible_columns(nodes, work, M, k):
    """Write U for the rates of a flexible body, and its block of M (3)."""
    size, H = nodes.n_z[k] + nodes.n_q[k], body_matrix(nodes, work, k)
    for j in range(size):
        v = flexible_column(nodes, work, H, k, j)
        for i in range(size):
            M[rate_of(nodes, k, i), v] = along_rate(nodes, work, k, i)


@loops
def mass_matrix(nodes, work, M, model, marker_work):
    """Write the mass matrix; nodes must be placed in the ground, flexible bodies evaluated."""
    n_n, S = nodes.parent.shape[0], work.S
    for k in range(n_n):
        moments_in_ground(nodes, work, model, marker_work, k)
    M[:, :] = 0.0
    for k in range(n_n - 1, -1, -1):
        v0, n_z, n = nodes.v0[k], nodes.n_z[k], nodes.n_q[k]
        if n > 0:
            flexible_columns(nodes, work, M, k)
            for j in range(n):
                v = nodes.vq[k] + j
                go_up(nodes, work, M, k, v, vector(work.U[v]), vector(work.U[v, 3:]))
        else:
            m, s, J = work.mass[k], vector(work.s[k]), matrix(work.J[k])
            for v in range(v0, v0 + n_z):
                f, t = times_inertia(m, s, J, vector(S[v]), vector(S[v, 3:]))
                put(work.U[v], 0, f)
                put(work.U[v], 3, t)
                for j in range(v0, v0 + n_z):
                    M[j, v] = along(S[j], f, t)
        for v in range(v0, v0 + n_z):
            go_up(nodes, work, M, k, v, vector(work.U[v]), vector(work.U[v, 3:]))
        if nodes.parent[k] >= 0:
            add_to_parent(nodes, work, k)


@loops
def evaluate_flexible(nodes, model, marker_work):
    """Write moments and coupling matrices of all flexible bodies at their modal coordinates."""
    for k in range(nodes.parent.shape[0]):
        if nodes.n_q[k] > 0:
            body_forces(model, marker_work, nodes.body[k])
