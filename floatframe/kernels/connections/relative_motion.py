"""Relative motion of two markers: what rows of joints and coordinates are made of."""

import math

from floatframe.joints.rows import PUSH, TURN, TURN_B, TWIST_B
from floatframe.kernels.compiler.compilation import inner
from floatframe.kernels.connections.time_function import time_function
from floatframe.kernels.marker import cross, rotate

__all__ = [
    "direction_of_a",
    "distance",
    "loaded_axis",
    "loaded_coordinate",
    "prescribed",
    "put_pair",
    "screw_angle",
    "screw_axis",
    "slip",
    "turned_angle",
]


@inner
def prescribed(model, work, k):
    """Return the motion of row k at the time of the iterate, its rate and its second rate; its constant without."""
    if model.rows.motion[k] < 0:
        return model.rows.c[k], 0.0, 0.0
    value, rate, second = time_function(model, model.rows.motion[k], work.state.time)
    if model.rows.kind[k] == TURN_B:  # seen from B, A turns back
        return -value, -rate, -second
    return value, rate, second


@inner
def direction_of_a(model, work, k, a):
    """Return the direction of marker a in row k, ground axes; that of a prescribed angle turns with time."""
    x = model.rows.x[k]
    if model.rows.kind[k] == TURN or model.rows.kind[k] == TURN_B:
        angle, _, _ = prescribed(model, work, k)
        z, c, s = model.rows.z[k], math.cos(angle), math.sin(angle)
        return rotate(work.markers.A[a], c * x[0] + s * z[0], c * x[1] + s * z[1], c * x[2] + s * z[2])
    return rotate(work.markers.A[a], x[0], x[1], x[2])


@inner
def distance(work, a, b):
    """Return r_B - r_A."""
    return (
        work.markers.r[b, 0] - work.markers.r[a, 0],
        work.markers.r[b, 1] - work.markers.r[a, 1],
        work.markers.r[b, 2] - work.markers.r[a, 2],
    )


@inner
def screw_angle(model, work, k, a, b):
    """Return the angle of D about Z × (-E), and its derivative by a rotation of A (of B: the opposite).

    th = atan2(S, C), S = -E·D, C = Z·D.
    """
    x, y, z = model.rows.x[k], model.rows.y[k], model.rows.z[k]
    e0, e1, e2 = rotate(work.markers.A[a], x[0], x[1], x[2])
    z0, z1, z2 = rotate(work.markers.A[a], z[0], z[1], z[2])
    d0, d1, d2 = rotate(work.markers.A[b], y[0], y[1], y[2])
    S, C = -(e0 * d0 + e1 * d1 + e2 * d2), z0 * d0 + z1 * d1 + z2 * d2
    p0, p1, p2 = cross(e0, e1, e2, d0, d1, d2)
    q0, q1, q2 = cross(z0, z1, z2, d0, d1, d2)
    f = -1.0 / (S * S + C * C)
    return math.atan2(S, C), f * (C * p0 + S * q0), f * (C * p1 + S * q1), f * (C * p2 + S * q2)


@inner
def screw_axis(model, work, k, a):
    """Return the axis x × z of a screw, ground axes."""
    x, z = model.rows.x[k], model.rows.z[k]
    n0, n1, n2 = cross(x[0], x[1], x[2], z[0], z[1], z[2])
    return rotate(work.markers.A[a], n0, n1, n2)


@inner
def turned_angle(model, work, k, a, b):
    """Return the angle of B about an axis of A (TWIST_B: of B), and its derivative by a rotation of A.

    By a rotation of B: the opposite.
    """
    if model.rows.kind[k] == TWIST_B:
        angle, t0, t1, t2 = screw_angle(model, work, k, b, a)
        return -angle, t0, t1, t2
    return screw_angle(model, work, k, a, b)


@inner
def loaded_axis(model, work, k, a, b):
    """Return the axis of a coordinate with forces, ground axes."""
    if model.rows.kind[k] == PUSH:
        x = model.rows.x[k]
        return rotate(work.markers.A[a], x[0], x[1], x[2])
    return screw_axis(model, work, k, b if model.rows.kind[k] == TWIST_B else a)


@inner
def loaded_coordinate(model, work, k, a, b):
    """Return value and rate of a coordinate with forces.

    It is a distance along an axis of A, or an angle about it (TWIST_B: about an axis of B).
    """
    e0, e1, e2 = loaded_axis(model, work, k, a, b)
    o, p = work.markers.omega[a], work.markers.omega[b]
    if model.rows.kind[k] != PUSH:
        angle, _, _, _ = turned_angle(model, work, k, a, b)
        return angle, e0 * (p[0] - o[0]) + e1 * (p[1] - o[1]) + e2 * (p[2] - o[2])
    r0, r1, r2 = distance(work, a, b)
    v0, v1, v2 = slip(work, a, b, r0, r1, r2)
    return e0 * r0 + e1 * r1 + e2 * r2, e0 * v0 + e1 * v1 + e2 * v2


@inner
def slip(work, a, b, r0, r1, r2):
    """Return the velocity of the point of B as seen from A: v_B - v_A - omega_A × d."""
    o = work.markers.omega[a]
    n0, n1, n2 = cross(o[0], o[1], o[2], r0, r1, r2)
    return (
        work.markers.v[b, 0] - work.markers.v[a, 0] - n0,
        work.markers.v[b, 1] - work.markers.v[a, 1] - n1,
        work.markers.v[b, 2] - work.markers.v[a, 2] - n2,
    )


@inner
def put_pair(P_a, P_b, r, column, factor, x0, x1, x2):
    """Write factor * x into a row of P at A, and its opposite at B."""
    P_a[r, column], P_a[r, column + 1], P_a[r, column + 2] = factor * x0, factor * x1, factor * x2
    P_b[r, column], P_b[r, column + 1], P_b[r, column + 2] = -factor * x0, -factor * x1, -factor * x2
