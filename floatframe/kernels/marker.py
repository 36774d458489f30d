"""Motion of a marker from that of its body, and the way of a wrench on the marker back to the body.

With [rho - c; th] = Psi q - 1/2 qᵀ K_P q (K_P, (6, n, n): zero unless the body is stiffened), Psi(q) = Psi - K_P q its
derivative (t: rows of rho, r: rows of th), E = exp(th), T' = left Jacobian at th, nu = T' th_dot, all in body axes:

    position     r + R rho                        velocity          v + R (omega × rho + rho_dot)
    axes         R E triad                        angular velocity  R (omega + nu)
    variation    dr_P = R (dx + dphi × rho + Psi_t(q) dq),  dphi_P = R (dphi + T' Psi_r(q) dq)
    wrench (f, m in body axes)  ->  f;  rho × f + m;  Psi_t(q)ᵀ f + (T' Psi_r(q))ᵀ m
"""

from floatframe.kernels.compiler.compilation import inner
from floatframe.kernels.dense import add_products
from floatframe.kernels.rotation import exp_matrix, left_jacobian, left_jacobian_derivative
from floatframe.kernels.vector import product, put_matrix, scaled, sub, turned, vector

__all__ = [
    "marker_acceleration_bias", "marker_columns", "marker_motion", "marker_stiffness", "pose_on_body", "wrench_to_body",
]  # fmt: skip


@inner
def cross(a0, a1, a2, b0, b1, b2):
    """Return a × b as three numbers."""
    return a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0


@inner
def rotate(R, x0, x1, x2):
    """Return R x as three numbers."""
    return (
        R[0, 0] * x0 + R[0, 1] * x1 + R[0, 2] * x2,
        R[1, 0] * x0 + R[1, 1] * x1 + R[1, 2] * x2,
        R[2, 0] * x0 + R[2, 1] * x1 + R[2, 2] * x2,
    )


@inner
def rotate_back(R, x0, x1, x2):
    """Return Rᵀ x as three numbers."""
    return (
        R[0, 0] * x0 + R[1, 0] * x1 + R[2, 0] * x2,
        R[0, 1] * x0 + R[1, 1] * x1 + R[2, 1] * x2,
        R[0, 2] * x0 + R[1, 2] * x1 + R[2, 2] * x2,
    )


@inner
def marker_motion(model, work, m):
    """Write place and motion of marker m."""
    i = model.markers.body[m]
    A, triad = work.markers.A[m], model.markers.triad[m]
    if i < 0:
        for a in range(3):
            work.markers.r[m, a] = model.markers.position[m, a]
            work.markers.v[m, a] = 0.0
            work.markers.omega[m, a] = 0.0
            for b in range(3):
                A[a, b] = triad[a, b]
        return
    for a in range(3):
        work.markers.rho[m, a] = model.markers.position[m, a]
    if model.markers.psi0[m] >= 0:
        elastic_motion(model, work, m, i)
    pose_on_body(model, work, m)


@inner
def pose_on_body(model, work, m):
    """Write place, axes and velocities of marker m in ground axes from its motion in its body."""
    i = model.markers.body[m]
    A, triad = work.markers.A[m], model.markers.triad[m]
    R, u0 = work.state.R[i], model.bodies.u0[i]
    u = work.state.u
    rho, rho_dot, spin = work.markers.rho[m], work.markers.rho_dot[m], work.markers.spin[m]
    if model.markers.psi0[m] >= 0:
        put_matrix(A, product(R, product(exp_matrix(vector(work.markers.angle[m])), triad)))
    else:
        put_matrix(A, product(R, triad))
    x0, x1, x2 = rotate(R, rho[0], rho[1], rho[2])
    work.markers.r[m, 0] = work.state.r[i, 0] + x0
    work.markers.r[m, 1] = work.state.r[i, 1] + x1
    work.markers.r[m, 2] = work.state.r[i, 2] + x2
    o0, o1, o2 = u[u0 + 3], u[u0 + 4], u[u0 + 5]
    x0, x1, x2 = cross(o0, o1, o2, rho[0], rho[1], rho[2])
    x0, x1, x2 = rotate(R, x0 + rho_dot[0], x1 + rho_dot[1], x2 + rho_dot[2])
    work.markers.v[m, 0] = u[u0] + x0
    work.markers.v[m, 1] = u[u0 + 1] + x1
    work.markers.v[m, 2] = u[u0 + 2] + x2
    work.markers.omega[m, 0], work.markers.omega[m, 1], work.markers.omega[m, 2] = rotate(
        R, o0 + spin[0], o1 + spin[1], o2 + spin[2]
    )


@inner
def elastic_motion(model, work, m, i):
    """Add the elastic displacement to rho and write elastic rotation, rates and the left Jacobian."""
    n, q0, u0, o = model.bodies.n_q[i], model.bodies.q0[i], model.bodies.u0[i], model.markers.psi0[m]
    is_bent = model.markers.bend0[m] >= 0
    if is_bent:
        bent_shapes(model, work, m, i)
    for a in range(3):
        d, d_dot, th, th_dot = 0.0, 0.0, 0.0, 0.0
        t = work.markers.psi[o + a * n : o + (a + 1) * n]
        r = work.markers.psi[o + (a + 3) * n : o + (a + 4) * n]
        if is_bent:  # Psi q - 1/2 qᵀ K_P q
            for k in range(n):
                d += 0.5 * (model.markers.psi[o + a * n + k] + t[k]) * work.state.q[q0 + k]
                th += 0.5 * (model.markers.psi[o + (a + 3) * n + k] + r[k]) * work.state.q[q0 + k]
                d_dot += t[k] * work.state.u[u0 + 6 + k]
                th_dot += r[k] * work.state.u[u0 + 6 + k]
        else:
            for k in range(n):
                d += t[k] * work.state.q[q0 + k]
                th += r[k] * work.state.q[q0 + k]
                d_dot += t[k] * work.state.u[u0 + 6 + k]
                th_dot += r[k] * work.state.u[u0 + 6 + k]
        work.markers.rho[m, a] += d
        work.markers.rho_dot[m, a] = d_dot
        work.markers.angle[m, a] = th
        work.markers.angle_dot[m, a] = th_dot
    put_matrix(work.markers.T_left[m], left_jacobian(vector(work.markers.angle[m])))
    d = work.markers.angle_dot[m]
    s = work.markers.spin[m]
    s[0], s[1], s[2] = rotate(work.markers.T_left[m], d[0], d[1], d[2])


@inner
def bent_shapes(model, work, m, i):
    """Write Psi(q) = Psi - K_P q."""
    n, q0, o, first = model.bodies.n_q[i], model.bodies.q0[i], model.markers.psi0[m], model.markers.bend0[m]
    psi, own = work.markers.psi[o : o + 6 * n], model.markers.psi[o : o + 6 * n]
    for j in range(6 * n):
        psi[j] = -own[j]
    add_products(model.markers.bend[first : first + 6 * n * n], work.state.q[q0 : q0 + n], psi)
    for j in range(6 * n):
        psi[j] = -psi[j]


@inner
def bent_rate(model, work, m, i, out):
    """Write K_P q_dot [6, k], minus the rate of Psi(q), into out, (6 n_q,)."""
    n, u0, first = model.bodies.n_q[i], model.bodies.u0[i], model.markers.bend0[m]
    for j in range(6 * n):
        out[j] = 0.0
    add_products(model.markers.bend[first : first + 6 * n * n], work.state.u[u0 + 6 : u0 + 6 + n], out)


@inner
def marker_acceleration_bias(model, work, m, out):
    """Write the acceleration (3) and angular acceleration (3) of marker m at zero u_dot, ground axes, into out.

    R (omega × (omega × rho + 2 rho_dot) + b_t) and R (omega × nu + (dT'/dth [th_dot]) th_dot + T' b_r), where
    b = -q_dotᵀ K_P q_dot.
    """
    out[:] = 0.0
    i = model.markers.body[m]
    if i < 0:
        return
    R, u0 = work.state.R[i], model.bodies.u0[i]
    o0, o1, o2 = work.state.u[u0 + 3], work.state.u[u0 + 4], work.state.u[u0 + 5]
    rho, rho_dot = work.markers.rho[m], work.markers.rho_dot[m]
    x0, x1, x2 = cross(o0, o1, o2, rho[0], rho[1], rho[2])
    x0, x1, x2 = cross(o0, o1, o2, x0 + 2 * rho_dot[0], x1 + 2 * rho_dot[1], x2 + 2 * rho_dot[2])
    n = model.bodies.n_q[i]
    b_t, b_r = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    if model.markers.bend0[m] >= 0:
        rate = work.markers.bend_dot[: 6 * n]
        bent_rate(model, work, m, i, rate)
        for k in range(n):
            q_dot = work.state.u[u0 + 6 + k]
            b_t = sub(b_t, scaled(q_dot, (rate[k], rate[n + k], rate[2 * n + k])))
            b_r = sub(b_r, scaled(q_dot, (rate[3 * n + k], rate[4 * n + k], rate[5 * n + k])))
    out[0], out[1], out[2] = rotate(R, x0 + b_t[0], x1 + b_t[1], x2 + b_t[2])
    if model.markers.psi0[m] >= 0:
        d, nu = work.markers.angle_dot[m], work.markers.spin[m]
        slope = left_jacobian_derivative(vector(work.markers.angle[m]), vector(d), 1.0)
        x0, x1, x2 = cross(o0, o1, o2, nu[0], nu[1], nu[2])
        y0, y1, y2 = turned(slope, d)
        z0, z1, z2 = turned(work.markers.T_left[m], b_r)
        out[3], out[4], out[5] = rotate(R, x0 + y0 + z0, x1 + y1 + z1, x2 + y2 + z2)


@inner
def wrench_to_body(model, work, m):
    """Subtract the generalised forces of the wrench on marker m from the residual of its body."""
    i = model.markers.body[m]
    if i < 0:
        return
    n, u0 = model.bodies.n_q[i], model.bodies.u0[i]
    R, F, rho = work.state.R[i], work.markers.wrench[m], work.markers.rho[m]
    f0, f1, f2 = rotate_back(R, F[0], F[1], F[2])
    t0, t1, t2 = rotate_back(R, F[3], F[4], F[5])
    res = work.bodies.residual
    x0, x1, x2 = cross(rho[0], rho[1], rho[2], f0, f1, f2)
    res[u0] -= f0
    res[u0 + 1] -= f1
    res[u0 + 2] -= f2
    res[u0 + 3] -= x0 + t0
    res[u0 + 4] -= x1 + t1
    res[u0 + 5] -= x2 + t2
    o = model.markers.psi0[m]
    if o >= 0:
        psi = work.markers.psi[o : o + 6 * n]
        t0, t1, t2 = rotate_back(work.markers.T_left[m], t0, t1, t2)
        for k in range(n):
            res[u0 + 6 + k] -= (
                psi[k] * f0
                + psi[n + k] * f1
                + psi[2 * n + k] * f2
                + psi[3 * n + k] * t0
                + psi[4 * n + k] * t1
                + psi[5 * n + k] * t2
            )


@inner
def marker_columns(model, work, m, rate, turning, column, row):
    """Write the derivatives of the motion of marker m by the body unknowns (dx, dtheta, dq), in body axes.

    column, (6, 6 + n): of position and rotation by velocities, whose transpose carries a wrench to the body.
    row, (12, 6 + n): of position, rotation, velocity, angular velocity by the unknowns of a step, in which
    domega = rate dtheta, dq_dot = rate dq, and the body turns by `turning` dtheta, (3, 3).
    """
    i = model.markers.body[m]
    n, u0 = model.bodies.n_q[i], model.bodies.u0[i]
    rho, rho_dot, nu = work.markers.rho[m], work.markers.rho_dot[m], work.markers.spin[m]
    o0, o1, o2 = work.state.u[u0 + 3], work.state.u[u0 + 4], work.state.u[u0 + 5]
    column[:, :] = 0.0
    row[:, :] = 0.0
    for a in range(3):
        column[a, a] = 1.0
        column[3 + a, 3 + a] = 1.0
        row[a, a] = 1.0
        row[6 + a, a] = rate
        for b in range(3):
            row[3 + a, 3 + b] = turning[a, b]
        row[9 + a, 3 + a] = rate
    s0, s1, s2 = cross(o0, o1, o2, rho[0], rho[1], rho[2])
    s0, s1, s2 = s0 + rho_dot[0], s1 + rho_dot[1], s2 + rho_dot[2]
    e0, e1, e2 = o0 + nu[0], o1 + nu[1], o2 + nu[2]
    for b in range(3):
        unit = (1.0 if b == 0 else 0.0, 1.0 if b == 1 else 0.0, 1.0 if b == 2 else 0.0)
        x0, x1, x2 = cross(unit[0], unit[1], unit[2], rho[0], rho[1], rho[2])
        column[0, 3 + b], column[1, 3 + b], column[2, 3 + b] = x0, x1, x2
        row[6, 3 + b] += rate * x0
        row[7, 3 + b] += rate * x1
        row[8, 3 + b] += rate * x2
        t0, t1, t2 = turning[0, b], turning[1, b], turning[2, b]
        row[0, 3 + b], row[1, 3 + b], row[2, 3 + b] = cross(t0, t1, t2, rho[0], rho[1], rho[2])
        x0, x1, x2 = cross(t0, t1, t2, s0, s1, s2)
        row[6, 3 + b] += x0
        row[7, 3 + b] += x1
        row[8, 3 + b] += x2
        x0, x1, x2 = cross(t0, t1, t2, e0, e1, e2)
        row[9, 3 + b] += x0
        row[10, 3 + b] += x1
        row[11, 3 + b] += x2
    o = model.markers.psi0[m]
    if o < 0:
        return
    slope = left_jacobian_derivative(vector(work.markers.angle[m]), vector(work.markers.angle_dot[m]), 1.0)
    psi = work.markers.psi[o : o + 6 * n]
    for k in range(n):
        p0, p1, p2 = psi[k], psi[n + k], psi[2 * n + k]
        y0, y1, y2 = psi[3 * n + k], psi[4 * n + k], psi[5 * n + k]
        t0, t1, t2 = rotate(work.markers.T_left[m], y0, y1, y2)
        column[0, 6 + k], column[1, 6 + k], column[2, 6 + k] = p0, p1, p2
        column[3, 6 + k], column[4, 6 + k], column[5, 6 + k] = t0, t1, t2
        row[0, 6 + k], row[1, 6 + k], row[2, 6 + k] = p0, p1, p2
        row[3, 6 + k], row[4, 6 + k], row[5, 6 + k] = t0, t1, t2
        x0, x1, x2 = cross(o0, o1, o2, p0, p1, p2)
        row[6, 6 + k], row[7, 6 + k], row[8, 6 + k] = x0 + rate * p0, x1 + rate * p1, x2 + rate * p2
        x0, x1, x2 = turned(slope, (y0, y1, y2))
        row[9, 6 + k], row[10, 6 + k], row[11, 6 + k] = x0 + rate * t0, x1 + rate * t1, x2 + rate * t2
    if model.markers.bend0[m] >= 0:  # d(Psi(q) q_dot)/dq = -K_P q_dot
        bent = work.markers.bend_dot[: 6 * n]
        bent_rate(model, work, m, i, bent)
        for k in range(n):
            t0, t1, t2 = rotate(work.markers.T_left[m], bent[3 * n + k], bent[4 * n + k], bent[5 * n + k])
            row[6, 6 + k] -= bent[k]
            row[7, 6 + k] -= bent[n + k]
            row[8, 6 + k] -= bent[2 * n + k]
            row[9, 6 + k] -= t0
            row[10, 6 + k] -= t1
            row[11, 6 + k] -= t2


@inner
def marker_stiffness(model, work, m, c_k, H, turn):
    """Add the derivative of minus the generalised forces of a held wrench on marker m to H and turn.

    A wrench fixed in space turns against the body (turn); one fixed in the marker turns with its elastic rotation.
    """
    i = model.markers.body[m]
    n = model.bodies.n_q[i]
    R, F, rho = work.state.R[i], work.markers.wrench[m], work.markers.rho[m]
    f0, f1, f2 = rotate_back(R, F[0], F[1], F[2])
    t0, t1, t2 = rotate_back(R, F[3], F[4], F[5])
    is_follower = model.markers.is_follower[m] != 0
    if not is_follower:
        for b in range(3):
            unit = (1.0 if b == 0 else 0.0, 1.0 if b == 1 else 0.0, 1.0 if b == 2 else 0.0)
            x0, x1, x2 = cross(f0, f1, f2, unit[0], unit[1], unit[2])
            y0, y1, y2 = cross(rho[0], rho[1], rho[2], x0, x1, x2)
            z0, z1, z2 = cross(t0, t1, t2, unit[0], unit[1], unit[2])
            turn[0, b] -= x0
            turn[1, b] -= x1
            turn[2, b] -= x2
            turn[3, b] -= y0 + z0
            turn[4, b] -= y1 + z1
            turn[5, b] -= y2 + z2
    o = model.markers.psi0[m]
    if o < 0:
        return
    psi = work.markers.psi[o : o + 6 * n]
    T = work.markers.T_left[m]
    if model.markers.bend0[m] >= 0:  # h = Psi(q)ᵀ [f; Tᵀ m], dPsi(q) = -K_P dq
        s0, s1, s2 = rotate_back(T, t0, t1, t2)
        first = model.markers.bend0[m]
        for j in range(n):
            row = model.markers.bend[first + 6 * n * j : first + 6 * n * (j + 1)]
            out = H[6 + j, 6:]
            for k in range(n):
                out[k] += c_k * (
                    f0 * row[k]
                    + f1 * row[n + k]
                    + f2 * row[2 * n + k]
                    + s0 * row[3 * n + k]
                    + s1 * row[4 * n + k]
                    + s2 * row[5 * n + k]
                )
    slope = left_jacobian_derivative(vector(work.markers.angle[m]), (t0, t1, t2), -1.0)
    for j in range(n):
        p0, p1, p2 = psi[j], psi[n + j], psi[2 * n + j]
        y0, y1, y2 = psi[3 * n + j], psi[4 * n + j], psi[5 * n + j]
        # tau: drho × f
        x0, x1, x2 = cross(p0, p1, p2, f0, f1, f2)
        H[3, 6 + j] -= c_k * x0
        H[4, 6 + j] -= c_k * x1
        H[5, 6 + j] -= c_k * x2
        # h: Psi_rᵀ d(T m)
        s0, s1, s2 = turned(slope, (y0, y1, y2))
        l0, l1, l2 = rotate(T, y0, y1, y2)  # rotation of the marker in the body
        df0, df1, df2 = 0.0, 0.0, 0.0
        if is_follower:
            df0, df1, df2 = cross(l0, l1, l2, f0, f1, f2)
            dt0, dt1, dt2 = cross(l0, l1, l2, t0, t1, t2)
            x0, x1, x2 = cross(rho[0], rho[1], rho[2], df0, df1, df2)
            H[0, 6 + j] -= c_k * df0
            H[1, 6 + j] -= c_k * df1
            H[2, 6 + j] -= c_k * df2
            H[3, 6 + j] -= c_k * (x0 + dt0)
            H[4, 6 + j] -= c_k * (x1 + dt1)
            H[5, 6 + j] -= c_k * (x2 + dt2)
            z0, z1, z2 = rotate_back(T, dt0, dt1, dt2)
            s0, s1, s2 = s0 + z0, s1 + z1, s2 + z2
        else:
            # turn, row of mode j: Psi_t,j · (f × dphi) + (T' Psi_r,j) · (m × dphi) = dphi · (Psi × f + ...)
            x0, x1, x2 = cross(p0, p1, p2, f0, f1, f2)
            z0, z1, z2 = cross(l0, l1, l2, t0, t1, t2)
            turn[6 + j, 0] -= x0 + z0
            turn[6 + j, 1] -= x1 + z1
            turn[6 + j, 2] -= x2 + z2
        for k in range(n):
            H[6 + k, 6 + j] -= c_k * (
                psi[k] * df0
                + psi[n + k] * df1
                + psi[2 * n + k] * df2
                + psi[3 * n + k] * s0
                + psi[4 * n + k] * s1
                + psi[5 * n + k] * s2
            )
