"""Equations of motion of one body, complete in the deformation (docs/theory.md §6-7), and their tangent.

Components in body axes; a: acceleration of the frame origin minus gravity, alpha: angular acceleration. From
W_ab = S_ab q, 1C(q) = 1C + K_t q, s = S + 1C q + 1/2 qᵀ K_t q (K_t, K_r: zero unless stiffened):

    D_k    = 3C_k + delta_ab Σ_c W_cc,k - W_ab,k               (= 3C_k + Σ_l 5C_lk q_l)
    B_k    = 2C_k + (W_zy - W_yz, W_xz - W_zx, W_yx - W_xy)_k  (= 2C_k + Σ_l 4C_kl q_l)
    J      = J0 + C + Cᵀ + (E + Eᵀ)/2,  C = Σ q_k 3C_k,  E_ab = delta_ab Σ_c q·W_cc - q·W_ab
    Y_k    = Σ_l 4C_kl q_dot_l
    (1) m a + alpha × s + 1C(q) q_ddot + q_dotᵀK_t q_dot + 2 omega × (1C(q) q_dot) + omega × (omega × s)  = f
    (2) s × a + J alpha + Σ B_k q_ddot_k + q_dotᵀK_r q_dot + 2 (Σ q_dot_k D_k) omega + omega × (J omega)  = tau
    (3) 1C_k(q)·a + B_k·alpha + (M q_ddot)_k + 2 Y_k·omega - omegaᵀ D_k omega + (D q_dot + K q)_k         = h_k

The matrices K_ab and K_r of a stiffened body are part of its S_ab (`compiling.stiffening`), so that B, D and J hold
them as they are written here. One pass over S_ab (9 n² numbers), one over 4C (3 n²), and over K_t, K_r (6 n²) carry
the cost.
"""

from floatframe.kernels.compiler.compilation import loops, view
from floatframe.kernels.dense import add_products
from floatframe.kernels.model import C1, C2, C3, C4, DAMPING, K_ROTATION, K_TRANSLATION, MASS, S_AB, STIFFNESS
from floatframe.kernels.scalars import cross

__all__ = ["body_forces", "body_mass_product", "body_tangent", "modal_term"]


@view
def block(model, i, which, size):
    """Return a constant block of body i as a view of the flat store."""
    start = model.body_types.block0[model.bodies.kind[i], which]
    return model.body_types.blocks[start : start + size]


@loops
def modal_term(model, i, which, x, out):
    """Add M x, K x or D x of body i to out, (n_q,)."""
    n = model.bodies.n_q[i]
    if model.body_types.is_diagonal[model.bodies.kind[i], which - MASS]:
        diagonal = block(model, i, which, n)
        for k in range(n):
            out[k] += diagonal[k] * x[k]
    else:
        matrix = block(model, i, which, n * n)
        for k in range(n):
            total = 0.0
            for j in range(n):
                total += matrix[k * n + j] * x[j]
            out[k] += total


@loops
def first_moments(model, work, i):
    """Write s(q) and 1C(q) = ds/dq into `work`, and K_t q_dot, K_r q_dot of a stiffened body."""
    t, n, q0, u0 = model.bodies.kind[i], model.bodies.n_q[i], model.bodies.q0[i], model.bodies.u0[i]
    s = work.bodies.s[i]
    s[0], s[1], s[2] = model.body_types.S[t, 0], model.body_types.S[t, 1], model.body_types.S[t, 2]
    if n == 0:
        return
    own = block(model, i, C1, 3 * n)
    first = work.bodies.C1[3 * q0 : 3 * (q0 + n)]
    for j in range(3 * n):
        first[j] = own[j]
    q = work.state.q[q0 : q0 + n]
    if model.body_types.is_stiffened[t]:
        qd = work.state.u[u0 + 6 : u0 + 6 + n]
        K_t = block(model, i, K_TRANSLATION, 3 * n * n)
        K_r = block(model, i, K_ROTATION, 3 * n * n)
        first_dot, turn_dot = work.bodies.K_t_q_dot[3 * q0 : 3 * (q0 + n)], work.bodies.K_r_q_dot[3 * q0 : 3 * (q0 + n)]
        for j in range(3 * n):
            first_dot[j] = 0.0
            turn_dot[j] = 0.0
        add_products(K_t, q, first)
        add_products(K_t, qd, first_dot)
        add_products(K_r, qd, turn_dot)
    for a in range(3):
        total = 0.0
        for k in range(n):
            total += (own[a * n + k] + first[a * n + k]) * q[k]
        s[a] += 0.5 * total


@loops
def sum_over_modes(columns, n, x):
    """Return Σ columns[a, k] x_k as three numbers."""
    s0, s1, s2 = 0.0, 0.0, 0.0
    for k in range(n):
        s0 += columns[k] * x[k]
        s1 += columns[n + k] * x[k]
        s2 += columns[2 * n + k] * x[k]
    return s0, s1, s2


@loops
def body_forces(model, work, i):
    """Write the left sides of (1) to (3) of body i into the residual, and s, 1C, W, Y, J, D_q_dot."""
    t, n, u0, q0 = model.bodies.kind[i], model.bodies.n_q[i], model.bodies.u0[i], model.bodies.q0[i]
    R, g = work.state.R[i], model.gravity
    ud, u = work.state.u_dot, work.state.u
    b0, b1, b2 = ud[u0] - g[0], ud[u0 + 1] - g[1], ud[u0 + 2] - g[2]
    a0 = R[0, 0] * b0 + R[1, 0] * b1 + R[2, 0] * b2
    a1 = R[0, 1] * b0 + R[1, 1] * b1 + R[2, 1] * b2
    a2 = R[0, 2] * b0 + R[1, 2] * b1 + R[2, 2] * b2
    work.bodies.a_B[i, 0] = a0
    work.bodies.a_B[i, 1] = a1
    work.bodies.a_B[i, 2] = a2
    o0, o1, o2 = u[u0 + 3], u[u0 + 4], u[u0 + 5]
    e0, e1, e2 = ud[u0 + 3], ud[u0 + 4], ud[u0 + 5]
    q = work.state.q[q0 : q0 + n]
    qd = u[u0 + 6 : u0 + 6 + n]
    qdd = ud[u0 + 6 : u0 + 6 + n]
    J, Dd = work.bodies.J[i], work.bodies.D_q_dot[i]
    for a in range(3):
        for b in range(3):
            J[a, b] = model.body_types.J0[t, a, b]
            Dd[a, b] = 0.0
    first_moments(model, work, i)
    s0, s1, s2 = work.bodies.s[i, 0], work.bodies.s[i, 1], work.bodies.s[i, 2]
    res = work.bodies.residual[u0 : u0 + 6 + n]
    t0, t1, t2 = 0.0, 0.0, 0.0
    f0, f1, f2 = 0.0, 0.0, 0.0
    if n > 0:
        W = work.bodies.W[9 * q0 : 9 * (q0 + n)]
        Y = work.bodies.Y[3 * q0 : 3 * (q0 + n)]
        products(model, i, q, qd, W, Y)
        c2 = block(model, i, C2, 3 * n)
        c1 = work.bodies.C1[3 * q0 : 3 * (q0 + n)]
        c3 = block(model, i, C3, 9 * n)
        h = res[6:]
        for k in range(n):
            # B_k, in place of nothing: three numbers a mode
            B0 = c2[k] + W[7 * n + k] - W[5 * n + k]
            B1 = c2[n + k] + W[2 * n + k] - W[6 * n + k]
            B2 = c2[2 * n + k] + W[3 * n + k] - W[n + k]
            t0 += B0 * qdd[k]
            t1 += B1 * qdd[k]
            t2 += B2 * qdd[k]
            h[k] = (
                c1[k] * a0
                + c1[n + k] * a1
                + c1[2 * n + k] * a2
                + B0 * e0
                + B1 * e1
                + B2 * e2
                + 2 * (Y[k] * o0 + Y[n + k] * o1 + Y[2 * n + k] * o2)
            )
        for a in range(3):
            oa = u[u0 + 3 + a]
            for b in range(3):
                oo = oa * u[u0 + 3 + b]
                o = (3 * a + b) * n
                total, total_C, total_E = 0.0, 0.0, 0.0
                for k in range(n):
                    D_ab = c3[o + k] - W[o + k]
                    h[k] -= oo * D_ab
                    total += qd[k] * D_ab
                    total_C += q[k] * c3[o + k]
                    total_E += q[k] * W[o + k]
                Dd[a, b] += total
                J[a, b] += total_C - 0.5 * total_E
                J[b, a] += total_C - 0.5 * total_E
        square = o0 * o0 + o1 * o1 + o2 * o2
        trace, trace_dot = 0.0, 0.0
        for k in range(n):
            Mq = W[k] + W[4 * n + k] + W[8 * n + k]
            h[k] -= square * Mq
            trace += q[k] * Mq
            trace_dot += qd[k] * Mq
        for a in range(3):
            J[a, a] += trace
            Dd[a, a] += trace_dot
        modal_term(model, i, MASS, qdd, h)
        modal_term(model, i, DAMPING, qd, h)
        modal_term(model, i, STIFFNESS, q, h)
        v0, v1, v2 = sum_over_modes(c1, n, qd)
        w0, w1, w2 = sum_over_modes(c1, n, qdd)
        f0, f1, f2 = cross(2 * o0, 2 * o1, 2 * o2, v0, v1, v2)
        f0 += w0
        f1 += w1
        f2 += w2
        if model.body_types.is_stiffened[t]:
            w0, w1, w2 = sum_over_modes(work.bodies.K_t_q_dot[3 * q0 : 3 * (q0 + n)], n, qd)
            f0, f1, f2 = f0 + w0, f1 + w1, f2 + w2
            w0, w1, w2 = sum_over_modes(work.bodies.K_r_q_dot[3 * q0 : 3 * (q0 + n)], n, qd)
            t0, t1, t2 = t0 + w0, t1 + w1, t2 + w2
        for b in range(3):
            ob = 2 * u[u0 + 3 + b]
            t0 += Dd[0, b] * ob
            t1 += Dd[1, b] * ob
            t2 += Dd[2, b] * ob
    # (1)
    m = model.body_types.mass[t]
    x0, x1, x2 = cross(e0, e1, e2, s0, s1, s2)
    y0, y1, y2 = cross(o0, o1, o2, s0, s1, s2)
    y0, y1, y2 = cross(o0, o1, o2, y0, y1, y2)
    res[0] = m * a0 + x0 + y0 + f0
    res[1] = m * a1 + x1 + y1 + f1
    res[2] = m * a2 + x2 + y2 + f2
    # (2)
    x0, x1, x2 = cross(s0, s1, s2, a0, a1, a2)
    L0 = J[0, 0] * o0 + J[0, 1] * o1 + J[0, 2] * o2
    L1 = J[1, 0] * o0 + J[1, 1] * o1 + J[1, 2] * o2
    L2 = J[2, 0] * o0 + J[2, 1] * o1 + J[2, 2] * o2
    y0, y1, y2 = cross(o0, o1, o2, L0, L1, L2)
    res[3] = x0 + y0 + t0 + J[0, 0] * e0 + J[0, 1] * e1 + J[0, 2] * e2
    res[4] = x1 + y1 + t1 + J[1, 0] * e0 + J[1, 1] * e1 + J[1, 2] * e2
    res[5] = x2 + y2 + t2 + J[2, 0] * e0 + J[2, 1] * e1 + J[2, 2] * e2


@loops
def products(model, i, q, qd, W, Y):
    """Write W_ab = S_ab q and Y = 4C q_dot."""
    n = model.bodies.n_q[i]
    S = block(model, i, S_AB, 9 * n * n)
    A = block(model, i, C4, 3 * n * n)
    for j in range(9 * n):
        W[j] = 0.0
    for j in range(3 * n):
        Y[j] = 0.0
    add_products(S, q, W)
    add_products(A, qd, Y)


@loops
def body_mass_product(model, work, i, v, out):
    """Write generalised momenta M u of body i into out, (6 + n_q,), for v, (6 + n_q,), with v_GO in body axes.

    `body_forces` has been called for this configuration.
    """
    t, n, q0 = model.bodies.kind[i], model.bodies.n_q[i], model.bodies.q0[i]
    J, m = work.bodies.J[i], model.body_types.mass[t]
    s0, s1, s2 = work.bodies.s[i, 0], work.bodies.s[i, 1], work.bodies.s[i, 2]
    first = work.bodies.C1[3 * q0 : 3 * (q0 + n)]
    x0, x1, x2 = cross(v[3], v[4], v[5], s0, s1, s2)
    y0, y1, y2 = cross(s0, s1, s2, v[0], v[1], v[2])
    c0, c1, c2 = sum_over_modes(first, n, v[6:])
    out[0] = m * v[0] + x0 + c0
    out[1] = m * v[1] + x1 + c1
    out[2] = m * v[2] + x2 + c2
    out[3] = y0 + J[0, 0] * v[3] + J[0, 1] * v[4] + J[0, 2] * v[5]
    out[4] = y1 + J[1, 0] * v[3] + J[1, 1] * v[4] + J[1, 2] * v[5]
    out[5] = y2 + J[2, 0] * v[3] + J[2, 1] * v[4] + J[2, 2] * v[5]
    if n > 0:
        W = work.bodies.W[9 * q0 : 9 * (q0 + n)]
        second = block(model, i, C2, 3 * n)
        for k in range(n):
            B0 = second[k] + W[7 * n + k] - W[5 * n + k]
            B1 = second[n + k] + W[2 * n + k] - W[6 * n + k]
            B2 = second[2 * n + k] + W[3 * n + k] - W[n + k]
            out[3] += B0 * v[6 + k]
            out[4] += B1 * v[6 + k]
            out[5] += B2 * v[6 + k]
            out[6 + k] = (
                first[k] * v[0] + first[n + k] * v[1] + first[2 * n + k] * v[2] + B0 * v[3] + B1 * v[4] + B2 * v[5]
            )
        modal_term(model, i, MASS, v[6:], out[6:])


@loops
def put_tilde(H, row, column, factor, x, y, z):
    """Add factor * tilde((x, y, z)) to H at (row, column)."""
    H[row, column + 1] -= factor * z
    H[row + 1, column] += factor * z
    H[row, column + 2] += factor * y
    H[row + 2, column] -= factor * y
    H[row + 1, column + 2] -= factor * x
    H[row + 2, column + 1] += factor * x


@loops
def put_tilde_product(H, row, column, factor, a0, a1, a2, b0, b1, b2):
    """Add factor * tilde(a) tilde(b) = factor * (b aᵀ - (a·b) 1) to H at (row, column)."""
    a, b = (a0, a1, a2), (b0, b1, b2)
    dot = a0 * b0 + a1 * b1 + a2 * b2
    for i in range(3):
        for j in range(3):
            H[row + i, column + j] += factor * b[i] * a[j]
        H[row + i, column + i] -= factor * dot


@loops
def body_tangent(model, work, i, c_m, c_d, c_k, H, turn):
    """Write the derivative of (1) to (3) into H, (6 + n, 6 + n), with weights of mass, damping, stiffness parts.

    Columns are (dx, dtheta, dq) with da = c_m dx, dalpha = c_m dtheta, dq_ddot = c_m dq, domega = c_d dtheta,
    dq_dot = c_d dq, dq: c_k dq. The derivative by the rotation of the body itself (da = a × dphi) goes
    unweighted into turn, (6 + n, 3). `body_forces` has been called for this iterate.
    """
    t, n, u0, q0 = model.bodies.kind[i], model.bodies.n_q[i], model.bodies.u0[i], model.bodies.q0[i]
    m = model.body_types.mass[t]
    u, J, Dd = work.state.u, work.bodies.J[i], work.bodies.D_q_dot[i]
    a0, a1, a2 = work.bodies.a_B[i, 0], work.bodies.a_B[i, 1], work.bodies.a_B[i, 2]
    o0, o1, o2 = u[u0 + 3], u[u0 + 4], u[u0 + 5]
    qd = u[u0 + 6 : u0 + 6 + n]
    H[:, :] = 0.0
    turn[:, :] = 0.0
    s0, s1, s2 = work.bodies.s[i, 0], work.bodies.s[i, 1], work.bodies.s[i, 2]
    v0, v1, v2 = sum_over_modes(work.bodies.C1[3 * q0 : 3 * (q0 + n)], n, qd)
    # by a
    for k in range(3):
        H[k, k] = c_m * m
    put_tilde(H, 3, 0, c_m, s0, s1, s2)
    put_tilde(turn, 0, 0, m, a0, a1, a2)
    put_tilde_product(turn, 3, 0, 1.0, s0, s1, s2, a0, a1, a2)
    # by alpha and omega
    put_tilde(H, 0, 3, -c_m, s0, s1, s2)
    put_tilde(H, 0, 3, -2 * c_d, v0, v1, v2)
    x0, x1, x2 = cross(o0, o1, o2, s0, s1, s2)
    put_tilde(H, 0, 3, -c_d, x0, x1, x2)
    put_tilde_product(H, 0, 3, -c_d, o0, o1, o2, s0, s1, s2)
    L0 = J[0, 0] * o0 + J[0, 1] * o1 + J[0, 2] * o2
    L1 = J[1, 0] * o0 + J[1, 1] * o1 + J[1, 2] * o2
    L2 = J[2, 0] * o0 + J[2, 1] * o1 + J[2, 2] * o2
    put_tilde(H, 3, 3, -c_d, L0, L1, L2)
    for b in range(3):
        y0, y1, y2 = cross(o0, o1, o2, J[0, b], J[1, b], J[2, b])
        H[3, 3 + b] += c_m * J[0, b] + c_d * (2 * Dd[0, b] + y0)
        H[4, 3 + b] += c_m * J[1, b] + c_d * (2 * Dd[1, b] + y1)
        H[5, 3 + b] += c_m * J[2, b] + c_d * (2 * Dd[2, b] + y2)
    if n == 0:
        return
    modal_tangent(model, work, i, c_m, c_d, c_k, H, turn)


@loops
def rate_tensor(c3, W, n, k, a, b):
    """Return 3C_k - W_k of component (a, b): D_k without its trace."""
    o = (3 * a + b) * n + k
    return c3[o] - W[o]


@loops
def tensor_products(c3, W, n, k, x0, x1, x2):
    """Return D_k x and D_kᵀ x, six numbers."""
    trace = W[k] + W[4 * n + k] + W[8 * n + k]
    d00 = rate_tensor(c3, W, n, k, 0, 0) + trace
    d01 = rate_tensor(c3, W, n, k, 0, 1)
    d02 = rate_tensor(c3, W, n, k, 0, 2)
    d10 = rate_tensor(c3, W, n, k, 1, 0)
    d11 = rate_tensor(c3, W, n, k, 1, 1) + trace
    d12 = rate_tensor(c3, W, n, k, 1, 2)
    d20 = rate_tensor(c3, W, n, k, 2, 0)
    d21 = rate_tensor(c3, W, n, k, 2, 1)
    d22 = rate_tensor(c3, W, n, k, 2, 2) + trace
    return (
        d00 * x0 + d01 * x1 + d02 * x2,
        d10 * x0 + d11 * x1 + d12 * x2,
        d20 * x0 + d21 * x1 + d22 * x2,
        d00 * x0 + d10 * x1 + d20 * x2,
        d01 * x0 + d11 * x1 + d21 * x2,
        d02 * x0 + d12 * x1 + d22 * x2,
    )


@loops
def put_column(H, row, column, x0, x1, x2):
    """Write three numbers down a column of H."""
    H[row, column] = x0
    H[row + 1, column] = x1
    H[row + 2, column] = x2


@loops
def modal_tangent(model, work, i, c_m, c_d, c_k, H, turn):
    """Write the rows and columns of the modes; see `body_tangent`."""
    n, q0, u0 = model.bodies.n_q[i], model.bodies.q0[i], model.bodies.u0[i]
    W = work.bodies.W[9 * q0 : 9 * (q0 + n)]
    Y = work.bodies.Y[3 * q0 : 3 * (q0 + n)]
    c1 = work.bodies.C1[3 * q0 : 3 * (q0 + n)]
    c2 = block(model, i, C2, 3 * n)
    c3 = block(model, i, C3, 9 * n)
    a0, a1, a2 = work.bodies.a_B[i, 0], work.bodies.a_B[i, 1], work.bodies.a_B[i, 2]
    o0, o1, o2 = work.state.u[u0 + 3], work.state.u[u0 + 4], work.state.u[u0 + 5]
    e0, e1, e2 = work.state.u_dot[u0 + 3], work.state.u_dot[u0 + 4], work.state.u_dot[u0 + 5]
    for k in range(n):
        x0, x1, x2 = c1[k], c1[n + k], c1[2 * n + k]
        b0 = c2[k] + W[7 * n + k] - W[5 * n + k]
        b1 = c2[n + k] + W[2 * n + k] - W[6 * n + k]
        b2 = c2[2 * n + k] + W[3 * n + k] - W[n + k]
        d0, d1, d2, t0, t1, t2 = tensor_products(c3, W, n, k, o0, o1, o2)
        j0, j1, j2 = d0 + t0, d1 + t1, d2 + t2  # dJ/dq_k omega
        p0, p1, p2, s0, s1, s2 = tensor_products(c3, W, n, k, e0, e1, e2)
        z0, z1, z2 = cross(o0, o1, o2, x0, x1, x2)
        w0, w1, w2 = cross(o0, o1, o2, z0, z1, z2)
        v0, v1, v2 = cross(e0, e1, e2, x0, x1, x2)
        # (1) by q
        put_column(
            H, 0, 6 + k,
            c_m * x0 + 2 * c_d * z0 + c_k * (v0 + w0),
            c_m * x1 + 2 * c_d * z1 + c_k * (v1 + w1),
            c_m * x2 + 2 * c_d * z2 + c_k * (v2 + w2),
        )  # fmt: skip
        # (2) by q, but for the sums over modes below
        v0, v1, v2 = cross(x0, x1, x2, a0, a1, a2)
        w0, w1, w2 = cross(o0, o1, o2, j0, j1, j2)
        put_column(
            H, 3, 6 + k,
            c_m * b0 + 2 * c_d * d0 + c_k * (v0 + p0 + s0 + w0),
            c_m * b1 + 2 * c_d * d1 + c_k * (v1 + p1 + s1 + w1),
            c_m * b2 + 2 * c_d * d2 + c_k * (v2 + p2 + s2 + w2),
        )  # fmt: skip
        # (3) by a, alpha, omega
        row = H[6 + k]
        row[0], row[1], row[2] = c_m * x0, c_m * x1, c_m * x2
        row[3] = c_m * b0 + c_d * (2 * Y[k] - j0)
        row[4] = c_m * b1 + c_d * (2 * Y[n + k] - j1)
        row[5] = c_m * b2 + c_d * (2 * Y[2 * n + k] - j2)
        turn[6 + k, 0], turn[6 + k, 1], turn[6 + k, 2] = v0, v1, v2
    modal_columns(model, work, i, c_d, c_k, H)
    if model.body_types.is_stiffened[model.bodies.kind[i]]:
        stiffened_columns(model, work, i, c_d, c_k, H)
    modal_block(model, i, MASS, c_m, H)
    modal_block(model, i, DAMPING, c_d, H)
    modal_block(model, i, STIFFNESS, c_k, H)


@loops
def modal_columns(model, work, i, c_d, c_k, H):
    """Add what needs products over 4C and S_ab: the modal block, and the rest of (2) by q.

    2 4C_kj·omega, B'_kj·alpha - omegaᵀ 5C_jk omega; Σ_k B'_kj q_ddot_k + 2 Σ_k q_dot_k 5C_jk omega, where B'_kj is the
    derivative of B_k by q_j: 4C_kj, and K_r,kj of a stiffened body; both are in S_ab.
    """
    n, u0 = model.bodies.n_q[i], model.bodies.u0[i]
    S = block(model, i, S_AB, 9 * n * n)
    A = block(model, i, C4, 3 * n * n)
    qd = work.state.u[u0 + 6 : u0 + 6 + n]
    qdd = work.state.u_dot[u0 + 6 : u0 + 6 + n]
    o = work.state.u[u0 + 3 : u0 + 6]
    e = work.state.u_dot[u0 + 3 : u0 + 6]
    # alpha·B'_jk = alpha·B'_kj - 2 alpha·4C_kj, the former by S_ab
    f0, f1, f2 = 2 * (c_d * o[0] + c_k * e[0]), 2 * (c_d * o[1] + c_k * e[1]), 2 * (c_d * o[2] + c_k * e[2])
    square = o[0] * o[0] + o[1] * o[1] + o[2] * o[2]
    xy, xz, yz = c_k * o[0] * o[1], c_k * o[0] * o[2], c_k * o[1] * o[2]
    weight = (  # omegaᵀ 5C omega = Σ weight_ab S_ab
        c_k * (o[0] * o[0] - square), xy - c_k * e[2], xz + c_k * e[1],
        xy + c_k * e[2], c_k * (o[1] * o[1] - square), yz - c_k * e[0],
        xz - c_k * e[1], yz + c_k * e[0], c_k * (o[2] * o[2] - square),
    )  # fmt: skip
    for j in range(n):
        row4 = A[3 * n * j : 3 * n * (j + 1)]  # 4C_kj over [a, k]
        rows = S[9 * n * j : 9 * n * (j + 1)]  # ∫ phi_a,k phi_b,j over [ab, k]
        out = H[6 + j, 6:]  # row j from column j: 4C is antisymmetric in k, j, the rest symmetric
        for k in range(n):
            out[k] = -(f0 * row4[k] + f1 * row4[n + k] + f2 * row4[2 * n + k])
        for k in range(n):
            out[k] += (
                (weight[0] * rows[k] + weight[1] * rows[n + k] + weight[2] * rows[2 * n + k])
                + (weight[3] * rows[3 * n + k] + weight[4] * rows[4 * n + k] + weight[5] * rows[5 * n + k])
                + (weight[6] * rows[6 * n + k] + weight[7] * rows[7 * n + k] + weight[8] * rows[8 * n + k])
            )
        trace = 0.0
        for r in range(3):
            for k in range(n):
                trace += rows[4 * r * n + k] * qd[k]
        for r in range(3):
            total = 2 * trace * o[r]
            plus, minus = 3 * ((r + 2) % 3) + (r + 1) % 3, 3 * ((r + 1) % 3) + (r + 2) % 3
            for k in range(n):
                total += (rows[plus * n + k] - rows[minus * n + k]) * qdd[k]
            for b in range(3):
                product = 0.0
                for k in range(n):
                    product += rows[(3 * r + b) * n + k] * qd[k]
                total -= 2 * product * o[b]
            H[3 + r, 6 + j] += c_k * total


@loops
def stiffened_columns(model, work, i, c_d, c_k, H):
    """Add what K_t gives beyond s(q) and 1C(q), and the derivatives of q_dotᵀK_t q_dot, q_dotᵀK_r q_dot."""
    n, q0, u0 = model.bodies.n_q[i], model.bodies.q0[i], model.bodies.u0[i]
    K_t = block(model, i, K_TRANSLATION, 3 * n * n)
    first_dot, turn_dot = work.bodies.K_t_q_dot[3 * q0 : 3 * (q0 + n)], work.bodies.K_r_q_dot[3 * q0 : 3 * (q0 + n)]
    qdd = work.state.u_dot[u0 + 6 : u0 + 6 + n]
    a0, a1, a2 = c_k * work.bodies.a_B[i, 0], c_k * work.bodies.a_B[i, 1], c_k * work.bodies.a_B[i, 2]
    o0, o1, o2 = work.state.u[u0 + 3], work.state.u[u0 + 4], work.state.u[u0 + 5]
    for j in range(n):
        row = K_t[3 * n * j : 3 * n * (j + 1)]  # over [a, k]
        out = H[6 + j, 6:]
        for k in range(n):
            out[k] += a0 * row[k] + a1 * row[n + k] + a2 * row[2 * n + k]
        x0, x1, x2 = first_dot[j], first_dot[n + j], first_dot[2 * n + j]
        y0, y1, y2 = sum_over_modes(row, n, qdd)
        z0, z1, z2 = cross(o0, o1, o2, x0, x1, x2)
        H[0, 6 + j] += 2 * c_d * x0 + c_k * (y0 + 2 * z0)
        H[1, 6 + j] += 2 * c_d * x1 + c_k * (y1 + 2 * z1)
        H[2, 6 + j] += 2 * c_d * x2 + c_k * (y2 + 2 * z2)
        for a in range(3):
            H[3 + a, 6 + j] += 2 * c_d * turn_dot[a * n + j]


@loops
def modal_block(model, i, which, factor, H):
    """Add factor * M, K or D to the modal block of H."""
    n = model.bodies.n_q[i]
    if model.body_types.is_diagonal[model.bodies.kind[i], which - MASS]:
        diagonal = block(model, i, which, n)
        for k in range(n):
            H[6 + k, 6 + k] += factor * diagonal[k]
    else:
        matrix = block(model, i, which, n * n)
        for k in range(n):
            for j in range(n):
                H[6 + k, 6 + j] += factor * matrix[k * n + j]
