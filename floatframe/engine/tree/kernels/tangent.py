"""The exact Newton matrix in relative coordinates (docs/relative.md §5).

Let F_i be the force of body i (its residual as a spatial vector about O), F the sum over a subtree, and J the screw of
an unknown. The residual of a joint column is rho = J · F; modal residuals contain the same sums at their markers. Then

    d rho = J · dF + (xi × J) · F        dF = D jet,   D the sum of the bodies of the subtree, (6, 18)

because a motion of the first body moves all bodies of its subtree alike. This includes the derivatives of the
projection, of the kinematics, and of forces that are fixed in body axes or ground axes.
"""

from floatframe.engine.kernels.body import moved_inertia, newton_block
from floatframe.engine.kernels.compiler.compilation import inner, small
from floatframe.engine.kernels.connections.connection import connection_derivatives
from floatframe.engine.kernels.dense import matrix_at, product_of
from floatframe.engine.kernels.evaluation import tangent_of_body
from floatframe.engine.kernels.marker import bent_rate
from floatframe.engine.kernels.vector import (
    add,
    add_column,
    congruent,
    copy,
    cross,
    dot,
    matrix,
    matrix_sum,
    product,
    put,
    put_block,
    put_matrix,
    scaled,
    scaled_matrix,
    sub,
    tilde,
    turned,
    turned_back,
    unit_matrix,
    vector,
)
from floatframe.engine.tree.kernels.body_jets import (
    mode_row,
    moments_of_body,
    momentum_of_modes,
    turning_of_momentum,
)
from floatframe.engine.tree.kernels.jets import carrier, put_mode_jet, write_jets
from floatframe.engine.tree.kernels.mode_screws import add_second_order, mode_rate, mode_screws
from floatframe.engine.tree.kernels.projection import subtract_slopes
from floatframe.engine.tree.kernels.spatial import (
    pair,
    pair_sum,
    put_pair_of,
    scaled_pair,
    spatial_cross,
    turned_power,
    world_screw,
    wrench_of_column,
)
from floatframe.engine.tree.kernels.tree import COLUMN, FAR_MODE, NEAR_MODE

__all__ = [
    "assemble",
    "inner_product",
    "product_of",
    "sum_forces",
    "unit_of",
    "write_tangent",
]


@inner
def write_tangent(model, work, tree, joints, tangent, weights):
    """Write jets, derivatives of the bodies, and P, V of the connections outside the tree.

    `evaluate_tree` must have been called for the iterate. The wrenches of the tree joints on the markers are set to
    zero.
    """
    _, c_d, c_k = weights
    rate = c_d / c_k if c_k > 0.0 else 0.0
    write_jets(model, work, tree, joints, tangent, weights, rate)
    for i in range(tree.parent.shape[0]):
        for m in (tree.near[i], tree.far[i]):
            if m >= 0:
                work.markers.wrench[m, :] = 0.0
    for i in range(tree.parent.shape[0]):
        of_body(model, work, joints, tangent, i, weights)
    for e in range(tree.kept.shape[0]):
        connection_derivatives(model, work, tree.kept[e], c_k)
    tangent.V[:, :] = 0.0
    tangent.C[:, :] = 0.0
    tangent.B[:, :] = 0.0
    for e in range(tree.kept.shape[0]):
        c = tree.kept[e]
        for r in range(model.connections.size[c]):
            for k in range(model.connections.size[c]):
                first = tree.kept_row[model.connections.w0[c]]
                tangent.V[first + r, first + k] = work.connections.V[c, r, k]
    for m in range(model.markers.body.shape[0]):
        c = model.markers.connection[m]
        if c >= 0 and model.markers.body[m] >= 0 and tree.is_kept[c] != 0 and model.connections.size[c] > 0:
            first = tree.kept_row[model.connections.w0[c]]
            kept_marker(model, work, tree, tangent, m, first, rate)
            if model.markers.accelerated[m] >= 0:
                accelerated_marker(model, work, tree, tangent, m, first, weights)


@inner
def of_body(model, work, joints, tangent, i, weights):
    """Write D, F and modal residual derivatives of body i without its subtree, and H with its mode columns.

    D and the rows of the modes are those of body_jets.py, plus the rotation of the residual with the body. The terms
    with `by_turn` and the acceleration a correct this for quantities that do not rotate with it.
    """
    n, u0, q0 = model.bodies.n_q[i], model.bodies.u0[i], model.bodies.q0[i]
    turning = work.bodies.T_right[i]
    put_matrix(turning, unit_matrix())
    tangent_of_body(model, work, i, weights, newton_block(model, work, i), turning)
    turn, residual = work.bodies.by_turn[u0 : u0 + 6 + n], joints.own[u0 : u0 + 6 + n]
    R, p = body_frame(work, tangent, i)
    v, omega_B, a = vector(work.state.u[u0:]), vector(work.state.u[u0 + 3 :]), vector(work.state.u_dot[u0:])
    f = turned(R, residual)
    tau = add(turned(R, residual[3:]), cross(p, f))
    put(tangent.F[i], 0, f)
    put(tangent.F[i], 3, tau)
    m, s, J = moments_of_body(model, work, i, R)
    momentum, Q = turning_of_momentum(m, s, J, momentum_of_modes(model, work, i, R), p, v, turned(R, omega_B))
    by_f = matrix_sum(congruent(R, matrix(turn)), tilde(scaled(-m, a)))
    by_tau = matrix_sum(congruent(R, matrix(turn[3:])), scaled_matrix(-1.0, product(tilde(s), tilde(a))))
    s, J = moved_inertia(m, s, J, p)
    D = tangent.D[i]
    D[:, :] = 0.0
    put_block(D, 3, 0, tilde(scaled(-1.0, f)))
    put_block(D, 0, 3, matrix_sum(by_f, tilde(scaled(-1.0, f))))
    put_block(D, 3, 3, matrix_sum(by_tau, matrix_sum(product(tilde(p), by_f), tilde(scaled(-1.0, tau)))))
    put_block(D, 0, 9, tilde(scaled(-2.0, momentum)))
    put_block(D, 3, 9, Q)
    put_block(D, 0, 12, scaled_matrix(m, unit_matrix()))
    put_block(D, 0, 15, tilde(scaled(-1.0, s)))
    put_block(D, 3, 12, tilde(s))
    put_block(D, 3, 15, J)
    for k in range(n):
        b, B, by_turning = mode_row(model, work, i, k, R, turned_back(R, v), omega_B)
        row = tangent.modal[q0 + k]
        row[:] = 0.0
        put(row, 3, add(turned(R, turn[6 + k]), cross(a, b)))
        put(row, 9, by_turning)
        put(row, 12, b)
        put(row, 15, add(B, cross(p, b)))


@small
def unit_of(e, first):
    """Return the component of the unit jet e that begins at index `first`."""
    return 1.0 if e == first else 0.0, 1.0 if e == first + 1 else 0.0, 1.0 if e == first + 2 else 0.0


@inner
def body_frame(work, tangent, i):
    """Return axes of body i, and the vector to its origin from `origin`."""
    return work.state.R[i], sub(vector(work.state.r[i]), vector(tangent.origin))


@inner
def inner_product(x, y):
    """Return the inner product of two vectors of six numbers."""
    return dot(x, y) + dot(x[3:], y[3:])


@inner
def sum_forces(model, work, tree, tangent, c_k):
    """Sum F over subtrees; write body forces by modes, and add to H the change of modal screws."""
    for place in range(tree.order.shape[0] - 1, -1, -1):
        i = tree.order[place]
        if tree.parent[i] >= 0:
            for r in range(6):
                tangent.F[tree.parent[i], r] += tangent.F[i, r]
    for i in range(tree.parent.shape[0]):
        H = newton_block(model, work, i)
        R, p = body_frame(work, tangent, i)
        for k in range(model.bodies.n_q[i]):
            put_pair_of(tangent.by_mode[model.bodies.q0[i] + k], 0, wrench_of_column(H, 6 + k, R, p))
        for j in range(tree.jet0[i], tree.jet0[i + 1]):
            k = tree.jet_item[j]
            if tree.jet_kind[j] == FAR_MODE:
                add_second_order(model, work, tree.far[i], k, R, p, -c_k, tangent.F[i], H[6 + k, 6:])
            elif tree.jet_kind[j] == NEAR_MODE:
                R_P, p_P = body_frame(work, tangent, tree.parent[i])
                of_parent = newton_block(model, work, tree.parent[i])
                add_second_order(model, work, tree.near[i], k, R_P, p_P, c_k, tangent.F[i], of_parent[6 + k, 6:])


@inner
def assemble(model, work, tree, tangent, c_d, c_k):
    """Assemble the matrix K of unknowns and kept wrenches."""
    K, n_s = tangent.K, tree.slot.shape[0]
    K[:, :] = 0.0
    sum_forces(model, work, tree, tangent, c_k)
    for s in range(n_s):
        matrix_column(model, work, tree, tangent, s)
    for i in range(tree.parent.shape[0]):
        subtract_slopes(model, work, tree, i, K, 0, c_d, c_k)
    for r in range(tangent.V.shape[0]):
        for k in range(tangent.V.shape[0]):
            K[n_s + r, n_s + k] = tangent.V[r, k]
        for k in range(n_s):
            K[n_s + r, k] = tangent.C[r, k]
            K[k, n_s + r] = tangent.B[r, k]


@inner
def add_jets(tree, tangent, i, s, kind, X):
    """Add the jets of one kind at the joint of body i that belong to unknown s."""
    for j in range(tree.jet0[i], tree.jet0[i + 1]):
        if tree.jet_s[j] == s and tree.jet_kind[j] == kind:
            for e in range(X.shape[0]):
                X[e] += tangent.jet[j, e]


@inner
def matrix_column(model, work, tree, tangent, s):
    """Write column s of K: motion by this unknown outwards (Y at carriers, X of bodies), then forces b inwards."""
    X, Y, b, n_b, K = tangent.X, tangent.Y, tangent.b, tree.order.shape[0], tangent.K
    for place in range(n_b):
        i = tree.order[place]
        for e in range(18):
            Y[i, e] = X[tree.parent[i], e] if tree.parent[i] >= 0 else 0.0
        add_jets(tree, tangent, i, s, NEAR_MODE, Y[i])
        copy(Y[i], X[i])
        add_jets(tree, tangent, i, s, COLUMN, X[i])
        add_jets(tree, tangent, i, s, FAR_MODE, X[i])
        product_of(tangent.D[i], X[i], b[i])
    for place in range(n_b - 1, -1, -1):
        i = tree.order[place]
        parent, m0, q0, F = tree.parent[i], tree.m0[i], model.bodies.q0[i], tangent.F[i]
        H, is_own = newton_block(model, work, i), m0 <= s < tree.s0[i + 1]
        for k in range(model.bodies.n_q[i]):
            for e in range(18):
                K[m0 + k, s] += tangent.modal[q0 + k, e] * X[i, e]
            if is_own:
                K[m0 + k, s] += H[6 + k, 6 + s - m0]
        if is_own:
            for r in range(6):
                b[i, r] += tangent.by_mode[q0 + s - m0, r]
        if parent >= 0:
            for r in range(6):
                b[parent, r] += b[i, r]
        near = pair(Y[i])
        add_jets(tree, tangent, i, s, COLUMN, Y[i])
        for j in range(tree.jet0[i], tree.jet0[i + 1]):
            screw, kind = tangent.screw[j], tree.jet_kind[j]
            xi = near  # of the frame in which the screw is fixed
            if kind == NEAR_MODE:
                xi = pair(X[parent])
            elif kind == FAR_MODE:
                xi = pair(X[i])
            elif tree.side[tree.jet_item[j]] != tree.is_reversed[i]:
                xi = pair(Y[i])
            K[tree.jet_s[j], s] += inner_product(screw, b[i]) + turned_power(xi, screw, F)


@inner
def kept_marker(model, work, tree, tangent, m, first, rate):
    """Add rows and columns for marker m of a connection outside the tree, whose rows begin at `first`."""
    i = model.markers.body[m]
    b = i
    while b >= 0:
        for j in range(tree.jet0[b], tree.jet0[b + 1]):
            reach, screw = tangent.reach[j], tangent.screw[j]
            xi, xi_dot = pair(reach), pair(reach[6:])
            kept_pair(model, work, tangent, m, first, tree.jet_s[j], xi, xi_dot, pair(screw))
        b = tree.parent[b]
    if model.markers.psi0[m] < 0:
        return
    state, u0 = work.state, model.bodies.u0[i]
    R, origin = body_frame(work, tangent, i)
    spin = turned(R, state.u[u0 + 3 :])
    V = sub(vector(state.u[u0:]), cross(spin, origin)), spin
    if model.markers.bend0[m] >= 0:
        bent_rate(model, work, m, i, matrix_at(work.markers.bend_dot, 0, 6, model.bodies.n_q[i]))
    for k in range(model.bodies.n_q[i]):
        s, s_1, _ = mode_rate(model, work, m, i, k)
        unit = world_screw(R, origin, s)
        own = world_screw(R, origin, s_1)
        xi_dot = pair_sum(pair_sum(scaled_pair(rate, unit), own), spatial_cross(V, unit))
        kept_pair(model, work, tangent, m, first, tree.m0[i] + k, unit, xi_dot, unit)


@inner
def kept_pair(model, work, tangent, m, first, s, xi, xi_dot, unit):
    """Add row and column of unknown s, which moves marker m by xi, xi_dot; unit: its screw."""
    C, B, motion, P = tangent.C, tangent.B, tangent.motion, work.connections.P[m]
    p, v = sub(vector(work.markers.r[m]), vector(tangent.origin)), vector(work.markers.v[m])
    put(motion, 0, add(xi[0], cross(xi[1], p)))
    put(motion, 3, xi[1])
    put(motion, 6, add(add(xi_dot[0], cross(xi_dot[1], p)), cross(xi[1], v)))
    put(motion, 9, add(xi_dot[1], cross(xi[1], vector(work.markers.omega[m]))))
    for r in range(model.connections.size[model.markers.connection[m]]):
        total = 0.0
        for k in range(12):
            total += P[r, k] * motion[k]
        C[first + r, s] += total
    sign = model.markers.sign[m]
    moved = add(unit[0], cross(unit[1], p))
    if model.markers.force[m] >= 0:
        add_column(B, first + model.markers.force[m], s, scaled(-sign, moved))
    if model.markers.moment[m] >= 0:
        add_column(B, first + model.markers.moment[m], s, scaled(-sign, unit[1]))


@inner
def accelerated_marker(model, work, tree, tangent, m, first, weights):
    """Add the effect of marker m's acceleration on the rows of its connection, which begin at `first`."""
    i = model.markers.body[m]
    b = i
    while b >= 0:
        for j in range(tree.jet0[b], tree.jet0[b + 1]):
            accelerated_pair(model, work, tangent, m, first, tree.jet_s[j], tangent.jet[j])
        b = tree.parent[b]
    if model.markers.psi0[m] < 0:
        return
    held = carrier(model, work, tangent, m, i)
    for k in range(model.bodies.n_q[i]):
        S, S_1, S_2 = mode_screws(model, work, m, i, k, held)
        put_mode_jet(tangent.own, S, S_1, S_2, held, weights)
        accelerated_pair(model, work, tangent, m, first, tree.m0[i] + k, tangent.own)


@inner
def accelerated_pair(model, work, tangent, m, first, s, jet):
    """Add P_a times the acceleration change of marker m by the jet (xi, xi_dot, xi_ddot) of unknown s.

    da = xi_ddot_v + xi_ddot_w × p + 2 xi_dot_w × v + xi_w × a
    dalpha = xi_ddot_w + xi_dot_w × omega + xi_w × alpha
    """
    accelerated = model.markers.accelerated[m]
    P_a, now = work.connections.P_a[accelerated], work.markers.acceleration[accelerated]
    p, v = sub(vector(work.markers.r[m]), vector(tangent.origin)), vector(work.markers.v[m])
    xi_w, xi_dot_w, xi_ddot_w = vector(jet[3:]), vector(jet[9:]), vector(jet[15:])
    da = add(add(vector(jet[12:]), cross(xi_ddot_w, p)), add(scaled(2.0, cross(xi_dot_w, v)), cross(xi_w, vector(now))))
    dalpha = add(xi_ddot_w, add(cross(xi_dot_w, vector(work.markers.omega[m])), cross(xi_w, vector(now[3:]))))
    for r in range(model.connections.size[model.markers.connection[m]]):
        tangent.C[first + r, s] += dot(da, P_a[r]) + dot(dalpha, P_a[r, 3:])
