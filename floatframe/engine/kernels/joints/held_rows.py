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

Most rows are products, g = c(t) P · Q - o(t): P and Q are d or directions fixed in A, in B or in the ground. A kind of
this form is one function of (model, k, t), which returns the product. The functions of the row follow from it, and its
change and reaction over a step of the structure-preserving schemes.

A direction E of A may also rotate relative to A, with the rates E_t and E_tt. With omega_A = o, the product rule needs

    E_dot = o × E + E_t,   E_ddot - alpha × E = o × (o × E) + 2 o × E_t + E_tt
"""

import math
from typing import NamedTuple

from floatframe.engine.kernels.compiler.compilation import inner, small
from floatframe.engine.kernels.joints.relative_motion import (
    angle_between,
    axis_between,
    distance,
    prescribed_at,
    relative_velocity,
)
from floatframe.engine.kernels.vector import add, cross, dot, scaled, sub, turned, vector

__all__ = [
    "A_TO_B",
    "OF_A",
    "OF_BOTH",
    "OF_GROUND",
    "ZERO",
    "Product",
    "Side",
    "dot_product",
    "dot_rates",
    "gap_of",
    "gradient_of",
    "length",
    "motion_rate",
    "of_a",
    "of_b",
    "point",
    "product_rates",
    "rate_in_time",
    "rates_of",
    "screw_rates",
    "screw_value",
    "slide",
    "times",
    "turn",
    "turn_about_b",
]

ZERO = (0.0, 0.0, 0.0)
ONE, MINUS_ONE = (1.0, 0.0, 0.0), (-1.0, 0.0, 0.0)


# products of two vectors ----------------------------------------------------------------------------------------------

OF_GROUND, OF_A, OF_B, OF_BOTH = range(4)  #: what a vector is fixed in; OF_BOTH: it is d


class Side(NamedTuple):
    """A vector of a product."""

    of: int  #: OF_GROUND, OF_A, OF_B or OF_BOTH
    e: tuple[float, float, float]  #: the direction relative to what it is fixed in; not used for d
    e_t: tuple[float, float, float]  #: its first and second rate relative to what it is fixed in
    e_tt: tuple[float, float, float]


class Product(NamedTuple):
    """The quantity c P · Q - o; c and o with their first and second rate."""

    P: Side
    Q: Side
    c: tuple[float, float, float]
    o: tuple[float, float, float]


A_TO_B = Side(OF_BOTH, ZERO, ZERO, ZERO)  #: d


@small
def of_a(x):
    """Return a direction fixed in A."""
    return Side(OF_A, vector(x), ZERO, ZERO)


@small
def of_b(x):
    """Return a direction fixed in B."""
    return Side(OF_B, vector(x), ZERO, ZERO)


@small
def times(P, Q):
    """Return the product P · Q."""
    return Product(P, Q, ONE, ZERO)


@small
def point(model, k, t):
    """POINT: -x · d, x in ground axes."""
    return Product(Side(OF_GROUND, vector(model.rows.x[k]), ZERO, ZERO), A_TO_B, MINUS_ONE, ZERO)


@small
def dot_product(model, k, t):
    """DOT: E · D - c."""
    return Product(of_a(model.rows.x[k]), of_b(model.rows.y[k]), ONE, (model.rows.c[k], 0.0, 0.0))


@small
def turn(model, k, t):
    """TURN: (E cos f + Z sin f) · D."""
    return times(turning(model, OF_A, k, t, 1.0), of_b(model.rows.y[k]))


@small
def turn_about_b(model, k, t):
    """TURN_B: TURN with A and B exchanged, and -f."""
    return times(of_a(model.rows.y[k]), turning(model, OF_B, k, t, -1.0))


@small
def slide(model, k, t):
    """SLIDE: E · d - f."""
    return Product(of_a(model.rows.x[k]), A_TO_B, ONE, prescribed_at(model, k, t))


@small
def length(model, k, t):
    """DISTANCE: (d · d/f - f)/2."""
    f, rate, second = prescribed_at(model, k, t)
    c = 0.5 / f
    c_t, c_tt = -c * rate / f, c * (2.0 * rate * rate / f - second) / f
    return Product(A_TO_B, A_TO_B, (c, c_t, c_tt), (0.5 * f, 0.5 * rate, 0.5 * second))


@inner
def turning(model, of, k, t, sense):
    """Return x cos f + z sin f, f: the prescribed angle times the sense."""
    f, rate, second = prescribed_at(model, k, t)
    c, s, x, z = math.cos(f), sense * math.sin(f), vector(model.rows.x[k]), vector(model.rows.z[k])
    e, n = add(scaled(c, x), scaled(s, z)), sub(scaled(c, z), scaled(s, x))
    return Side(of, e, scaled(sense * rate, n), sub(scaled(sense * second, n), scaled(rate * rate, e)))


@small
def in_ground(of, x, markers, a, b):
    """Return a direction in ground axes."""
    return x if of == OF_GROUND or of == OF_BOTH else turned(markers.A[a if of == OF_A else b], x)


@small
def vector_of(side, markers, a, b):
    """Return a vector of a product in ground axes."""
    return distance(markers, a, b) if side.of == OF_BOTH else in_ground(side.of, side.e, markers, a, b)


@small
def gap_of(one, markers, a, b):
    """Return the value of a product."""
    return one.c[0] * dot(vector_of(one.P, markers, a, b), vector_of(one.Q, markers, a, b)) - one.o[0]


@small
def gradient_of(one, markers, a, b):
    """Return n, m_a and m_b of a product; if P is fixed in A, its change is (dphi_A × P) · Q = dphi_A · (P × Q)."""
    c, P, Q = one.c[0], vector_of(one.P, markers, a, b), vector_of(one.Q, markers, a, b)
    m = scaled(c, cross(P, Q))
    opposite = scaled(-1.0, m)
    n = share(one, OF_BOTH, scaled(c, Q), scaled(c, P))
    return n, share(one, OF_A, m, opposite), share(one, OF_B, m, opposite)


@small
def share(one, of, by_p, by_q):
    """Return the sum of by_p, if P is of the kind `of`, and by_q, if Q is."""
    first = by_p if one.P.of == of else ZERO
    return add(first, by_q) if one.Q.of == of else first


@inner
def rate_in_time(one, markers, a, b):
    """Return dg/dt of a product, which its rotating direction, c and o cause."""
    P, Q = vector_of(one.P, markers, a, b), vector_of(one.Q, markers, a, b)
    P_t, Q_t = in_ground(one.P.of, one.P.e_t, markers, a, b), in_ground(one.Q.of, one.Q.e_t, markers, a, b)
    return one.c[0] * (dot(P_t, Q) + dot(P, Q_t)) + one.c[1] * dot(P, Q) - one.o[1]


@small
def motion_rate(one, markers, a, b):
    """Return g_dot - dg/dt of a product."""
    P, Q = vector_of(one.P, markers, a, b), vector_of(one.Q, markers, a, b)
    return one.c[0] * (dot(moved(one.P, P, markers, a, b), Q) + dot(P, moved(one.Q, Q, markers, a, b)))


@small
def moved(side, P, markers, a, b):
    """Return P_dot - P_t of a vector P of a product."""
    if side.of == OF_GROUND:
        return ZERO
    if side.of == OF_BOTH:
        return relative_velocity(markers, a, b)
    return cross(vector(markers.omega[a if side.of == OF_A else b]), P)


@inner
def rates_of(side, markers, a, b):
    """Return P, P_dot and P_ddot - alpha × P of a vector of a product in ground axes."""
    P, P_t = vector_of(side, markers, a, b), in_ground(side.of, side.e_t, markers, a, b)
    P_dot = add(moved(side, P, markers, a, b), P_t)
    if side.of == OF_GROUND or side.of == OF_BOTH:
        return P, P_dot, ZERO
    P_tt, omega = in_ground(side.of, side.e_tt, markers, a, b), vector(markers.omega[a if side.of == OF_A else b])
    return P, P_dot, add(cross(omega, add(P_dot, P_t)), P_tt)


@inner
def dot_rates(P, Q):
    """Return P · Q and its first and second rate, the latter at zero accelerations, from `rates_of` both."""
    second = dot(P[2], Q[0]) + 2 * dot(P[1], Q[1]) + dot(P[0], Q[2])
    return dot(P[0], Q[0]), dot(P[1], Q[0]) + dot(P[0], Q[1]), second


@inner
def product_rates(one, markers, a, b):
    """Return dg/dt and beta of a product."""
    x, x_dot, x_ddot = dot_rates(rates_of(one.P, markers, a, b), rates_of(one.Q, markers, a, b))
    beta = one.c[0] * x_ddot + 2 * one.c[1] * x_dot + one.c[2] * x - one.o[2]
    return rate_in_time(one, markers, a, b), beta


# rows that are not one product ---------------------------------------------------------------------------------------


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
    return product_rates(times(of_a(axis), A_TO_B), work.markers, a, b)
