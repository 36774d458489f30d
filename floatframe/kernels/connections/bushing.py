"""A bushing: force and torque of a potential of six deformations between two markers, with damping.

Half of the rotation of B against A takes A to the middle axes C, so that A and B can be exchanged. With d = r_B - r_A
and theta the rotation vector of A_Aᵀ A_B (|theta| < pi; its components are the same in A, B and C)

    e = Cᵀ d,  xi = (e, theta),  (f, m) = dV/dxi + D xi_dot,  V = 1/2 xiᵀ K xi + preload · xi + tables of each xi_i

Variations in the axes of C, a and b the rotations of A and B, u = b - a:

    dtheta = S u,   S = alpha 1 + beta theta thetaᵀ,   alpha = (t/2)/sin(t/2), beta = (1 - alpha)/t²,  t = |theta|
    dc = (a + b)/2 - tau theta × u,   tau = tan(t/4)/(2 t)            the rotation of C
    de = Cᵀ dd + e × dc

so that by virtual work, with p = f × e,  F = C f is the force on A (on B the opposite), and the moments are

    on A:  M = C (-p/2 + tau theta × p + S m)        on B:  -N = -C (p/2 + tau theta × p + S m)

`bushing_variation` gives the exact change of F, M and N; rates follow the same formulas with velocities for variations.
"""

import math

from floatframe.kernels.compiler.compilation import inner
from floatframe.kernels.connections.time_function import time_function
from floatframe.kernels.marker import cross, rotate, rotate_back
from floatframe.kernels.rotation import exp_matrix
from floatframe.kernels.vector import product, put_matrix

__all__ = ["bushing_energy", "bushing_power", "bushing_state", "bushing_variation"]

# places in work.pair.numbers; C is the first nine
E, THETA, Y, OMEGA, MEAN, GAMMA, E_DOT, THETA_DOT, F, M, P, SCALARS, SLOPE = (
    9,
    12,
    15,
    18,
    21,
    24,
    27,
    30,
    33,
    36,
    39,
    42,
    48,
)
LAW, INPUT, OUTPUT = 60, 72, 90  # results: F, M, N; variations: dd, a, b, dv, domega_A, domega_B; their F, M, N
SERIES_BELOW = 0.01  # t² at the switch
A1, A2, A3, A4, A5 = 1 / 24, 7 / 5760, 31 / 967680, 127 / 154828800, 73 / 3503554560  # of alpha - 1 in t²


@inner
def dot(a0, a1, a2, b0, b1, b2):
    """Return a · b."""
    return a0 * b0 + a1 * b1 + a2 * b2


@inner
def three(s, k):
    """Return three numbers from place k on."""
    return s[k], s[k + 1], s[k + 2]


@inner
def put(s, k, x0, x1, x2):
    """Write three numbers from place k on."""
    s[k], s[k + 1], s[k + 2] = x0, x1, x2


@inner
def rotation_vector(A, B):
    """Return the rotation vector of Aᵀ B, no longer than pi."""
    x, y, z, w = 0.0, 0.0, 0.0, 1.0
    for k in range(3):
        w += A[k, 0] * B[k, 0] + A[k, 1] * B[k, 1] + A[k, 2] * B[k, 2]
        x += A[k, 2] * B[k, 1] - A[k, 1] * B[k, 2]
        y += A[k, 0] * B[k, 2] - A[k, 2] * B[k, 0]
        z += A[k, 1] * B[k, 0] - A[k, 0] * B[k, 1]
    if w < 1.0:  # more than 90 degrees: x from the symmetric part, x² = (1 + R00 - R11 - R22)/4 and so on
        squares = (0.0, 0.0, 0.0)
        trace = w - 1.0
        r00, r11, r22, s01, s02, s12 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(3):
            r00 += A[k, 0] * B[k, 0]
            r11 += A[k, 1] * B[k, 1]
            r22 += A[k, 2] * B[k, 2]
            s01 += A[k, 0] * B[k, 1] + A[k, 1] * B[k, 0]
            s02 += A[k, 0] * B[k, 2] + A[k, 2] * B[k, 0]
            s12 += A[k, 1] * B[k, 2] + A[k, 2] * B[k, 1]
        squares = (1 + 2 * r00 - trace, 1 + 2 * r11 - trace, 1 + 2 * r22 - trace)  # 4 x², 4 y², 4 z²
        twist = (x, y, z)  # 4 w times x, y, z
        if squares[0] >= squares[1] and squares[0] >= squares[2]:
            x, y, z, w = squares[0], s01, s02, twist[0]
        elif squares[1] >= squares[2]:
            x, y, z, w = s01, squares[1], s12, twist[1]
        else:
            x, y, z, w = s02, s12, squares[2], twist[2]
        if w < 0.0:
            x, y, z, w = -x, -y, -z, -w
    length = math.sqrt(x * x + y * y + z * z)
    factor = 2.0 * math.atan2(length, w) / length if length > 0.0 else 0.0
    return factor * x, factor * y, factor * z


@inner
def scalars(t2):
    """Return alpha, beta, alpha'/t, beta'/t, tau, tau'/t of t²."""
    if t2 < SERIES_BELOW:
        y2 = t2 / 16
        return (
            1 + t2 * (A1 + t2 * (A2 + t2 * (A3 + t2 * (A4 + t2 * A5)))),
            -(A1 + t2 * (A2 + t2 * (A3 + t2 * (A4 + t2 * A5)))),
            2 * A1 + t2 * (4 * A2 + t2 * (6 * A3 + t2 * (8 * A4 + t2 * 10 * A5))),
            -(2 * A2 + t2 * (4 * A3 + t2 * (6 * A4 + t2 * 8 * A5))),
            (1 + y2 * (1 / 3 + y2 * (2 / 15 + y2 * (17 / 315 + y2 * 62 / 2835)))) / 8,
            (2 / 3 + y2 * (8 / 15 + y2 * (102 / 315 + y2 * 496 / 2835))) / 128,
        )
    t = math.sqrt(t2)
    x, y = t / 2, t / 4
    s, c = math.sin(x), math.cos(x)
    alpha = x / s
    beta = (1 - alpha) / t2
    by_t = 0.5 * (s - x * c) / (s * s * t)
    tan = math.tan(y)
    return alpha, beta, by_t, -(by_t + 2 * beta) / t2, tan / (2 * t), ((1 + tan * tan) / y - tan / (y * y)) / (32 * t)


@inner
def by_S(s, u0, u1, u2):
    """Return S u."""
    t0, t1, t2 = three(s, THETA)
    f = s[SCALARS + 1] * dot(t0, t1, t2, u0, u1, u2)
    alpha = s[SCALARS]
    return alpha * u0 + f * t0, alpha * u1 + f * t1, alpha * u2 + f * t2


@inner
def by_dS(s, k, h0, h1, h2, u0, u1, u2):
    """Return dS u for dtheta = h and k = theta · h."""
    t0, t1, t2 = three(s, THETA)
    beta, a, b = s[SCALARS + 1], s[SCALARS + 2] * k, s[SCALARS + 3] * k
    along = dot(t0, t1, t2, u0, u1, u2)
    f = b * along + beta * dot(h0, h1, h2, u0, u1, u2)
    g = beta * along
    return a * u0 + f * t0 + g * h0, a * u1 + f * t1 + g * h1, a * u2 + f * t2 + g * h2


@inner
def law_of(K, x0, x1, x2, y0, y1, y2, r):
    """Return component r of K (x, y)."""
    row = K[r]
    return row[0] * x0 + row[1] * x1 + row[2] * x2 + row[3] * y0 + row[4] * y1 + row[5] * y2


@inner
def bushing_state(model, work, c):
    """Write all that follows from the motion of the markers of bushing c into work.pair.numbers."""
    a, b, s, K = (
        model.connections.a[c],
        model.connections.b[c],
        work.pair.numbers,
        model.bushings.stiffness[model.connections.item[c]],
    )
    D, preload = model.bushings.damping[model.connections.item[c]], model.bushings.preload[model.connections.item[c]]
    A, B = work.markers.A[a], work.markers.A[b]
    t0, t1, t2 = rotation_vector(A, B)
    put(s, THETA, t0, t1, t2)
    C = s[:9].reshape((3, 3))
    put_matrix(C, product(A, exp_matrix((0.5 * t0, 0.5 * t1, 0.5 * t2))))
    alpha, beta, alpha_1, beta_1, tau, tau_1 = scalars(t0 * t0 + t1 * t1 + t2 * t2)
    put(s, SCALARS, alpha, beta, alpha_1)
    put(s, SCALARS + 3, beta_1, tau, tau_1)
    d, v, o, q = work.markers.r, work.markers.v, work.markers.omega[a], work.markers.omega[b]
    e0, e1, e2 = rotate_back(C, d[b, 0] - d[a, 0], d[b, 1] - d[a, 1], d[b, 2] - d[a, 2])
    y0, y1, y2 = rotate_back(C, v[b, 0] - v[a, 0], v[b, 1] - v[a, 1], v[b, 2] - v[a, 2])
    u0, u1, u2 = rotate_back(C, q[0] - o[0], q[1] - o[1], q[2] - o[2])
    n0, n1, n2 = rotate_back(C, 0.5 * (q[0] + o[0]), 0.5 * (q[1] + o[1]), 0.5 * (q[2] + o[2]))
    x0, x1, x2 = cross(t0, t1, t2, u0, u1, u2)
    g0, g1, g2 = n0 - tau * x0, n1 - tau * x1, n2 - tau * x2
    x0, x1, x2 = cross(e0, e1, e2, g0, g1, g2)
    ed0, ed1, ed2 = y0 + x0, y1 + x1, y2 + x2
    td0, td1, td2 = by_S(s, u0, u1, u2)
    put(s, E, e0, e1, e2)
    put(s, Y, y0, y1, y2)
    put(s, OMEGA, u0, u1, u2)
    put(s, MEAN, n0, n1, n2)
    put(s, GAMMA, g0, g1, g2)
    put(s, E_DOT, ed0, ed1, ed2)
    put(s, THETA_DOT, td0, td1, td2)
    for r in range(6):
        value = law_of(K, e0, e1, e2, t0, t1, t2, r) + law_of(D, ed0, ed1, ed2, td0, td1, td2, r) + preload[r]
        s[SLOPE + r] = 0.0
        table = model.bushings.table[model.connections.item[c], r]
        if table >= 0:
            own, slope, _ = time_function(model, table, s[E + r])
            value += own
            s[SLOPE + r] = slope
        s[F + r] = value
    f0, f1, f2 = three(s, F)
    p0, p1, p2 = cross(f0, f1, f2, e0, e1, e2)
    put(s, P, p0, p1, p2)
    h0, h1, h2 = cross(t0, t1, t2, p0, p1, p2)
    m0, m1, m2 = by_S(s, s[M], s[M + 1], s[M + 2])
    h0, h1, h2 = tau * h0 + m0, tau * h1 + m1, tau * h2 + m2
    x0, x1, x2 = rotate(C, f0, f1, f2)
    put(s, LAW, x0, x1, x2)
    x0, x1, x2 = rotate(C, h0 - 0.5 * p0, h1 - 0.5 * p1, h2 - 0.5 * p2)
    put(s, LAW + 3, x0, x1, x2)
    x0, x1, x2 = rotate(C, h0 + 0.5 * p0, h1 + 0.5 * p1, h2 + 0.5 * p2)
    put(s, LAW + 6, x0, x1, x2)


@inner
def bushing_variation(model, work, c):
    """Write the change of F, M, N for the variation of the motion in work.pair.numbers, ground axes."""
    s, K = work.pair.numbers, model.bushings.stiffness[model.connections.item[c]]
    D = model.bushings.damping[model.connections.item[c]]
    C = s[:9].reshape((3, 3))
    tau, tau_1 = s[SCALARS + 4], s[SCALARS + 5]
    e0, e1, e2 = three(s, E)
    t0, t1, t2 = three(s, THETA)
    w0, w1, w2 = three(s, OMEGA)
    g0, g1, g2 = three(s, GAMMA)
    d0, d1, d2 = rotate_back(C, s[INPUT], s[INPUT + 1], s[INPUT + 2])
    a0, a1, a2 = rotate_back(C, s[INPUT + 3], s[INPUT + 4], s[INPUT + 5])
    b0, b1, b2 = rotate_back(C, s[INPUT + 6], s[INPUT + 7], s[INPUT + 8])
    v0, v1, v2 = rotate_back(C, s[INPUT + 9], s[INPUT + 10], s[INPUT + 11])
    oa0, oa1, oa2 = rotate_back(C, s[INPUT + 12], s[INPUT + 13], s[INPUT + 14])
    ob0, ob1, ob2 = rotate_back(C, s[INPUT + 15], s[INPUT + 16], s[INPUT + 17])
    u0, u1, u2 = b0 - a0, b1 - a1, b2 - a2
    x0, x1, x2 = cross(t0, t1, t2, u0, u1, u2)
    c0, c1, c2 = 0.5 * (a0 + b0) - tau * x0, 0.5 * (a1 + b1) - tau * x1, 0.5 * (a2 + b2) - tau * x2
    h0, h1, h2 = by_S(s, u0, u1, u2)
    k = dot(t0, t1, t2, h0, h1, h2)
    x0, x1, x2 = cross(e0, e1, e2, c0, c1, c2)
    de0, de1, de2 = d0 + x0, d1 + x1, d2 + x2
    # rates
    x0, x1, x2 = cross(s[Y], s[Y + 1], s[Y + 2], c0, c1, c2)
    dy0, dy1, dy2 = v0 + x0, v1 + x1, v2 + x2
    x0, x1, x2 = cross(w0, w1, w2, c0, c1, c2)
    dw0, dw1, dw2 = ob0 - oa0 + x0, ob1 - oa1 + x1, ob2 - oa2 + x2
    x0, x1, x2 = cross(s[MEAN], s[MEAN + 1], s[MEAN + 2], c0, c1, c2)
    n0, n1, n2 = 0.5 * (oa0 + ob0) + x0, 0.5 * (oa1 + ob1) + x1, 0.5 * (oa2 + ob2) + x2
    x0, x1, x2 = by_S(s, dw0, dw1, dw2)
    y0, y1, y2 = by_dS(s, k, h0, h1, h2, w0, w1, w2)
    dt0, dt1, dt2 = x0 + y0, x1 + y1, x2 + y2
    x0, x1, x2 = cross(t0, t1, t2, w0, w1, w2)
    y0, y1, y2 = cross(h0, h1, h2, w0, w1, w2)
    z0, z1, z2 = cross(t0, t1, t2, dw0, dw1, dw2)
    n0 -= tau_1 * k * x0 + tau * (y0 + z0)
    n1 -= tau_1 * k * x1 + tau * (y1 + z1)
    n2 -= tau_1 * k * x2 + tau * (y2 + z2)
    x0, x1, x2 = cross(de0, de1, de2, g0, g1, g2)
    y0, y1, y2 = cross(e0, e1, e2, n0, n1, n2)
    dd0, dd1, dd2 = dy0 + x0 + y0, dy1 + x1 + y1, dy2 + x2 + y2
    # force and torque in C
    out = s[OUTPUT : OUTPUT + 9]
    change = (de0, de1, de2, h0, h1, h2)
    for r in range(6):
        out[r] = (
            law_of(K, de0, de1, de2, h0, h1, h2, r)
            + law_of(D, dd0, dd1, dd2, dt0, dt1, dt2, r)
            + s[SLOPE + r] * change[r]
        )
    df0, df1, df2 = three(out, 0)
    f0, f1, f2 = three(s, F)
    p0, p1, p2 = three(s, P)
    x0, x1, x2 = cross(df0, df1, df2, e0, e1, e2)
    y0, y1, y2 = cross(f0, f1, f2, de0, de1, de2)
    dp0, dp1, dp2 = x0 + y0, x1 + y1, x2 + y2
    x0, x1, x2 = cross(t0, t1, t2, p0, p1, p2)
    y0, y1, y2 = cross(h0, h1, h2, p0, p1, p2)
    z0, z1, z2 = cross(t0, t1, t2, dp0, dp1, dp2)
    m0, m1, m2 = by_S(s, out[3], out[4], out[5])
    l0, l1, l2 = by_dS(s, k, h0, h1, h2, s[M], s[M + 1], s[M + 2])
    m0 += l0 + tau_1 * k * x0 + tau * (y0 + z0)
    m1 += l1 + tau_1 * k * x1 + tau * (y1 + z1)
    m2 += l2 + tau_1 * k * x2 + tau * (y2 + z2)
    turn_with(C, out, 0, c0, c1, c2, df0, df1, df2, s[LAW], s[LAW + 1], s[LAW + 2])
    turn_with(C, out, 3, c0, c1, c2, m0 - 0.5 * dp0, m1 - 0.5 * dp1, m2 - 0.5 * dp2, s[LAW + 3], s[LAW + 4], s[LAW + 5])
    turn_with(C, out, 6, c0, c1, c2, m0 + 0.5 * dp0, m1 + 0.5 * dp1, m2 + 0.5 * dp2, s[LAW + 6], s[LAW + 7], s[LAW + 8])


@inner
def turn_with(C, out, k, c0, c1, c2, x0, x1, x2, X0, X1, X2):
    """Write C x + (C c) × X from place k on: the change in ground axes of a vector X, x its change in C."""
    g0, g1, g2 = rotate(C, c0, c1, c2)
    y0, y1, y2 = cross(g0, g1, g2, X0, X1, X2)
    x0, x1, x2 = rotate(C, x0, x1, x2)
    put(out, k, x0 + y0, x1 + y1, x2 + y2)


@inner
def bushing_energy(model, work, c):
    """Return 1/2 xiᵀ K xi + preload · xi; tables count as forces, see `bushing_power`."""
    s, K = work.pair.numbers, model.bushings.stiffness[model.connections.item[c]]
    preload = model.bushings.preload[model.connections.item[c]]
    bushing_state(model, work, c)
    total = 0.0
    for r in range(6):
        linear = law_of(K, s[E], s[E + 1], s[E + 2], s[THETA], s[THETA + 1], s[THETA + 2], r)
        total += s[E + r] * (0.5 * linear + preload[r])
    return total


@inner
def bushing_power(model, work, c):
    """Return the power that enters by tables, and that taken by damping."""
    s, D = work.pair.numbers, model.bushings.damping[model.connections.item[c]]
    bushing_state(model, work, c)
    given, taken = 0.0, 0.0
    for r in range(6):
        rate = s[E_DOT + r]
        taken += rate * law_of(
            D, s[E_DOT], s[E_DOT + 1], s[E_DOT + 2], s[THETA_DOT], s[THETA_DOT + 1], s[THETA_DOT + 2], r
        )
        table = model.bushings.table[model.connections.item[c], r]
        if table >= 0:
            value, _, _ = time_function(model, table, s[E + r])
            given -= value * rate
    return given, taken
