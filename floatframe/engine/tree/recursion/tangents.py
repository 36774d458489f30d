"""Exact derivatives of inverse dynamics by positions and rates, by recursion (docs/theory.md §10).

All vectors are in ground axes about the origin of the ground. A rate j moves its subtree by S_j. In axes that move with
the subtree, the velocities of all its bodies change by one motion Y_j, and their spatial accelerations A by
X_j - V × Y_j with one motion X_j. For a joint whose inner frame has the velocity V_P and the acceleration A_P, and
whose outer frame has V_Q, A_Q,

    by position   Y = V_P × S,  X = A_P × S + V_P × Y       (for reversed rotations V_Q, A_Q instead of V_P, A_P)
    by rate       Y = S,        X = V_P × S + V_Q × S

For a mode they are the motions of its markers (kernels/mode_screws.py); for the body itself the motion of its own
marker counts negative. In axes of the subtree, its force then changes by I X + N Y, N = [[0, -2 p~], [0, Q]] (p:
momentum); in ground axes also by S ×* f. This leads to the following steps:

    (1) S, Y, X of all rates, p, Q, I, f of all subtrees
    (2) rows      force along rate i due to the motion of all above it: a_i·X + b_i·Y,  a = I S, b = Nᵀ S; a mode adds
                  its row of the equations of the body, and the rows of its markers at the subtrees
    (3) columns   wrench of all below j: I X + N Y + S ×* f, along the rates above; a mode adds the tangent of its body
    (4) the body of the modes: rows times columns, and the change of its screws along the forces of the subtree at each
                  marker

Sources: Carpentier & Mansard (2018); Singh, Russell & Wensing (2022) for rigid bodies; derived anew for flexible ones.
"""

from floatframe.engine.kernels.body import NewtonWeights, body_tangent, moved_inertia
from floatframe.engine.kernels.compiler.compilation import loops, small
from floatframe.engine.kernels.marker_acceleration import elastic_carrier
from floatframe.engine.kernels.vector import (
    add,
    add_block,
    cross,
    dot,
    matrix,
    put,
    put_matrix,
    put_sum,
    scaled,
    sub,
    turned,
    turned_back,
    vector,
)
from floatframe.engine.tree.kernels.body_jets import mode_row, momentum_of_modes, turning_of_momentum
from floatframe.engine.tree.kernels.mode_screws import add_second_order, mode_screws, second_rates, variation_rates
from floatframe.engine.tree.kernels.spatial import (
    pair,
    pair_sum,
    put_pair_of,
    scaled_pair,
    spatial_cross,
    spatial_motion,
    turned_power,
    wrench_of_column,
)
from floatframe.engine.tree.recursion.composite import along, body_matrix, body_moments, times_inertia

__all__ = ["force_tangents"]


@loops
def node_motion(work, k):
    """Return spatial velocity V and acceleration A of node k."""
    R, r = work.R_G[k], vector(work.r_G[k])
    alpha, a = turned(R, vector(work.alpha[k])), turned(R, vector(work.acc[k]))
    return spatial_motion(r, vector(work.motion[k]), vector(work.motion[k, 3:]), a, alpha)


@loops
def marker_motion(model, marker_work, m, work, k):
    """Return spatial velocity V and acceleration A of marker m on flexible node k."""
    R = work.R_G[k]
    omega, alpha, a = vector(work.omega[k]), vector(work.alpha[k]), vector(work.acc[k])
    omega_P, alpha_P, a_P = elastic_carrier(model, marker_work, m, omega, alpha, a)
    rho, rho_dot = vector(marker_work.markers.rho[m]), vector(marker_work.markers.rho_dot[m])
    v = add(vector(work.motion[k]), turned(R, add(cross(omega, rho), rho_dot)))
    r = add(vector(work.r_G[k]), turned(R, rho))
    return spatial_motion(r, v, turned(R, omega_P), turned(R, a_P), turned(R, alpha_P))


@loops
def inner_motion(nodes, work, model, marker_work, k):
    """Return spatial velocity V and acceleration A of the inner frame of node k's joint."""
    above, m = nodes.parent[k], nodes.above[k]
    zero = (0.0, 0.0, 0.0)
    if above < 0:
        return (zero, zero), (scaled(-1.0, vector(work.gravity)), zero)
    if m >= 0:
        return marker_motion(model, marker_work, m, work, above)
    return node_motion(work, above)


@loops
def joint_changes(nodes, work, dense, model, marker_work, k):
    """Write S, Y, X for the rates of a joint (1)."""
    inner_V, inner_A = inner_motion(nodes, work, model, marker_work, k)
    m, r = nodes.own[k], vector(work.r_G[k])
    outer_V, outer_A = node_motion(work, k)
    if m >= 0:
        outer_V, outer_A = marker_motion(model, marker_work, m, work, k)
    V, A = inner_V, inner_A
    if nodes.is_near[k]:
        V, A = outer_V, outer_A
    for j in range(nodes.v0[k], nodes.v0[k] + nodes.n_z[k]):
        w = vector(work.S[j, 3:])
        S = sub(vector(work.S[j]), cross(w, r)), w
        Y = spatial_cross(V, S)
        put_pair_of(dense.S[j], 0, S)
        put_pair_of(dense.change[j], 0, Y)
        put_pair_of(dense.change[j], 6, pair_sum(spatial_cross(A, S), spatial_cross(V, Y)))
        put_pair_of(dense.change[j], 12, spatial_cross(pair_sum(inner_V, outer_V), S))


@loops
def mode_changes(nodes, work, dense, model, marker_work, k):
    """Write S, Y, X for a flexible body's modes at its own marker, and for its parent's modes at marker `above` (1)."""
    first, end = nodes.vq[k], nodes.vq[k] + nodes.n_q[k]
    if end > first:
        put_mode_changes(work, model, marker_work, k, nodes.own[k], -1.0, dense.S[first:end], dense.change[first:end])
    first, end = nodes.c0[k], nodes.c0[k + 1]
    if end > first:
        S, change = dense.above[first:end], dense.above_change[first:end]
        put_mode_changes(work, model, marker_work, nodes.parent[k], nodes.above[k], 1.0, S, change)


@loops
def put_mode_changes(work, model, marker_work, k, m, sign, out, change):
    """Write sign times S, (n, 6), and Y, X, (n, 18), for node k's modes at its marker m; m = -1: none."""
    if m < 0 or model.markers.psi0[m] < 0:
        out[:, :] = 0.0
        change[:, :] = 0.0
        return
    i, R, r = model.markers.body[m], matrix(work.R_G[k]), vector(work.r_G[k])
    V, A = node_motion(work, k)
    rho_2, angle_2 = second_rates(model, marker_work, m, i)
    for j in range(out.shape[0]):
        S, S_1, S_2 = mode_screws(model, marker_work, m, i, j, (R, r, V, A, rho_2, angle_2))
        Y, X = variation_rates(S, S_1, S_2, V, A)
        put_pair_of(out[j], 0, scaled_pair(sign, S))
        put_pair_of(change[j], 0, scaled_pair(sign, Y))
        put_pair_of(change[j], 6, scaled_pair(sign, X))
        put_pair_of(change[j], 12, scaled_pair(2.0 * sign, Y))


@loops
def body_by_turning(nodes, work, dense, model, marker_work, k):
    """Write p and Q of node k's body without its subtree, and wrench and inertia of its subtree (1)."""
    R, r, zero = work.R_G[k], vector(work.r_G[k]), (0.0, 0.0, 0.0)
    by_modes = zero, (zero, zero, zero)
    if nodes.n_q[k] > 0:
        by_modes = momentum_of_modes(model, marker_work, nodes.body[k], R)
    m, s, J = body_moments(nodes, work, model, marker_work, k)
    v, omega = vector(work.motion[k]), vector(work.motion[k, 3:])
    p, Q = turning_of_momentum(m, s, J, by_modes, r, v, omega)
    put(dense.momentum[k], 0, p)
    put_matrix(dense.Q[k], Q)
    f = turned(R, vector(work.f[k]))
    put(dense.wrench[k], 0, f)
    put(dense.wrench[k], 3, add(turned(R, vector(work.t[k])), cross(r, f)))
    s, J = moved_inertia(work.mass[k], vector(work.s[k]), matrix(work.J[k]), r)
    put(dense.s[k], 0, s)
    put_matrix(dense.J[k], J)


@small
def wrench_of(m, s, J, p, Q, x, x_w, y_w):
    """Return the change of a wrench I X + N Y."""
    f, t = times_inertia(m, s, J, x, x_w)
    return add(f, scaled(2.0, cross(y_w, p))), add(t, turned(Q, y_w))


@small
def by_turning(p, Q, v, w):
    """Return the rotation part of Nᵀ (v, w); the translation part is zero."""
    return add(scaled(2.0, cross(p, v)), turned_back(Q, w))


@small
def force_cross(v, w, f, t):
    """Return the spatial cross product (v, w) ×* (f, t), the change of a wrench that moves along."""
    return cross(w, f), add(cross(w, t), cross(v, f))


@loops
def mode_rows(nodes, work, dense, model, marker_work, k):
    """Write the modal rows of flexible node k for motions of its body alone (2)."""
    vq, R, r, omega = nodes.vq[k], work.R_G[k], vector(work.r_G[k]), vector(work.omega[k])
    v = turned_back(R, work.motion[k])
    for j in range(nodes.n_q[k]):
        b, B, by_turning = mode_row(model, marker_work, nodes.body[k], j, R, v, omega)
        put(dense.row_a[vq + j], 0, b)
        put(dense.row_a[vq + j], 3, add(B, cross(r, b)))
        put(dense.row_b[vq + j], 0, by_turning)


@small
def row_times(dense, i, change, first, turning):
    """Return a_i·X + b_i·Y for a row; first, turning: indices in a change of X and of the rotation of Y."""
    a, b = dense.row_a[i], vector(dense.row_b[i])
    return along(a, vector(change[first:]), vector(change[first + 3 :])) + dot(b, vector(turning))


@small
def put_rows(dense, k, v, S, m, s, J):
    """Add the row of motion S of subtree k to the row of rate v (2)."""
    move, w = vector(S), vector(S[3:])
    f, t = times_inertia(m, s, J, move, w)
    put_sum(dense.row_a[v], 0, f)
    put_sum(dense.row_a[v], 3, t)
    put_sum(dense.row_b[v], 0, by_turning(vector(dense.momentum[k]), dense.Q[k], move, w))


@loops
def change_of_wrench(dense, k, S, change, m, s, J):
    """Return the wrench changes of subtree k for S with Y, X, in ground axes: by position and by rate (3)."""
    p, Q, f, t = vector(dense.momentum[k]), dense.Q[k], vector(dense.wrench[k]), vector(dense.wrench[k, 3:])
    v, w = vector(S), vector(S[3:])
    f_z, t_z = wrench_of(m, s, J, p, Q, vector(change[6:]), vector(change[9:]), vector(change[3:]))
    f_more, t_more = force_cross(v, w, f, t)
    f_d, t_d = wrench_of(m, s, J, p, Q, vector(change[12:]), vector(change[15:]), w)
    return add(f_z, f_more), add(t_z, t_more), f_d, t_d


@loops
def go_up_tangents(nodes, dense, k, v, f_z, t_z, f_d, t_d):
    """Write the entries between rate v of node k and the rates of all nodes above it, in both triangles."""
    S, change, by_z, by_rate = dense.S, dense.change, dense.by_z, dense.by_rate
    while True:
        above = nodes.parent[k]
        if above < 0:
            return
        n, vq, c0 = nodes.n_q[above], nodes.vq[above], nodes.c0[k]
        for j in range(nodes.v0[above], nodes.v0[above] + nodes.n_z[above]):
            C = change[j]
            by_z[j, v] = along(S[j], f_z, t_z)
            by_rate[j, v] = along(S[j], f_d, t_d)
            by_z[v, j] = row_times(dense, v, C, 6, C[3:])
            by_rate[v, j] = row_times(dense, v, C, 12, S[j, 3:])
        for j in range(n):
            i, C, E, T = vq + j, change[vq + j], dense.above_change[c0 + j], dense.above[c0 + j]
            by_z[i, v] = along(S[i], f_z, t_z) + along(T, f_z, t_z)
            by_rate[i, v] = along(S[i], f_d, t_d) + along(T, f_d, t_d)
            by_z[v, i] = row_times(dense, v, C, 6, C[3:]) + row_times(dense, v, E, 6, E[3:])
            by_rate[v, i] = row_times(dense, v, C, 12, S[i, 3:]) + row_times(dense, v, E, 12, T[3:])
        k = above


@loops
def tangent_columns(nodes, work, dense, model, marker_work, k, c_d, c_k, first):
    """Add the tangent of flexible body k's equations by its modes (c_k = 1) or modal rates (c_d = 1) (4)."""
    n, vq = nodes.n_q[k], nodes.vq[k]
    H = body_matrix(nodes, work, k)
    body_tangent(
        model, marker_work, nodes.body[k], NewtonWeights(0.0, c_d, c_k), H, marker_work.bodies.by_turn[: 6 + n]
    )
    R, r = work.R_G[k], vector(work.r_G[k])
    out = dense.by_z if first == 0 else dense.by_rate
    for j in range(n):
        c = 6 + j
        f, t = wrench_of_column(H, c, R, r)
        put_sum(dense.by_mode[vq + j], first, f)
        put_sum(dense.by_mode[vq + j], first + 3, t)
        for i in range(n):
            out[vq + i, vq + j] += H[6 + i, c]


@loops
def flexible_tangents(nodes, work, dense, model, marker_work, k):
    """Write the columns of node k's modes (4), and complete the rows."""
    n, vq, v0, n_z, own = nodes.n_q[k], nodes.vq[k], nodes.v0[k], nodes.n_z[k], nodes.own[k]
    tangent_columns(nodes, work, dense, model, marker_work, k, 0.0, 1.0, 0)
    tangent_columns(nodes, work, dense, model, marker_work, k, 1.0, 0.0, 6)
    m, s, J = work.mass[k], vector(dense.s[k]), matrix(dense.J[k])
    R, r, F = work.R_G[k], vector(work.r_G[k]), dense.wrench[k]
    for j in range(n):
        v = vq + j
        if own >= 0:
            add_second_order(model, marker_work, own, j, R, r, -1.0, F, dense.by_z[v, vq:])
        C, S, more = dense.change[v], dense.S[v], dense.by_mode[v]
        f_z, t_z, f_d, t_d = change_of_wrench(dense, k, S, C, m, s, J)
        f_z, t_z = add(f_z, vector(more)), add(t_z, vector(more[3:]))
        f_d, t_d = add(f_d, vector(more[6:])), add(t_d, vector(more[9:]))
        for i in range(n):
            row = vq + i
            dense.by_z[row, v] += row_times(dense, row, C, 6, C[3:]) + along(dense.S[row], f_z, t_z)
            dense.by_rate[row, v] += row_times(dense, row, C, 12, S[3:]) + along(dense.S[row], f_d, t_d)
            dense.by_z[row, v] += turned_power(pair(S), dense.S[row], F)
        for row in range(v0, v0 + n_z):
            dense.by_z[row, v] = along(dense.S[row], f_z, t_z)
            dense.by_rate[row, v] = along(dense.S[row], f_d, t_d)
        put(more, 0, f_z)
        put(more, 3, t_z)
        put(more, 6, f_d)
        put(more, 9, t_d)
    for j in range(n):
        put_rows(dense, k, vq + j, dense.S[vq + j], m, s, J)
        more = dense.by_mode[vq + j]
        go_up_tangents(nodes, dense, k, vq + j, vector(more), vector(more[3:]), vector(more[6:]), vector(more[9:]))


@loops
def joint_tangents(nodes, work, dense, k):
    """Write rows and columns of the rates of node k's joint (2), (3)."""
    m, s, J = work.mass[k], vector(dense.s[k]), matrix(dense.J[k])
    v0, n_z, n, vq = nodes.v0[k], nodes.n_z[k], nodes.n_q[k], nodes.vq[k]
    for v in range(v0, v0 + n_z):
        put_rows(dense, k, v, dense.S[v], m, s, J)
    for v in range(v0, v0 + n_z):
        C, S = dense.change[v], dense.S[v]
        f_z, t_z, f_d, t_d = change_of_wrench(dense, k, S, C, m, s, J)
        for row in range(v0, v0 + n_z):
            dense.by_rate[row, v] = row_times(dense, row, C, 12, S[3:])
            if nodes.is_near[k]:
                dense.by_z[row, v] = along(dense.S[row], f_z, t_z)
            else:
                dense.by_z[row, v] = row_times(dense, row, C, 6, C[3:])
        for row in range(vq, vq + n):
            dense.by_z[row, v] = row_times(dense, row, C, 6, C[3:])
            dense.by_rate[row, v] = row_times(dense, row, C, 12, S[3:])
        go_up_tangents(nodes, dense, k, v, f_z, t_z, f_d, t_d)


@loops
def give_to_flexible_parent(nodes, work, dense, model, marker_work, k):
    """Add the contribution of subtree k to rows, columns and block of its parent's modes (2), (4)."""
    above, c0 = nodes.parent[k], nodes.c0[k]
    n, vq, R, r = nodes.n_q[above], nodes.vq[above], work.R_G[above], vector(work.r_G[above])
    m, s, J = work.mass[k], vector(dense.s[k]), matrix(dense.J[k])
    for j in range(n):
        v, S, C, more = vq + j, dense.above[c0 + j], dense.above_change[c0 + j], dense.by_mode[vq + j]
        put_rows(dense, k, v, S, m, s, J)
        f_z, t_z, f_d, t_d = change_of_wrench(dense, k, S, C, m, s, J)
        for i in range(n):
            T = dense.above[c0 + i]
            dense.by_z[vq + i, v] += along(T, f_z, t_z)
            dense.by_rate[vq + i, v] += along(T, f_d, t_d)
        add_second_order(model, marker_work, nodes.above[k], j, R, r, 1.0, dense.wrench[k], dense.by_z[v, vq:])
        put_sum(more, 0, f_z)
        put_sum(more, 3, t_z)
        put_sum(more, 6, f_d)
        put_sum(more, 9, t_d)


@loops
def force_tangents(nodes, work, dense, model, marker_work):
    """Write derivatives of forces by positions and rates; needs inverse dynamics and mass matrix."""
    n_n = nodes.parent.shape[0]
    dense.by_z[:, :] = 0.0
    dense.by_rate[:, :] = 0.0
    dense.by_mode[:, :] = 0.0
    dense.row_a[:, :] = 0.0
    dense.row_b[:, :] = 0.0
    for k in range(n_n):
        joint_changes(nodes, work, dense, model, marker_work, k)
        mode_changes(nodes, work, dense, model, marker_work, k)
        body_by_turning(nodes, work, dense, model, marker_work, k)
        if nodes.n_q[k] > 0:
            mode_rows(nodes, work, dense, model, marker_work, k)
    for k in range(n_n - 1, -1, -1):
        above = nodes.parent[k]
        if nodes.n_q[k] > 0:
            flexible_tangents(nodes, work, dense, model, marker_work, k)
        joint_tangents(nodes, work, dense, k)
        if above >= 0:
            if nodes.n_q[above] > 0:
                give_to_flexible_parent(nodes, work, dense, model, marker_work, k)
            put_sum(dense.momentum[above], 0, vector(dense.momentum[k]))
            add_block(dense.Q[above], 0, 0, matrix(dense.Q[k]))
