"""The law of the linear tyre: forces proportional to slip, limited by friction."""

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

__all__ = ["linear_law", "linear_law_at_rest"]

C_X, C_Y, C_GAMMA, TRAIL, FRICTION, FLATTENING, RESISTANCE = range(COMMON, COMMON + 7)


@njit(error_model="numpy")
def linear_law(t, x, z, lam, data, wrench, z_dot, g, seen):
    """Write wrenches, rates and outputs of a linear tyre.

    (1) contact; normal force F_z from k d; V_sx = V_x - R_e Omega, R_e = R_0 - q d
    (2) slips kappa, tan alpha of the tread
    (3) F_x = C_x kappa and F_y = -C_y tan alpha - C_gamma sin gamma, both scaled so that |F| <= mu F_z; mu is
        multiplied by the friction factor of the road
    (4) M_z = t C_y tan alpha, scaled alike; M_y = -f_r R_0 F_z sgn Omega - (R_e - rho) F_x: the lever arm of F_x is
        R_e, so that F_x dissipates exactly F_x V_sx
    """
    x_W, y_W, n, _, point, d, rho, sine, cosine, V_x, V_y, Omega, rate, left = contact(x, data)  # (1)
    is_down = d.real > 0.0
    landed = touching(data, d)
    zero = 0.0 * d
    F_z = normal_force(data, d, landed, rate, cosine, data[STIFFNESS] * d)
    R_e = data[RADIUS] - data[FLATTENING] * d if is_down else data[RADIUS] + zero
    V_sx = V_x - R_e * Omega
    limit = data[FRICTION] * grip_at(x, data, point) * F_z
    sigma = data[SIGMA_X] + zero, data[SIGMA_Y] + zero  # (2)
    scale = limit / data[C_X], limit / data[C_Y]
    kappa, tangent = tread_slip(data, sigma, scale, z, z_dot, V_x, V_sx, V_y, landed)
    F_x, F_y, arm = zero, zero, zero  # (3)
    if is_down:
        F_x, F_y = data[C_X] * kappa, -data[C_Y] * tangent - data[C_GAMMA] * sine
        arm = data[TRAIL] * data[C_Y] * tangent
    square = F_x * F_x + F_y * F_y
    if square.real > (limit * limit).real:
        share = limit / np.sqrt(square)
        F_x, F_y, arm = share * F_x, share * F_y, share * arm
    turning = direction(data[RADIUS] * Omega, data[LOW_SPEED])  # (4)
    F = F_x, F_y, F_z
    M = zero, -data[RESISTANCE] * data[RADIUS] * F_z * turning - (R_e - rho) * F_x, arm
    power = put_wrenches(x, wrench, (x_W, y_W, n, point), F, M)
    energy, rising = zero, zero
    if is_down:
        energy, rising = 0.5 * data[STIFFNESS] * d * d, data[STIFFNESS] * d * rate
    k = 0
    if data[SIGMA_X] > 0.0:
        energy += 0.5 * data[C_X] / data[SIGMA_X] * z[0] * z[0]
        rising += data[C_X] / data[SIGMA_X] * z[0] * z_dot[0]
        k = 1
    if data[SIGMA_Y] > 0.0:
        energy += 0.5 * data[C_Y] / data[SIGMA_Y] * z[k] * z[k]
        rising += data[C_Y] / data[SIGMA_Y] * z[k] * z_dot[k]
    show(seen, F, M, (kappa, tangent, sine), (d, rho), (V_x, V_sx, V_y), point)
    show_energy(seen, energy, -power - rising, left, zero)


@njit(error_model="numpy")
def linear_law_at_rest(t, x, z, lam, data, wrench, z_dot, g, seen):
    """Write the same for a standing wheel, whose tread is deformed by the displacement of the wheel."""
    linear_law(t, x, z, lam, data, wrench, z_dot, g, seen)
    hold_tread(x, data, seen[10], z, z_dot)
