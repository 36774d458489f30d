"""A thin disc of radius R that rolls on a plane without slip.

N: normal of the plane, fixed in A; n: axis of the disc, fixed in B; d = r_B - r_A. With c = N·n, s = sqrt(1 - c²) the
rim is nearest to the plane at rho = -R (N - c n)/s from the centre, and there

    RIM_HEIGHT   N · (d + rho) = N · d - R s = 0
    ROLL t       t · V = 0,  V = v_B + omega_B × rho - v_A - omega_A × (d + rho),  t fixed in A: holds a velocity
    RIM x        x · (N_w - rho × F) = 0,  x in ground axes: the force on B acts at the rim

The row ROLL has no position: for c_k = 0, where rows stand for velocities or accelerations, its P is that of t · V.
"""

import math

from floatframe.joints.rows import MOMENT_B, RIM, RIM_HEIGHT
from floatframe.kernels.compiler.compilation import inner
from floatframe.kernels.connections.relative_motion import distance
from floatframe.kernels.marker import cross, rotate

__all__ = ["rolling_acceleration", "rolling_derivatives", "rolling_rate", "rolling_row"]


@inner
def dot(a0, a1, a2, b0, b1, b2):
    """Return a · b."""
    return a0 * b0 + a1 * b1 + a2 * b2


@inner
def rim(model, work, k, a, b):
    """Return N, n, c, s and rho: eleven numbers, ground axes."""
    z, y, R = model.rows.z[k], model.rows.y[k], model.rows.c[k]
    N0, N1, N2 = rotate(work.markers.A[a], z[0], z[1], z[2])
    n0, n1, n2 = rotate(work.markers.A[b], y[0], y[1], y[2])
    c = dot(N0, N1, N2, n0, n1, n2)
    u0, u1, u2 = N0 - c * n0, N1 - c * n1, N2 - c * n2
    s = math.sqrt(dot(u0, u1, u2, u0, u1, u2))
    f = -R / s
    return N0, N1, N2, n0, n1, n2, c, s, f * u0, f * u1, f * u2


@inner
def rim_velocity(work, a, b, rho0, rho1, rho2):
    """Return the velocity of the rim at the contact as seen from A."""
    d0, d1, d2 = distance(work, a, b)
    o, p = work.markers.omega[a], work.markers.omega[b]
    x0, x1, x2 = cross(p[0], p[1], p[2], rho0, rho1, rho2)
    y0, y1, y2 = cross(o[0], o[1], o[2], d0 + rho0, d1 + rho1, d2 + rho2)
    return (
        work.markers.v[b, 0] - work.markers.v[a, 0] + x0 - y0,
        work.markers.v[b, 1] - work.markers.v[a, 1] + x1 - y1,
        work.markers.v[b, 2] - work.markers.v[a, 2] + x2 - y2,
    )


@inner
def rolling_row(model, work, k, a, b, w, c_k):
    """Return the residual of a row RIM_HEIGHT, ROLL or RIM."""
    N0, N1, N2, _, _, _, _, s, rho0, rho1, rho2 = rim(model, work, k, a, b)
    kind, x = model.rows.kind[k], model.rows.x[k]
    if kind == RIM_HEIGHT:
        d0, d1, d2 = distance(work, a, b)
        return dot(N0, N1, N2, d0, d1, d2) - model.rows.c[k] * s
    if kind == RIM:
        m0, m1, m2 = cross(rho0, rho1, rho2, w[0], w[1], w[2])
        return c_k * dot(x[0], x[1], x[2], w[MOMENT_B] - m0, w[MOMENT_B + 1] - m1, w[MOMENT_B + 2] - m2)
    t0, t1, t2 = rotate(work.markers.A[a], x[0], x[1], x[2])
    v0, v1, v2 = rim_velocity(work, a, b, rho0, rho1, rho2)
    return dot(t0, t1, t2, v0, v1, v2)


@inner
def add_by_rim(model, P_a, P_b, k, r, g0, g1, g2, N0, N1, N2, n0, n1, n2, c, s):
    """Add g · d(rho) to row r of P.

    rho = -R u, u = (N - c n)/s,  du = (dN - dc n - c dn)/s + u c dc/s²,  dc = dN·n + N·dn, dN = dphi_A × N, ...
    so that g·du = A·dN + B·dn with m = (u c/s - n)·g/s:  A = g/s + m n,  B = m N - c g/s.
    """
    u0, u1, u2 = (N0 - c * n0) / s, (N1 - c * n1) / s, (N2 - c * n2) / s
    m = (dot(u0, u1, u2, g0, g1, g2) * c / s - dot(n0, n1, n2, g0, g1, g2)) / s
    f = -model.rows.c[k]
    x0, x1, x2 = cross(N0, N1, N2, g0 / s + m * n0, g1 / s + m * n1, g2 / s + m * n2)
    P_a[r, 3] += f * x0
    P_a[r, 4] += f * x1
    P_a[r, 5] += f * x2
    x0, x1, x2 = cross(n0, n1, n2, m * N0 - c * g0 / s, m * N1 - c * g1 / s, m * N2 - c * g2 / s)
    P_b[r, 3] += f * x0
    P_b[r, 4] += f * x1
    P_b[r, 5] += f * x2


@inner
def rolling_derivatives(model, work, k, r, a, b, w, c_k, P_a, P_b, V):
    """Write row r of P and V of a row RIM_HEIGHT, ROLL or RIM; both are zero before."""
    N0, N1, N2, n0, n1, n2, c, s, rho0, rho1, rho2 = rim(model, work, k, a, b)
    kind, x = model.rows.kind[k], model.rows.x[k]
    d0, d1, d2 = distance(work, a, b)
    if kind == RIM_HEIGHT:  # N·dd + d·dN + R c/s dc
        f = model.rows.c[k] * c / s
        for j in range(3):
            value = (N0, N1, N2)[j]
            P_a[r, j], P_b[r, j] = -value, value
        P_a[r, 3], P_a[r, 4], P_a[r, 5] = cross(N0, N1, N2, d0 + f * n0, d1 + f * n1, d2 + f * n2)
        P_b[r, 3], P_b[r, 4], P_b[r, 5] = cross(n0, n1, n2, f * N0, f * N1, f * N2)
        return
    if kind == RIM:  # x·(dN_w - rho × dF - drho × F)
        for j in range(3):
            V[r, MOMENT_B + j] = x[j]
        V[r, 0], V[r, 1], V[r, 2] = cross(rho0, rho1, rho2, x[0], x[1], x[2])
        g0, g1, g2 = cross(x[0], x[1], x[2], w[0], w[1], w[2])
        add_by_rim(model, P_a, P_b, k, r, c_k * g0, c_k * g1, c_k * g2, N0, N1, N2, n0, n1, n2, c, s)
        return
    o, p = work.markers.omega[a], work.markers.omega[b]
    t0, t1, t2 = rotate(work.markers.A[a], x[0], x[1], x[2])
    first = 6 if c_k > 0.0 else 0
    for j in range(3):
        value = (t0, t1, t2)[j]
        P_a[r, first + j], P_b[r, first + j] = -value, value
    x0, x1, x2 = cross(d0 + rho0, d1 + rho1, d2 + rho2, t0, t1, t2)
    P_a[r, first + 3], P_a[r, first + 4], P_a[r, first + 5] = -x0, -x1, -x2
    P_b[r, first + 3], P_b[r, first + 4], P_b[r, first + 5] = cross(rho0, rho1, rho2, t0, t1, t2)
    if c_k == 0.0:
        return
    x0, x1, x2 = cross(t0, t1, t2, o[0], o[1], o[2])  # t·(-omega_A × dd) = -dd·(t × omega_A)
    for j in range(3):
        value = (x0, x1, x2)[j]
        P_a[r, j], P_b[r, j] = value, -value
    v0, v1, v2 = rim_velocity(work, a, b, rho0, rho1, rho2)
    P_a[r, 3], P_a[r, 4], P_a[r, 5] = cross(t0, t1, t2, v0, v1, v2)
    g0, g1, g2 = cross(t0, t1, t2, p[0] - o[0], p[1] - o[1], p[2] - o[2])  # t·(omega × drho) = drho·(t × omega)
    add_by_rim(model, P_a, P_b, k, r, g0, g1, g2, N0, N1, N2, n0, n1, n2, c, s)


@inner
def rim_rates(work, a, b, N0, N1, N2, n0, n1, n2):
    """Return the rates of N and n, and of c: seven numbers."""
    o, p = work.markers.omega[a], work.markers.omega[b]
    x0, x1, x2 = cross(o[0], o[1], o[2], N0, N1, N2)
    y0, y1, y2 = cross(p[0], p[1], p[2], n0, n1, n2)
    return x0, x1, x2, y0, y1, y2, dot(x0, x1, x2, n0, n1, n2) + dot(N0, N1, N2, y0, y1, y2)


@inner
def rolling_rate(model, work, k, a, b):
    """Return the rate of a row RIM_HEIGHT; of ROLL what it holds, the velocity."""
    if model.rows.kind[k] != RIM_HEIGHT:
        return rolling_row(model, work, k, a, b, work.state.w, 1.0)
    N0, N1, N2, n0, n1, n2, c, s, _, _, _ = rim(model, work, k, a, b)
    X0, X1, X2, _, _, _, c_dot = rim_rates(work, a, b, N0, N1, N2, n0, n1, n2)
    d0, d1, d2 = distance(work, a, b)
    v0, v1, v2 = (
        work.markers.v[b, 0] - work.markers.v[a, 0],
        work.markers.v[b, 1] - work.markers.v[a, 1],
        work.markers.v[b, 2] - work.markers.v[a, 2],
    )
    return dot(N0, N1, N2, v0, v1, v2) + dot(X0, X1, X2, d0, d1, d2) + model.rows.c[k] * c * c_dot / s


@inner
def turned_twice(o, al0, al1, al2, x0, x1, x2):
    """Return al × x + o × (o × x)."""
    y0, y1, y2 = cross(o[0], o[1], o[2], x0, x1, x2)
    z0, z1, z2 = cross(o[0], o[1], o[2], y0, y1, y2)
    a0, a1, a2 = cross(al0, al1, al2, x0, x1, x2)
    return a0 + z0, a1 + z1, a2 + z2


@inner
def rolling_acceleration(model, work, k, a, b, bias_a, bias_b):
    """Return the second rate of RIM_HEIGHT, the first of ROLL, for given accelerations (6) of both markers."""
    N0, N1, N2, n0, n1, n2, c, s, rho0, rho1, rho2 = rim(model, work, k, a, b)
    X0, X1, X2, Y0, Y1, Y2, c_dot = rim_rates(work, a, b, N0, N1, N2, n0, n1, n2)
    o, p, x = work.markers.omega[a], work.markers.omega[b], model.rows.x[k]
    d0, d1, d2 = distance(work, a, b)
    v0, v1, v2 = (
        work.markers.v[b, 0] - work.markers.v[a, 0],
        work.markers.v[b, 1] - work.markers.v[a, 1],
        work.markers.v[b, 2] - work.markers.v[a, 2],
    )
    h0, h1, h2 = bias_b[0] - bias_a[0], bias_b[1] - bias_a[1], bias_b[2] - bias_a[2]
    R = model.rows.c[k]
    if model.rows.kind[k] == RIM_HEIGHT:
        XX0, XX1, XX2 = turned_twice(o, bias_a[3], bias_a[4], bias_a[5], N0, N1, N2)
        YY0, YY1, YY2 = turned_twice(p, bias_b[3], bias_b[4], bias_b[5], n0, n1, n2)
        c_ddot = dot(XX0, XX1, XX2, n0, n1, n2) + 2 * dot(X0, X1, X2, Y0, Y1, Y2) + dot(N0, N1, N2, YY0, YY1, YY2)
        s_ddot = -(c_dot * c_dot + c * c_ddot) / s - c * c * c_dot * c_dot / (s * s * s)
        along = dot(XX0, XX1, XX2, d0, d1, d2) + 2 * dot(X0, X1, X2, v0, v1, v2) + dot(N0, N1, N2, h0, h1, h2)
        return along - R * s_ddot
    # rho_dot = -R u_dot, u_dot = (N_dot - c_dot n - c n_dot)/s + u c c_dot/s²
    f, g = -R / s, c * c_dot / (s * s)
    q0 = f * (X0 - c_dot * n0 - c * Y0) + g * rho0
    q1 = f * (X1 - c_dot * n1 - c * Y1) + g * rho1
    q2 = f * (X2 - c_dot * n2 - c * Y2) + g * rho2
    t0, t1, t2 = rotate(work.markers.A[a], x[0], x[1], x[2])
    T0, T1, T2 = cross(o[0], o[1], o[2], t0, t1, t2)
    V0, V1, V2 = rim_velocity(work, a, b, rho0, rho1, rho2)
    w0, w1, w2 = cross(p[0], p[1], p[2], q0, q1, q2)
    y0, y1, y2 = cross(bias_b[3], bias_b[4], bias_b[5], rho0, rho1, rho2)
    m0, m1, m2 = cross(o[0], o[1], o[2], v0 + q0, v1 + q1, v2 + q2)
    z0, z1, z2 = cross(bias_a[3], bias_a[4], bias_a[5], d0 + rho0, d1 + rho1, d2 + rho2)
    return dot(T0, T1, T2, V0, V1, V2) + dot(
        t0, t1, t2, h0 + y0 + w0 - z0 - m0, h1 + y1 + w1 - z1 - m1, h2 + y2 + w2 - z2 - m2
    )
