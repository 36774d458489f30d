"""Ports: coordinates of joints or markers through which couplers and user forces see and move the system.

A port has a value x, its rate v and a force Q that acts to increase x (its power is Q v). With d = r_B - r_A and e an
axis of A:

    PUSH     x = e · d             v = e · (v_B - v_A - omega_A × d)     force Q e on B at its point
    TWIST    x angle of B about e  v = e · (omega_B - omega_A)           torque Q e on B
    TWIST_B  the same about an axis of B
    SPAN     x = |d|               v = d · (v_B - v_A)/|d|               force Q d/|d| on B

and the opposite on A. Rows of a port, in this order: x and v as unknowns (angles then go on beyond a turn: the one
nearest to the value before), the force or torque on A (3), and where a PUSH has A on a body the moment on A (3),

    X - x = 0,   v' - v = 0,   F + Q e = 0,   M - d × F = 0.
"""

import math

from floatframe.joints.rows import PUSH, SPAN, TWIST_B
from floatframe.kernels.compiler.compilation import inner
from floatframe.kernels.connections.relative_motion import distance, loaded_axis, loaded_coordinate, slip, turned_angle
from floatframe.kernels.marker import cross

__all__ = [
    "port_derivatives",
    "port_gradient",
    "port_motion",
    "port_rows",
    "port_second_rate",
    "port_tangent_rate",
    "predict_port",
]


@inner
def port_line(model, work, p):
    """Return the direction in which the force of port p acts, ground axes."""
    a, b, k = model.ports.a[p], model.ports.b[p], model.ports.row[p]
    if model.rows.kind[k] == SPAN:
        r0, r1, r2 = distance(work, a, b)
        length = math.sqrt(r0 * r0 + r1 * r1 + r2 * r2)
        return r0 / length, r1 / length, r2 / length
    return loaded_axis(model, work, k, a, b)


@inner
def port_motion(model, work, p):
    """Return value and rate of port p; an angle is the one nearest to the unknown X."""
    a, b, k = model.ports.a[p], model.ports.b[p], model.ports.row[p]
    if model.rows.kind[k] == SPAN:
        e0, e1, e2 = port_line(model, work, p)
        r0, r1, r2 = distance(work, a, b)
        v0, v1, v2 = (
            work.markers.v[b, 0] - work.markers.v[a, 0],
            work.markers.v[b, 1] - work.markers.v[a, 1],
            work.markers.v[b, 2] - work.markers.v[a, 2],
        )
        return e0 * r0 + e1 * r1 + e2 * r2, e0 * v0 + e1 * v1 + e2 * v2
    x, v = loaded_coordinate(model, work, k, a, b)
    if model.rows.kind[k] != PUSH:
        x += 2 * math.pi * math.floor((work.state.w[k] - x) / (2 * math.pi) + 0.5)
    return x, v


@inner
def predict_port(model, work, p, h):
    """Move the unknown X of port p by its rate, so that a fast angle is followed."""
    k = model.ports.row[p]
    work.state.w[k] += h * work.state.w[k + 1]


@inner
def port_rows(model, work, p, Q, c_k):
    """Write the rows of port p with force Q, and its wrench on both markers."""
    a, b, k = model.ports.a[p], model.ports.b[p], model.ports.row[p]
    x, v = port_motion(model, work, p)
    work.connections.g[k] = c_k * (work.state.w[k] - x)
    work.connections.g[k + 1] = c_k * (work.state.w[k + 1] - v)
    f = model.ports.force[p]
    if f < 0:
        return
    e0, e1, e2 = port_line(model, work, p)
    work.connections.g[f] = c_k * (work.state.w[f] + Q * e0)
    work.connections.g[f + 1] = c_k * (work.state.w[f + 1] + Q * e1)
    work.connections.g[f + 2] = c_k * (work.state.w[f + 2] + Q * e2)
    first = 0 if model.markers.force[a] >= 0 else 3
    for i in range(3):
        work.markers.wrench[a, first + i] += work.state.w[f + i]
        work.markers.wrench[b, first + i] -= work.state.w[f + i]
    n = model.ports.arm[p]
    if n >= 0:
        r0, r1, r2 = distance(work, a, b)
        m0, m1, m2 = cross(r0, r1, r2, work.state.w[f], work.state.w[f + 1], work.state.w[f + 2])
        work.connections.g[n] = c_k * (work.state.w[n] - m0)
        work.connections.g[n + 1] = c_k * (work.state.w[n + 1] - m1)
        work.connections.g[n + 2] = c_k * (work.state.w[n + 2] - m2)
        for i in range(3):
            work.markers.wrench[a, 3 + i] += work.state.w[n + i]


@inner
def add_pair(P_a, P_b, r, column, factor, x0, x1, x2):
    """Add factor * x to a row of P at A, and its opposite at B."""
    P_a[r, column] += factor * x0
    P_a[r, column + 1] += factor * x1
    P_a[r, column + 2] += factor * x2
    P_b[r, column] -= factor * x0
    P_b[r, column + 1] -= factor * x1
    P_b[r, column + 2] -= factor * x2


@inner
def add_three(P, r, column, factor, x0, x1, x2):
    """Add factor * x to a row of P."""
    P[r, column] += factor * x0
    P[r, column + 1] += factor * x1
    P[r, column + 2] += factor * x2


@inner
def port_gradient(model, work, p, r, by_x, by_v):
    """Add by_x dx + by_v dv of port p to row r of P at both markers; see `loaded_row_derivatives`."""
    a, b, k = model.ports.a[p], model.ports.b[p], model.ports.row[p]
    P_a, P_b = work.connections.P[a], work.connections.P[b]
    o, q = work.markers.omega[a], work.markers.omega[b]
    e0, e1, e2 = port_line(model, work, p)
    kind = model.rows.kind[k]
    if kind == SPAN:
        r0, r1, r2 = distance(work, a, b)
        length = e0 * r0 + e1 * r1 + e2 * r2
        v0, v1, v2 = (
            work.markers.v[b, 0] - work.markers.v[a, 0],
            work.markers.v[b, 1] - work.markers.v[a, 1],
            work.markers.v[b, 2] - work.markers.v[a, 2],
        )
        v = e0 * v0 + e1 * v1 + e2 * v2
        add_pair(P_a, P_b, r, 0, -by_x, e0, e1, e2)
        add_pair(P_a, P_b, r, 0, -by_v / length, v0 - v * e0, v1 - v * e1, v2 - v * e2)
        add_pair(P_a, P_b, r, 6, -by_v, e0, e1, e2)
    elif kind == PUSH:
        r0, r1, r2 = distance(work, a, b)
        s0, s1, s2 = slip(work, a, b, r0, r1, r2)
        add_pair(P_a, P_b, r, 0, -by_x, e0, e1, e2)
        add_pair(P_a, P_b, r, 6, -by_v, e0, e1, e2)
        n0, n1, n2 = cross(e0, e1, e2, o[0], o[1], o[2])
        add_pair(P_a, P_b, r, 0, by_v, n0, n1, n2)
        n0, n1, n2 = cross(e0, e1, e2, r0, r1, r2)
        add_three(P_a, r, 3, by_x, n0, n1, n2)
        add_three(P_a, r, 9, by_v, n0, n1, n2)
        n0, n1, n2 = cross(e0, e1, e2, s0, s1, s2)
        add_three(P_a, r, 3, by_v, n0, n1, n2)
    else:
        _, t0, t1, t2 = turned_angle(model, work, k, a, b)
        add_pair(P_a, P_b, r, 3, by_x, t0, t1, t2)
        add_pair(P_a, P_b, r, 9, -by_v, e0, e1, e2)
        n0, n1, n2 = cross(e0, e1, e2, q[0] - o[0], q[1] - o[1], q[2] - o[2])
        add_three(P_b if kind == TWIST_B else P_a, r, 3, by_v, n0, n1, n2)


@inner
def port_derivatives(model, work, c, p, Q, column, by_unknown, c_k):
    """Write the rows of P and V of port p, of connection c, whose force is Q = by_unknown w[column]."""
    a, b, k, w0 = model.ports.a[p], model.ports.b[p], model.ports.row[p], model.connections.w0[c]
    P_a, P_b, V = work.connections.P[a], work.connections.P[b], work.connections.V[c]
    r = k - w0
    V[r, r], V[r + 1, r + 1] = 1.0, 1.0
    port_gradient(model, work, p, r, -c_k, 0.0)
    port_gradient(model, work, p, r + 1, 0.0, -c_k)
    f = model.ports.force[p]
    if f < 0:
        return
    r = f - w0
    e0, e1, e2 = port_line(model, work, p)
    e = (e0, e1, e2)
    kind = model.rows.kind[k]
    d0, d1, d2 = distance(work, a, b)
    length = math.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
    for i in range(3):
        V[r + i, r + i] = 1.0
        V[r + i, column - w0] = by_unknown * e[i]
        unit = (1.0 if i == 0 else 0.0, 1.0 if i == 1 else 0.0, 1.0 if i == 2 else 0.0)
        if kind == SPAN:  # de = (1 - e eᵀ) dd / |d|
            s = -c_k * Q / length
            add_pair(
                P_a, P_b, r + i, 0, s, unit[0] - e[i] * e0, unit[1] - e[i] * e1, unit[2] - e[i] * e2
            )  # fmt: skip
        else:  # unit · (dphi × e) = dphi · (e × unit)
            n0, n1, n2 = cross(e0, e1, e2, unit[0], unit[1], unit[2])
            add_three(P_b if kind == TWIST_B else P_a, r + i, 3, c_k * Q, n0, n1, n2)
    n = model.ports.arm[p]
    if n < 0:
        return
    m = n - w0
    for i in range(3):
        unit = (1.0 if i == 0 else 0.0, 1.0 if i == 1 else 0.0, 1.0 if i == 2 else 0.0)
        V[m + i, m + i] = 1.0
        # unit · (d × dF) = dF · (unit × d),  unit · (dd × F) = dd · (F × unit)
        n0, n1, n2 = cross(unit[0], unit[1], unit[2], d0, d1, d2)
        V[m + i, r], V[m + i, r + 1], V[m + i, r + 2] = -n0, -n1, -n2
        n0, n1, n2 = cross(work.state.w[f], work.state.w[f + 1], work.state.w[f + 2], unit[0], unit[1], unit[2])
        add_pair(P_a, P_b, m + i, 0, c_k, n0, n1, n2)


@inner
def port_tangent_rate(model, work, p):
    """Return the rate of port p as its gradient gives it; of an angle between axes that are not parallel not v."""
    a, b, k = model.ports.a[p], model.ports.b[p], model.ports.row[p]
    if model.rows.kind[k] == SPAN or model.rows.kind[k] == PUSH:
        _, v = port_motion(model, work, p)
        return v
    _, t0, t1, t2 = turned_angle(model, work, k, a, b)
    o, q = work.markers.omega[a], work.markers.omega[b]
    return t0 * (o[0] - q[0]) + t1 * (o[1] - q[1]) + t2 * (o[2] - q[2])


@inner
def port_second_rate(model, work, p, bias_a, bias_b):
    """Return the second rate of port p for given accelerations (6) of both markers; angles: of parallel axes."""
    a, b, k = model.ports.a[p], model.ports.b[p], model.ports.row[p]
    kind = model.rows.kind[k]
    if kind != SPAN and kind != PUSH:
        _, t0, t1, t2 = turned_angle(model, work, k, a, b)
        return t0 * (bias_a[3] - bias_b[3]) + t1 * (bias_a[4] - bias_b[4]) + t2 * (bias_a[5] - bias_b[5])
    r0, r1, r2 = distance(work, a, b)
    v0, v1, v2 = (
        work.markers.v[b, 0] - work.markers.v[a, 0],
        work.markers.v[b, 1] - work.markers.v[a, 1],
        work.markers.v[b, 2] - work.markers.v[a, 2],
    )
    c0, c1, c2 = bias_b[0] - bias_a[0], bias_b[1] - bias_a[1], bias_b[2] - bias_a[2]
    e0, e1, e2 = port_line(model, work, p)
    along = e0 * c0 + e1 * c1 + e2 * c2
    if kind == SPAN:
        length = e0 * r0 + e1 * r1 + e2 * r2
        rate = e0 * v0 + e1 * v1 + e2 * v2
        return along + (v0 * v0 + v1 * v1 + v2 * v2 - rate * rate) / length
    o = work.markers.omega[a]
    f0, f1, f2 = cross(o[0], o[1], o[2], e0, e1, e2)
    n0, n1, n2 = cross(o[0], o[1], o[2], f0, f1, f2)
    m0, m1, m2 = cross(bias_a[3], bias_a[4], bias_a[5], e0, e1, e2)
    turned = (n0 + m0) * r0 + (n1 + m1) * r1 + (n2 + m2) * r2
    return along + turned + 2 * (f0 * v0 + f1 * v1 + f2 * v2)
