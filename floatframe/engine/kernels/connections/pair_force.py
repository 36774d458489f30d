"""Forces from the relative motion of two markers: spring-dampers, bushings and contacts of spheres.

A law gives the force F on A, -F on B, and the moment -N on B from the motion of B relative to A: d = r_B - r_A, the
axes of both, v = d_dot - omega_A × d and omega = omega_B - omega_A. The moment on A balances them, M = N + d × F. The
wrench w = (F, M, N), for a spring only F, has the rows w - law(motion) = 0. A contact has one more unknown, its speed
of approach.

Derivatives are taken along unit variations of d, of the rotation u of B, of v and of omega, all relative to A, one
after the other. Let g_d, g_u, g_v, g_w be the derivatives of the component x·e of a vector x, which is F or N. Then

    dx·e = (g_d + omega_A × g_v)·dd + g_u·phi_B + (g_d × d - g_u + g_v × v + g_w × omega + x × e)·phi_A
         + g_v·dd_dot + g_w·domega_B + (g_v × d - g_w)·domega_A

To add a force, write its functions of state, variation and power, and add a line to each function that selects by law.
"""

from floatframe.engine.kernels.compiler.compilation import inner, small
from floatframe.engine.kernels.connections.bushing import bushing_power, bushing_state, bushing_variation
from floatframe.engine.kernels.connections.contact import V_0, contact_power, contact_state, contact_variation
from floatframe.engine.kernels.connections.spring_damper import spring_power, spring_state, spring_variation
from floatframe.engine.kernels.joints.relative_motion import add_pair, by_markers, distance, put_pair, slip
from floatframe.engine.kernels.model import BUSHING, CONTACT, SPRING
from floatframe.engine.kernels.vector import add, cross, matrix, put, put_matrix, scaled, sub, unit, vector

__all__ = ["is_pair", "pair_derivatives", "pair_power", "pair_rows"]

ON_A, ON_B = 3, 6  # first rows of M and N in the wrench


@small
def is_pair(law):
    """Whether a connection law is one of the forces in this module."""
    return law == SPRING or law == BUSHING or law == CONTACT


@inner
def pair_state(model, work, c):
    """Write F, N and v_0 of connection c for the motion of its markers into work.pair."""
    a, b, markers, pair = model.connections.a[c], model.connections.b[c], work.markers, work.pair
    d = distance(markers, a, b)
    put(pair.d, 0, d)
    put(pair.v, 0, slip(markers, a, b, d))
    if model.connections.law[c] == SPRING:
        spring_state(model, work, c)
        return
    put(pair.omega, 0, sub(vector(markers.omega[b]), vector(markers.omega[a])))
    put_matrix(pair.A, matrix(markers.A[a]))
    put_matrix(pair.B, matrix(markers.A[b]))
    if model.connections.law[c] == BUSHING:
        bushing_state(model, work, c)
    else:
        contact_state(model, work, c)


@inner
def pair_power(model, work, c):
    """Return the energy of connection c, the power supplied by its tables, and its dissipated power."""
    pair_state(model, work, c)
    if model.connections.law[c] == SPRING:
        return spring_power(model, work, c)
    if model.connections.law[c] == BUSHING:
        return bushing_power(model, work, c)
    return contact_power(model, work, c)


@inner
def pair_rows(model, work, c, c_k):
    """Write the residual of connection c."""
    pair_state(model, work, c)
    w0, size, pair = model.connections.w0[c], model.connections.size[c], work.pair
    w, g, F, N = work.state.w[w0:], work.connections.g[w0:], vector(pair.F), vector(pair.N)
    put(g, 0, scaled(c_k, sub(vector(w), F)))
    if size > ON_A:
        put(g, ON_A, scaled(c_k, sub(vector(w[ON_A:]), add(N, cross(pair.d, F)))))
        put(g, ON_B, scaled(c_k, sub(vector(w[ON_B:]), N)))
    if size > V_0:
        g[V_0] = c_k * (w[V_0] - pair.v_0)


@inner
def pair_derivatives(model, work, c, c_k):
    """Write P at both markers and V of connection c, which must be zero before."""
    a, b, size, pair = model.connections.a[c], model.connections.b[c], model.connections.size[c], work.pair
    P_a, P_b = work.connections.P[a], work.connections.P[b]
    pair_state(model, work, c)
    for k in range(12):
        pair.motion[k] = 0.0
    for k in range(12):
        if size == ON_A and k % 6 > 2:  # rotations do not change a spring
            for r in range(ON_A):
                pair.slopes[r, k] = 0.0
            continue
        pair.motion[k] = 1.0
        if model.connections.law[c] == SPRING:
            spring_variation(model, work, c)
        elif model.connections.law[c] == BUSHING:
            bushing_variation(model, work, c)
        else:
            contact_variation(model, work, c)
        pair.motion[k] = 0.0
        for r in range(3):
            pair.slopes[r, k], pair.slopes[ON_B + r, k] = pair.F_change[r], pair.N_change[r]
        pair.slopes[V_0, k] = pair.v_0_change
    d, v, omega, omega_a = vector(pair.d), vector(pair.v), vector(pair.omega), vector(work.markers.omega[a])
    for r in range(size):
        work.connections.V[c, r, r] = 1.0
        if r < ON_A or r >= ON_B:
            g_d, g_u, g_v, g_w = slopes_of(pair, r)
            by = by_markers(work, a, b, r)
            put_pair(by, 0, scaled(c_k, add(g_d, cross(omega_a, g_v))))
            put_pair(by, 6, scaled(c_k, g_v))
            if size > ON_A:
                turn = add(sub(cross(g_d, d), g_u), add(cross(g_v, v), cross(g_w, omega)))
                if r < V_0:
                    turn = add(turn, cross(pair.F if r < ON_A else pair.N, unit(r % 3)))
                put(by.a, 3, scaled(-c_k, turn))
                put(by.b, 3, scaled(-c_k, g_u))
                put(by.a, 9, scaled(c_k, sub(g_w, cross(g_v, d))))
                put(by.b, 9, scaled(-c_k, g_w))
    if size > ON_A:
        for r in range(3):  # M = N + d × F
            arm = cross(unit(r), d)
            for j in range(12):
                P_a[ON_A + r, j] = P_a[ON_B + r, j] + arm[0] * P_a[0, j] + arm[1] * P_a[1, j] + arm[2] * P_a[2, j]
                P_b[ON_A + r, j] = P_b[ON_B + r, j] + arm[0] * P_b[0, j] + arm[1] * P_b[1, j] + arm[2] * P_b[2, j]
            add_pair(by_markers(work, a, b, ON_A + r), 0, scaled(c_k, cross(pair.F, unit(r))))


@small
def slopes_of(pair, r):
    """Return the derivatives of result r (F, unused, N, v_0) by d, u, v and omega."""
    row = pair.slopes[r]
    return vector(row), vector(row[3:]), vector(row[6:]), vector(row[9:])
