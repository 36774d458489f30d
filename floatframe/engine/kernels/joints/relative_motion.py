"""Relative motion of two markers, the basis of rows of joints and coordinates."""

import math

from floatframe.engine.kernels.compiler.compilation import inner, small
from floatframe.engine.kernels.time_function import time_function
from floatframe.engine.kernels.vector import add, cross, dot, put, put_sum, scaled, sub, turned, vector
from floatframe.model.joints.rows.kinds import PUSH, TWIST_B

__all__ = [
    "add_coordinate_gradient",
    "add_pair",
    "angle_between",
    "axis_between",
    "direction",
    "distance",
    "loaded_axis",
    "loaded_coordinate",
    "prescribed",
    "prescribed_at",
    "put_pair",
    "relative_velocity",
    "slip",
    "turned_angle",
]


@inner
def prescribed(model, work, k):
    """Return the prescribed value of row k at the time of the iterate, with its first and second rate."""
    return prescribed_at(model, k, work.state.time)


@inner
def prescribed_at(model, k, t):
    """Return the prescribed value of row k at time t with its first and second rate; a constant without motion."""
    if model.rows.motion[k] < 0:
        return model.rows.c[k], 0.0, 0.0
    return time_function(model.functions, model.rows.motion[k], t)


@small
def direction(markers, m, x):
    """Return the direction x of marker m in ground axes."""
    return turned(markers.A[m], vector(x))


@small
def distance(markers, a, b):
    """Return the vector d = r_B - r_A."""
    return sub(vector(markers.r[b]), vector(markers.r[a]))


@small
def relative_velocity(markers, a, b):
    """Return the relative velocity v_B - v_A."""
    return sub(vector(markers.v[b]), vector(markers.v[a]))


@inner
def slip(markers, a, b, d):
    """Return the velocity of the point of B relative to A: v_B - v_A - omega_A × d."""
    return sub(relative_velocity(markers, a, b), cross(vector(markers.omega[a]), d))


@inner
def angle_between(rows, markers, k, a, b):
    """Return the angle th of D about the axis of row k in A, and its derivative by a rotation of A (by B: opposite).

    th = atan2(S, C), S = -E · D, C = Z · D;  t = -(C E × D + S Z × D)/(S² + C²).
    """
    E, Z = direction(markers, a, rows.x[k]), direction(markers, a, rows.z[k])
    D = direction(markers, b, rows.y[k])
    S, C = -dot(E, D), dot(Z, D)
    t = scaled(-1.0 / (S * S + C * C), add(scaled(C, cross(E, D)), scaled(S, cross(Z, D))))
    return math.atan2(S, C), t


@small
def axis_between(rows, markers, k, a):
    """Return the axis x × z of row k in A, ground axes."""
    return turned(markers.A[a], cross(vector(rows.x[k]), vector(rows.z[k])))


@inner
def turned_angle(rows, markers, k, a, b):
    """Return the angle of B about the axis of row k in A (TWIST_B: in B), and its derivative by a rotation of A.

    The derivative by a rotation of B is the opposite.
    """
    if rows.kind[k] == TWIST_B:
        angle, t = angle_between(rows, markers, k, b, a)
        return -angle, t
    return angle_between(rows, markers, k, a, b)


@inner
def loaded_axis(rows, markers, k, a, b):
    """Return the axis of a coordinate along which forces act, ground axes."""
    if rows.kind[k] == PUSH:
        return direction(markers, a, rows.x[k])
    return axis_between(rows, markers, k, b if rows.kind[k] == TWIST_B else a)


@inner
def loaded_coordinate(rows, markers, k, a, b):
    """Return value and rate of a coordinate along which forces act.

    It is a distance along an axis of A, or an angle about it (TWIST_B: about an axis of B).
    """
    e = loaded_axis(rows, markers, k, a, b)
    if rows.kind[k] != PUSH:
        angle, _ = turned_angle(rows, markers, k, a, b)
        return angle, dot(e, sub(vector(markers.omega[b]), vector(markers.omega[a])))
    d = distance(markers, a, b)
    return dot(e, d), dot(e, slip(markers, a, b, d))


@inner
def add_coordinate_gradient(rows, markers, k, a, b, P_a, P_b, r, by_x, by_v):
    """Add by_x dx + by_v dv to row r of P; x, v: value and rate of the coordinate of row k, see `loaded_rows`."""
    e = loaded_axis(rows, markers, k, a, b)
    add_pair(P_a, P_b, r, 9 if rows.kind[k] != PUSH else 6, scaled(-by_v, e))
    if rows.kind[k] != PUSH:
        _, t = turned_angle(rows, markers, k, a, b)
        add_pair(P_a, P_b, r, 3, scaled(by_x, t))
        turn = cross(e, sub(vector(markers.omega[b]), vector(markers.omega[a])))
        put_sum(P_b[r] if rows.kind[k] == TWIST_B else P_a[r], 3, scaled(by_v, turn))
        return
    d = distance(markers, a, b)
    arm, s = cross(e, d), slip(markers, a, b, d)
    add_pair(P_a, P_b, r, 0, sub(scaled(by_v, cross(e, vector(markers.omega[a]))), scaled(by_x, e)))
    put_sum(P_a[r], 3, add(scaled(by_x, arm), scaled(by_v, cross(e, s))))
    put_sum(P_a[r], 9, scaled(by_v, arm))


@small
def add_pair(P_a, P_b, r, column, x):
    """Add x to row r of P at marker A, and -x at marker B."""
    put_sum(P_a[r], column, x)
    put_sum(P_b[r], column, scaled(-1.0, x))


@small
def put_pair(P_a, P_b, r, column, x):
    """Write x into row r of P at marker A, and -x at marker B."""
    put(P_a[r], column, x)
    put(P_b[r], column, scaled(-1.0, x))
