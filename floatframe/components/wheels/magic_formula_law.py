"""The law of a tyre with the Magic Formula: contact, tread and validity ranges around the formula."""

import numpy as np
from numba import njit
from numba.extending import register_jitable

from floatframe.components.wheels.contact import (
    LOW_SPEED,
    RADIUS,
    SIGMA_X,
    SIGMA_Y,
    contact,
    grip_at,
    normal_force,
    put_wrenches,
    touching,
)
from floatframe.components.wheels.magic_formula import (
    ALPHA_HIGH,
    ALPHA_LOW,
    BREFF,
    C_LAT,
    C_LONG,
    C_VERTICAL,
    DP,
    DREFF,
    FREFF,
    GAMMA_HIGH,
    GAMMA_LOW,
    IS_61,
    KAPPA_HIGH,
    KAPPA_LOW,
    LFZO,
    LOAD,
    LOAD_HIGH,
    LOAD_LOW,
    LSGAL,
    LSGKP,
    PCFX1,
    PCFX2,
    PCFX3,
    PCFY1,
    PCFY2,
    PCFY3,
    PFZ1,
    PKY3,
    PTX1,
    PTX2,
    PTX3,
    PTY1,
    PTY2,
    QFZ1,
    QFZ2,
    QRE0,
    QV1,
    QV2,
    SIDE,
    SIGMA_FROM_FILE,
    SIGN,
    SPEED,
    forces_and_moments,
    peaks_and_stiffnesses,
)
from floatframe.components.wheels.outputs import show, show_energy
from floatframe.components.wheels.slip import direction, hold_tread, magnitude, tread_slip

__all__ = ["magic_formula_law", "magic_formula_law_at_rest"]

SHORTEST = 0.05  #: least relaxation length of a tyre with a small load, divided by its radius


@register_jitable(error_model="numpy")
def held(value, low, high):
    """Return a number clamped to a range, and 1 if it was outside (else 0)."""
    if value.real < low:
        return low + 0.0 * value, 1.0
    if value.real > high:
        return high + 0.0 * value, 1.0
    return value, 0.0


@register_jitable(error_model="numpy")
def relaxation(data, df, load, K_x, K_y, gamma):
    """Return the relaxation lengths along x and y [m].

    They are computed from the coefficients p_T if the file has them, else as slip stiffness divided by the stiffness of
    the carcass. A value given for the element overrides both.
    """
    if data[SIGMA_FROM_FILE] == 0.0:
        return data[SIGMA_X] + 0.0 * load, data[SIGMA_Y] + 0.0 * load
    R_0, F_0, dp = data[RADIUS], data[LOAD], data[DP]
    if data[PTX1] != 0.0:
        x = load * (data[PTX1] + data[PTX2] * df) * np.exp(-data[PTX3] * df) * R_0 / F_0 * data[LSGKP]
    else:
        stiffness = data[C_LONG] * (1.0 + data[PCFX1] * df + data[PCFX2] * df * df) * (1.0 + data[PCFX3] * dp)
        x = magnitude(K_x) / stiffness
    if data[PTY1] != 0.0:
        y = data[PTY1] * np.sin(2.0 * np.arctan(load / (data[PTY2] * F_0 * data[LFZO])))
        y = y * (1.0 - data[PKY3] * magnitude(gamma)) * R_0 * data[LFZO] * data[LSGAL]
    else:
        stiffness = data[C_LAT] * (1.0 + data[PCFY1] * df + data[PCFY2] * df * df) * (1.0 + data[PCFY3] * dp)
        y = magnitude(K_y) / stiffness
    least = SHORTEST * R_0
    return x if x.real > least else least + 0.0 * x, y if y.real > least else least + 0.0 * y


@njit(error_model="numpy")
def magic_formula_law(t, x, z, lam, data, wrench, z_dot, g, seen):
    """Write wrenches, rates and outputs of a tyre with the Magic Formula.

    (1) contact; R_free = R_0 (q_re0 + q_V1 (R_0 Omega/V_0)²), deflection d = R_free - rho
    (2) F_z = (1 + q_V2 R_0/V_0 |Omega|)(1 + p_Fz1 dp)(q_Fz1 d/R_0 + q_Fz2 (d/R_0)²) F_0 + damping
    (3) R_e = R_free - F_0/c_z (D_reff atan(B_reff F_z/F_0) + F_reff F_z/F_0); V_sx = V_x - R_e Omega
    (4) slips of the tread, clamped to the ranges of the file; below the range of the load, the forces at the lowest
        load are scaled in proportion
    (5) the formula, in signs and on the side of the file, converted to ISO axes
    """
    x_W, y_W, n, _, point, d, rho, sine, cosine, V_x, V_y, Omega, rate, left = contact(x, data)  # (1)
    zero = 0.0 * d
    R_0, F_0, V_0 = data[RADIUS], data[LOAD], data[SPEED]
    spin = R_0 * Omega / V_0
    R_free = R_0 * (data[QRE0] + data[QV1] * spin * spin)
    d = d + R_free - R_0
    is_down = d.real > 0.0
    landed = touching(data, d)
    stiffening = 1.0 + data[QV2] * magnitude(spin)
    q = d / R_0
    spring = (1.0 + data[PFZ1] * data[DP]) * (data[QFZ1] * q + data[QFZ2] * q * q) * F_0  # (2)
    F_z = normal_force(data, d, landed, rate, cosine, stiffening * spring)
    f = F_z / F_0
    R_e = R_free - F_0 / data[C_VERTICAL] * (data[DREFF] * np.arctan(data[BREFF] * f) + data[FREFF] * f)  # (3)
    V_sx = V_x - R_e * Omega
    load, over = held(F_z, data[LOAD_LOW], data[LOAD_HIGH])  # (4)
    share = F_z / load if F_z.real < data[LOAD_LOW] else 1.0 + zero
    clamped = over if F_z.real > 0.0 else 0.0
    gamma, over = held(np.arctan(sine / cosine), data[GAMMA_LOW], data[GAMMA_HIGH])
    clamped += over
    side, sign = data[SIDE], data[SIGN]
    c = np.sin(gamma) if data[IS_61] > 0.0 else gamma
    grip = grip_at(x, data, point)
    df, mu_x, K_x, mu_y, K_y = peaks_and_stiffnesses(data, load, side * c, grip)
    sigma = relaxation(data, df, load, K_x, K_y, gamma)
    scale = 3.0 * mu_x * load / magnitude(K_x), 3.0 * mu_y * load / magnitude(K_y)
    kappa, tangent = tread_slip(data, sigma, scale, z, z_dot, V_x, V_sx, V_y, landed)
    kappa_held, over = held(kappa, data[KAPPA_LOW], data[KAPPA_HIGH])
    clamped += over
    alpha_held, over = held(np.arctan(tangent), data[ALPHA_LOW], data[ALPHA_HIGH])
    clamped += over
    F = zero, zero, F_z  # (5)
    M = zero, zero, zero
    if F_z.real > 0.0:
        forward = direction(V_x, data[LOW_SPEED])
        F_x, F_y, M_x, M_y, M_z = forces_and_moments(
            data, load, kappa_held, side * alpha_held, side * gamma, R_0, V_x, forward, magnitude(forward), grip
        )
        turning = direction(R_0 * Omega, data[LOW_SPEED])
        F = share * F_x, sign * side * share * F_y, F_z
        M = side * share * M_x, -share * M_y * turning, sign * side * share * M_z
    power = put_wrenches(x, wrench, (x_W, y_W, n, point), F, M)
    energy, rising = zero, zero
    if is_down:
        energy = (1.0 + data[PFZ1] * data[DP]) * (data[QFZ1] / 2.0 + data[QFZ2] * q / 3.0) * q * d * F_0
        rising = spring * rate
    show(seen, F, M, (kappa, tangent, sine), (d, rho), (V_x, V_sx, V_y), point)
    show_energy(seen, energy, -power - rising, left, clamped + zero)


@njit(error_model="numpy")
def magic_formula_law_at_rest(t, x, z, lam, data, wrench, z_dot, g, seen):
    """Write the same for a standing wheel, whose tread is deformed by the displacement of the wheel."""
    magic_formula_law(t, x, z, lam, data, wrench, z_dot, g, seen)
    hold_tread(x, data, seen[10], z, z_dot)
