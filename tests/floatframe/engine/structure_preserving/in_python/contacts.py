"""Contacts of a sphere on B with a plane or a sphere on A over a step, see kernels/connections/contact.py.

Formulas: `floatframe.engine.structure_preserving.kernels.connections.contacts`.
"""

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.kernels.connections.contact import V_0
from floatframe.engine.kernels.model import Model
from floatframe.model.rotations import cross, dot
from tests.floatframe.engine.structure_preserving.in_python.constraints import Loads, Pair, Span, slip_change
from tests.floatframe.engine.structure_preserving.in_python.coordinates import add_pair, span_parts

ALIKE = 0.02  #: difference of depths over their sum below which the quotient is a mean of forces
GAUSS = ((-np.sqrt(0.6), 5 / 18), (0.0, 8 / 18), (np.sqrt(0.6), 5 / 18))  #: points and weights: exact to degree five


def gaps(model: Model, c: int, pair: Pair) -> tuple[Array, Array, Array]:
    """Return the gap of contact c at the start and end of the force interval, and its change over the step."""
    a, b = pair
    i, own = int(model.connections.item[c]), model.contacts
    if own.is_sphere[i]:
        d, l_0, l_1 = span_parts(pair)
        radii = own.radius_a[i] + own.radius_b[i]
        return l_0 - radii, l_1 - radii, 2 * dot(d, b.dx - a.dx) / (l_0 + l_1)
    k = int(model.connections.w0[c])
    E_0, E_1 = a.ends(model.rows.x[k])
    radius = own.radius_b[i]
    return dot(E_0, b.x_0 - a.x_0) - radius, dot(E_1, b.x_1 - a.x_1) - radius, slip_change(model, k, pair)[0]


def depth(gap: Array) -> Array:
    """Return the depth, with its derivative along an imaginary part."""
    return np.where(np.real(gap) < 0, -gap, 0.0)


def power(x: Array, n: float) -> Array:
    """Return xⁿ of non-negative numbers, also complex."""
    is_positive = np.real(x) > 0
    return np.where(is_positive, np.exp(n * np.log(np.where(is_positive, x, 1.0))), 0.0)


def mean_force(k: float, n: float, x_0: Array, x_1: Array) -> Array:
    """Return the change of k x^(n+1)/(n+1) divided by that of the depth, for gaps with these depths."""
    difference, both = x_1 - x_0, x_0 + x_1
    is_alike = np.abs(np.real(difference)) <= ALIKE * np.real(both)
    gauss = sum(w * power(0.5 * both + 0.5 * p * difference, n) for p, w in GAUSS)
    quotient = (power(x_1, n + 1) - power(x_0, n + 1)) / ((n + 1) * np.where(is_alike, 1.0, difference))
    return k * np.where(is_alike, gauss, quotient)


def spring_force(k: float, n: float, gap_0: Array, gap_1: Array) -> Array:
    """Return f_s."""
    x_0, x_1 = depth(gap_0), depth(gap_1)
    is_partial = (np.real(gap_0) < 0) != (np.real(gap_1) < 0)
    way = np.where(is_partial, gap_0 - gap_1, 1.0)  # for steps that are only partly in contact
    return mean_force(k, n, x_0, x_1) * np.where(is_partial, (x_1 - x_0) / way, 1.0)


def contact_load(model: Model, c: int, pair: Pair, loads: Loads, span: Span) -> Array:
    """Add the loads of contact c, and return the work that restitution and friction dissipate."""
    a, b = pair
    i, k, own = int(model.connections.item[c]), int(model.connections.w0[c]), model.contacts
    gap_0, gap_1, change = gaps(model, c, pair)
    known = span.w[k + V_0]
    v_0 = known if known > 0 else max(-known, own.slow[i])
    f_s = spring_force(own.stiffness[i], own.exponent[i], gap_0, gap_1)
    factor = 1 - own.dissipation[i] / v_0 * change / span.h
    f = np.where(np.real(factor) > 0, f_s * factor, 0.0)
    taken = (f_s - f) * change
    d = b.x_mean - a.x_mean
    if own.is_sphere[i]:
        _, l_0, l_1 = span_parts(pair)
        N = d
        add_pair(pair, loads, (2 * f / (l_0 + l_1))[..., None] * d)
    else:
        _, N, _ = slip_change(model, k, pair)
        add_pair(pair, loads, f[..., None] * N)
        a.add_direction(loads[0], model.rows.x[k], f[..., None] * d)
    if own.friction[i] == 0:
        return taken
    N = N / np.sqrt(dot(N, N))[..., None]
    rho = -own.radius_b[i] * N
    V = (b.dx - a.dx + cross(b.turning(), rho) - cross(a.turning(), d + rho)) / span.h
    V_t = V - dot(N, V)[..., None] * N
    T = -(own.friction[i] * f / np.sqrt(dot(V_t, V_t) + own.slip_speed[i] ** 2))[..., None] * V_t
    add_pair(pair, loads, T)
    b.add_moment(loads[1], cross(rho, T))
    a.add_moment(loads[0], -cross(d + rho, T))
    return taken - dot(T, V) * span.h


def speed_of_approach(model: Model, c: int, pair: Pair, span: Span) -> float:
    """Return v_0 for the next step: in contact v_0, otherwise minus the speed at which the gap closes."""
    slow = float(model.contacts.slow[model.connections.item[c]])
    known = float(span.w[int(model.connections.w0[c]) + V_0])
    _, gap, change = gaps(model, c, pair)
    if gap >= 0:
        return min(float(change) / span.h, -slow)
    return known if known > 0 else max(-known, slow)
