"""The law of an oleo-pneumatic strut, see `floatframe.components.hydraulics.oleo_strut`."""

import numpy as np
from numba import njit
from numba.extending import register_jitable

from floatframe.components.hydraulics.fluid import compression
from floatframe.components.hydraulics.stops import stop_force
from floatframe.model.elements.curves import function_at
from floatframe.model.elements.pairs import add_axial_force, axial_motion, direction_of

__all__ = ["AREAS", "oleo_law"]

AREAS = 26  # index of the first metered area
TRANSITION = 1e-3  # relative to the ambient pressure; below it, the flow of compressible oil is laminar


@register_jitable
def gas_spring(V, V_0, charge, n, p_a, least):
    """Return the gas pressure at volume V, and its energy relative to V_0 and ambient pressure."""
    low = least * V_0
    inside = low + 0.0 * V if V.real < low else V
    p = charge * (V_0 / inside) ** n
    if n == 1.0:
        energy = charge * V_0 * np.log(V_0 / inside)
    else:
        energy = charge * V_0 / (n - 1.0) * ((V_0 / inside) ** (n - 1.0) - 1.0)
    energy = energy - p_a * (V_0 - inside)
    if V.real < low:
        x = V - low
        slope = -n * p / low
        energy = energy - x * (p - p_a) - 0.5 * slope * x * x
        p = p + slope * x
    return p, energy


@njit
def oleo_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Write the force of a strut, the rate of its oil pressure, and its outputs."""
    p_a, p_v, width, rho = data[3], data[4], data[5], data[6]
    V_0, charge, A_g, A_o, n, discharge = data[7], data[8], data[9], data[10], data[11], data[12]
    volume, at_recoil = data[20], int(data[21])
    e = direction_of(x, 0, data, 22)
    distance, extension = axial_motion(x, 0, 1, e)
    s, rate = data[14] - distance, -extension
    V = V_0 - A_g * s
    if volume > 0.0:
        v, dv, h = compression(z[0], data, 0)
        v_0, _, h_0 = compression(charge, data, 0)
        V = V + volume * (v_0 - v)
    p_g, energy = gas_spring(V, V_0, charge, n, p_a, data[25])
    if volume > 0.0:
        p_o = z[0]
        drop = p_o - p_g
        at = AREAS if drop.real > 0.0 else at_recoil
        d = TRANSITION * p_a
        q = discharge * function_at(data, at, s) * np.sqrt(2.0 / rho) * drop / np.sqrt(np.sqrt(drop * drop + d * d))
        z_dot[0] = (A_o * rate - q) / (-volume * dv)
        energy = energy + volume * (h - (p_o - p_a) * v - h_0 + (charge - p_a) * v_0)
    else:
        q = A_o * rate
        at = AREAS if rate.real > 0.0 else at_recoil
        speed = q / (discharge * function_at(data, at, s))
        drop = 0.5 * rho * speed * (speed if rate.real > 0.0 else -speed)
        y = p_g + drop - p_v
        p_o = p_v + 0.5 * (y + np.sqrt(y * y + width * width))
    v_s = data[19]
    friction = (data[17] + data[18] * (p_g - p_a)) * rate / np.sqrt(rate * rate + v_s * v_s)
    top, top_energy, top_lost = stop_force(-s, -rate, data[15], data[16])
    bottom, bottom_energy, bottom_lost = stop_force(s - data[13], rate, data[15], data[16])
    gas, oil, stops = (p_g - p_a) * A_g, (p_o - p_g) * A_o, bottom - top
    force = gas + oil + friction + stops
    add_axial_force(wrench, x, 0, 1, force, e)
    outputs[0], outputs[1], outputs[2], outputs[3], outputs[4], outputs[5] = s, rate, force, p_g, p_o, q
    outputs[6], outputs[7], outputs[8], outputs[9] = gas, oil, friction, stops
    outputs[10] = (p_o - p_g) * q + friction * rate + top_lost + bottom_lost
    outputs[11] = -force * rate
    outputs[12], outputs[13] = energy + top_energy + bottom_energy, data[13] - s
