"""Residual rows of joints and spring-dampers in terms of the motion of their two markers.

The rows of a connection have its wrench w as unknown (see joints/rows.py). Rows that hold a position are in its unit;
rows that say what the wrench is (GAUGE, SPRING) are multiplied by c_k, so that their unknown is c_k dw:

    GAUGE     e · moment = 0, e = A_A x           derivative by phi_A: e × moment, by the moment: e
    SPRING    F - s d = 0, s = k (l - l_0) + c l_dot + preload, d = (r_B - r_A)/l
"""

import math

from floatframe.joints.rows import DOT, POINT
from floatframe.kernels.compilation import inner
from floatframe.kernels.marker import marker_acceleration_bias, rotate
from floatframe.kernels.rotation import cross

__all__ = ["connection_derivatives", "connection_rows", "constraint_rates", "row_rate", "spring_tension"]


@inner
def spring_line(model, work, c):
    """Return r_B - r_A, v_B - v_A (six numbers) and the length of spring c."""
    a, b = model.c_a[c], model.c_b[c]
    x0, x1, x2 = (work.m_r[b, 0] - work.m_r[a, 0], work.m_r[b, 1] - work.m_r[a, 1], work.m_r[b, 2] - work.m_r[a, 2])
    y0, y1, y2 = (work.m_v[b, 0] - work.m_v[a, 0], work.m_v[b, 1] - work.m_v[a, 1], work.m_v[b, 2] - work.m_v[a, 2])
    return x0, x1, x2, y0, y1, y2, math.sqrt(x0 * x0 + x1 * x1 + x2 * x2)


@inner
def spring_tension(model, work, c):
    """Return tension over length, its parts without damping, length and rate of length of spring c.

    At length zero the tension has a direction only if the free length is zero: then k remains.
    """
    k, damping, free, preload = model.springs[model.c_spring[c]]
    x0, x1, x2, y0, y1, y2, length = spring_line(model, work, c)
    if length == 0.0:
        return k, length, 0.0
    rate = (x0 * y0 + x1 * y1 + x2 * y2) / length
    return (k * (length - free) + damping * rate + preload) / length, length, rate


@inner
def connection_rows(model, work, c, c_k):
    """Write the residual of connection c, and its wrench on both markers."""
    a, b, w0, size = model.c_a[c], model.c_b[c], model.c_w0[c], model.c_size[c]
    for k in range(size):
        work.m_wrench[a, k] += work.w[w0 + k]
        work.m_wrench[b, k] -= work.w[w0 + k]
    if model.c_spring[c] >= 0:
        tension, _, _ = spring_tension(model, work, c)
        for k in range(3):
            work.g[w0 + k] = c_k * (work.w[w0 + k] - tension * (work.m_r[b, k] - work.m_r[a, k]))
        return
    for k in range(w0, w0 + size):
        x = model.row_x[k]
        if model.row_kind[k] == POINT:
            work.g[k] = (
                x[0] * (work.m_r[a, 0] - work.m_r[b, 0])
                + x[1] * (work.m_r[a, 1] - work.m_r[b, 1])
                + x[2] * (work.m_r[a, 2] - work.m_r[b, 2])
            )
            continue
        e0, e1, e2 = rotate(work.m_A[a], x[0], x[1], x[2])
        if model.row_kind[k] == DOT:
            y = model.row_y[k]
            d0, d1, d2 = rotate(work.m_A[b], y[0], y[1], y[2])
            work.g[k] = e0 * d0 + e1 * d1 + e2 * d2 - model.row_c[k]
        else:
            work.g[k] = c_k * (e0 * work.w[w0 + 3] + e1 * work.w[w0 + 4] + e2 * work.w[w0 + 5])


@inner
def connection_derivatives(model, work, c, c_k):
    """Write P at both markers and V of connection c."""
    a, b, w0, size = model.c_a[c], model.c_b[c], model.c_w0[c], model.c_size[c]
    P_a, P_b, V = work.P[a], work.P[b], work.V[c]
    P_a[:, :] = 0.0
    P_b[:, :] = 0.0
    V[:, :] = 0.0
    if model.c_spring[c] >= 0:
        spring_derivatives(model, work, c, c_k)
        return
    for r in range(size):
        k = w0 + r
        x = model.row_x[k]
        if model.row_kind[k] == POINT:
            for j in range(3):
                P_a[r, j] = x[j]
                P_b[r, j] = -x[j]
            continue
        e0, e1, e2 = rotate(work.m_A[a], x[0], x[1], x[2])
        if model.row_kind[k] == DOT:
            y = model.row_y[k]
            d0, d1, d2 = rotate(work.m_A[b], y[0], y[1], y[2])
            n0, n1, n2 = cross(e0, e1, e2, d0, d1, d2)
            P_a[r, 3], P_a[r, 4], P_a[r, 5] = n0, n1, n2
            P_b[r, 3], P_b[r, 4], P_b[r, 5] = -n0, -n1, -n2
        else:
            n0, n1, n2 = cross(e0, e1, e2, work.w[w0 + 3], work.w[w0 + 4], work.w[w0 + 5])
            P_a[r, 3], P_a[r, 4], P_a[r, 5] = c_k * n0, c_k * n1, c_k * n2
            V[r, 3], V[r, 4], V[r, 5] = e0, e1, e2


@inner
def spring_derivatives(model, work, c, c_k):
    """Write P and V of spring c.

    d(s d)/dr_B = (k - s/l) d dᵀ + (s/l) 1 + (c/l) d (v - l_dot d)ᵀ,  d(s d)/dv_B = c d dᵀ.
    """
    P_a, P_b, V = work.P[model.c_a[c]], work.P[model.c_b[c]], work.V[c]
    k, damping, _, _ = model.springs[model.c_spring[c]]
    x0, x1, x2, y0, y1, y2, _ = spring_line(model, work, c)
    tension, length, rate = spring_tension(model, work, c)
    x, y = (x0, x1, x2), (y0, y1, y2)
    for r in range(3):
        V[r, r] = 1.0
        for j in range(3):
            by_r = tension if r == j else 0.0
            by_v = 0.0
            if length > 0.0:
                d_r, d_j = x[r] / length, x[j] / length
                by_r += (k - tension) * d_r * d_j + damping / length * d_r * (y[j] - rate * d_j)
                by_v = damping * d_r * d_j
            P_a[r, j] = c_k * by_r
            P_b[r, j] = -c_k * by_r
            P_a[r, 6 + j] = c_k * by_v
            P_b[r, 6 + j] = -c_k * by_v


@inner
def row_rate(model, work, k, a, b):
    """Return the rate of the held quantity of row k between markers a and b; zero for rows that hold none."""
    x = model.row_x[k]
    if model.row_kind[k] == POINT:
        return (
            x[0] * (work.m_v[a, 0] - work.m_v[b, 0])
            + x[1] * (work.m_v[a, 1] - work.m_v[b, 1])
            + x[2] * (work.m_v[a, 2] - work.m_v[b, 2])
        )
    if model.row_kind[k] == DOT:
        y = model.row_y[k]
        e0, e1, e2 = rotate(work.m_A[a], x[0], x[1], x[2])
        d0, d1, d2 = rotate(work.m_A[b], y[0], y[1], y[2])
        n0, n1, n2 = cross(e0, e1, e2, d0, d1, d2)
        o, p = work.m_omega[a], work.m_omega[b]
        return n0 * (o[0] - p[0]) + n1 * (o[1] - p[1]) + n2 * (o[2] - p[2])
    return 0.0


@inner
def row_acceleration(model, work, k, a, b, bias_a, bias_b):
    """Return the second rate of the held quantity of row k for given accelerations (6) of both markers.

    DOT: (al_a × e + w_a × (w_a × e))·d + 2 (w_a × e)·(w_b × d) + e·(al_b × d + w_b × (w_b × d)).
    """
    x = model.row_x[k]
    if model.row_kind[k] == POINT:
        return x[0] * (bias_a[0] - bias_b[0]) + x[1] * (bias_a[1] - bias_b[1]) + x[2] * (bias_a[2] - bias_b[2])
    if model.row_kind[k] == DOT:
        y = model.row_y[k]
        e0, e1, e2 = rotate(work.m_A[a], x[0], x[1], x[2])
        d0, d1, d2 = rotate(work.m_A[b], y[0], y[1], y[2])
        o, p = work.m_omega[a], work.m_omega[b]
        f0, f1, f2 = cross(o[0], o[1], o[2], e0, e1, e2)
        h0, h1, h2 = cross(p[0], p[1], p[2], d0, d1, d2)
        ff0, ff1, ff2 = cross(o[0], o[1], o[2], f0, f1, f2)
        hh0, hh1, hh2 = cross(p[0], p[1], p[2], h0, h1, h2)
        a0, a1, a2 = cross(bias_a[3], bias_a[4], bias_a[5], e0, e1, e2)
        b0, b1, b2 = cross(bias_b[3], bias_b[4], bias_b[5], d0, d1, d2)
        return (
            (a0 + ff0) * d0
            + (a1 + ff1) * d1
            + (a2 + ff2) * d2
            + 2 * (f0 * h0 + f1 * h1 + f2 * h2)
            + e0 * (b0 + hh0)
            + e1 * (b1 + hh1)
            + e2 * (b2 + hh2)
        )
    return 0.0


@inner
def constraint_rates(model, work, rate, bias):
    """Write for every row the rate of the held quantity and its second rate at zero u_dot, both (n_w,).

    `evaluate` has been called for the iterate.
    """
    motion = work.m_bias
    for m in range(model.m_body.shape[0]):
        marker_acceleration_bias(model, work, m, motion[m])
    for c in range(model.c_size.shape[0]):
        a, b = model.c_a[c], model.c_b[c]
        for k in range(model.c_w0[c], model.c_w0[c + 1]):
            rate[k] = row_rate(model, work, k, a, b)
            bias[k] = row_acceleration(model, work, k, a, b, motion[a], motion[b])
