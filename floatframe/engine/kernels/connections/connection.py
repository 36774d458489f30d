"""Residual rows of connections as functions of the motion of their markers.

The unknown of the rows of a connection is its wrench w. Constraint rows of a joint have the unit of the constrained
quantity. Rows that define the wrench are multiplied by c_k, so that their unknown is c_k dw.
kernels/joints/row_formulas.py names the formulas of all kinds of rows. Constraint rows with a compliance `soft` s yield
by s c_k times their own force, far below the tolerance of positions, so that redundant rows share their load.
"""

from floatframe.engine.kernels.compiler.compilation import inner, small
from floatframe.engine.kernels.connections.coupler import (
    coupler_derivatives,
    coupler_rate,
    coupler_rates,
    coupler_rows,
)
from floatframe.engine.kernels.connections.element_law import law_derivatives, law_rates, law_rows
from floatframe.engine.kernels.connections.pair_force import pair_derivatives, pair_rows
from floatframe.engine.kernels.connections.user_force import user_force_derivatives, user_force_rows
from floatframe.engine.kernels.joints.relative_motion import (
    by_markers,
    put_pair,
    rate_along,
)
from floatframe.engine.kernels.joints.row_formulas import (
    held_by_place,
    held_gap,
    held_rate,
    held_rates,
    held_value,
    wrench_derivatives,
    wrench_value,
)
from floatframe.engine.kernels.marker_acceleration import marker_acceleration_bias
from floatframe.engine.kernels.model import COUPLER, ELEMENT, JOINT, USER_FORCE
from floatframe.engine.kernels.vector import dot, put, put_sum, scaled, sub, vector
from floatframe.model.joints.rows.kinds import NOTHING, POSITION, VELOCITY

__all__ = [
    "connection_derivatives",
    "connection_rows",
    "constraint_rates",
    "row_rates",
    "write_velocity_gaps",
]


@inner
def connection_rows(model, work, c, c_k):
    """Write the residual of connection c, and its wrench on its markers."""
    law = model.connections.law[c]
    if law == COUPLER:
        coupler_rows(model, work, c, c_k)
        return
    if law == USER_FORCE:
        user_force_rows(model, work, c, c_k)
        return
    if law == ELEMENT:
        law_rows(model, work, c, c_k)
        return
    a, b, w0, size = model.connections.a[c], model.connections.b[c], model.connections.w0[c], model.connections.size[c]
    w, wrench = work.state.w[w0 : w0 + size], work.markers.wrench
    put_sum(wrench[a], 0, vector(w))
    put_sum(wrench[b], 0, scaled(-1.0, vector(w)))
    if model.markers.moment[a] >= 0:
        put_sum(wrench[a], 3, vector(w[model.markers.moment[a] :]))
    if model.markers.moment[b] >= 0:
        put_sum(wrench[b], 3, scaled(-1.0, vector(w[model.markers.moment[b] :])))
    if law != JOINT:
        pair_rows(model, work, c, c_k)
    else:
        for k in range(w0, w0 + size):
            joint_row(model, work, k, a, b, w, c_k)


@small
def joint_row(model, work, k, a, b, w, c_k):
    """Write the residual of row k of a joint."""
    kind, soft = model.rows.kind[k], model.rows.soft[k]
    if model.rows.holds[k] == NOTHING:
        work.connections.g[k] = c_k * wrench_value(kind, model, work, k, a, b, w)
        return
    if soft == 0.0:
        work.connections.g[k] = held_gap(kind, model, work, k, a, b)
        return
    g, n, _, m_b = held_value(kind, model, work, k, a, b)
    work.connections.g[k] = g - soft * c_k * (dot(n, vector(w)) + dot(m_b, vector(w[model.rows.part[k] :])))


@inner
def connection_derivatives(model, work, c, c_k):
    """Write the derivatives of connection c: P by the motion of its markers, V by its own wrench."""
    law = model.connections.law[c]
    if law == COUPLER:
        coupler_derivatives(model, work, c, c_k)
        return
    if law == USER_FORCE:
        user_force_derivatives(model, work, c, c_k)
        return
    if law == ELEMENT:
        law_derivatives(model, work, c, c_k)
        return
    a, b, w0, size = model.connections.a[c], model.connections.b[c], model.connections.w0[c], model.connections.size[c]
    P_a, P_b, V = work.connections.P[a], work.connections.P[b], work.connections.V[c]
    for r in range(size):
        for j in range(12):
            P_a[r, j] = 0.0
            P_b[r, j] = 0.0
        for j in range(size):
            V[r, j] = 0.0
    if law != JOINT:
        pair_derivatives(model, work, c, c_k)
    else:
        w = work.state.w[w0 : w0 + size]
        for r in range(size):
            joint_row_derivatives(model, work, w0 + r, a, b, w, c_k, by_markers(work, a, b, r), V[r])


@small
def joint_row_derivatives(model, work, k, a, b, w, c_k, by, V):
    """Write derivatives of row k of a joint: by motions of its markers to `by`, by its wrench to V, (size,).

    For c_k = 0 rows serve to find velocities or accelerations; P of a velocity constraint then has its derivatives by
    velocities in the columns of positions. The change of a soft row's reaction due to its change of direction is
    omitted: it is of second order.
    """
    kind, holds = model.rows.kind[k], model.rows.holds[k]
    if holds == NOTHING:
        wrench_derivatives(kind, model, work, k, a, b, w, c_k, by, V)
        return
    _, n, m_a, m_b = held_value(kind, model, work, k, a, b)
    first = 0
    if holds == VELOCITY and c_k > 0.0:
        first = 6
        held_by_place(kind, model, work, k, a, b, by)
    put_pair(by, first, scaled(-1.0, n))
    put(by.a, first + 3, m_a)
    put(by.b, first + 3, m_b)
    soft = model.rows.soft[k]
    if soft > 0.0:
        put_sum(V, 0, scaled(-soft, n))
        put_sum(V, model.rows.part[k], scaled(-soft, m_b))


@inner
def write_velocity_gaps(model, work, c, factor, gap):
    """Write g - factor dg/dt for the position constraints of joint or coupler c into gap, (n_w,), and zero elsewhere.

    The gap of elements is set to zero too, because their rates need many evaluations of the law.
    """
    law, g, w0, end = model.connections.law[c], work.connections.g, model.connections.w0[c], model.connections.w0[c + 1]
    if law != JOINT:
        for k in range(w0, end):
            gap[k] = 0.0
        if law == COUPLER:
            k = model.elements.core[model.connections.item[c]]
            if model.rows.holds[k] == POSITION:
                gap[k] = g[k] - factor * coupler_rate(model, work, c)
        return
    a, b = model.connections.a[c], model.connections.b[c]
    for k in range(w0, end):
        gap[k] = 0.0
        if model.rows.holds[k] == POSITION:
            gap[k] = g[k] - factor * held_rate(model.rows.kind[k], model, work, k, a, b)


@inner
def row_rates(model, work, k, a, b):
    """Return the rate of row k's constrained quantity and its second rate at zero u_dot; zero for other rows.

    For a velocity constraint, return the velocity and its rate. `work.markers.bias` contains the accelerations of
    markers at zero u_dot.
    """
    rows = model.rows
    if rows.holds[k] == NOTHING:
        return 0.0, 0.0
    kind, markers = rows.kind[k], work.markers
    _, n, m_a, m_b = held_value(kind, model, work, k, a, b)
    rate, second = held_rates(kind, model, work, k, a, b)
    rate += rate_along(markers, a, b, n, m_a, m_b)
    bias_a, bias_b = markers.bias[a], markers.bias[b]
    turning = dot(m_a, vector(bias_a[3:])) + dot(m_b, vector(bias_b[3:]))
    return rate, second + dot(n, sub(bias_b, bias_a)) + turning


@inner
def constraint_rates(model, work):
    """Write, for every row, the rate of the constrained quantity and its second rate at zero u_dot.

    `evaluate` must have been called for the iterate.
    """
    for m in range(model.markers.body.shape[0]):
        marker_acceleration_bias(model, work, m, work.markers.bias[m])
    for c in range(model.connections.size.shape[0]):
        connection_rates(model, work, c)


@inner
def connection_rates(model, work, c):
    """Write the result of `constraint_rates` for connection c, from accelerations in `work.markers.bias`."""
    rate, bias = work.connections.rate, work.connections.bias
    a, b = model.connections.a[c], model.connections.b[c]
    for k in range(model.connections.w0[c], model.connections.w0[c + 1]):
        rate[k], bias[k] = 0.0, 0.0
        if model.connections.law[c] == JOINT:
            rate[k], bias[k] = row_rates(model, work, k, a, b)
    if model.connections.law[c] == COUPLER:
        coupler_rates(model, work, c, rate, bias)
    elif model.connections.law[c] == ELEMENT:
        law_rates(model, work, c, rate, bias)
