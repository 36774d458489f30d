"""The gas of an accumulator: polytropic, behind a bladder that closes the port, with a limit of the oil volume.

Of the gas volume V_0 at the charge pressure p_0, the oil occupies U(p) = V_0 (1 - (p_0/p)^(1/n)) for p > p_0 and zero
below it, up to a limit U_m, which is reached at p_m = p_0 (1 - U_m/V_0)^-n. The two corners are rounded by cubics over
the pressures (1 - w) p to (1 + w) p, so that U and its slope are continuous and the integral of U is known exactly.
"""

from collections.abc import Sequence

import numpy as np
from numba.extending import register_jitable

from fe_models.foundation.arrays import Array

__all__ = ["gas_numbers", "oil_in_accumulator"]

ROUNDING = 0.01  #: half width w of the rounding, relative to the pressure at the corner


def gas_numbers(volume: float, charge: float, exponent: float, limit: float) -> Sequence[float]:
    """Return the data of `oil_in_accumulator`: V_0, p_0, 1/n, U_m, corners, their values, slopes and integrals."""
    m = 1 / exponent
    top = charge * (1 - limit / volume) ** -exponent

    def oil(p: float) -> tuple[float, float]:
        part = (charge / p) ** m
        return volume * (1 - part), volume * m * part / p

    ends = [charge * (1 - ROUNDING), charge * (1 + ROUNDING), top * (1 - ROUNDING), top * (1 + ROUNDING)]
    first, first_slope = oil(ends[1])
    last, last_slope = oil(ends[2])
    return [volume, charge, m, limit, *ends, first, first_slope, last, last_slope, float(ends[1] > ends[2])]


@register_jitable
def cubic(x, width, a, a_slope, b, b_slope):
    """Return value, slope and integral from x = 0 of the cubic between (a, a_slope) and (b, b_slope), x in 0 .. 1."""
    c = 3.0 * (b - a) - width * (2.0 * a_slope + b_slope)
    d = 2.0 * (a - b) + width * (a_slope + b_slope)
    value = a + x * (width * a_slope + x * (c + x * d))
    slope = (width * a_slope + x * (2.0 * c + 3.0 * d * x)) / width
    integral = width * x * (a + x * (width * a_slope / 2.0 + x * (c / 3.0 + x * d / 4.0)))
    return value, slope, integral


@register_jitable
def power_integral(p, volume, charge, m):
    """Return the integral of V_0 (1 - (p_0/p)^m) over pressure."""
    if m == 1.0:
        return volume * (p - charge * np.log(p / charge))
    return volume * (p - charge / (1.0 - m) * (p / charge) ** (1.0 - m))


@register_jitable
def oil_in_accumulator(p, data: Array, at: int):
    """Return the oil volume U, dU/dp and the integral of U up to p, for the gas whose parameters begin at data[at]."""
    volume, charge, m, limit = data[at], data[at + 1], data[at + 2], data[at + 3]
    p1, p2, p3, p4 = data[at + 4], data[at + 5], data[at + 6], data[at + 7]
    zero = 0.0 * p
    if p.real <= p1:
        return zero, zero, zero
    U2, C2, U3, C3 = data[at + 8], data[at + 9], data[at + 10], data[at + 11]
    if p.real < p2:
        return cubic((p - p1) / (p2 - p1), p2 - p1, 0.0, 0.0, U2, C2)
    area = cubic(1.0, p2 - p1, 0.0, 0.0, U2, C2)[2] - power_integral(p2, volume, charge, m)
    if p.real <= p3:
        part = (charge / p) ** m
        return volume * (1.0 - part), volume * m * part / p, area + power_integral(p, volume, charge, m)
    area += power_integral(p3, volume, charge, m)
    if p.real < p4:
        U, C, more = cubic((p - p3) / (p4 - p3), p4 - p3, U3, C3, limit, 0.0)
        return U, C, area + more
    area += cubic(1.0, p4 - p3, U3, C3, limit, 0.0)[2]
    return limit + zero, zero, area + limit * (p - p4)
