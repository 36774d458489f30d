"""Constraint rows between two markers: values, and derivatives by the motion and explicitly by time.

The constrained quantity g of a row depends on d = r_B - r_A, on the axes of both markers and on time, so that

    dg     = n · (dr_B - dr_A) + m_a · dphi_A + m_b · dphi_B + (dg/dt) dt
    g_ddot = n · (a_B - a_A) + m_a · alpha_A + m_b · alpha_B + beta

The force n on B, -n on A, with the moments m_b, m_a, is its unit reaction. A kind consists of two functions of
(model, work, k, a, b):

    value   g, n, m_a, m_b
    rates   dg/dt, beta

A row that constrains a velocity (ROLL) has the same form: g is the velocity, n, m_a, m_b are its derivatives by the
velocities of the markers, and beta is its rate at zero accelerations.

Most rows are products of two vectors, each fixed in A, fixed in B, or d. A direction E of A may also rotate relative to
A, with the rates E_t and E_tt. With omega_A = o, the product rule needs

    E_dot = o × E + E_t,   E_ddot - alpha × E = o × (o × E) + 2 o × E_t + E_tt
"""

import math

from floatframe.engine.kernels.compiler.compilation import inner, small
from floatframe.engine.kernels.joints.relative_motion import (
    angle_between,
    axis_between,
    direction,
    distance,
    prescribed,
    prescribed_at,
    relative_velocity,
)
from floatframe.engine.kernels.vector import add, cross, dot, scaled, sub, turned, vector
from floatframe.model.joints.rows.kinds import DOT, EQUAL_TURN, TURN_B

__all__ = [
    "ZERO",
    "angle_rates",
    "axis_rates",
    "directions",
    "distance_rates",
    "distance_value",
    "dot_value",
    "point_rates",
    "point_value",
    "product",
    "product_rates",
    "rates_of",
    "screw_rates",
    "screw_value",
    "slide_rates",
    "slide_value",
    "span_rates",
    "turn_value",
]

ZERO = (0.0, 0.0, 0.0)


# products of two vectors ----------------------------------------------------------------------------------------------


@small
def product(E, D):
    """Return E · D with its derivatives, E fixed in A and D in B."""
    m = cross(E, D)
    return dot(E, D), ZERO, m, scaled(-1.0, m)


@small
def fixed(x):
    """Return a direction of a marker with its rates relative to it, which are zero."""
    return vector(x), ZERO, ZERO


@inner
def rates_of(markers, m, e):
    """Return E, E_t, E_dot and E_ddot - alpha × E in ground axes; e: a direction of marker m and its relative rates."""
    A, omega = markers.A[m], vector(markers.omega[m])
    E, E_t, E_tt = turned(A, e[0]), turned(A, e[1]), turned(A, e[2])
    along = cross(omega, E)
    return E, E_t, add(along, E_t), add(cross(omega, add(along, scaled(2.0, E_t))), E_tt)


@inner
def axis_rates(markers, m, x):
    """Return the rates of direction x of marker m as `rates_of`."""
    E, omega = turned(markers.A[m], x), vector(markers.omega[m])
    E_dot = cross(omega, E)
    return E, ZERO, E_dot, cross(omega, E_dot)


@inner
def span_rates(markers, a, b):
    """Return d and its rates as `rates_of`."""
    return distance(markers, a, b), ZERO, relative_velocity(markers, a, b), ZERO


@inner
def product_rates(P, Q):
    """Return dg/dt and beta of P · Q from the vectors and their rates."""
    beta = dot(P[3], Q[0]) + 2 * dot(P[2], Q[2]) + dot(P[0], Q[3])
    return dot(P[1], Q[0]) + dot(P[0], Q[1]), beta


# rows -----------------------------------------------------------------------------------------------------------------


@small
def point_value(model, work, k, a, b):
    """Return the value of POINT: -x · d, with x in ground axes."""
    x = vector(model.rows.x[k])
    return -dot(x, distance(work.markers, a, b)), scaled(-1.0, x), ZERO, ZERO


@inner
def point_rates(model, work, k, a, b):
    """Return the rates of POINT, to which only the motion of the points contributes."""
    return 0.0, 0.0


@small
def directions(model, k, t):
    """Return the directions in A and in B whose product row k constrains, with their relative rates.

    DOT: x and y. EQUAL_TURN, first product: x and u. TURN: x cos f + z sin f and y. TURN_B measures f from B: y and
    x cos f - z sin f.
    """
    kind, y = model.rows.kind[k], fixed(model.rows.y[k])
    if kind == DOT:
        return fixed(model.rows.x[k]), y
    if kind == EQUAL_TURN:
        return fixed(model.rows.x[k]), fixed(model.rows.u[k])
    e = turning(model, k, t, -1.0 if kind == TURN_B else 1.0)
    return (y, e) if kind == TURN_B else (e, y)


@inner
def turning(model, k, t, sense):
    """Return x cos f + z sin f with its rates, f: the prescribed angle times the sense."""
    f, rate, second = prescribed_at(model, k, t)
    c, s, x, z = math.cos(f), sense * math.sin(f), vector(model.rows.x[k]), vector(model.rows.z[k])
    e, n = add(scaled(c, x), scaled(s, z)), sub(scaled(c, z), scaled(s, x))
    return e, scaled(sense * rate, n), sub(scaled(sense * second, n), scaled(rate * rate, e))


@small
def dot_value(model, work, k, a, b):
    """Return the value of DOT: E · D - c."""
    rows, markers = model.rows, work.markers
    g, n, m_a, m_b = product(direction(markers, a, rows.x[k]), direction(markers, b, rows.y[k]))
    return g - rows.c[k], n, m_a, m_b


@inner
def turn_value(model, work, k, a, b):
    """Return the value of TURN or TURN_B: E · D."""
    e, y = directions(model, k, work.state.time)
    return product(turned(work.markers.A[a], e[0]), turned(work.markers.A[b], y[0]))


@inner
def angle_rates(model, work, k, a, b):
    """Return the rates of DOT, TURN or TURN_B."""
    e, y = directions(model, k, work.state.time)
    return product_rates(rates_of(work.markers, a, e), rates_of(work.markers, b, y))


@small
def slide_value(model, work, k, a, b):
    """Return the value of SLIDE: E · d - f."""
    markers = work.markers
    f, _, _ = prescribed(model, work, k)
    E, d = direction(markers, a, model.rows.x[k]), distance(markers, a, b)
    return dot(E, d) - f, E, cross(E, d), ZERO


@inner
def slide_rates(model, work, k, a, b):
    """Return the rates of SLIDE."""
    markers = work.markers
    _, rate, second = prescribed(model, work, k)
    _, beta = product_rates(axis_rates(markers, a, vector(model.rows.x[k])), span_rates(markers, a, b))
    return -rate, beta - second


@inner
def distance_value(model, work, k, a, b):
    """Return the value of DISTANCE: (d · d/f - f)/2."""
    f, _, _ = prescribed(model, work, k)
    d = distance(work.markers, a, b)
    return 0.5 * (dot(d, d) / f - f), scaled(1.0 / f, d), ZERO, ZERO


@inner
def distance_rates(model, work, k, a, b):
    """Return the rates of DISTANCE."""
    markers = work.markers
    f, rate, second = prescribed(model, work, k)
    d, v = distance(markers, a, b), relative_velocity(markers, a, b)
    square = dot(d, d) / (f * f)
    own = (dot(v, v) - 2 * dot(d, v) * rate / f + square * rate * rate) / f
    return -0.5 * rate * (square + 1.0), own - 0.5 * second * (square + 1.0)


@inner
def screw_value(model, work, k, a, b):
    """Return the value of SCREW, E · d - c th; E: axis, th: angle of D about it, counted to the nearest turn."""
    rows, markers = model.rows, work.markers
    c, d, E = rows.c[k], distance(markers, a, b), axis_between(rows, markers, k, a)
    th, t = angle_between(rows, markers.A, k, a, b)
    along = dot(E, d)
    turns = math.floor((along / c - th) / (2 * math.pi) + 0.5)
    return along - c * (th + 2 * math.pi * turns), E, sub(cross(E, d), scaled(c, t)), scaled(c, t)


@inner
def screw_rates(model, work, k, a, b):
    """Return the rates of SCREW; the second rate of the angle is the one for parallel axes."""
    axis = cross(vector(model.rows.x[k]), vector(model.rows.z[k]))
    return product_rates(axis_rates(work.markers, a, axis), span_rates(work.markers, a, b))
