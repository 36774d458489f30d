"""Residual rows of joints and spring-dampers in terms of the motion of their two markers.

The rows of a connection have its wrench w as unknown (see joints/rows.py). Rows that hold something are in its unit;
rows that say what the wrench is are multiplied by c_k, so that their unknown is c_k dw. Held rows with `row_soft` s
give way by s c_k times their own force, far below the tolerance of positions, so that redundant ones share their load.
A spring-damper has

    SPRING    F - s d = 0, s = k (l - l_0) + c l_dot + preload, d = (r_B - r_A)/l
"""

import math

from floatframe.joints.rows import (
    ARM,
    DISTANCE,
    DOT,
    GAUGE,
    GAUGE_B,
    LINE,
    LINE_FREE,
    LINE_TURN,
    MOMENT,
    MOMENT_B,
    POINT,
    PUSH,
    RIM,
    RIM_HEIGHT,
    ROD,
    ROLL,
    SCREW,
    SLIDE,
    THREAD,
    TURN,
    TURN_B,
    TWIST,
    TWIST_B,
)
from floatframe.kernels.compiler.compilation import inner
from floatframe.kernels.connections.coordinate_force import coordinate_force
from floatframe.kernels.connections.coupler import coupler_derivatives, coupler_rates, coupler_rows
from floatframe.kernels.connections.deformed_line import (
    line_acceleration,
    line_derivatives,
    line_rate,
    line_row,
    line_turn_by_place,
)
from floatframe.kernels.connections.pair_force import pair_derivatives, pair_rows
from floatframe.kernels.connections.relative_motion import (
    direction_of_a,
    distance,
    loaded_axis,
    loaded_coordinate,
    prescribed,
    put_pair,
    screw_angle,
    screw_axis,
    slip,
    turned_angle,
)
from floatframe.kernels.connections.rolling import rolling_acceleration, rolling_derivatives, rolling_rate, rolling_row
from floatframe.kernels.connections.time_function import time_function
from floatframe.kernels.connections.user_force import user_force_derivatives, user_force_rows
from floatframe.kernels.marker import cross, marker_acceleration_bias, rotate
from floatframe.kernels.model import BUSHING, CONTACT, COUPLER, JOINT, SPRING, USER_FORCE

__all__ = [
    "connection_derivatives",
    "connection_rows",
    "constraint_rates",
    "normal_force",
    "row_rate",
    "spring_tension",
]


@inner
def spring_line(model, work, c):
    """Return r_B - r_A, v_B - v_A (six numbers) and the length of spring c."""
    a, b = model.connections.a[c], model.connections.b[c]
    x0, x1, x2 = (
        work.markers.r[b, 0] - work.markers.r[a, 0],
        work.markers.r[b, 1] - work.markers.r[a, 1],
        work.markers.r[b, 2] - work.markers.r[a, 2],
    )
    y0, y1, y2 = (
        work.markers.v[b, 0] - work.markers.v[a, 0],
        work.markers.v[b, 1] - work.markers.v[a, 1],
        work.markers.v[b, 2] - work.markers.v[a, 2],
    )
    return x0, x1, x2, y0, y1, y2, math.sqrt(x0 * x0 + x1 * x1 + x2 * x2)


@inner
def spring_tension(model, work, c):
    """Return tension over length, its parts without damping, length and rate of length of spring c.

    At length zero the tension has a direction only if the free length is zero: then k remains.
    """
    i, springs = model.connections.item[c], model.springs
    k, damping, free, preload = springs.stiffness[i], springs.damping[i], springs.free_length[i], springs.preload[i]
    x0, x1, x2, y0, y1, y2, length = spring_line(model, work, c)
    if length == 0.0:
        return k, length, 0.0
    rate = (x0 * y0 + x1 * y1 + x2 * y2) / length
    tension = k * (length - free) + damping * rate + preload
    if springs.table[i] >= 0:
        value, _, _ = time_function(model, springs.table[i], length - free)
        tension += value
    return tension / length, length, rate


@inner
def normal_force(w, e0, e1, e2):
    """Return the size of the force normal to the axis, and its part along it."""
    along = e0 * w[0] + e1 * w[1] + e2 * w[2]
    square = w[0] * w[0] + w[1] * w[1] + w[2] * w[2] - along * along
    return math.sqrt(max(square, 0.0)), along


@inner
def loaded_row(model, work, k, a, b, w, c_k):
    """Return the residual of a PUSH, TWIST or TWIST_B row."""
    e0, e1, e2 = loaded_axis(model, work, k, a, b)
    x, v = loaded_coordinate(model, work, k, a, b)
    normal, _ = normal_force(w, e0, e1, e2)
    Q, _, _, _ = coordinate_force(model, work, k, model.rows.kind[k] != PUSH, x, v, normal)
    part = model.rows.part[k]
    return c_k * (e0 * w[part] + e1 * w[part + 1] + e2 * w[part + 2] + Q)


@inner
def loaded_row_derivatives(model, work, k, r, a, b, w, c_k, P_a, P_b, V):
    """Write row r of P and V of a PUSH, TWIST or TWIST_B row.

    With e the axis, s the slip of B seen from A and n the size of the force normal to e:
    PUSH   dx = e·(dr_B - dr_A) + (e × d)·dphi_A,   dv = e·(dv_B - dv_A) + (e × d)·domega_A
           - (e × omega_A)·(dr_B - dr_A) + (e × s)·dphi_A
    TWIST  dx by `screw_angle`,   dv = e·(domega_B - domega_A) + (e × (omega_B - omega_A))·dphi_A
    """
    o, p = work.markers.omega[a], work.markers.omega[b]
    part, is_angle = model.rows.part[k], model.rows.kind[k] != PUSH
    e0, e1, e2 = loaded_axis(model, work, k, a, b)
    x, v = loaded_coordinate(model, work, k, a, b)
    normal, along = normal_force(w, e0, e1, e2)
    _, Q_x, Q_v, Q_n = coordinate_force(model, work, k, is_angle, x, v, normal)
    V[r, part], V[r, part + 1], V[r, part + 2] = e0, e1, e2
    n0, n1, n2 = cross(e0, e1, e2, w[part], w[part + 1], w[part + 2])
    if Q_n != 0.0 and normal > 0.0:
        f = Q_n / normal
        V[r, 0] += f * (w[0] - along * e0)
        V[r, 1] += f * (w[1] - along * e1)
        V[r, 2] += f * (w[2] - along * e2)
        m0, m1, m2 = cross(e0, e1, e2, w[0], w[1], w[2])
        n0, n1, n2 = n0 - f * along * m0, n1 - f * along * m1, n2 - f * along * m2
    if is_angle:
        _, t0, t1, t2 = turned_angle(model, work, k, a, b)
        put_pair(P_a, P_b, r, 3, c_k * Q_x, t0, t1, t2)
        put_pair(P_a, P_b, r, 9, -c_k * Q_v, e0, e1, e2)
        m0, m1, m2 = cross(e0, e1, e2, p[0] - o[0], p[1] - o[1], p[2] - o[2])
        n0, n1, n2 = n0 + Q_v * m0, n1 + Q_v * m1, n2 + Q_v * m2
    else:
        r0, r1, r2 = distance(work, a, b)
        s0, s1, s2 = slip(work, a, b, r0, r1, r2)
        m0, m1, m2 = cross(e0, e1, e2, o[0], o[1], o[2])
        put_pair(P_a, P_b, r, 0, c_k, Q_v * m0 - Q_x * e0, Q_v * m1 - Q_x * e1, Q_v * m2 - Q_x * e2)
        put_pair(P_a, P_b, r, 6, -c_k * Q_v, e0, e1, e2)
        m0, m1, m2 = cross(e0, e1, e2, r0, r1, r2)
        P_a[r, 9], P_a[r, 10], P_a[r, 11] = c_k * Q_v * m0, c_k * Q_v * m1, c_k * Q_v * m2
        n0, n1, n2 = n0 + Q_x * m0, n1 + Q_x * m1, n2 + Q_x * m2
        m0, m1, m2 = cross(e0, e1, e2, s0, s1, s2)
        n0, n1, n2 = n0 + Q_v * m0, n1 + Q_v * m1, n2 + Q_v * m2
    P = P_b if model.rows.kind[k] == TWIST_B else P_a  # of the marker that holds the axis
    P[r, 3] += c_k * n0
    P[r, 4] += c_k * n1
    P[r, 5] += c_k * n2


@inner
def connection_rows(model, work, c, c_k):
    """Write the residual of connection c, and its wrench on its markers."""
    if model.connections.law[c] == COUPLER:
        coupler_rows(model, work, c, c_k)
        return
    if model.connections.law[c] == USER_FORCE:
        user_force_rows(model, work, c, c_k)
        return
    a, b, w0, size = model.connections.a[c], model.connections.b[c], model.connections.w0[c], model.connections.size[c]
    w = work.state.w[w0 : w0 + size]
    for k in range(3):
        work.markers.wrench[a, k] += w[k]
        work.markers.wrench[b, k] -= w[k]
        if model.markers.moment[a] >= 0:
            work.markers.wrench[a, 3 + k] += w[model.markers.moment[a] + k]
        if model.markers.moment[b] >= 0:
            work.markers.wrench[b, 3 + k] -= w[model.markers.moment[b] + k]
    if model.connections.law[c] == BUSHING or model.connections.law[c] == CONTACT:
        pair_rows(model, work, c, c_k)
        return
    if model.connections.law[c] == SPRING:
        tension, _, _ = spring_tension(model, work, c)
        for k in range(3):
            work.connections.g[w0 + k] = c_k * (
                work.state.w[w0 + k] - tension * (work.markers.r[b, k] - work.markers.r[a, k])
            )
        return
    r0, r1, r2 = distance(work, a, b)
    for k in range(w0, w0 + size):
        kind, x, part = model.rows.kind[k], model.rows.x[k], model.rows.part[k]
        if kind == POINT:
            force = x[0] * w[0] + x[1] * w[1] + x[2] * w[2]
            work.connections.g[k] = model.rows.soft[k] * c_k * force - (x[0] * r0 + x[1] * r1 + x[2] * r2)
        elif kind == ARM:
            n0, n1, n2 = cross(r0, r1, r2, w[0], w[1], w[2])
            n0, n1, n2 = w[MOMENT] - n0, w[MOMENT + 1] - n1, w[MOMENT + 2] - n2
            if size > MOMENT_B:
                n0, n1, n2 = n0 - w[MOMENT_B], n1 - w[MOMENT_B + 1], n2 - w[MOMENT_B + 2]
            work.connections.g[k] = c_k * (x[0] * n0 + x[1] * n1 + x[2] * n2)
        elif kind == ROD:
            work.connections.g[k] = c_k * (
                x[0] * (w[0] - w[3] * r0) + x[1] * (w[1] - w[3] * r1) + x[2] * (w[2] - w[3] * r2)
            )
        elif kind == DISTANCE:
            length, _, _ = prescribed(model, work, k)
            work.connections.g[k] = 0.5 * ((r0 * r0 + r1 * r1 + r2 * r2) / length - length)
        elif kind == SCREW:
            slope = model.rows.c[k]
            angle, _, _, _ = screw_angle(model, work, k, a, b)
            e0, e1, e2 = screw_axis(model, work, k, a)
            along = e0 * r0 + e1 * r1 + e2 * r2
            turns = math.floor((along / slope - angle) / (2 * math.pi) + 0.5)
            work.connections.g[k] = along - slope * (angle + 2 * math.pi * turns)
        elif kind == PUSH or kind == TWIST or kind == TWIST_B:
            work.connections.g[k] = loaded_row(model, work, k, a, b, w, c_k)
        elif kind == GAUGE_B:
            y = model.rows.y[k]
            e0, e1, e2 = rotate(work.markers.A[b], y[0], y[1], y[2])
            work.connections.g[k] = c_k * (e0 * w[part] + e1 * w[part + 1] + e2 * w[part + 2])
        elif kind == RIM_HEIGHT or kind == ROLL or kind == RIM:
            work.connections.g[k] = rolling_row(model, work, k, a, b, w, c_k)
        elif kind == LINE or kind == LINE_FREE:
            work.connections.g[k] = line_row(model, work, k, a, b, w, c_k)
        elif kind == TURN_B:
            y = model.rows.y[k]
            e0, e1, e2 = direction_of_a(model, work, k, b)
            d0, d1, d2 = rotate(work.markers.A[a], y[0], y[1], y[2])
            work.connections.g[k] = e0 * d0 + e1 * d1 + e2 * d2
        else:
            e0, e1, e2 = direction_of_a(model, work, k, a)
            if kind == GAUGE:
                work.connections.g[k] = c_k * (e0 * w[part] + e1 * w[part + 1] + e2 * w[part + 2])
            elif kind == THREAD:
                slope = model.rows.c[k]
                work.connections.g[k] = c_k * (
                    e0 * (w[MOMENT_B] + slope * w[0])
                    + e1 * (w[MOMENT_B + 1] + slope * w[1])
                    + e2 * (w[MOMENT_B + 2] + slope * w[2])
                )
            elif kind == SLIDE:
                value, _, _ = prescribed(model, work, k)
                force = e0 * w[0] + e1 * w[1] + e2 * w[2]
                work.connections.g[k] = e0 * r0 + e1 * r1 + e2 * r2 - value - model.rows.soft[k] * c_k * force
            else:  # DOT, TURN, LINE_TURN
                y = model.rows.y[k]
                d0, d1, d2 = rotate(work.markers.A[b], y[0], y[1], y[2])
                held = model.rows.c[k] if kind == DOT else 0.0
                work.connections.g[k] = e0 * d0 + e1 * d1 + e2 * d2 - held
                if model.rows.soft[k] > 0.0:
                    n0, n1, n2 = cross(e0, e1, e2, d0, d1, d2)
                    work.connections.g[k] += (
                        model.rows.soft[k] * c_k * (n0 * w[part] + n1 * w[part + 1] + n2 * w[part + 2])
                    )


@inner
def connection_derivatives(model, work, c, c_k):
    """Write P at the markers and V of connection c."""
    if model.connections.law[c] == COUPLER:
        coupler_derivatives(model, work, c, c_k)
        return
    if model.connections.law[c] == USER_FORCE:
        user_force_derivatives(model, work, c, c_k)
        return
    a, b, w0, size = model.connections.a[c], model.connections.b[c], model.connections.w0[c], model.connections.size[c]
    P_a, P_b, V, w = work.connections.P[a], work.connections.P[b], work.connections.V[c], work.state.w[w0 : w0 + size]
    for r in range(size):
        for j in range(12):
            P_a[r, j] = 0.0
            P_b[r, j] = 0.0
        for j in range(size):
            V[r, j] = 0.0
    if model.connections.law[c] == BUSHING or model.connections.law[c] == CONTACT:
        pair_derivatives(model, work, c, c_k)
        return
    if model.connections.law[c] == SPRING:
        spring_derivatives(model, work, c, c_k)
        return
    r0, r1, r2 = distance(work, a, b)
    for r in range(size):
        k = w0 + r
        kind, x, part = model.rows.kind[k], model.rows.x[k], model.rows.part[k]
        if kind == POINT:
            put_pair(P_a, P_b, r, 0, 1.0, x[0], x[1], x[2])
            for j in range(3):
                V[r, j] = model.rows.soft[k] * x[j]
        elif kind == ARM:  # x·(M - N - d × F) = x·(M - N) - (x × d)·F, and (x × d)·F = d·(F × x)
            n0, n1, n2 = cross(x[0], x[1], x[2], r0, r1, r2)
            V[r, 0], V[r, 1], V[r, 2] = -n0, -n1, -n2
            n0, n1, n2 = cross(w[0], w[1], w[2], x[0], x[1], x[2])
            put_pair(P_a, P_b, r, 0, c_k, n0, n1, n2)
            for j in range(3):
                V[r, MOMENT + j] = x[j]
                if size > MOMENT_B:
                    V[r, MOMENT_B + j] = -x[j]
        elif kind == ROD:
            for j in range(3):
                V[r, j] = x[j]
            V[r, 3] = -(x[0] * r0 + x[1] * r1 + x[2] * r2)
            put_pair(P_a, P_b, r, 0, c_k * w[3], x[0], x[1], x[2])
        elif kind == DISTANCE:
            length, _, _ = prescribed(model, work, k)
            put_pair(P_a, P_b, r, 0, -1.0 / length, r0, r1, r2)
        elif kind == SCREW:
            e0, e1, e2 = screw_axis(model, work, k, a)
            put_pair(P_a, P_b, r, 0, -1.0, e0, e1, e2)
            _, t0, t1, t2 = screw_angle(model, work, k, a, b)
            put_pair(P_a, P_b, r, 3, -model.rows.c[k], t0, t1, t2)
            n0, n1, n2 = cross(e0, e1, e2, r0, r1, r2)
            P_a[r, 3] += n0
            P_a[r, 4] += n1
            P_a[r, 5] += n2
        elif kind == PUSH or kind == TWIST or kind == TWIST_B:
            loaded_row_derivatives(model, work, k, r, a, b, w, c_k, P_a, P_b, V)
        elif kind == GAUGE_B:
            y = model.rows.y[k]
            e0, e1, e2 = rotate(work.markers.A[b], y[0], y[1], y[2])
            n0, n1, n2 = cross(e0, e1, e2, w[part], w[part + 1], w[part + 2])
            P_b[r, 3], P_b[r, 4], P_b[r, 5] = c_k * n0, c_k * n1, c_k * n2
            V[r, part], V[r, part + 1], V[r, part + 2] = e0, e1, e2
        elif kind == RIM_HEIGHT or kind == ROLL or kind == RIM:
            rolling_derivatives(model, work, k, r, a, b, w, c_k, P_a, P_b, V)
        elif kind == LINE or kind == LINE_FREE:
            line_derivatives(model, work, k, r, a, b, w, c_k, P_a, P_b, V)
        elif kind == TURN_B:
            y = model.rows.y[k]
            e0, e1, e2 = direction_of_a(model, work, k, b)
            d0, d1, d2 = rotate(work.markers.A[a], y[0], y[1], y[2])
            n0, n1, n2 = cross(e0, e1, e2, d0, d1, d2)
            put_pair(P_b, P_a, r, 3, 1.0, n0, n1, n2)
        else:
            e0, e1, e2 = direction_of_a(model, work, k, a)
            if kind == GAUGE:
                n0, n1, n2 = cross(e0, e1, e2, w[part], w[part + 1], w[part + 2])
                P_a[r, 3], P_a[r, 4], P_a[r, 5] = c_k * n0, c_k * n1, c_k * n2
                V[r, part], V[r, part + 1], V[r, part + 2] = e0, e1, e2
            elif kind == THREAD:
                slope = model.rows.c[k]
                n0, n1, n2 = cross(
                    e0, e1, e2,
                    w[MOMENT_B] + slope * w[0], w[MOMENT_B + 1] + slope * w[1], w[MOMENT_B + 2] + slope * w[2],
                )  # fmt: skip
                P_a[r, 3], P_a[r, 4], P_a[r, 5] = c_k * n0, c_k * n1, c_k * n2
                V[r, MOMENT_B], V[r, MOMENT_B + 1], V[r, MOMENT_B + 2] = e0, e1, e2
                V[r, 0], V[r, 1], V[r, 2] = slope * e0, slope * e1, slope * e2
            elif kind == SLIDE:
                put_pair(P_a, P_b, r, 0, -1.0, e0, e1, e2)
                P_a[r, 3], P_a[r, 4], P_a[r, 5] = cross(e0, e1, e2, r0, r1, r2)
                V[r, 0], V[r, 1], V[r, 2] = -model.rows.soft[k] * e0, -model.rows.soft[k] * e1, -model.rows.soft[k] * e2
            else:  # DOT, TURN, LINE_TURN
                y = model.rows.y[k]
                d0, d1, d2 = rotate(work.markers.A[b], y[0], y[1], y[2])
                n0, n1, n2 = cross(e0, e1, e2, d0, d1, d2)
                put_pair(P_a, P_b, r, 3, 1.0, n0, n1, n2)
                if kind == LINE_TURN:
                    line_turn_by_place(model, work, r, a, n0, n1, n2, P_a, P_b)
                if model.rows.soft[k] > 0.0:  # its change with the direction is left out: of second order
                    f = model.rows.soft[k]
                    V[r, part], V[r, part + 1], V[r, part + 2] = f * n0, f * n1, f * n2


@inner
def spring_derivatives(model, work, c, c_k):
    """Write P and V of spring c.

    d(s d)/dr_B = (k - s/l) d dᵀ + (s/l) 1 + (c/l) d (v - l_dot d)ᵀ,  d(s d)/dv_B = c d dᵀ.
    """
    P_a, P_b, V = (
        work.connections.P[model.connections.a[c]],
        work.connections.P[model.connections.b[c]],
        work.connections.V[c],
    )
    i, springs = model.connections.item[c], model.springs
    k, damping, free = springs.stiffness[i], springs.damping[i], springs.free_length[i]
    x0, x1, x2, y0, y1, y2, own_length = spring_line(model, work, c)
    if springs.table[i] >= 0:
        _, slope, _ = time_function(model, springs.table[i], own_length - free)
        k += slope
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
def moving_direction(model, work, k, a):
    """Return E, E_dot less omega_A × E, and E_ddot less alpha and omega terms, of row k: nine numbers, ground axes."""
    e0, e1, e2 = direction_of_a(model, work, k, a)
    if model.rows.kind[k] != TURN and model.rows.kind[k] != TURN_B:
        return e0, e1, e2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    angle, rate, second = prescribed(model, work, k)
    x, z, c, s = model.rows.x[k], model.rows.z[k], math.cos(angle), math.sin(angle)
    n0, n1, n2 = rotate(work.markers.A[a], c * z[0] - s * x[0], c * z[1] - s * x[1], c * z[2] - s * x[2])
    square = rate * rate
    return (
        e0, e1, e2, rate * n0, rate * n1, rate * n2,
        second * n0 - square * e0, second * n1 - square * e1, second * n2 - square * e2,
    )  # fmt: skip


@inner
def row_rate(model, work, k, a, b):
    """Return the rate of the held quantity of row k between markers a and b; zero for rows that hold none."""
    kind, x, y = model.rows.kind[k], model.rows.x[k], model.rows.y[k]
    o, p = work.markers.omega[a], work.markers.omega[b]
    v0, v1, v2 = (
        work.markers.v[b, 0] - work.markers.v[a, 0],
        work.markers.v[b, 1] - work.markers.v[a, 1],
        work.markers.v[b, 2] - work.markers.v[a, 2],
    )
    if kind == POINT:
        return -(x[0] * v0 + x[1] * v1 + x[2] * v2)
    r0, r1, r2 = distance(work, a, b)
    if kind == DISTANCE:
        length, rate, _ = prescribed(model, work, k)
        square = r0 * r0 + r1 * r1 + r2 * r2
        return (r0 * v0 + r1 * v1 + r2 * v2) / length - 0.5 * rate * (square / (length * length) + 1.0)
    if kind == SCREW:
        e0, e1, e2 = screw_axis(model, work, k, a)
        _, t0, t1, t2 = screw_angle(model, work, k, a, b)
        f0, f1, f2 = cross(o[0], o[1], o[2], e0, e1, e2)
        turning = t0 * (o[0] - p[0]) + t1 * (o[1] - p[1]) + t2 * (o[2] - p[2])
        return f0 * r0 + f1 * r1 + f2 * r2 + e0 * v0 + e1 * v1 + e2 * v2 - model.rows.c[k] * turning
    if kind == RIM_HEIGHT or kind == ROLL:
        return rolling_rate(model, work, k, a, b)
    if kind == LINE or kind == LINE_TURN:
        return line_rate(model, work, k, a, b)
    if kind == TURN_B:
        a, b, o, p = b, a, p, o
    if kind == DOT or kind == TURN or kind == TURN_B or kind == SLIDE:
        e0, e1, e2, f0, f1, f2, _, _, _ = moving_direction(model, work, k, a)
        n0, n1, n2 = cross(o[0], o[1], o[2], e0, e1, e2)
        f0, f1, f2 = f0 + n0, f1 + n1, f2 + n2
        if kind == SLIDE:
            _, rate, _ = prescribed(model, work, k)
            return f0 * r0 + f1 * r1 + f2 * r2 + e0 * v0 + e1 * v1 + e2 * v2 - rate
        d0, d1, d2 = rotate(work.markers.A[b], y[0], y[1], y[2])
        h0, h1, h2 = cross(p[0], p[1], p[2], d0, d1, d2)
        return f0 * d0 + f1 * d1 + f2 * d2 + e0 * h0 + e1 * h1 + e2 * h2
    return 0.0


@inner
def row_acceleration(model, work, k, a, b, bias_a, bias_b):
    """Return the second rate of the held quantity of row k for given accelerations (6) of both markers.

    E_ddot·D + 2 E_dot·D_dot + E·D_ddot with E_ddot = al × E + w × (w × E) + 2 w × E' + E'', E' and E'' the rates in A;
    the second rate of the angle of a screw is that of parallel axes.
    """
    kind, x, y = model.rows.kind[k], model.rows.x[k], model.rows.y[k]
    c0, c1, c2 = bias_b[0] - bias_a[0], bias_b[1] - bias_a[1], bias_b[2] - bias_a[2]
    if kind == POINT:
        return -(x[0] * c0 + x[1] * c1 + x[2] * c2)
    o, p = work.markers.omega[a], work.markers.omega[b]
    v0, v1, v2 = (
        work.markers.v[b, 0] - work.markers.v[a, 0],
        work.markers.v[b, 1] - work.markers.v[a, 1],
        work.markers.v[b, 2] - work.markers.v[a, 2],
    )
    r0, r1, r2 = distance(work, a, b)
    if kind == DISTANCE:
        L, rate, second = prescribed(model, work, k)
        square, slope = r0 * r0 + r1 * r1 + r2 * r2, r0 * v0 + r1 * v1 + r2 * v2
        own = (v0 * v0 + v1 * v1 + v2 * v2 + r0 * c0 + r1 * c1 + r2 * c2) / L - 2 * slope * rate / (L * L)
        return own + square * rate * rate / (L * L * L) - 0.5 * second * (square / (L * L) + 1.0)
    if kind == RIM_HEIGHT or kind == ROLL:
        return rolling_acceleration(model, work, k, a, b, bias_a, bias_b)
    if kind == LINE or kind == LINE_TURN:
        return line_acceleration(model, work, k, a, b, bias_a, bias_b)
    if kind == TURN_B:
        a, b, o, p, bias_a, bias_b = b, a, p, o, bias_b, bias_a
    if kind == DOT or kind == TURN or kind == TURN_B or kind == SLIDE or kind == SCREW:
        e0, e1, e2, t0, t1, t2, s0, s1, s2 = moving_direction(model, work, k, a)
        if kind == SCREW:
            e0, e1, e2 = screw_axis(model, work, k, a)
        f0, f1, f2 = cross(o[0], o[1], o[2], e0, e1, e2)
        n0, n1, n2 = cross(o[0], o[1], o[2], f0 + 2 * t0, f1 + 2 * t1, f2 + 2 * t2)
        a0, a1, a2 = cross(bias_a[3], bias_a[4], bias_a[5], e0, e1, e2)
        a0, a1, a2 = a0 + n0 + s0, a1 + n1 + s1, a2 + n2 + s2
        f0, f1, f2 = f0 + t0, f1 + t1, f2 + t2
        if kind == SLIDE or kind == SCREW:
            along = a0 * r0 + a1 * r1 + a2 * r2 + 2 * (f0 * v0 + f1 * v1 + f2 * v2) + e0 * c0 + e1 * c1 + e2 * c2
            if kind == SLIDE:
                _, _, second = prescribed(model, work, k)
                return along - second
            _, t0, t1, t2 = screw_angle(model, work, k, a, b)
            turning = t0 * (bias_a[3] - bias_b[3]) + t1 * (bias_a[4] - bias_b[4]) + t2 * (bias_a[5] - bias_b[5])
            return along - model.rows.c[k] * turning
        d0, d1, d2 = rotate(work.markers.A[b], y[0], y[1], y[2])
        h0, h1, h2 = cross(p[0], p[1], p[2], d0, d1, d2)
        hh0, hh1, hh2 = cross(p[0], p[1], p[2], h0, h1, h2)
        b0, b1, b2 = cross(bias_b[3], bias_b[4], bias_b[5], d0, d1, d2)
        return (
            a0 * d0 + a1 * d1 + a2 * d2
            + 2 * (f0 * h0 + f1 * h1 + f2 * h2)
            + e0 * (b0 + hh0) + e1 * (b1 + hh1) + e2 * (b2 + hh2)
        )  # fmt: skip
    return 0.0


@inner
def constraint_rates(model, work):
    """Write for every row the rate of the held quantity and its second rate at zero u_dot into `work.connections`.

    `evaluate` has been called for the iterate.
    """
    motion, rate, bias = work.markers.bias, work.connections.rate, work.connections.bias
    for m in range(model.markers.body.shape[0]):
        marker_acceleration_bias(model, work, m, motion[m])
    for c in range(model.connections.size.shape[0]):
        a, b = model.connections.a[c], model.connections.b[c]
        if model.connections.law[c] != JOINT:
            for k in range(model.connections.w0[c], model.connections.w0[c + 1]):
                rate[k], bias[k] = 0.0, 0.0
        if model.connections.law[c] == COUPLER:
            coupler_rates(model, work, c, rate, bias)
        if model.connections.law[c] != JOINT:
            continue
        for k in range(model.connections.w0[c], model.connections.w0[c + 1]):
            rate[k] = row_rate(model, work, k, a, b)
            bias[k] = row_acceleration(model, work, k, a, b, motion[a], motion[b])
