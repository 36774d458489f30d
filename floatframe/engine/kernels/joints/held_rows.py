"""Constraint rows between two markers: values, and derivatives by the motion and explicitly by time.

The constrained quantity g of a row depends on d = r_B - r_A, on the axes of both markers and on time, so that

    dg     = n · (dr_B - dr_A) + m_a · dphi_A + m_b · dphi_B + (dg/dt) dt
    g_ddot = n · (a_B - a_A) + m_a · alpha_A + m_b · alpha_B + beta

The force n on B, -n on A, with the moments m_b, m_a, is its unit reaction. A kind consists of two functions of
(model, work, k, a, b):

    value   g, n, m_a, m_b
    rates   dg/dt, beta

A row that constrains a velocity (ROLL) has the same form: g is the velocity, n, m_a, m_b are its derivatives by the
velocities of the markers, and beta is its rate at zero accelerations. With E = A_A x, Z = A_A z, D = A_B y,
omega_A = o, omega_B = p, and the rates E' = R_A e' and E'' of E relative to A,

    E_dot = o × E + E',   E_ddot - alpha × E = o × (o × E) + 2 o × E' + E''
"""

import math

from floatframe.engine.kernels.compiler.compilation import inner, small
from floatframe.engine.kernels.joints.relative_motion import (
    angle_between,
    axis_between,
    direction,
    distance,
    prescribed,
    relative_velocity,
)
from floatframe.engine.kernels.vector import add, cross, dot, scaled, sub, turned, vector

__all__ = [
    "angle_rates",
    "angle_value",
    "distance_rates",
    "distance_value",
    "point_rates",
    "point_value",
    "screw_rates",
    "screw_value",
    "slide_rates",
    "slide_value",
    "turn_b_rates",
    "turn_b_value",
    "turn_rates",
    "turn_value",
    "turned_twice",
]


@inner
def turned_twice(omega, x):
    """Return omega × (omega × x)."""
    return cross(omega, cross(omega, x))


@inner
def along_rates(markers, a, b, E):
    """Return the velocity terms beta of E · d with E fixed in A."""
    omega = vector(markers.omega[a])
    d, v = distance(markers, a, b), relative_velocity(markers, a, b)
    return dot(turned_twice(omega, E), d) + 2 * dot(cross(omega, E), v)


@small
def product(E, D):
    """Return E · D with its derivatives, E fixed in A and D in B."""
    m = cross(E, D)
    return dot(E, D), (0.0, 0.0, 0.0), m, scaled(-1.0, m)


@inner
def product_rates(o, p, E, E_1, E_2, D):
    """Return dg/dt and the velocity terms beta of E · D; E_1, E_2: rates of E relative to A."""
    E_dot, D_dot = add(cross(o, E), E_1), cross(p, D)
    E_ddot = add(add(turned_twice(o, E), scaled(2.0, cross(o, E_1))), E_2)
    return dot(E_1, D), dot(E_ddot, D) + 2 * dot(E_dot, D_dot) + dot(E, cross(p, D_dot))


@small
def point_value(model, work, k, a, b):
    """Return the value of POINT: -x · d, with x in ground axes."""
    x = vector(model.rows.x[k])
    zero = (0.0, 0.0, 0.0)
    return -dot(x, distance(work.markers, a, b)), scaled(-1.0, x), zero, zero


@inner
def point_rates(model, work, k, a, b):
    """Return the rates of POINT, to which only the motion of the points contributes."""
    return 0.0, 0.0


@small
def angle_value(model, work, k, a, b):
    """Return the value of DOT: E · D - c."""
    rows, markers = model.rows, work.markers
    g, n, m_a, m_b = product(direction(markers, a, rows.x[k]), direction(markers, b, rows.y[k]))
    return g - rows.c[k], n, m_a, m_b


@inner
def angle_rates(model, work, k, a, b):
    """Return the rates of DOT."""
    rows, markers = model.rows, work.markers
    E, D, zero = direction(markers, a, rows.x[k]), direction(markers, b, rows.y[k]), (0.0, 0.0, 0.0)
    return product_rates(vector(markers.omega[a]), vector(markers.omega[b]), E, zero, zero, D)


@inner
def turning_direction(model, work, k, a, sense):
    """Return E cos f + Z sin f with its derivatives E', E'' by f, ground axes; sense -1: f is measured from B."""
    f, rate, second = prescribed(model, work, k)
    c, s, x, z = math.cos(f), sense * math.sin(f), vector(model.rows.x[k]), vector(model.rows.z[k])
    E = turned(work.markers.A[a], add(scaled(c, x), scaled(s, z)))
    N = turned(work.markers.A[a], sub(scaled(c, z), scaled(s, x)))
    return E, scaled(sense * rate, N), sub(scaled(sense * second, N), scaled(rate * rate, E))


@small
def turn_value(model, work, k, a, b):
    """Return the value of TURN: (E cos f + Z sin f) · D."""
    E, _, _ = turning_direction(model, work, k, a, 1.0)
    return product(E, direction(work.markers, b, model.rows.y[k]))


@inner
def turn_rates(model, work, k, a, b):
    """Return the rates of TURN."""
    markers = work.markers
    E, E_1, E_2 = turning_direction(model, work, k, a, 1.0)
    D = direction(markers, b, model.rows.y[k])
    return product_rates(vector(markers.omega[a]), vector(markers.omega[b]), E, E_1, E_2, D)


@inner
def turn_b_value(model, work, k, a, b):
    """Return the value of TURN_B, which is TURN with A and B exchanged; A rotates backwards relative to B."""
    E, _, _ = turning_direction(model, work, k, b, -1.0)
    g, n, m_b, m_a = product(E, direction(work.markers, a, model.rows.y[k]))
    return g, n, m_a, m_b


@inner
def turn_b_rates(model, work, k, a, b):
    """Return the rates of TURN_B."""
    markers = work.markers
    E, E_1, E_2 = turning_direction(model, work, k, b, -1.0)
    D = direction(markers, a, model.rows.y[k])
    return product_rates(vector(markers.omega[b]), vector(markers.omega[a]), E, E_1, E_2, D)


@small
def slide_value(model, work, k, a, b):
    """Return the value of SLIDE: E · d - f."""
    markers = work.markers
    f, _, _ = prescribed(model, work, k)
    E, d = direction(markers, a, model.rows.x[k]), distance(markers, a, b)
    return dot(E, d) - f, E, cross(E, d), (0.0, 0.0, 0.0)


@inner
def slide_rates(model, work, k, a, b):
    """Return the rates of SLIDE."""
    markers = work.markers
    _, rate, second = prescribed(model, work, k)
    return -rate, along_rates(markers, a, b, direction(markers, a, model.rows.x[k])) - second


@inner
def distance_value(model, work, k, a, b):
    """Return the value of DISTANCE: (d · d/f - f)/2."""
    f, _, _ = prescribed(model, work, k)
    d, zero = distance(work.markers, a, b), (0.0, 0.0, 0.0)
    return 0.5 * (dot(d, d) / f - f), scaled(1.0 / f, d), zero, zero


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
    th, t = angle_between(rows, markers, k, a, b)
    along = dot(E, d)
    turns = math.floor((along / c - th) / (2 * math.pi) + 0.5)
    return along - c * (th + 2 * math.pi * turns), E, sub(cross(E, d), scaled(c, t)), scaled(c, t)


@inner
def screw_rates(model, work, k, a, b):
    """Return the rates of SCREW; the second rate of the angle is the one for parallel axes."""
    markers = work.markers
    return 0.0, along_rates(markers, a, b, axis_between(model.rows, markers, k, a))
