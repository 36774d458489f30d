"""The Magic Formula 5.2 and 6.1: forces and moments of a tyre as functions of load, slip, inclination and pressure.

Values have the signs of the property file (ISO or adapted SAE), and are for the side for which the file was made;
`magic_formula_law` converts them. The formulas are those of Pacejka (2012) and, for version 6.1,
Besselink, Schmeitz & Pacejka (2010).
"""

import numpy as np
from numba.extending import register_jitable

from floatframe.components.wheels.contact import COMMON
from floatframe.model.elements.smooth import absolute, square

__all__ = ["COEFFICIENTS_AT", "IS_61", "PRESSURE", "forces_and_moments", "peaks_and_stiffnesses"]

# indices of the parameters before the coefficients: version 6.1 (or 5.2); combined (or pure) slip; dp = (p - p_0)/p_0;
# p/p_0; load F_0; speed V_0; sign of the file relative to ISO; sign of the mounted side relative to the side of the
# file
IS_61, IS_COMBINED, DP, PRESSURE, LOAD, SPEED, SIGN, SIDE = range(COMMON, COMMON + 8)
KAPPA_LOW, KAPPA_HIGH, ALPHA_LOW, ALPHA_HIGH, GAMMA_LOW, GAMMA_HIGH, LOAD_LOW, LOAD_HIGH = range(
    COMMON + 8, COMMON + 16
)
C_VERTICAL, SIGMA_FROM_FILE, C_LONG, C_LAT = range(COMMON + 16, COMMON + 20)
COEFFICIENTS_AT = COMMON + 20

# in the order of `coefficients.COEFFICIENTS`
(
    PCX1, PDX1, PDX2, PDX3, PEX1, PEX2, PEX3, PEX4, PKX1, PKX2, PKX3, PHX1, PHX2, PVX1, PVX2, PPX1, PPX2, PPX3,
    PPX4, RBX1, RBX2, RBX3, RCX1, REX1, REX2, RHX1, PTX1, PTX2, PTX3, PCY1, PDY1, PDY2, PDY3, PEY1, PEY2, PEY3,
    PEY4, PEY5, PKY1, PKY2, PKY3, PKY4, PKY5, PKY6, PKY7, PHY1, PHY2, PHY3, PVY1, PVY2, PVY3, PVY4, PPY1, PPY2,
    PPY3, PPY4, PPY5, RBY1, RBY2, RBY3, RBY4, RCY1, REY1, REY2, RHY1, RHY2, RVY1, RVY2, RVY3, RVY4, RVY5, RVY6,
    PTY1, PTY2, QBZ1, QBZ2, QBZ3, QBZ4, QBZ5, QBZ9, QBZ10, QCZ1, QDZ1, QDZ2, QDZ3, QDZ4, QDZ6, QDZ7, QDZ8, QDZ9,
    QDZ10, QDZ11, QEZ1, QEZ2, QEZ3, QEZ4, QEZ5, QHZ1, QHZ2, QHZ3, QHZ4, PPZ1, PPZ2, SSZ1, SSZ2, SSZ3, SSZ4, QSX1,
    QSX2, QSX3, QSX4, QSX5, QSX6, QSX7, QSX8, QSX9, QSX10, QSX11, PPMX1, QSY1, QSY2, QSY3, QSY4, QSY5, QSY6, QSY7,
    QSY8, BREFF, DREFF, FREFF, QRE0, QV1, QV2, QFZ1, QFZ2, PFZ1, PCFX1, PCFX2, PCFX3, PCFY1, PCFY2, PCFY3, LFZO,
    LCX, LMUX, LEX, LKX, LHX, LVX, LGAX, LCY, LMUY, LEY, LKY, LHY, LVY, LGAY, LKYC, LTR, LRES, LGAZ, LKZC, LXAL,
    LYKA, LVYKA, LS, LSGKP, LSGAL, LMX, LVMX, LMY,
) = range(COEFFICIENTS_AT, COEFFICIENTS_AT + 171)  # fmt: skip

TINY = 1e-9  #: small load, relative to the nominal load, that keeps quotients of an unloaded tyre finite
LESS_FRICTION = 10.0  #: factor A_mu by which shifts decrease with friction, version 6.1


@register_jitable(error_model="numpy")
def sine_curve(slip, B, C, D, E):
    """Return D sin(C atan(B s - E (B s - atan B s)))."""
    b = B * slip
    return D * np.sin(C * np.arctan(b - E * (b - np.arctan(b))))


@register_jitable(error_model="numpy")
def cosine_curve(slip, B, C, E):
    """Return cos(C atan(B s - E (B s - atan B s)))."""
    b = B * slip
    return np.cos(C * np.arctan(b - E * (b - np.arctan(b))))


@register_jitable(error_model="numpy")
def at_most_one(E):
    """Return E, or 1 if E is above 1."""
    return E if E.real < 1.0 else 1.0 + 0.0 * E


@register_jitable(error_model="numpy")
def sign_of(a):
    """Return the sign of a number; 1 for zero."""
    return 1.0 if a.real >= 0.0 else -1.0


@register_jitable(error_model="numpy")
def peaks_and_stiffnesses(p, F_z, c, grip):
    """Return df, mu_x, K_x, mu_y, K_y at load F_z and inclination c (gamma in 5.2, sin gamma in 6.1).

    The friction factor of the road multiplies lambda_mu, here and in `forces_and_moments`.

    mu = (p_D1 + p_D2 df)(1 + p_3 dp + p_4 dp²)(1 - p_D3 c²) lambda_mu;
    K_x = F_z (p_K1 + p_K2 df) exp(p_K3 df)(1 + p_1 dp + p_2 dp²) lambda_K;
    K_y = p_K1 F_0 (1 + p_1 dp)(1 - p_K3 |c|) sin(p_K4 atan((F_z/F_0) / ((p_K2 + p_K5 c²)(1 + p_2 dp)))) lambda_K.
    """
    F_0 = p[LFZO] * p[LOAD]
    df = (F_z - F_0) / F_0
    dp = p[DP]
    c_x, c_y = p[LGAX] * c, p[LGAY] * c
    mu_x = (p[PDX1] + p[PDX2] * df) * (1.0 + p[PPX3] * dp + p[PPX4] * dp * dp) * (1.0 - p[PDX3] * c_x * c_x)
    mu_x = mu_x * p[LMUX] * grip
    mu_y = (p[PDY1] + p[PDY2] * df) * (1.0 + p[PPY3] * dp + p[PPY4] * dp * dp) * (1.0 - p[PDY3] * c_y * c_y)
    mu_y = mu_y * p[LMUY] * grip
    K_x = F_z * (p[PKX1] + p[PKX2] * df) * np.exp(p[PKX3] * df) * (1.0 + p[PPX1] * dp + p[PPX2] * dp * dp) * p[LKX]
    at_peak = (p[PKY2] + p[PKY5] * c_y * c_y) * (1.0 + p[PPY2] * dp)
    K_y = p[PKY1] * F_0 * (1.0 + p[PPY1] * dp) * (1.0 - p[PKY3] * absolute(c_y))
    K_y = K_y * np.sin(p[PKY4] * np.arctan(F_z / (F_0 * at_peak))) * p[LKY]
    return df, mu_x, K_x, mu_y, K_y


@register_jitable(error_model="numpy")
def lateral(p, F_z, s, c, df, mu_y, K_y, rolling, scale):
    """Return F_y0 of pure side slip, S_Hy, S_Vy and B_y C_y; `scale` is lambda_mu_y times the friction of the road."""
    F_0 = p[LFZO] * p[LOAD]
    c_y = p[LGAY] * c
    if p[IS_61] > 0.0:
        fading = LESS_FRICTION * scale / (1.0 + (LESS_FRICTION - 1.0) * scale)
        S_V_c = F_z * (p[PVY3] + p[PVY4] * df) * c * p[LKYC] * fading
        S_V = F_z * (p[PVY1] + p[PVY2] * df) * p[LVY] * fading + S_V_c
        K_c = F_z * (p[PKY6] + p[PKY7] * df) * (1.0 + p[PPY5] * p[DP]) * p[LKYC]
        S_H = (p[PHY1] + p[PHY2] * df) * p[LHY] + (K_c * c - S_V_c) / (K_y + sign_of(K_y) * TINY * F_0)
    else:
        S_V = F_z * (p[PVY1] + p[PVY2] * df + (p[PVY3] + p[PVY4] * df) * c_y) * p[LVY] * scale
        S_H = (p[PHY1] + p[PHY2] * df + p[PHY3] * c_y) * p[LHY]
    S_H, S_V = rolling * S_H, rolling * S_V
    a = s + S_H
    C = p[PCY1] * p[LCY]
    E = (p[PEY1] + p[PEY2] * df) * (1.0 + p[PEY5] * c_y * c_y - (p[PEY3] + p[PEY4] * c_y) * sign_of(a)) * p[LEY]
    D = mu_y * F_z
    B = K_y / (C * D + TINY * F_0)
    return sine_curve(a, B, C, D, at_most_one(E)) + S_V, S_H, S_V, B * C


@register_jitable(error_model="numpy")
def forces_and_moments(p, F_z, kappa, alpha, gamma, R_0, V_x, forward, rolling, grip):
    """Return F_x, F_y, M_x, M_y (of rolling, positive) and M_z in the signs of the file.

    Parameters
    ----------
    p
        Parameters of the tyre, see the top of the module.
    F_z
        Load within its range [N].
    kappa, alpha, gamma
        Slips and inclination within their ranges [-, rad, rad].
    R_0, V_x
        Unloaded radius [m] and speed [m/s].
    forward, rolling
        Direction of V_x, from -1 to 1; 1 for a rolling wheel, 0 at a standstill.
    grip
        Factor of the road on the friction.
    """
    is_61 = p[IS_61] > 0.0
    F_0 = p[LFZO] * p[LOAD]
    s, c = (np.sin(alpha) / np.cos(alpha), np.sin(gamma)) if is_61 else (alpha, gamma)
    cos_alpha = np.cos(alpha)
    df, mu_x, K_x, mu_y, K_y = peaks_and_stiffnesses(p, F_z, c, grip)
    scale_x, scale_y = p[LMUX] * grip, p[LMUY] * grip
    # longitudinal force of pure slip
    fading = LESS_FRICTION * scale_x / (1.0 + (LESS_FRICTION - 1.0) * scale_x) if is_61 else scale_x
    S_Hx = rolling * (p[PHX1] + p[PHX2] * df) * p[LHX]
    S_Vx = rolling * F_z * (p[PVX1] + p[PVX2] * df) * p[LVX] * fading
    k = kappa + S_Hx
    C_x = p[PCX1] * p[LCX]
    E_x = (p[PEX1] + p[PEX2] * df + p[PEX3] * df * df) * (1.0 - p[PEX4] * sign_of(k)) * p[LEX]
    D_x = mu_x * F_z
    F_x = sine_curve(k, K_x / (C_x * D_x + TINY * F_0), C_x, D_x, at_most_one(E_x)) + S_Vx
    # lateral force of pure slip
    F_y0, S_Hy, S_Vy, BC_y = lateral(p, F_z, s, c, df, mu_y, K_y, rolling, scale_y)
    F_y, F_y_trail, S_Vyk = F_y0, F_y0, 0.0 * F_y0
    if is_61:  # the trail multiplies the force of an upright wheel
        _, _, _, mu_upright, K_upright = peaks_and_stiffnesses(p, F_z, 0.0 * c, grip)
        F_y_trail, _, _, _ = lateral(p, F_z, s, 0.0 * c, df, mu_upright, K_upright, rolling, scale_y)
    if p[IS_COMBINED] > 0.0:
        B = (p[RBX1] + p[RBX3] * c * c) * np.cos(np.arctan(p[RBX2] * kappa)) * p[LXAL]
        E = at_most_one(p[REX1] + p[REX2] * df)
        F_x = F_x * cosine_curve(s + p[RHX1], B, p[RCX1], E) / cosine_curve(p[RHX1] + 0.0 * s, B, p[RCX1], E)
        B = (p[RBY1] + p[RBY4] * c * c) * np.cos(np.arctan(p[RBY2] * (s - p[RBY3]))) * p[LYKA]
        E = at_most_one(p[REY1] + p[REY2] * df)
        S_H = p[RHY1] + p[RHY2] * df
        G = cosine_curve(kappa + S_H, B, p[RCY1], E) / cosine_curve(S_H, B, p[RCY1], E)
        D_V = mu_y * F_z * (p[RVY1] + p[RVY2] * df + p[RVY3] * c) * np.cos(np.arctan(p[RVY4] * s))
        S_Vyk = rolling * D_V * np.sin(p[RVY5] * np.arctan(p[RVY6] * kappa)) * p[LVYKA]
        F_y, F_y_trail = G * F_y0 + S_Vyk, G * F_y_trail
    # aligning moment
    c_z = c if is_61 else p[LGAZ] * c
    size = absolute(c_z)
    S_Ht = rolling * (p[QHZ1] + p[QHZ2] * df + (p[QHZ3] + p[QHZ4] * df) * c_z)
    a_t = s + S_Ht
    a_r = s + S_Hy + S_Vy / (K_y + sign_of(K_y) * TINY * F_0)
    if p[IS_COMBINED] > 0.0:
        q = K_x / (K_y + sign_of(K_y) * TINY * F_0) * kappa
        if is_61:
            a_t = np.sqrt(a_t * a_t + q * q + 1e-30) * sign_of(a_t)
            a_r = np.sqrt(a_r * a_r + q * q + 1e-30) * sign_of(a_r)
        else:
            a_t = np.arctan(np.sqrt(square(np.tan(a_t)) + q * q + 1e-30)) * sign_of(a_t)
            a_r = np.arctan(np.sqrt(square(np.tan(a_r)) + q * q + 1e-30)) * sign_of(a_r)
    B_t = (p[QBZ1] + p[QBZ2] * df + p[QBZ3] * df * df) * (1.0 + p[QBZ4] * c_z + p[QBZ5] * size) * p[LKY] / scale_y
    D_t = F_z * R_0 / F_0 * (p[QDZ1] + p[QDZ2] * df) * (1.0 - p[PPZ1] * p[DP]) * p[LTR]
    D_t = D_t * (1.0 + p[QDZ3] * (size if is_61 else c_z) + p[QDZ4] * c_z * c_z)
    E_t = p[QEZ1] + p[QEZ2] * df + p[QEZ3] * df * df
    E_t = E_t * (1.0 + (p[QEZ4] + p[QEZ5] * c_z) * 2.0 / np.pi * np.arctan(B_t * p[QCZ1] * a_t))
    trail = D_t * cosine_curve(a_t, B_t, p[QCZ1], at_most_one(E_t)) * cos_alpha
    B_r = p[QBZ9] * p[LKY] / scale_y + p[QBZ10] * BC_y
    D_r = (p[QDZ6] + p[QDZ7] * df) * p[LRES]
    D_r = D_r + ((p[QDZ8] + p[QDZ9] * df) * (1.0 + p[PPZ2] * p[DP]) + (p[QDZ10] + p[QDZ11] * df) * size) * c_z * p[LKZC]
    residual = F_z * R_0 * D_r * scale_y * np.cos(np.arctan(B_r * a_r)) * cos_alpha
    lever = R_0 * (p[SSZ1] + p[SSZ2] * F_y / F_0 + (p[SSZ3] + p[SSZ4] * df) * c_z) * p[LS]
    M_z = forward * (-trail * F_y_trail + residual) + rolling * lever * F_x
    # overturning and rolling moments
    f = F_z / p[LOAD]
    y = F_y / p[LOAD]
    tilt = p[QSX1] * p[LVMX] - p[QSX2] * gamma * (1.0 + p[PPMX1] * p[DP]) + p[QSX3] * y
    tilt = tilt + p[QSX4] * np.cos(p[QSX5] * square(np.arctan(p[QSX6] * f))) * np.sin(
        p[QSX7] * gamma + p[QSX8] * np.arctan(p[QSX9] * y)
    )
    tilt = tilt + p[QSX10] * np.arctan(p[QSX11] * f) * gamma
    M_x = R_0 * F_z * tilt * p[LMX]
    v = V_x / p[SPEED]
    resistance = p[QSY1] + p[QSY2] * F_x / p[LOAD] + p[QSY3] * absolute(v) + p[QSY4] * square(square(v))
    resistance = resistance + (p[QSY5] + p[QSY6] * f) * gamma * gamma
    loaded = f
    if is_61:
        loaded = np.exp(p[QSY7] * np.log(f + 1e-12)) * p[PRESSURE] ** p[QSY8]
    return F_x, F_y, M_x, R_0 * p[LOAD] * loaded * resistance * p[LMY], M_z
