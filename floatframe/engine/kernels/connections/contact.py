"""Contact of a sphere on B with a plane or a sphere on A: normal force with restitution, and friction.

N: unit normal from A to B, of the plane (fixed in A) or along d = r_B - r_A; depth x = -gap,

    gap = N · d - R_B   (plane)   or   |d| - R_A - R_B   (sphere)
    f   = k xⁿ max(0, 1 + (h/v_0) x_dot)  for x > 0            v_0 speed of approach at the beginning of the contact
    F_B = f N - mu f V_t/sqrt(|V_t|² + v_s²)                   V_t slip at the point rho = -R_B N from the centre of B

The wrench on the markers is F = -F_B on A, -N_w = -rho × F on B. v_0 is an unknown of its own. Without contact it is
minus the speed of approach (at least the speed `slow`); in contact it is the value from the beginning of the step.

Described in `floatframe.model.forces.sphere_contact`.
"""

import math

from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.vector import add, cross, dot, norm, put, scaled, sub, turned, vector

__all__ = ["V_0", "contact_gap", "contact_power", "contact_state", "contact_variation"]

V_0 = 9  # index of the approach speed among the unknowns, after F, M, N


@inner
def contact_gap(model, r, A, c):
    """Return the gap of contact c for given positions r and axes A of its markers."""
    a, b, i, own = model.connections.a[c], model.connections.b[c], model.connections.item[c], model.contacts
    d = sub(vector(r[b]), vector(r[a]))
    if own.is_sphere[i]:
        return norm(d) - own.radius_a[i] - own.radius_b[i]
    return dot(turned(A[a], vector(model.rows.x[model.connections.w0[c]])), d) - own.radius_b[i]


@inner
def contact_state(model, work, c):
    """Write the quantities of contact c into work.contact, and F, N and the approach speed v_0 into work.pair."""
    i, own, s, pair = model.connections.item[c], model.contacts, work.contact, work.pair
    d, v = vector(pair.d), vector(pair.v)
    if own.is_sphere[i]:
        N = scaled(1 / norm(d), d)
        s.gap = norm(d) - own.radius_b[i] - own.radius_a[i]
    else:
        N = turned(pair.A, model.rows.x[model.connections.w0[c]])
        s.gap = dot(N, d) - own.radius_b[i]
    s.rate = dot(N, v)
    rho = scaled(-own.radius_b[i], N)
    V = add(v, cross(pair.omega, rho))
    V_t = sub(V, scaled(dot(N, V), N))
    normal_force(model, work, c)
    s.slip = math.sqrt(dot(V_t, V_t) + own.slip_speed[i] ** 2)
    F = sub(scaled(own.friction[i] * s.f / s.slip, V_t), scaled(s.f, N))
    put(s.N, 0, N)
    put(s.rho, 0, rho)
    put(s.V, 0, V)
    put(s.V_t, 0, V_t)
    put(pair.F, 0, F)
    put(pair.N, 0, cross(rho, F))


@inner
def normal_force(model, work, c):
    """Write the normal force f with its derivatives by depth and rate, and v_0 with its derivative by rate."""
    s, own, i = work.contact, model.contacts, model.connections.item[c]
    start, slow = work.state.w_start[model.connections.w0[c] + V_0], own.slow[i]
    s.depth, s.f, s.f_by_depth, s.f_by_rate, s.v_0_by_rate = max(-s.gap, 0.0), 0.0, 0.0, 0.0, 0.0
    if s.gap >= 0.0:
        work.pair.v_0 = min(s.rate, -slow)
        s.v_0_by_rate = 1.0 if s.rate < -slow else 0.0
        return
    v_0 = start if start > 0.0 else max(-start, slow)
    work.pair.v_0 = v_0
    n, h = own.exponent[i], own.dissipation[i] / v_0
    spring, factor = own.stiffness[i] * s.depth**n, 1.0 - h * s.rate
    if factor > 0.0:
        s.f = spring * factor
        s.f_by_depth = n * spring / s.depth * factor
        s.f_by_rate = -spring * h


@inner
def contact_variation(model, work, c):
    """Write the change of F, N and v_0, relative to A, for the variation of the motion in work.pair."""
    i, own, s, pair = model.connections.item[c], model.contacts, work.contact, work.pair
    N, rho, V, V_t, F = vector(s.N), vector(s.rho), vector(s.V), vector(s.V_t), vector(pair.F)
    dd, dv, dN = vector(pair.motion), vector(pair.motion[6:]), (0.0, 0.0, 0.0)
    gap = dot(N, dd)
    if own.is_sphere[i]:
        dN = scaled(1 / norm(pair.d), sub(dd, scaled(gap, N)))
    rate = dot(dN, pair.v) + dot(N, dv)
    # V = v + omega × rho, V_t = V - N (N·V)
    drho = scaled(-own.radius_b[i], dN)
    dV = add(dv, add(cross(pair.motion[9:], rho), cross(pair.omega, drho)))
    change = dot(dN, V) + dot(N, dV)
    dV_t = sub(dV, add(scaled(change, N), scaled(dot(N, V), dN)))
    # F = mu f V_t / slip - f N
    df = -s.f_by_depth * gap + s.f_by_rate * rate
    rub, slowed = own.friction[i] / s.slip, dot(V_t, dV_t) / s.slip**2
    friction = add(scaled(rub * (df - s.f * slowed), V_t), scaled(rub * s.f, dV_t))
    dF = sub(friction, add(scaled(df, N), scaled(s.f, dN)))
    put(pair.F_change, 0, dF)
    put(pair.N_change, 0, add(cross(drho, F), cross(rho, dF)))
    pair.v_0_change = s.v_0_by_rate * rate


@inner
def contact_power(model, work, c):
    """Return k x^(n + 1)/(n + 1), a supplied power of zero, and the power dissipated by restitution and friction."""
    s, own, i = work.contact, model.contacts, model.connections.item[c]
    spring = own.stiffness[i] * s.depth ** own.exponent[i]
    lost = -(s.f - spring) * s.rate + own.friction[i] * s.f * dot(s.V_t, s.V_t) / s.slip
    return spring * s.depth / (own.exponent[i] + 1.0), 0.0, lost
