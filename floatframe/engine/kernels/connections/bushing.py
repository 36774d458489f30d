"""A bushing: force and torque from a potential of six deformations between two markers, with damping.

The axes C are the axes of A after a `share` of the rotation of B relative to A: 0 (axes of A), 1 (axes of B), or 1/2
(half way, symmetric in A and B). With d = r_B - r_A and theta the rotation vector of A_Aᵀ A_B, whose components are the
same in A, B and C,

    e = Cᵀ d,  xi = (e, theta),  (f, m) = dV/dxi + D xi_dot,  V = 1/2 xiᵀ K xi + preload · xi + tables of each xi_i

Variations relative to A in the axes of C, with u the rotation of B and t = |theta|:

    dtheta = S u,   S = alpha 1 + beta theta thetaᵀ + sigma tilde(theta),   beta = (1 - alpha)/t²
        axes of A, B: alpha = (t/2) cot(t/2), sigma = -1/2, 1/2;   half way: alpha = (t/2)/sin(t/2), sigma = 0
    dc = share u - tau theta × u                              the rotation of C
        axes of A, B: tau = 0;   half way: tau = tan(t/4)/(2 t)
    de = Cᵀ dd + e × dc

so that by virtual work, with p = f × e,  F = C f is the force on A (on B the opposite), and the moment on B is

    -N = -C (q + share p),      q = tau theta × p + Sᵀ m

In axes of A or B, turns are counted: of all rotation vectors theta + 2 pi n theta/t of A_Aᵀ A_B, theta is the one
nearest to the value predicted by the rates of the last step (`kernels/turns.py`). Half way, t < pi.

`bushing_variation` gives the exact change of F and N; rates follow the same formulas with velocities for variations.

Described in `floatframe.model.forces.bushing`.
"""

import math

from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.rotation import exp_matrix, quaternion_of
from floatframe.engine.kernels.time_function import time_function
from floatframe.engine.kernels.vector import (
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

__all__ = ["bushing_power", "bushing_state", "bushing_variation", "continued", "rotation_vector"]

SERIES_BELOW = 0.01  # t² at the switch
# value of t below which the direction of the rotation vector is only roundoff, compared with full turns
NEAR_FULL_TURN = 1e-6
# series of alpha - 1 in t², half way
A1, A2, A3, A4, A5 = 1 / 24, 7 / 5760, 31 / 967680, 127 / 154828800, 73 / 3503554560
B1, B2, B3, B4, B5 = 1 / 12, 1 / 720, 1 / 30240, 1 / 1209600, 1 / 47900160  # series of 1 - alpha in t², axes of A or B


@inner
def rotation_vector(A, B):
    """Return the rotation vector of Aᵀ B, with a length of at most pi."""
    w, x = quaternion_of(product(transposed(A), B))
    length = norm(x)
    return scaled(2.0 * math.atan2(length, w) / length if length > 0.0 else 0.0, x)


@inner
def continued(theta, expected):
    """Return the rotation vector theta + 2 pi n theta/|theta|, |theta| <= pi, that is nearest to the expected one."""
    t, size = norm(theta), norm(expected)
    if size + t < math.pi:
        return theta
    if t < NEAR_FULL_TURN:
        return add(theta, scaled(2 * math.pi * math.floor(size / (2 * math.pi) + 0.5) / size, expected))
    n = math.floor((dot(expected, theta) / t - t) / (2 * math.pi) + 0.5)
    return scaled(1.0 + 2 * math.pi * n / t, theta)


@inner
def scalars(t2, share):
    """Return alpha, beta, alpha'/t, beta'/t, tau, tau'/t as functions of t², t the angle of rotation."""
    if share == 0.5:
        return scalars_half_way(t2)
    if t2 < SERIES_BELOW:
        return (
            1 - t2 * (B1 + t2 * (B2 + t2 * (B3 + t2 * (B4 + t2 * B5)))),
            B1 + t2 * (B2 + t2 * (B3 + t2 * (B4 + t2 * B5))),
            -(2 * B1 + t2 * (4 * B2 + t2 * (6 * B3 + t2 * (8 * B4 + t2 * 10 * B5)))),
            2 * B2 + t2 * (4 * B3 + t2 * (6 * B4 + t2 * 8 * B5)),
            0.0,
            0.0,
        )
    t = math.sqrt(t2)
    x = t / 2
    s, c = math.sin(x), math.cos(x)
    alpha = x * c / s
    beta = (1 - alpha) / t2
    by_t = 0.5 * (s * c - x) / (s * s * t)
    return alpha, beta, by_t, -(by_t + 2 * beta) / t2, 0.0, 0.0


@inner
def scalars_half_way(t2):
    """Return the same as `scalars` for axes half way between A and B."""
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
def by_S(s, u, sigma):
    """Return S u for the sign sigma; the opposite sign gives Sᵀ u."""
    theta = vector(s.xi[3:])
    both = add(scaled(s.alpha, u), scaled(s.beta * dot(theta, u), theta))
    return add(both, scaled(sigma, cross(theta, u)))


@inner
def by_dS(s, k, h, u, sigma):
    """Return dS u for dtheta = h and k = theta · h; the opposite sign sigma gives dSᵀ u."""
    theta = vector(s.xi[3:])
    along = dot(theta, u)
    by_theta = s.beta_1 * k * along + s.beta * dot(h, u)
    both = add(add(scaled(s.alpha_1 * k, u), scaled(by_theta, theta)), scaled(s.beta * along, h))
    return add(both, scaled(sigma, cross(h, u)))


@inner
def axes_of(A, B, theta, share):
    """Return the axes of a bushing: those of A, those of B, or the axes half way between them."""
    if share == 0.0:
        return matrix(A)
    if share == 1.0:
        return matrix(B)
    return product(A, exp_matrix(scaled(share, theta)))


@inner
def law(row, x):
    """Return the product of a row of stiffness or damping, (6,), with the deformations or their rates, (6,)."""
    return row[0] * x[0] + row[1] * x[1] + row[2] * x[2] + row[3] * x[3] + row[4] * x[4] + row[5] * x[5]


@inner
def bushing_state(model, work, c):
    """Write the deformations of bushing c into work.bushing, and F and N into work.pair."""
    i, pair, s = model.connections.item[c], work.pair, work.bushing
    K, D, A, B = model.bushings.stiffness[i], model.bushings.damping[i], pair.A, pair.B
    share, angle = model.bushings.share[i], model.bushings.angle[i]
    theta = rotation_vector(A, B)
    if angle >= 0:
        theta = continued(theta, vector(work.state.angle[angle:]))
    C = axes_of(A, B, theta, share)
    s.alpha, s.beta, s.alpha_1, s.beta_1, s.tau, s.tau_1 = scalars(dot(theta, theta), share)
    s.sigma = share - 0.5
    e, v, omega = turned_back(C, pair.d), turned_back(C, pair.v), turned_back(C, pair.omega)
    put(s.xi, 0, e)
    put(s.xi, 3, theta)
    gamma = sub(scaled(share, omega), scaled(s.tau, cross(theta, omega)))
    put(s.xi_dot, 0, add(v, cross(e, gamma)))
    put(s.xi_dot, 3, by_S(s, omega, s.sigma))
    for r in range(6):
        s.force[r] = law(K[r], s.xi) + law(D[r], s.xi_dot) + model.bushings.preload[i, r]
        s.slope[r] = 0.0
        table = model.bushings.table[i, r]
        if table >= 0:
            value, s.slope[r], _ = time_function(model.functions, table, s.xi[r])
            s.force[r] += value
    f, m = vector(s.force), vector(s.force[3:])
    p = cross(f, e)
    turning = add(scaled(s.tau, cross(theta, p)), by_S(s, m, -s.sigma))
    put_matrix(s.C, C)
    put(s.v, 0, v)
    put(s.omega, 0, omega)
    put(s.gamma, 0, gamma)
    put(s.p, 0, p)
    put(pair.F, 0, turned(C, f))
    put(pair.N, 0, turned(C, add(turning, scaled(share, p))))


@inner
def bushing_variation(model, work, c):
    """Write the change of F and N, relative to A, for the variation of the motion in work.pair."""
    s, pair, i = work.bushing, work.pair, model.connections.item[c]
    K, D, C, share = model.bushings.stiffness[i], model.bushings.damping[i], matrix(s.C), model.bushings.share[i]
    e, theta, omega, gamma = vector(s.xi), vector(s.xi[3:]), vector(s.omega), vector(s.gamma)
    u = turned_back(C, pair.motion[3:6])
    dc = sub(scaled(share, u), scaled(s.tau, cross(theta, u)))
    dtheta = by_S(s, u, s.sigma)
    k = dot(theta, dtheta)
    de = add(turned_back(C, pair.motion[:3]), cross(e, dc))
    # rates
    dv = add(turned_back(C, pair.motion[6:9]), cross(s.v, dc))
    domega = add(turned_back(C, pair.motion[9:12]), cross(omega, dc))
    by_turn = add(scaled(s.tau_1 * k, cross(theta, omega)), scaled(s.tau, cross(dtheta, omega)))
    dgamma = sub(scaled(share, domega), add(by_turn, scaled(s.tau, cross(theta, domega))))
    put(s.dxi, 0, de)
    put(s.dxi, 3, dtheta)
    put(s.dxi_dot, 0, add(dv, add(cross(de, gamma), cross(e, dgamma))))
    put(s.dxi_dot, 3, add(by_S(s, domega, s.sigma), by_dS(s, k, dtheta, omega, s.sigma)))
    # force and torque in C
    for r in range(6):
        s.dforce[r] = law(K[r], s.dxi) + law(D[r], s.dxi_dot) + s.slope[r] * s.dxi[r]
    f, m, p, df, dm = vector(s.force), vector(s.force[3:]), vector(s.p), vector(s.dforce), vector(s.dforce[3:])
    dp = add(cross(df, e), cross(f, de))
    by_turn = add(scaled(s.tau_1 * k, cross(theta, p)), scaled(s.tau, cross(dtheta, p)))
    by_force = add(scaled(s.tau, cross(theta, dp)), by_S(s, dm, -s.sigma))
    turning = add(add(by_turn, by_force), by_dS(s, k, dtheta, m, -s.sigma))
    turn = turned(C, dc)
    put(pair.F_change, 0, add(turned(C, df), cross(turn, pair.F)))
    put(pair.N_change, 0, add(turned(C, add(turning, scaled(share, dp))), cross(turn, pair.N)))


@inner
def bushing_power(model, work, c):
    """Return 1/2 xiᵀ K xi + preload · xi, the power supplied by tables, and the power dissipated by damping."""
    s, own, i = work.bushing, model.bushings, model.connections.item[c]
    stored, given, taken = 0.0, 0.0, 0.0
    for r in range(6):
        stored += s.xi[r] * (0.5 * law(own.stiffness[i, r], s.xi) + own.preload[i, r])
        taken += s.xi_dot[r] * law(own.damping[i, r], s.xi_dot)
        if own.table[i, r] >= 0:
            value, _, _ = time_function(model.functions, own.table[i, r], s.xi[r])
            given -= value * s.xi_dot[r]
    return stored, given, taken
