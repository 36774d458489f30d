"""Relative motion of two markers, the basis of rows of joints and coordinates."""

import math
from typing import NamedTuple

from fe_models.foundation.arrays import Array
from floatframe.engine.kernels.compiler.compilation import inner, small, view
from floatframe.engine.kernels.time_function import time_function
from floatframe.engine.kernels.vector import add, cross, dot, norm, put, put_sum, scaled, sub, turned, vector
from floatframe.model.joints.rows.kinds import PUSH, SPAN, TWIST_B

__all__ = [
    "ByMarkers",
    "add_coordinate_gradient",
    "add_pair",
    "angle_between",
    "axis_between",
    "by_markers",
    "coordinate_at",
    "direction",
    "distance",
    "loaded_axis",
    "loaded_coordinate",
    "prescribed",
    "prescribed_at",
    "put_pair",
    "rate_along",
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


@small
def rate_along(markers, a, b, n, m_a, m_b):
    """Return n · (v_B - v_A) + m_a · omega_A + m_b · omega_B."""
    turning = dot(m_a, vector(markers.omega[a])) + dot(m_b, vector(markers.omega[b]))
    return dot(n, relative_velocity(markers, a, b)) + turning


@inner
def angle_between(rows, A, k, a, b):
    """Return the angle th of D about the axis of row k in A, and its derivative by a rotation of A (by B: opposite).

    th = atan2(S, C), S = -E · D, C = Z · D;  t = -(C E × D + S Z × D)/(S² + C²);  A: axes of the markers.
    """
    E, Z = turned(A[a], vector(rows.x[k])), turned(A[a], vector(rows.z[k]))
    D = turned(A[b], vector(rows.y[k]))
    S, C = -dot(E, D), dot(Z, D)
    t = scaled(-1.0 / (S * S + C * C), add(scaled(C, cross(E, D)), scaled(S, cross(Z, D))))
    return math.atan2(S, C), t


@small
def axis_between(rows, markers, k, a):
    """Return the axis x × z of row k in A, ground axes."""
    return turned(markers.A[a], cross(vector(rows.x[k]), vector(rows.z[k])))


@inner
def turned_angle(rows, A, k, a, b):
    """Return the angle of B about the axis of row k in A (TWIST_B: in B), and its derivative by a rotation of A.

    The derivative by a rotation of B is the opposite.
    """
    if rows.kind[k] == TWIST_B:
        angle, t = angle_between(rows, A, k, b, a)
        return -angle, t
    return angle_between(rows, A, k, a, b)


@inner
def loaded_axis(rows, markers, k, a, b):
    """Return the axis of a coordinate along which forces act, ground axes."""
    if rows.kind[k] == PUSH:
        return direction(markers, a, rows.x[k])
    return axis_between(rows, markers, k, b if rows.kind[k] == TWIST_B else a)


@inner
def coordinate_at(rows, r, A, k, a, b):
    """Return the coordinate of row k for positions r and axes A of the markers; angles are between -pi and pi."""
    if rows.kind[k] != PUSH and rows.kind[k] != SPAN:
        angle, _ = turned_angle(rows, A, k, a, b)
        return angle
    d = sub(vector(r[b]), vector(r[a]))
    return norm(d) if rows.kind[k] == SPAN else dot(turned(A[a], vector(rows.x[k])), d)


@inner
def loaded_coordinate(rows, markers, k, a, b):
    """Return value and rate of a coordinate along which forces act.

    It is a distance along an axis of A, or an angle about it (TWIST_B: about an axis of B).
    """
    x, e = coordinate_at(rows, markers.r, markers.A, k, a, b), loaded_axis(rows, markers, k, a, b)
    if rows.kind[k] != PUSH:
        return x, dot(e, sub(vector(markers.omega[b]), vector(markers.omega[a])))
    return x, dot(e, slip(markers, a, b, distance(markers, a, b)))


@inner
def add_coordinate_gradient(rows, markers, k, a, b, by, by_x, by_v):
    """Add by_x dx + by_v dv to a row of P; x, v: value and rate of the coordinate of row k, see `loaded_rows`."""
    e = loaded_axis(rows, markers, k, a, b)
    add_pair(by, 9 if rows.kind[k] != PUSH else 6, scaled(-by_v, e))
    if rows.kind[k] != PUSH:
        _, t = turned_angle(rows, markers.A, k, a, b)
        add_pair(by, 3, scaled(by_x, t))
        turn = cross(e, sub(vector(markers.omega[b]), vector(markers.omega[a])))
        put_sum(by.b if rows.kind[k] == TWIST_B else by.a, 3, scaled(by_v, turn))
        return
    d = distance(markers, a, b)
    arm, s = cross(e, d), slip(markers, a, b, d)
    add_pair(by, 0, sub(scaled(by_v, cross(e, vector(markers.omega[a]))), scaled(by_x, e)))
    put_sum(by.a, 3, add(scaled(by_x, arm), scaled(by_v, cross(e, s))))
    put_sum(by.a, 9, scaled(by_v, arm))


class ByMarkers(NamedTuple):
    """Derivatives of one row of a connection by displacement, rotation, velocity and angular velocity of its markers.

    They are parts of P, (12,) each.
    """

    a: Array  #: by the motion of marker A
    b: Array


@view
def by_markers(work, a, b, r):
    """Return row r of P at markers a and b."""
    return ByMarkers(work.connections.P[a, r], work.connections.P[b, r])


@small
def add_pair(by, column, x):
    """Add x to a row of P at marker A, and -x at marker B."""
    put_sum(by.a, column, x)
    put_sum(by.b, column, scaled(-1.0, x))


@small
def put_pair(by, column, x):
    """Write x into a row of P at marker A, and -x at marker B."""
    put(by.a, column, x)
    put(by.b, column, scaled(-1.0, x))
