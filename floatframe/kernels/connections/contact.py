"""Contact of a sphere on B with a plane or a sphere on A: normal force with restitution, and friction.

N: unit normal from A to B, of the plane (fixed in A) or along d = r_B - r_A; depth x = -gap,

    gap = N · d - R_B   (plane)   or   |d| - R_A - R_B   (sphere)
    f   = k xⁿ max(0, 1 + (h/v_0) x_dot)  for x > 0            v_0 speed of approach at the beginning of the contact
    F_B = f N - mu f V_t/sqrt(|V_t|² + v_s²)                   V_t slip at the point rho = -R_B N from the centre of B

and on the markers F = -F_B, M = (d + rho) × F on A, -N_w = -rho × F on B. v_0 is an unknown of its own: while there is
no contact minus the speed of approach (at least the slow one), in contact the value from the beginning of the step.
"""

import math

from floatframe.kernels.compiler.compilation import inner
from floatframe.kernels.connections.bushing import INPUT, LAW, OUTPUT, dot, put, three
from floatframe.kernels.marker import cross, rotate

__all__ = ["contact_energy", "contact_power", "contact_state", "contact_variation"]

NORMAL, D, RHO, V, REL, GAP, RATE, FORCE, BY_X, BY_RATE, SLIP, FREE, DEPTH = (
    0,
    3,
    6,
    9,
    12,
    15,
    16,
    17,
    18,
    19,
    20,
    21,
    22,
)


@inner
def contact_state(model, work, c):
    """Write all that follows from the motion of the markers of contact c into work.pair.numbers."""
    a, b, s, i = model.connections.a[c], model.connections.b[c], work.pair.numbers, model.connections.item[c]
    data = model.contacts
    r, v, o, q = work.markers.r, work.markers.v, work.markers.omega[a], work.markers.omega[b]
    d0, d1, d2 = r[b, 0] - r[a, 0], r[b, 1] - r[a, 1], r[b, 2] - r[a, 2]
    y0, y1, y2 = v[b, 0] - v[a, 0], v[b, 1] - v[a, 1], v[b, 2] - v[a, 2]
    radius = data.radius_b[i]
    if data.is_sphere[i]:
        length = math.sqrt(dot(d0, d1, d2, d0, d1, d2))
        N0, N1, N2 = d0 / length, d1 / length, d2 / length
        gap = length - radius - data.radius_a[i]
        rate = dot(N0, N1, N2, y0, y1, y2)
    else:
        x = model.rows.x[model.connections.w0[c]]
        N0, N1, N2 = rotate(work.markers.A[a], x[0], x[1], x[2])
        gap = dot(N0, N1, N2, d0, d1, d2) - radius
        x0, x1, x2 = cross(o[0], o[1], o[2], d0, d1, d2)
        rate = dot(N0, N1, N2, y0 - x0, y1 - x1, y2 - x2)
    rho0, rho1, rho2 = -radius * N0, -radius * N1, -radius * N2
    x0, x1, x2 = cross(q[0], q[1], q[2], rho0, rho1, rho2)
    z0, z1, z2 = cross(o[0], o[1], o[2], d0 + rho0, d1 + rho1, d2 + rho2)
    V0, V1, V2 = y0 + x0 - z0, y1 + x1 - z1, y2 + x2 - z2
    along = dot(N0, N1, N2, V0, V1, V2)
    put(s, NORMAL, N0, N1, N2)
    put(s, D, d0, d1, d2)
    put(s, RHO, rho0, rho1, rho2)
    put(s, V, V0 - along * N0, V1 - along * N1, V2 - along * N2)
    put(s, REL, V0, V1, V2)
    put(s, GAP, gap, rate, 0.0)
    start = work.state.w_start[model.connections.w0[c] + 9]
    speed = start if start > 0.0 else max(-start, data.slow[i])
    s[BY_X], s[BY_RATE], s[FREE], s[DEPTH] = 0.0, 0.0, 0.0, max(-gap, 0.0)
    s[LAW + 9] = speed
    if gap < 0.0:
        n, h = data.exponent[i], data.dissipation[i] / speed
        spring = data.stiffness[i] * (-gap) ** n
        factor = 1.0 - h * rate
        if factor > 0.0:
            s[FORCE] = spring * factor
            s[BY_X] = n * spring / -gap * factor
            s[BY_RATE] = -spring * h
    else:
        s[LAW + 9] = min(rate, -data.slow[i])
        s[FREE] = 1.0 if rate < -data.slow[i] else 0.0
    f = s[FORCE]
    slow = data.slip_speed[i]
    size = math.sqrt(dot(s[V], s[V + 1], s[V + 2], s[V], s[V + 1], s[V + 2]) + slow * slow)
    s[SLIP] = size
    rub = data.friction[i] * f / size
    F0, F1, F2 = rub * s[V] - f * N0, rub * s[V + 1] - f * N1, rub * s[V + 2] - f * N2
    put(s, LAW, F0, F1, F2)
    x0, x1, x2 = cross(d0 + rho0, d1 + rho1, d2 + rho2, F0, F1, F2)
    put(s, LAW + 3, x0, x1, x2)
    x0, x1, x2 = cross(rho0, rho1, rho2, F0, F1, F2)
    put(s, LAW + 6, x0, x1, x2)


@inner
def contact_variation(model, work, c):
    """Write the change of F, M, N and v_0 for the variation of the motion in work.pair.numbers, ground axes."""
    a, b, s, i = model.connections.a[c], model.connections.b[c], work.pair.numbers, model.connections.item[c]
    data = model.contacts
    o, q = work.markers.omega[a], work.markers.omega[b]
    out = s[OUTPUT : OUTPUT + 10]
    N0, N1, N2 = three(s, NORMAL)
    d0, d1, d2 = three(s, D)
    rho0, rho1, rho2 = three(s, RHO)
    dd0, dd1, dd2 = three(s, INPUT)
    dv0, dv1, dv2 = three(s, INPUT + 9)
    v, r = work.markers.v, data.radius_b[i]
    y0, y1, y2 = v[b, 0] - v[a, 0], v[b, 1] - v[a, 1], v[b, 2] - v[a, 2]
    if data.is_sphere[i]:
        length = dot(N0, N1, N2, d0, d1, d2)
        along = dot(N0, N1, N2, dd0, dd1, dd2)
        n0, n1, n2 = (dd0 - along * N0) / length, (dd1 - along * N1) / length, (dd2 - along * N2) / length
        gap = along
        rate = dot(n0, n1, n2, y0, y1, y2) + dot(N0, N1, N2, dv0, dv1, dv2)
    else:
        n0, n1, n2 = cross(s[INPUT + 3], s[INPUT + 4], s[INPUT + 5], N0, N1, N2)
        gap = dot(n0, n1, n2, d0, d1, d2) + dot(N0, N1, N2, dd0, dd1, dd2)
        x0, x1, x2 = cross(o[0], o[1], o[2], d0, d1, d2)
        z0, z1, z2 = cross(o[0], o[1], o[2], dd0, dd1, dd2)
        l0, l1, l2 = cross(s[INPUT + 12], s[INPUT + 13], s[INPUT + 14], d0, d1, d2)
        rate = dot(n0, n1, n2, y0 - x0, y1 - x1, y2 - x2)
        rate += dot(N0, N1, N2, dv0 - z0 - l0, dv1 - z1 - l1, dv2 - z2 - l2)
    # slip: dV = dv + domega_B × rho + omega_B × drho - domega_A × (d + rho) - omega_A × (dd + drho)
    p0, p1, p2 = -r * n0, -r * n1, -r * n2
    x0, x1, x2 = cross(s[INPUT + 15], s[INPUT + 16], s[INPUT + 17], rho0, rho1, rho2)
    V0, V1, V2 = dv0 + x0, dv1 + x1, dv2 + x2
    x0, x1, x2 = cross(q[0], q[1], q[2], p0, p1, p2)
    V0, V1, V2 = V0 + x0, V1 + x1, V2 + x2
    x0, x1, x2 = cross(s[INPUT + 12], s[INPUT + 13], s[INPUT + 14], d0 + rho0, d1 + rho1, d2 + rho2)
    V0, V1, V2 = V0 - x0, V1 - x1, V2 - x2
    x0, x1, x2 = cross(o[0], o[1], o[2], dd0 + p0, dd1 + p1, dd2 + p2)
    V0, V1, V2 = V0 - x0, V1 - x1, V2 - x2
    along = dot(N0, N1, N2, s[REL], s[REL + 1], s[REL + 2])
    change = dot(n0, n1, n2, s[REL], s[REL + 1], s[REL + 2]) + dot(N0, N1, N2, V0, V1, V2)
    V0, V1, V2 = V0 - change * N0 - along * n0, V1 - change * N1 - along * n1, V2 - change * N2 - along * n2
    # force
    f, size, mu = s[FORCE], s[SLIP], data.friction[i]
    df = -s[BY_X] * gap + s[BY_RATE] * rate
    g = dot(s[V], s[V + 1], s[V + 2], V0, V1, V2) / (size * size)
    rub = mu * f / size
    F0 = mu * df / size * s[V] + rub * (V0 - g * s[V]) - df * N0 - f * n0
    F1 = mu * df / size * s[V + 1] + rub * (V1 - g * s[V + 1]) - df * N1 - f * n1
    F2 = mu * df / size * s[V + 2] + rub * (V2 - g * s[V + 2]) - df * N2 - f * n2
    put(out, 0, F0, F1, F2)
    L0, L1, L2 = three(s, LAW)
    x0, x1, x2 = cross(dd0 + p0, dd1 + p1, dd2 + p2, L0, L1, L2)
    z0, z1, z2 = cross(d0 + rho0, d1 + rho1, d2 + rho2, F0, F1, F2)
    put(out, 3, x0 + z0, x1 + z1, x2 + z2)
    x0, x1, x2 = cross(p0, p1, p2, L0, L1, L2)
    z0, z1, z2 = cross(rho0, rho1, rho2, F0, F1, F2)
    put(out, 6, x0 + z0, x1 + z1, x2 + z2)
    out[9] = s[FREE] * rate


@inner
def contact_energy(model, work, c):
    """Return k x^(n + 1)/(n + 1)."""
    s, data, i = work.pair.numbers, model.contacts, model.connections.item[c]
    contact_state(model, work, c)
    return data.stiffness[i] * s[DEPTH] ** (data.exponent[i] + 1.0) / (data.exponent[i] + 1.0)


@inner
def contact_power(model, work, c):
    """Return the power taken by restitution and friction."""
    s, data, i = work.pair.numbers, model.contacts, model.connections.item[c]
    contact_state(model, work, c)
    spring = data.stiffness[i] * s[DEPTH] ** data.exponent[i]
    slip = dot(s[V], s[V + 1], s[V + 2], s[V], s[V + 1], s[V + 2])
    return -(s[FORCE] - spring) * s[RATE] + data.friction[i] * s[FORCE] * slip / s[SLIP]
