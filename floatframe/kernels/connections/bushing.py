"""A bushing: force and torque of a potential of six deformations between two markers, with damping.

Half of the rotation of B against A takes A to the middle axes C, so that A and B can be exchanged. With d = r_B - r_A
and theta the rotation vector of A_Aᵀ A_B (|theta| < pi; its components are the same in A, B and C)

    e = Cᵀ d,  xi = (e, theta),  (f, m) = dV/dxi + D xi_dot,  V = 1/2 xiᵀ K xi + preload · xi + tables of each xi_i

Variations in the axes of C, a and b the rotations of A and B, u = b - a:

    dtheta = S u,   S = alpha 1 + beta theta thetaᵀ,   alpha = (t/2)/sin(t/2), beta = (1 - alpha)/t²,  t = |theta|
    dc = (a + b)/2 - tau theta × u,   tau = tan(t/4)/(2 t)            the rotation of C
    de = Cᵀ dd + e × dc

so that by virtual work, with p = f × e,  F = C f is the force on A (on B the opposite), and the moments are

    on A:  M = C (-p/2 + tau theta × p + S m)        on B:  -N = -C (p/2 + tau theta × p + S m)

`bushing_variation` gives the exact change of F, M and N; rates follow the same formulas with velocities for variations.
"""

import math

from floatframe.kernels.compiler.compilation import inner
from floatframe.kernels.rotation import exp_matrix
from floatframe.kernels.time_function import time_function
from floatframe.kernels.vector import (
    add,
    cross,
    dot,
    matrix,
    norm,
    product,
    put,
    put_matrix,
    scaled,
    sub,
    transposed,
    turned,
    turned_back,
    vector,
)

__all__ = ["bushing_energy", "bushing_power", "bushing_state", "bushing_variation"]

SERIES_BELOW = 0.01  # t² at the switch
A1, A2, A3, A4, A5 = 1 / 24, 7 / 5760, 31 / 967680, 127 / 154828800, 73 / 3503554560  # of alpha - 1 in t²


@inner
def rotation_vector(A, B):
    """Return the rotation vector of R = Aᵀ B, no longer than pi, by a quaternion (w, x) of any length."""
    R = product(transposed(A), B)
    w = 1.0 + R[0][0] + R[1][1] + R[2][2]  # 4 w², and 4 w times x
    x = (R[2][1] - R[1][2], R[0][2] - R[2][0], R[1][0] - R[0][1])
    if w < 1.0:  # more than 90 degrees: 4 times the largest of x, y, z times all of them
        k = 0 if R[0][0] >= R[1][1] and R[0][0] >= R[2][2] else (1 if R[1][1] >= R[2][2] else 2)
        symmetric = (
            (2.0 + 2 * R[0][0] - w, R[0][1] + R[1][0], R[0][2] + R[2][0]),
            (R[0][1] + R[1][0], 2.0 + 2 * R[1][1] - w, R[1][2] + R[2][1]),
            (R[0][2] + R[2][0], R[1][2] + R[2][1], 2.0 + 2 * R[2][2] - w),
        )
        w, x = x[k], symmetric[k]
        if w < 0.0:
            w, x = -w, scaled(-1.0, x)
    length = norm(x)
    return scaled(2.0 * math.atan2(length, w) / length if length > 0.0 else 0.0, x)


@inner
def scalars(t2):
    """Return alpha, beta, alpha'/t, beta'/t, tau, tau'/t of t²."""
    if t2 < SERIES_BELOW:
        y2 = t2 / 16
        return (
            1 + t2 * (A1 + t2 * (A2 + t2 * (A3 + t2 * (A4 + t2 * A5)))),
            -(A1 + t2 * (A2 + t2 * (A3 + t2 * (A4 + t2 * A5)))),
            2 * A1 + t2 * (4 * A2 + t2 * (6 * A3 + t2 * (8 * A4 + t2 * 10 * A5))),
            -(2 * A2 + t2 * (4 * A3 + t2 * (6 * A4 + t2 * 8 * A5))),
            (1 + y2 * (1 / 3 + y2 * (2 / 15 + y2 * (17 / 315 + y2 * 62 / 2835)))) / 8,
            (2 / 3 + y2 * (8 / 15 + y2 * (102 / 315 + y2 * 496 / 2835))) / 128,
        )
    t = math.sqrt(t2)
    x, y = t / 2, t / 4
    s, c = math.sin(x), math.cos(x)
    alpha = x / s
    beta = (1 - alpha) / t2
    by_t = 0.5 * (s - x * c) / (s * s * t)
    tan = math.tan(y)
    return alpha, beta, by_t, -(by_t + 2 * beta) / t2, tan / (2 * t), ((1 + tan * tan) / y - tan / (y * y)) / (32 * t)


@inner
def by_S(s, u):
    """Return S u."""
    theta = vector(s.xi[3:])
    return add(scaled(s.alpha, u), scaled(s.beta * dot(theta, u), theta))


@inner
def by_dS(s, k, h, u):
    """Return dS u for dtheta = h and k = theta · h."""
    theta = vector(s.xi[3:])
    along = dot(theta, u)
    by_theta = s.beta_1 * k * along + s.beta * dot(h, u)
    return add(add(scaled(s.alpha_1 * k, u), scaled(by_theta, theta)), scaled(s.beta * along, h))


@inner
def law(row, x):
    """Return the product of a row of stiffness or damping, (6,), by deformations or their rates, (6,)."""
    return row[0] * x[0] + row[1] * x[1] + row[2] * x[2] + row[3] * x[3] + row[4] * x[4] + row[5] * x[5]


@inner
def bushing_state(model, work, c):
    """Write what follows from the motion of bushing c into work.bushing, F, M and N into work.pair."""
    a, b, i, markers = model.connections.a[c], model.connections.b[c], model.connections.item[c], work.markers
    s, K, D = work.bushing, model.bushings.stiffness[i], model.bushings.damping[i]
    theta = rotation_vector(markers.A[a], markers.A[b])
    C = product(markers.A[a], exp_matrix(scaled(0.5, theta)))
    s.alpha, s.beta, s.alpha_1, s.beta_1, s.tau, s.tau_1 = scalars(dot(theta, theta))
    omega_a, omega_b = vector(markers.omega[a]), vector(markers.omega[b])
    e = turned_back(C, sub(markers.r[b], markers.r[a]))
    put(s.xi, 0, e)
    put(s.xi, 3, theta)
    v = turned_back(C, sub(markers.v[b], markers.v[a]))
    omega = turned_back(C, sub(omega_b, omega_a))
    mean = turned_back(C, scaled(0.5, add(omega_a, omega_b)))
    gamma = sub(mean, scaled(s.tau, cross(theta, omega)))
    put(s.xi_dot, 0, add(v, cross(e, gamma)))
    put(s.xi_dot, 3, by_S(s, omega))
    for r in range(6):
        s.force[r] = law(K[r], s.xi) + law(D[r], s.xi_dot) + model.bushings.preload[i, r]
        s.slope[r] = 0.0
        table = model.bushings.table[i, r]
        if table >= 0:
            value, s.slope[r], _ = time_function(model.functions, table, s.xi[r])
            s.force[r] += value
    f, m = vector(s.force), vector(s.force[3:])
    p = cross(f, e)
    turning = add(scaled(s.tau, cross(theta, p)), by_S(s, m))
    put_matrix(s.C, C)
    put(s.v, 0, v)
    put(s.omega, 0, omega)
    put(s.mean, 0, mean)
    put(s.gamma, 0, gamma)
    put(s.p, 0, p)
    put(work.pair.law, 0, turned(C, f))
    put(work.pair.law, 3, turned(C, sub(turning, scaled(0.5, p))))
    put(work.pair.law, 6, turned(C, add(turning, scaled(0.5, p))))


@inner
def bushing_variation(model, work, c):
    """Write the change of F, M, N for the variation of the motion in work.pair, ground axes."""
    s, pair, i = work.bushing, work.pair, model.connections.item[c]
    K, D, C = model.bushings.stiffness[i], model.bushings.damping[i], matrix(s.C)
    e, theta, omega, gamma = vector(s.xi), vector(s.xi[3:]), vector(s.omega), vector(s.gamma)
    a, b = turned_back(C, pair.motion[3:6]), turned_back(C, pair.motion[6:9])
    u = sub(b, a)
    dc = sub(scaled(0.5, add(a, b)), scaled(s.tau, cross(theta, u)))
    dtheta = by_S(s, u)
    k = dot(theta, dtheta)
    de = add(turned_back(C, pair.motion[:3]), cross(e, dc))
    # rates
    domega_a, domega_b = turned_back(C, pair.motion[12:15]), turned_back(C, pair.motion[15:18])
    dv = add(turned_back(C, pair.motion[9:12]), cross(s.v, dc))
    domega = add(sub(domega_b, domega_a), cross(omega, dc))
    dmean = add(scaled(0.5, add(domega_a, domega_b)), cross(s.mean, dc))
    by_turn = add(scaled(s.tau_1 * k, cross(theta, omega)), scaled(s.tau, cross(dtheta, omega)))
    dgamma = sub(dmean, add(by_turn, scaled(s.tau, cross(theta, domega))))
    put(s.dxi, 0, de)
    put(s.dxi, 3, dtheta)
    put(s.dxi_dot, 0, add(dv, add(cross(de, gamma), cross(e, dgamma))))
    put(s.dxi_dot, 3, add(by_S(s, domega), by_dS(s, k, dtheta, omega)))
    # force and torque in C
    for r in range(6):
        s.dforce[r] = law(K[r], s.dxi) + law(D[r], s.dxi_dot) + s.slope[r] * s.dxi[r]
    f, m, p, df, dm = vector(s.force), vector(s.force[3:]), vector(s.p), vector(s.dforce), vector(s.dforce[3:])
    dp = add(cross(df, e), cross(f, de))
    by_turn = add(scaled(s.tau_1 * k, cross(theta, p)), scaled(s.tau, cross(dtheta, p)))
    by_force = add(scaled(s.tau, cross(theta, dp)), by_S(s, dm))
    turning = add(add(by_turn, by_force), by_dS(s, k, dtheta, m))
    turn = turned(C, dc)
    put(pair.change, 0, add(turned(C, df), cross(turn, pair.law)))
    put(pair.change, 3, add(turned(C, sub(turning, scaled(0.5, dp))), cross(turn, pair.law[3:])))
    put(pair.change, 6, add(turned(C, add(turning, scaled(0.5, dp))), cross(turn, pair.law[6:])))


@inner
def bushing_energy(model, work, c):
    """Return 1/2 xiᵀ K xi + preload · xi; tables count as forces, see `bushing_power`."""
    s, i = work.bushing, model.connections.item[c]
    bushing_state(model, work, c)
    total = 0.0
    for r in range(6):
        total += s.xi[r] * (0.5 * law(model.bushings.stiffness[i, r], s.xi) + model.bushings.preload[i, r])
    return total


@inner
def bushing_power(model, work, c):
    """Return the power that enters by tables, and that taken by damping."""
    s, i = work.bushing, model.connections.item[c]
    bushing_state(model, work, c)
    given, taken = 0.0, 0.0
    for r in range(6):
        taken += s.xi_dot[r] * law(model.bushings.damping[i, r], s.xi_dot)
        if model.bushings.table[i, r] >= 0:
            value, _, _ = time_function(model.functions, model.bushings.table[i, r], s.xi[r])
            given -= value * s.xi_dot[r]
    return given, taken
