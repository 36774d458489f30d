"""A point that slides along the deformed centre line of a flexible body.

The line leads along e (unit, body axes) through the markers of stations at s_1 < s_2 < …. Between two of them cubic
Hermite functions of xi = (s - s_1)/h carry their displacement d and rotation th:

    D(s) = a_1 d_1 + a_2 d_2 + b_1 th_1 × e + b_2 th_2 × e,   r = c(s) + D,   r' = e + D'
    th(s) = e × D' + e (e · (l_1 th_1 + l_2 th_2)),   l linear: sections stay normal to the line

Beyond the ends the line is straight. The sliding marker is where B is: (r_B - r)·r' = 0, or where its drive says; all
that the marker needs (displacement, rotation, their rates and their derivatives by q) is the same combination of
those of the stations. With n_0 = r'/|r'|, n_1 and n_2 normal to it, d = r_B - r and kappa the turning of its axes by s,

    LINE i       n_i · d = 0                           i = 1, 2; i = 0 if it is driven
    LINE_TURN    E · D = 0 as DOT, where A also turns with kappa s_dot
    LINE_FREE    n_0 · F + kappa · M / |r'| = 0        no force along the line: the wrench does no work as s changes

The places on A where a force acts and n_i turn with s; their change is left out of the tangent, where it is of the
order of the reaction times the curvature, but not of the residual.
"""

import math

from floatframe.joints.rows import LINE, LINE_TURN, MOMENT
from floatframe.kernels.compiler.compilation import inner
from floatframe.kernels.connections.relative_motion import distance, prescribed, put_pair
from floatframe.kernels.marker import cross, pose_on_body, rotate, rotate_back
from floatframe.kernels.rotation import left_jacobian
from floatframe.kernels.vector import put_matrix, vector

__all__ = [
    "line_acceleration", "line_derivatives", "line_rate", "line_row", "line_turn_by_place", "slide_marker",
]  # fmt: skip

MOST, CLOSE = 30, 1e-14


@inner
def dot(a0, a1, a2, b0, b1, b2):
    """Return a · b."""
    return a0 * b0 + a1 * b1 + a2 * b2


@inner
def piece(model, k, s):
    """Return the first of the two stations about s and their distance; before or after the line: the nearest piece."""
    j, last = model.lines.station0[k], model.lines.station0[k + 1] - 2
    while j < last and s > model.stations.s[j + 1]:
        j += 1
    return j, model.stations.s[j + 1] - model.stations.s[j]


@inner
def weights(model, k, j, h, s, order):
    """Return a_1, a_2, b_1, b_2 or their derivatives by s."""
    x = (s - model.stations.s[j]) / h
    if x < 0.0 or x > 1.0:
        end = 1.0 if x > 1.0 else 0.0
        by_slope = s - model.stations.s[j] - end * h if order == 0 else (1.0 if order == 1 else 0.0)
        own = 1.0 if order == 0 else 0.0
        return own * (1.0 - end), own * end, by_slope * (1.0 - end), by_slope * end
    if order == 0:
        a = x * x * (3 - 2 * x)
        return 1.0 - a, a, h * x * (1 - x) * (1 - x), h * x * x * (x - 1)
    if order == 1:
        a = 6 * x * (1 - x) / h
        return -a, a, 1 + x * (3 * x - 4), x * (3 * x - 2)
    a = (6 - 12 * x) / (h * h)
    return -a, a, (6 * x - 4) / h, (6 * x - 2) / h


@inner
def linear_weight(model, j, h, s):
    """Return l_2 and its derivative."""
    x = (s - model.stations.s[j]) / h
    if x < 0.0:
        return 0.0, 0.0
    if x > 1.0:
        return 1.0, 0.0
    return x, 1.0 / h


@inner
def combined(e, a1, a2, b1, b2, d1, th1, d2, th2):
    """Return a_1 d_1 + a_2 d_2 + (b_1 th_1 + b_2 th_2) × e as three numbers."""
    t0, t1, t2 = b1 * th1[0] + b2 * th2[0], b1 * th1[1] + b2 * th2[1], b1 * th1[2] + b2 * th2[2]
    x0, x1, x2 = cross(t0, t1, t2, e[0], e[1], e[2])
    return a1 * d1[0] + a2 * d2[0] + x0, a1 * d1[1] + a2 * d2[1] + x1, a1 * d1[2] + a2 * d2[2] + x2


@inner
def displacement(model, work, k, s, order):
    """Return D, D' or D'' at s, body axes."""
    j, h = piece(model, k, s)
    a1, a2, b1, b2 = weights(model, k, j, h, s, order)
    m1, m2, e = model.stations.marker[j], model.stations.marker[j + 1], model.lines.axis[k]
    c1, c2 = model.markers.position[m1], model.markers.position[m2]
    x0, x1, x2 = combined(
        e, a1, a2, b1, b2, work.markers.rho[m1], work.markers.angle[m1], work.markers.rho[m2], work.markers.angle[m2]
    )
    return (
        x0 - a1 * c1[0] - a2 * c2[0],
        x1 - a1 * c1[1] - a2 * c2[1],
        x2 - a1 * c1[2] - a2 * c2[2],
    )


@inner
def place_of(model, work, k, b):
    """Return the place s nearest to the point of marker b."""
    m, e = model.lines.marker[k], model.lines.axis[k]
    i = model.markers.body[m]
    c = model.markers.position[m]  # of s = 0
    x0, x1, x2 = (
        work.markers.r[b, 0] - work.state.r[i, 0],
        work.markers.r[b, 1] - work.state.r[i, 1],
        work.markers.r[b, 2] - work.state.r[i, 2],
    )
    x0, x1, x2 = rotate_back(work.state.R[i], x0, x1, x2)
    x0, x1, x2 = x0 - c[0], x1 - c[1], x2 - c[2]
    s = dot(x0, x1, x2, e[0], e[1], e[2])
    length = model.stations.s[model.lines.station0[k + 1] - 1]
    for _ in range(MOST):
        d0, d1, d2 = displacement(model, work, k, s, 0)
        t0, t1, t2 = displacement(model, work, k, s, 1)
        u0, u1, u2 = displacement(model, work, k, s, 2)
        t0, t1, t2 = t0 + e[0], t1 + e[1], t2 + e[2]
        g0, g1, g2 = x0 - s * e[0] - d0, x1 - s * e[1] - d1, x2 - s * e[2] - d2
        slope = dot(t0, t1, t2, t0, t1, t2) - dot(g0, g1, g2, u0, u1, u2)
        change = dot(g0, g1, g2, t0, t1, t2) / slope
        s += change
        if abs(change) <= CLOSE * length:
            break
    return s


@inner
def slide_marker(model, work, k):
    """Put the sliding marker of line k to its place and write its motion; all other markers have theirs."""
    m, b, row = model.lines.marker[k], model.lines.other[k], model.lines.row[k]
    i, e = model.markers.body[m], model.lines.axis[k]
    is_driven = row >= 0
    if is_driven:
        s, rate, _ = prescribed(model, work, row)
    else:
        s, rate = place_of(model, work, k, b), 0.0
    j, h = piece(model, k, s)
    m1, m2 = model.stations.marker[j], model.stations.marker[j + 1]
    w1, by_s = linear_weight(model, j, h, s)
    d0, d1, d2 = displacement(model, work, k, s, 0)
    t0, t1, t2 = displacement(model, work, k, s, 1)
    u0, u1, u2 = displacement(model, work, k, s, 2)
    rho, rho_dot, angle, angle_dot = (
        work.markers.rho[m],
        work.markers.rho_dot[m],
        work.markers.angle[m],
        work.markers.angle_dot[m],
    )
    c = model.markers.position[m]
    rho[0], rho[1], rho[2] = c[0] + s * e[0] + d0, c[1] + s * e[1] + d1, c[2] + s * e[2] + d2
    th1, th2 = work.markers.angle[m1], work.markers.angle[m2]
    twist = (1 - w1) * dot(e[0], e[1], e[2], th1[0], th1[1], th1[2]) + w1 * dot(
        e[0], e[1], e[2], th2[0], th2[1], th2[2]
    )
    twist_s = by_s * dot(e[0], e[1], e[2], th2[0] - th1[0], th2[1] - th1[1], th2[2] - th1[2])
    x0, x1, x2 = cross(e[0], e[1], e[2], t0, t1, t2)
    angle[0], angle[1], angle[2] = x0 + twist * e[0], x1 + twist * e[1], x2 + twist * e[2]
    p0, p1, p2 = cross(e[0], e[1], e[2], u0, u1, u2)
    p0, p1, p2 = p0 + twist_s * e[0], p1 + twist_s * e[1], p2 + twist_s * e[2]  # th'
    # rates
    a1, a2, b1, b2 = weights(model, k, j, h, s, 0)
    rho_dot[0], rho_dot[1], rho_dot[2] = combined(
        e,
        a1,
        a2,
        b1,
        b2,
        work.markers.rho_dot[m1],
        work.markers.angle_dot[m1],
        work.markers.rho_dot[m2],
        work.markers.angle_dot[m2],
    )
    c1, c2, f1, f2 = weights(model, k, j, h, s, 1)
    y0, y1, y2 = combined(
        e,
        c1,
        c2,
        f1,
        f2,
        work.markers.rho_dot[m1],
        work.markers.angle_dot[m1],
        work.markers.rho_dot[m2],
        work.markers.angle_dot[m2],
    )
    o1, o2 = work.markers.angle_dot[m1], work.markers.angle_dot[m2]
    turn = (1 - w1) * dot(e[0], e[1], e[2], o1[0], o1[1], o1[2]) + w1 * dot(e[0], e[1], e[2], o2[0], o2[1], o2[2])
    x0, x1, x2 = cross(e[0], e[1], e[2], y0, y1, y2)
    angle_dot[0], angle_dot[1], angle_dot[2] = x0 + turn * e[0], x1 + turn * e[1], x2 + turn * e[2]
    put_matrix(work.markers.T_left[m], left_jacobian(vector(angle)))
    spin = work.markers.spin[m]
    spin[0], spin[1], spin[2] = rotate(work.markers.T_left[m], angle_dot[0], angle_dot[1], angle_dot[2])
    shapes(model, work, m, m1, m2, e, (a1, a2, b1, b2), (c1, c2, f1, f2), w1)
    pose_on_body(model, work, m)
    # the line in ground axes
    line, R = work.lines, work.state.R[i]
    t0, t1, t2 = t0 + e[0], t1 + e[1], t2 + e[2]
    slope = math.sqrt(dot(t0, t1, t2, t0, t1, t2))
    n0, n1, n2 = rotate(R, t0 / slope, t1 / slope, t2 / slope)
    if not is_driven:
        v = work.markers.v
        rate = dot(n0, n1, n2, v[b, 0] - v[m, 0], v[b, 1] - v[m, 1], v[b, 2] - v[m, 2]) / slope
    line.s[k], line.s_dot[k], line.slope[k], line.by_place[k] = s, rate, slope, 0.0 if is_driven else 1.0 / slope
    line.n_0[k, 0], line.n_0[k, 1], line.n_0[k, 2] = n0, n1, n2
    p0, p1, p2 = rotate(work.markers.T_left[m], p0, p1, p2)
    line.kappa[k, 0], line.kappa[k, 1], line.kappa[k, 2] = rotate(R, p0, p1, p2)
    line.curve[k, 0], line.curve[k, 1], line.curve[k, 2] = rotate(R, u0, u1, u2)
    u = model.bodies.u0[i] + 3
    x0, x1, x2 = cross(work.state.u[u], work.state.u[u + 1], work.state.u[u + 2], t0, t1, t2)
    line.slope_dot[k, 0], line.slope_dot[k, 1], line.slope_dot[k, 2] = rotate(R, x0 + y0, x1 + y1, x2 + y2)


@inner
def shapes(model, work, m, m1, m2, e, value, slope, w):
    """Write the derivatives of displacement and rotation of the sliding marker by q."""
    n, o, o1, o2 = (
        model.bodies.n_q[model.markers.body[m]],
        model.markers.psi0[m],
        model.markers.psi0[m1],
        model.markers.psi0[m2],
    )
    own, first, second = (
        work.markers.psi[o : o + 6 * n],
        work.markers.psi[o1 : o1 + 6 * n],
        work.markers.psi[o2 : o2 + 6 * n],
    )
    for q in range(n):
        d1, d2 = (first[q], first[n + q], first[2 * n + q]), (second[q], second[n + q], second[2 * n + q])
        th1 = (first[3 * n + q], first[4 * n + q], first[5 * n + q])
        th2 = (second[3 * n + q], second[4 * n + q], second[5 * n + q])
        x0, x1, x2 = combined(e, value[0], value[1], value[2], value[3], d1, th1, d2, th2)
        t0, t1, t2 = combined(e, slope[0], slope[1], slope[2], slope[3], d1, th1, d2, th2)
        y0, y1, y2 = cross(e[0], e[1], e[2], t0, t1, t2)
        twist = (1 - w) * dot(e[0], e[1], e[2], th1[0], th1[1], th1[2]) + w * dot(
            e[0], e[1], e[2], th2[0], th2[1], th2[2]
        )
        own[q], own[n + q], own[2 * n + q] = x0, x1, x2
        own[3 * n + q], own[4 * n + q], own[5 * n + q] = y0 + twist * e[0], y1 + twist * e[1], y2 + twist * e[2]


@inner
def normal(model, work, row, a):
    """Return n_i of row k, ground axes: 0 along the line, 1 nearest to y of the marker, 2 across both."""
    i, line, part = model.markers.line[a], work.lines, model.rows.part[row]
    n0, n1, n2 = line.n_0[i, 0], line.n_0[i, 1], line.n_0[i, 2]
    if part == 0:
        return n0, n1, n2
    A = work.markers.A[a]
    along = dot(A[0, 1], A[1, 1], A[2, 1], n0, n1, n2)
    y0, y1, y2 = A[0, 1] - along * n0, A[1, 1] - along * n1, A[2, 1] - along * n2
    size = math.sqrt(dot(y0, y1, y2, y0, y1, y2))
    y0, y1, y2 = y0 / size, y1 / size, y2 / size
    if part == 1:
        return y0, y1, y2
    return cross(n0, n1, n2, y0, y1, y2)


@inner
def free_moment(model, work, a):
    """Return kappa / |r'|, ground axes."""
    i, line = model.markers.line[a], work.lines
    f = 1.0 / line.slope[i]
    return f * line.kappa[i, 0], f * line.kappa[i, 1], f * line.kappa[i, 2]


@inner
def line_row(model, work, k, a, b, w, c_k):
    """Return the residual of a row LINE or LINE_FREE."""
    if model.rows.kind[k] == LINE:
        n0, n1, n2 = normal(model, work, k, a)
        r0, r1, r2 = distance(work, a, b)
        held = dot(n0, n1, n2, r0, r1, r2)
        return held - model.rows.soft[k] * c_k * dot(n0, n1, n2, w[0], w[1], w[2])
    i, line = model.markers.line[a], work.lines
    total = dot(line.n_0[i, 0], line.n_0[i, 1], line.n_0[i, 2], w[0], w[1], w[2])
    if model.markers.moment[a] >= 0:
        m0, m1, m2 = free_moment(model, work, a)
        total += dot(m0, m1, m2, w[MOMENT], w[MOMENT + 1], w[MOMENT + 2])
    return c_k * total


@inner
def line_derivatives(model, work, k, r, a, b, w, c_k, P_a, P_b, V):
    """Write row r of P and V of a row LINE or LINE_FREE."""
    if model.rows.kind[k] == LINE:
        n0, n1, n2 = normal(model, work, k, a)
        put_pair(P_a, P_b, r, 0, -1.0, n0, n1, n2)
        f = -model.rows.soft[k]
        V[r, 0], V[r, 1], V[r, 2] = f * n0, f * n1, f * n2
        return
    i, line = model.markers.line[a], work.lines
    n0, n1, n2 = line.n_0[i, 0], line.n_0[i, 1], line.n_0[i, 2]
    V[r, 0], V[r, 1], V[r, 2] = n0, n1, n2
    x0, x1, x2 = cross(n0, n1, n2, w[0], w[1], w[2])
    if model.markers.moment[a] >= 0:
        m0, m1, m2 = free_moment(model, work, a)
        V[r, MOMENT], V[r, MOMENT + 1], V[r, MOMENT + 2] = m0, m1, m2
        y0, y1, y2 = cross(m0, m1, m2, w[MOMENT], w[MOMENT + 1], w[MOMENT + 2])
        x0, x1, x2 = x0 + y0, x1 + y1, x2 + y2
    P_a[r, 3], P_a[r, 4], P_a[r, 5] = c_k * x0, c_k * x1, c_k * x2


@inner
def line_turn_by_place(model, work, r, a, n0, n1, n2, P_a, P_b):
    """Write the part of row r that comes by s, which follows the points: n = E × D."""
    i, line = model.markers.line[a], work.lines
    f = -line.by_place[i] * dot(n0, n1, n2, line.kappa[i, 0], line.kappa[i, 1], line.kappa[i, 2])
    put_pair(P_a, P_b, r, 0, f, line.n_0[i, 0], line.n_0[i, 1], line.n_0[i, 2])


@inner
def line_rate(model, work, k, a, b):
    """Return the rate of the held quantity of a row LINE or LINE_TURN."""
    i, line, v = model.markers.line[a], work.lines, work.markers.v
    if model.rows.kind[k] == LINE_TURN:
        x, y, o, p = model.rows.x[k], model.rows.y[k], work.markers.omega[a], work.markers.omega[b]
        e0, e1, e2 = rotate(work.markers.A[a], x[0], x[1], x[2])
        d0, d1, d2 = rotate(work.markers.A[b], y[0], y[1], y[2])
        n0, n1, n2 = cross(e0, e1, e2, d0, d1, d2)
        s_dot = line.s_dot[i]
        return dot(
            n0, n1, n2,
            o[0] - p[0] + s_dot * line.kappa[i, 0], o[1] - p[1] + s_dot * line.kappa[i, 1],
            o[2] - p[2] + s_dot * line.kappa[i, 2],
        )  # fmt: skip
    n0, n1, n2 = normal(model, work, k, a)
    rate = dot(n0, n1, n2, v[b, 0] - v[a, 0], v[b, 1] - v[a, 1], v[b, 2] - v[a, 2])
    if model.rows.part[k] == 0:
        rate -= line.s_dot[i] * line.slope[i]
    return rate


@inner
def line_acceleration(model, work, k, a, b, bias_a, bias_b):
    """Return the second rate of the held quantity for given accelerations (6) of both markers, A fixed in the line.

    r_ddot of the place = a + 2 s_dot r'_dot + s_dot² r'' + s_ddot r'. Of LINE_TURN the change of kappa with time and
    place is left out.
    """
    i, line = model.markers.line[a], work.lines
    s_dot = line.s_dot[i]
    x0 = bias_b[0] - bias_a[0] - 2 * s_dot * line.slope_dot[i, 0] - s_dot * s_dot * line.curve[i, 0]
    x1 = bias_b[1] - bias_a[1] - 2 * s_dot * line.slope_dot[i, 1] - s_dot * s_dot * line.curve[i, 1]
    x2 = bias_b[2] - bias_a[2] - 2 * s_dot * line.slope_dot[i, 2] - s_dot * s_dot * line.curve[i, 2]
    row = model.lines.row[model.markers.line[a]]
    second = line.by_place[i] * dot(line.n_0[i, 0], line.n_0[i, 1], line.n_0[i, 2], x0, x1, x2)
    if row >= 0:
        _, _, second = prescribed(model, work, row)
    if model.rows.kind[k] == LINE:
        n0, n1, n2 = normal(model, work, k, a)
        held = dot(n0, n1, n2, x0, x1, x2)
        return held - second * line.slope[i] if model.rows.part[k] == 0 else held
    x, y, o, p = model.rows.x[k], model.rows.y[k], work.markers.omega[a], work.markers.omega[b]
    k0, k1, k2 = line.kappa[i, 0], line.kappa[i, 1], line.kappa[i, 2]
    o0, o1, o2 = o[0] + s_dot * k0, o[1] + s_dot * k1, o[2] + s_dot * k2
    e0, e1, e2 = rotate(work.markers.A[a], x[0], x[1], x[2])
    d0, d1, d2 = rotate(work.markers.A[b], y[0], y[1], y[2])
    n0, n1, n2 = cross(e0, e1, e2, d0, d1, d2)
    q0, q1, q2 = cross(o[0], o[1], o[2], k0, k1, k2)
    turning = dot(
        n0, n1, n2,
        bias_a[3] - bias_b[3] + second * k0 + s_dot * q0, bias_a[4] - bias_b[4] + second * k1 + s_dot * q1,
        bias_a[5] - bias_b[5] + second * k2 + s_dot * q2,
    )  # fmt: skip
    f0, f1, f2 = cross(o0, o1, o2, e0, e1, e2)
    g0, g1, g2 = cross(o0, o1, o2, f0, f1, f2)
    h0, h1, h2 = cross(p[0], p[1], p[2], d0, d1, d2)
    i0, i1, i2 = cross(p[0], p[1], p[2], h0, h1, h2)
    return turning + dot(g0, g1, g2, d0, d1, d2) + 2 * dot(f0, f1, f2, h0, h1, h2) + dot(e0, e1, e2, i0, i1, i2)
