"""Coordinates of joints or markers through which couplers and user forces act on the system.

A coordinate has a value x, its rate v and a force Q that acts to increase x (its power is Q v). With d = r_B - r_A and
e an axis of A:

    PUSH     x = e · d             v = e · (v_B - v_A - omega_A × d)     force Q e on B at its point
    TWIST    x angle of B about e  v = e · (omega_B - omega_A)           torque Q e on B
    TWIST_B  the same about an axis of B
    SPAN     x = |d|               v = d · (v_B - v_A)/|d|               force Q d/|d| on B

and the opposite on A. The rows of a coordinate are, in this order: x and v as unknowns (so that angles continue beyond
a turn: the angle nearest to the previous value), the force or torque on A (3), and the moment on A (3) for a PUSH if A
is on a body,

    X - x = 0,   v' - v = 0,   F + Q e = 0,   M - d × F = 0.
"""

import math

from floatframe.engine.kernels.compiler.compilation import inner, small
from floatframe.engine.kernels.joints.relative_motion import (
    add_coordinate_gradient,
    add_pair,
    by_markers,
    distance,
    loaded_axis,
    loaded_coordinate,
    relative_velocity,
    turned_angle,
)
from floatframe.engine.kernels.vector import add, cross, dot, norm, put, put_sum, scaled, sub, unit, vector
from floatframe.model.joints.rows.kinds import PUSH, SPAN, TWIST_B

__all__ = [
    "coordinate_gradient",
    "coordinate_motion",
    "coordinate_second_rate",
    "coordinate_tangent_rate",
    "derivatives_along_coordinates",
    "ends_and_row",
    "indices_of",
    "predict_coordinate",
    "rows_along_coordinates",
]


@small
def indices_of(model, c):
    """Return the index of connection c among couplers and user forces, and the range of its coordinates."""
    i = model.connections.item[c]
    return i, model.elements.coordinate0[i], model.elements.coordinate0[i + 1]


@small
def ends_and_row(model, p):
    """Return the markers of coordinate p, and its first row."""
    return model.coordinates.a[p], model.coordinates.b[p], model.coordinates.row[p]


@inner
def force_direction(model, work, p):
    """Return the direction of the force along coordinate p, ground axes."""
    rows, markers = model.rows, work.markers
    a, b, k = ends_and_row(model, p)
    if rows.kind[k] == SPAN:
        d = distance(markers, a, b)
        return scaled(1 / norm(d), d)
    return loaded_axis(rows, markers, k, a, b)


@inner
def relative_rotation(markers, a, b):
    """Return the relative angular velocity omega_B - omega_A."""
    return sub(markers.omega[b], markers.omega[a])


@inner
def turning_gradient(model, work, k, a, b):
    """Return the derivative of an angle by a rotation of A; for a rotation of B it has the opposite sign."""
    _, t = turned_angle(model.rows, work.markers.A, k, a, b)
    return t


@inner
def coordinate_motion(model, work, p):
    """Return value and rate of coordinate p; for an angle the value nearest to the unknown X."""
    rows, markers = model.rows, work.markers
    a, b, k = ends_and_row(model, p)
    if rows.kind[k] == SPAN:
        e = force_direction(model, work, p)
        return dot(e, distance(markers, a, b)), dot(e, relative_velocity(markers, a, b))
    x, v = loaded_coordinate(rows, markers, k, a, b)
    if rows.kind[k] != PUSH:
        x += 2 * math.pi * math.floor((work.state.w[k] - x) / (2 * math.pi) + 0.5)
    return x, v


@inner
def predict_coordinate(coordinates, state, p, h):
    """Advance the unknown X of coordinate p by its rate, so that fast angles are counted correctly."""
    k = coordinates.row[p]
    state.w[k] += h * state.w[k + 1]


@inner
def rows_along_coordinates(model, work, c, c_k):
    """Write the rows of the coordinates of connection c, and the wrenches of its forces."""
    _, first, last = indices_of(model, c)
    for p in range(first, last):
        coordinate_rows(model, work, p, c_k)


@small
def force_along(model, work, p):
    """Return the force along coordinate p."""
    return model.coordinates.factor[p] * work.state.w[model.coordinates.core[p]]


@inner
def coordinate_rows(model, work, p, c_k):
    """Write the rows of coordinate p, and the wrench that its force applies to both markers."""
    a, b, k = ends_and_row(model, p)
    g, w, wrench = work.connections.g, work.state.w, work.markers.wrench
    x, v = coordinate_motion(model, work, p)
    g[k] = c_k * (w[k] - x)
    g[k + 1] = c_k * (w[k + 1] - v)
    f, m = model.coordinates.force[p], model.coordinates.arm[p]
    if f < 0:
        return
    F = vector(w[f:])
    put(g, f, scaled(c_k, add(F, scaled(force_along(model, work, p), force_direction(model, work, p)))))
    first = 0 if model.markers.force[a] >= 0 else 3
    put_sum(wrench[a], first, F)
    put_sum(wrench[b], first, scaled(-1.0, F))
    if m >= 0:
        M = vector(w[m:])
        put(g, m, scaled(c_k, sub(M, cross(distance(work.markers, a, b), F))))
        put_sum(wrench[a], 3, M)


@inner
def coordinate_gradient(model, work, p, r, by_x, by_v):
    """Add by_x dx + by_v dv to row r of P at both markers; x, v: value and rate of coordinate p."""
    markers = work.markers
    a, b, k = ends_and_row(model, p)
    by = by_markers(work, a, b, r)
    if model.rows.kind[k] != SPAN:
        add_coordinate_gradient(model.rows, markers, k, a, b, by, by_x, by_v)
        return
    e, d, v = force_direction(model, work, p), distance(markers, a, b), relative_velocity(markers, a, b)
    across = sub(v, scaled(dot(e, v), e))
    add_pair(by, 0, sub(scaled(-by_x, e), scaled(by_v / dot(e, d), across)))
    add_pair(by, 6, scaled(-by_v, e))


@inner
def derivatives_along_coordinates(model, work, c, c_k):
    """Write P and V for the rows of the coordinates of connection c, and set those of its other rows to zero."""
    size, V = model.connections.size[c], work.connections.V[c]
    _, first, last = indices_of(model, c)
    for r in range(size):
        for j in range(size):
            V[r, j] = 0.0
        for p in range(first, last):
            for j in range(12):
                work.connections.P[model.coordinates.a[p], r, j] = 0.0
                work.connections.P[model.coordinates.b[p], r, j] = 0.0
    for p in range(first, last):
        coordinate_derivatives(model, work, c, p, c_k)


@inner
def coordinate_derivatives(model, work, c, p, c_k):
    """Write P and V for the rows of coordinate p of connection c."""
    a, b, k = ends_and_row(model, p)
    w0 = model.connections.w0[c]
    V = work.connections.V[c]
    r = k - w0
    V[r, r], V[r + 1, r + 1] = 1.0, 1.0
    coordinate_gradient(model, work, p, r, -c_k, 0.0)
    coordinate_gradient(model, work, p, r + 1, 0.0, -c_k)
    f, m = model.coordinates.force[p], model.coordinates.arm[p]
    if f < 0:
        return
    Q, column, by_unknown = force_along(model, work, p), model.coordinates.core[p], model.coordinates.factor[p]
    e, d, kind = force_direction(model, work, p), distance(work.markers, a, b), model.rows.kind[k]
    for i in range(3):  # row of F + Q e for an axis of the ground
        axis, r = unit(i), f - w0 + i
        by = by_markers(work, a, b, r)
        V[r, r] = 1.0
        V[r, column - w0] = by_unknown * dot(axis, e)
        if kind == SPAN:  # de = (1 - e eᵀ) dd / |d|
            add_pair(by, 0, scaled(-c_k * Q / norm(d), sub(axis, scaled(dot(axis, e), e))))
        else:  # axis · (dphi × e) = dphi · (e × axis)
            put_sum(by.b if kind == TWIST_B else by.a, 3, scaled(c_k * Q, cross(e, axis)))
    if m < 0:
        return
    F = vector(work.state.w[f:])
    for i in range(3):  # row of M - d × F for an axis of the ground
        axis, r = unit(i), m - w0 + i
        V[r, r] = 1.0
        put(V[r], f - w0, cross(d, axis))  # axis · (d × dF) = dF · (axis × d)
        add_pair(by_markers(work, a, b, r), 0, scaled(c_k, cross(F, axis)))  # axis · (dd × F) = dd · (F × axis)


@inner
def coordinate_tangent_rate(model, work, p):
    """Return the rate of coordinate p from its gradient; it differs from v for an angle of non-parallel axes."""
    rows = model.rows
    a, b, k = ends_and_row(model, p)
    if rows.kind[k] == SPAN or rows.kind[k] == PUSH:
        _, v = coordinate_motion(model, work, p)
        return v
    return -dot(turning_gradient(model, work, k, a, b), relative_rotation(work.markers, a, b))


@inner
def coordinate_second_rate(model, work, p, bias_a, bias_b):
    """Return the second rate of coordinate p for given accelerations (6) of its two markers.

    The formula for angles is valid for parallel axes.
    """
    markers = work.markers
    a, b, k = ends_and_row(model, p)
    kind = model.rows.kind[k]
    if kind != SPAN and kind != PUSH:
        return -dot(turning_gradient(model, work, k, a, b), sub(bias_b[3:], bias_a[3:]))
    e, d, v = force_direction(model, work, p), distance(markers, a, b), relative_velocity(markers, a, b)
    along = dot(e, sub(bias_b, bias_a))
    if kind == SPAN:
        return along + (dot(v, v) - dot(e, v) ** 2) / dot(e, d)
    omega_a = vector(markers.omega[a])
    e_dot = cross(omega_a, e)
    e_ddot = add(cross(omega_a, e_dot), cross(bias_a[3:], e))
    return along + dot(e_ddot, d) + 2 * dot(e_dot, v)
