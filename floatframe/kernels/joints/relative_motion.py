"""Relative motion of two markers: what rows of joints and coordinates are made of."""

import math

from floatframe.joints.rows.kinds import PUSH, TWIST_B
from floatframe.kernels.compiler.compilation import inner, small
from floatframe.kernels.time_function import time_function
from floatframe.kernels.vector import add, cross, dot, put, scaled, sub, turned, vector

__all__ = [
    "angle_between",
    "axis_between",
    "direction",
    "distance",
    "loaded_axis",
    "loaded_coordinate",
    "prescribed",
    "put_pair",
    "relative_velocity",
    "slip",
    "turned_angle",
]


@inner
def prescribed(model, work, k):
    """Return the motion of row k at the time of the iterate, its rate and its second rate; its constant without."""
    if model.rows.motion[k] < 0:
        return model.rows.c[k], 0.0, 0.0
    return time_function(model, model.rows.motion[k], work.state.time)


@small
def direction(work, m, x):
    """Return the direction x of marker m in ground axes."""
    return turned(work.markers.A[m], vector(x))


@small
def distance(work, a, b):
    """Return d = r_B - r_A."""
    return sub(vector(work.markers.r[b]), vector(work.markers.r[a]))


@small
def relative_velocity(work, a, b):
    """Return v_B - v_A."""
    return sub(vector(work.markers.v[b]), vector(work.markers.v[a]))


@inner
def slip(work, a, b, d):
    """Return the velocity of the point of B as seen from A: v_B - v_A - omega_A × d."""
    return sub(relative_velocity(work, a, b), cross(vector(work.markers.omega[a]), d))


@inner
def angle_between(model, work, k, a, b):
    """Return the angle th of D about the axis of row k in A, and its derivative t by a rotation of A (of B: -t).

    th = atan2(S, C), S = -E · D, C = Z · D;  t = -(C E × D + S Z × D)/(S² + C²).
    """
    E, Z = direction(work, a, model.rows.x[k]), direction(work, a, model.rows.z[k])
    D = direction(work, b, model.rows.y[k])
    S, C = -dot(E, D), dot(Z, D)
    t = scaled(-1.0 / (S * S + C * C), add(scaled(C, cross(E, D)), scaled(S, cross(Z, D))))
    return math.atan2(S, C), t


@small
def axis_between(model, work, k, a):
    """Return the axis x × z of row k in A, ground axes."""
    return turned(work.markers.A[a], cross(vector(model.rows.x[k]), vector(model.rows.z[k])))


@inner
def turned_angle(model, work, k, a, b):
    """Return the angle of B about an axis of A (TWIST_B: of B), and its derivative by a rotation of A.

    By a rotation of B: the opposite.
    """
    if model.rows.kind[k] == TWIST_B:
        angle, t = angle_between(model, work, k, b, a)
        return -angle, t
    return angle_between(model, work, k, a, b)


@inner
def loaded_axis(model, work, k, a, b):
    """Return the axis of a coordinate with forces, ground axes."""
    if model.rows.kind[k] == PUSH:
        return direction(work, a, model.rows.x[k])
    return axis_between(model, work, k, b if model.rows.kind[k] == TWIST_B else a)


@inner
def loaded_coordinate(model, work, k, a, b):
    """Return value and rate of a coordinate with forces.

    It is a distance along an axis of A, or an angle about it (TWIST_B: about an axis of B).
    """
    e = loaded_axis(model, work, k, a, b)
    if model.rows.kind[k] != PUSH:
        angle, _ = turned_angle(model, work, k, a, b)
        return angle, dot(e, sub(vector(work.markers.omega[b]), vector(work.markers.omega[a])))
    d = distance(work, a, b)
    return dot(e, d), dot(e, slip(work, a, b, d))


@small
def put_pair(P_a, P_b, r, column, x):
    """Write x into a row of P at A, and its opposite at B."""
    put(P_a[r], column, x)
    put(P_b[r], column, scaled(-1.0, x))
