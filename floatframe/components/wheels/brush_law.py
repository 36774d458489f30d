"""The brush tyre model: bristles stick until the parabolic pressure times the friction coefficient is exceeded."""

import numpy as np
from numba import njit

from floatframe.components.wheels.contact import (
    COMMON,
    LOW_SPEED,
    RADIUS,
    SIGMA_X,
    SIGMA_Y,
    STIFFNESS,
    contact,
    grip_at,
    normal_force,
    put_wrenches,
    touching,
)
from floatframe.components.wheels.outputs import show, show_energy
from floatframe.components.wheels.slip import direction, hold_tread, tread_slip

__all__ = ["brush_law", "brush_law_at_rest"]

SLIP_STIFFNESS, HALF_LENGTH, LOAD, FRICTION, FLATTENING, RESISTANCE = range(COMMON, COMMON + 6)


@njit(error_model="numpy")
def brush_law(t, x, z, lam, data, wrench, z_dot, g, seen):
    """Write wrenches, rates and outputs of a brush tyre.

    The contact length is 2a, a = a_0 sqrt(F_z/F_0), with the pressure q(s) = 3 F_z/(4a) (1 - s²/a²). Bristles of
    stiffness c_p, equal along and across, enter undeformed. They are bent by slip at the rate of the theoretical slip

        sigma_x = -V_sx/|V_r|, sigma_y = V_sy/|V_r|,   V_r = R_e Omega,

    as the tread does with V_r as transport speed. With C = 2 c_p a² = C_0 F_z/F_0, the whole contact slides beyond
    sigma_s = 3 mu F_z/C. With r = |sigma|/sigma_s:

    (1) |F| = mu F_z (3 r - 3 r² + r³) for r < 1, mu F_z beyond, along (sigma_x, -sigma_y)
    (2) pneumatic trail t = (a/3) (1 - r)³/(1 - r + r²/3), zero beyond; M_z = -t F_y
    (3) M_y as for the linear tyre
    """
    x_W, y_W, n, _, point, d, rho, sine, cosine, V_x, V_y, Omega, rate, left = contact(x, data)
    is_down = d.real > 0.0
    landed = touching(data, d)
    zero = 0.0 * d
    F_z = normal_force(data, d, landed, rate, cosine, data[STIFFNESS] * d)
    R_e = data[RADIUS] - data[FLATTENING] * d if is_down else data[RADIUS] + zero
    V_r = R_e * Omega
    V_sx = V_x - V_r
    mu = data[FRICTION] * grip_at(x, data, point)
    limit = mu * F_z
    sliding = 3.0 * mu * data[LOAD] / data[SLIP_STIFFNESS]  # sigma_s, the same at all loads
    length = data[SIGMA_X] + zero, data[SIGMA_Y] + zero
    sigma_x, sigma_y = tread_slip(data, length, (sliding + zero, sliding + zero), z, z_dot, V_r, V_sx, V_y, landed)
    F_x, F_y, M_z = zero, zero, zero
    if is_down:
        a = data[HALF_LENGTH] * np.sqrt(F_z / data[LOAD] + 1e-12)
        r = np.sqrt(sigma_x * sigma_x + sigma_y * sigma_y + 1e-24) / sliding
        if r.real < 1.0:  # (1)
            over = limit * (3.0 - 3.0 * r + r * r) / sliding
            trail = a / 3.0 * (1.0 - r) * (1.0 - r) * (1.0 - r) / (1.0 - r + r * r / 3.0)  # (2)
        else:
            over = limit / (r * sliding)
            trail = zero
        F_x, F_y = over * sigma_x, -over * sigma_y
        M_z = -trail * F_y
    turning = direction(V_r, data[LOW_SPEED])  # (3)
    F = F_x, F_y, F_z
    M = zero, -data[RESISTANCE] * data[RADIUS] * F_z * turning - (R_e - rho) * F_x, M_z * turning
    power = put_wrenches(x, wrench, (x_W, y_W, n, point), F, M)
    energy, rising = zero, zero
    if is_down:
        energy, rising = 0.5 * data[STIFFNESS] * d * d, data[STIFFNESS] * d * rate
    show(seen, F, M, (sigma_x, sigma_y, sine), (d, rho), (V_x, V_sx, V_y), point)
    show_energy(seen, energy, -power - rising, left, zero)


@njit(error_model="numpy")
def brush_law_at_rest(t, x, z, lam, data, wrench, z_dot, g, seen):
    """Write the same for a standing wheel, whose tread is deformed by the displacement of the wheel."""
    brush_law(t, x, z, lam, data, wrench, z_dot, g, seen)
    hold_tread(x, data, seen[10], z, z_dot)
