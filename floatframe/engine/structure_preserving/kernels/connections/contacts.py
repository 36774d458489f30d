"""Contacts of a sphere on B with a plane or sphere on A over a step, see the engine's kernels/connections/contact.py.

The normal force is the discrete derivative of its potential U = k x^(n+1)/(n+1), x the depth, times the factor of
restitution at the mean rate. Friction acts at the point rho = -R_B N, N the mean normal, against the mean slip V_t:

    f_s = -(U_1 - U_0)/(gap_1 - gap_0),   f = f_s max(0, 1 - (h/v_0) dgap/dt)
    V = (dx_B - dx_A + phi_B × rho - phi_A × (d + rho))/dt,   T = -mu f V_t/sqrt(|V_t|² + v_s²)

so that the dissipated work, (f_s - f) dgap and -T·V dt, is never negative, and forces and moments balance about any
point. The speed of approach v_0 is taken from the step before the contact began.
"""

import math

from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.connections.contact import V_0, contact_gap
from floatframe.engine.kernels.joints.held_rows import A_TO_B, of_a
from floatframe.engine.kernels.vector import add, cross, dot, norm, scaled, sub, vector
from floatframe.engine.structure_preserving.kernels.coordinates import span
from floatframe.engine.structure_preserving.kernels.markers import (
    add_moment,
    add_pair,
    begin_unit_load,
    end_unit_load,
    mean_direction,
    turning,
)
from floatframe.engine.structure_preserving.kernels.rows import add_product, mean_distance

__all__ = ["contact_load", "speed_of_approach"]

ALIKE = 0.02  # difference of depths relative to their sum, below which the quotient is the mean force
POINT = math.sqrt(0.6)  # outer point of Gauss' rule, exact to degree five


@inner
def mean_force(k, n, x_0, x_1):
    """Return the change of k x^(n+1)/(n+1) divided by the change of depth, for depths x_0 and x_1."""
    middle, half = 0.5 * (x_0 + x_1), 0.5 * (x_1 - x_0)
    if abs(half) <= ALIKE * middle:
        ends = (middle - POINT * half) ** n + (middle + POINT * half) ** n
        return k * (5.0 * ends + 8.0 * middle**n) / 18.0
    return k * (x_1 ** (n + 1.0) - x_0 ** (n + 1.0)) / ((n + 1.0) * 2.0 * half)


@inner
def spring_force(k, n, gap_0, gap_1):
    """Return the mean elastic force f_s of a contact."""
    x_0, x_1 = max(-gap_0, 0.0), max(-gap_1, 0.0)
    if x_0 == 0.0 and x_1 == 0.0:
        return 0.0
    f = mean_force(k, n, x_0, x_1)
    if x_0 > 0.0 and x_1 > 0.0:
        return f
    return f * (x_1 - x_0) / (gap_0 - gap_1)


@inner
def known_speed(model, step, c):
    """Return the approach speed v_0 of contact c."""
    known = step.known[model.connections.w0[c] + V_0]
    return known if known > 0.0 else max(-known, model.contacts.slow[model.connections.item[c]])


@inner
def add_normal_force(model, discrete, step, c, f):
    """Add the loads of normal force f, whose work is f times the change of gap; return the mean normal."""
    a, b, x = model.connections.a[c], model.connections.b[c], vector(model.rows.x[model.connections.w0[c]])
    if model.contacts.is_sphere[model.connections.item[c]]:
        _, N = span(step, a, b)
        add_pair(step, a, b, scaled(f, N))
        return N
    add_product(model, discrete, step, a, b, of_a(x), A_TO_B, f)
    return mean_direction(step, a, x)


@inner
def contact_load(model, discrete, step, c):
    """Add the loads of contact c, and return the work dissipated by restitution and friction."""
    a, b, i, own = model.connections.a[c], model.connections.b[c], model.connections.item[c], model.contacts
    gap_0, gap_1 = contact_gap(model, step.x_0, step.A_0, c), contact_gap(model, step.x_f, step.A_f, c)
    f_s = spring_force(own.stiffness[i], own.exponent[i], gap_0, gap_1)
    if f_s == 0.0:
        return 0.0
    begin_unit_load(step, a, b)
    N = add_normal_force(model, discrete, step, c, 1.0)
    way = end_unit_load(model, step, a, b)
    f = f_s * max(1.0 - own.dissipation[i] / known_speed(model, step, c) * way / step.h, 0.0)
    taken = (f_s - f) * way
    add_normal_force(model, discrete, step, c, f)
    if own.friction[i] == 0.0:
        return taken
    N, d, dx = scaled(1.0 / norm(N), N), mean_distance(step, a, b), sub(vector(step.dx[b]), vector(step.dx[a]))
    rho = scaled(-own.radius_b[i], N)
    arm = add(d, rho)
    slip = add(dx, sub(cross(turning(model, step, b), rho), cross(turning(model, step, a), arm)))
    V = scaled(1.0 / step.h, slip)
    V_t = sub(V, scaled(dot(N, V), N))
    T = scaled(-own.friction[i] * f / math.sqrt(dot(V_t, V_t) + own.slip_speed[i] ** 2), V_t)
    add_pair(step, a, b, T)
    add_moment(model, step, b, cross(rho, T))
    add_moment(model, step, a, scaled(-1.0, cross(arm, T)))
    return taken - dot(T, V) * step.h


@inner
def speed_of_approach(model, step, c):
    """Return v_0 for the next step: the approach speed in contact, otherwise the (negative) rate of the gap."""
    begin = contact_gap(model, step.x_0, step.A_0, c)
    end = contact_gap(model, step.end.markers.r, step.end.markers.A, c)
    if end >= 0.0:
        return min((end - begin) / step.h, -model.contacts.slow[model.connections.item[c]])
    return known_speed(model, step, c)
