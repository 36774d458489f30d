"""Distributions of the cycle amplitudes of a stationary Gaussian stress, from its spectral moments.

The moments l_m = int f^m G df give the rates of up-crossings of the mean nu_0 = sqrt(l_2 / l_0) and of peaks
nu_p = sqrt(l_4 / l_2), a_1 = l_1 / sqrt(l_0 l_2) and a_2 = l_2 / sqrt(l_0 l_4). Every method except Wirsching and
Light's is a sum of densities b x^(b-1) / theta^b exp(-(x / theta)^b) of the amplitude x (b = 1: exponential, 2:
Rayleigh, otherwise Weibull), each with a rate of cycles. The damage on a straight line of the S-N curve is then an
incomplete gamma function:

    int_lo^hi x^k p dx = theta^k [gamma(1 + k/b, (hi/theta)^b) - gamma(1 + k/b, (lo/theta)^b)].
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import gamma, gammaincc

from fe_models.foundation.arrays import Array
from floatframe.durability.fatigue.sn_curve import SNCurve
from floatframe.errors import FatigueError

__all__ = ["SPECTRAL_METHODS", "Density", "damage_rates", "widths"]

NARROW = 1 - 1e-6  #: a_2 above which a spectrum counts as a single line, because wide-band formulas divide by 1 - a_2
LEAST_ZHAO_BAKER = 0.13  #: a_2 below which the weight of the Weibull part exceeds 1


@dataclass(frozen=True, eq=False)
class Density:
    """Cycles with a Weibull distribution of amplitudes."""

    rate: Array  #: cycles per second, (n,) [Hz]
    theta: Array  #: scale parameter theta of the distribution, (n,) [Pa]
    shape: Array  #: shape parameter b of the distribution, (n,)


def widths(moments: Array) -> tuple[Array, Array, Array, Array]:
    """Return nu_0, nu_p [Hz], a_1, a_2 from spectral moments of orders 0, 1, 2, 4, (4, n); 0 without stress."""
    l_0, l_1, l_2, l_4 = (np.maximum(each, 0.0) for each in moments)
    with np.errstate(divide="ignore", invalid="ignore"):
        found = np.sqrt(l_2 / l_0), np.sqrt(l_4 / l_2), l_1 / np.sqrt(l_0 * l_2), l_2 / np.sqrt(l_0 * l_4)
    nu_0, nu_p, a_1, a_2 = (np.where(np.isfinite(each), each, 0.0) for each in found)
    return nu_0, nu_p, np.minimum(a_1, 1.0), np.minimum(a_2, 1.0)


def narrow_band(moments: Array) -> list[Density]:
    """Return the Rayleigh distribution of peaks with one cycle per up-crossing; conservative for wide spectra."""
    nu_0, _, _, _ = widths(moments)
    return [rayleigh(nu_0, root(moments))]


def dirlik(moments: Array) -> list[Density]:
    """Return Dirlik's (1985) exponential and two Rayleigh densities, fitted to rainflow counts of simulations."""
    _, nu_p, a_1, a_2 = widths(moments)
    sigma = root(moments)
    is_narrow = a_2 > NARROW
    g = np.where(is_narrow, 0.5, a_2)
    x = np.where(is_narrow, 0.5, a_1 * a_2)  # mean frequency l_1 / l_0 sqrt(l_2 / l_4)
    D_1 = 2 * (x - g**2) / (1 + g**2)
    R = (g - x - D_1**2) / (1 - g - D_1 + D_1**2)
    D_2 = (1 - g - D_1 + D_1**2) / (1 - R)
    D_3 = 1 - D_1 - D_2
    with np.errstate(divide="ignore", invalid="ignore"):
        Q = np.where(D_1 != 0, 1.25 * (g - D_3 - D_2 * R) / D_1, 0.0)
    D_1, D_2, D_3 = (np.where(is_narrow, share, each) for share, each in ((0.0, D_1), (0.0, D_2), (1.0, D_3)))
    exponential = Density(nu_p * D_1, np.abs(Q) * sigma, np.ones(len(sigma)))
    return [exponential, rayleigh(nu_p * D_2, np.abs(R) * sigma), rayleigh(nu_p * D_3, sigma)]


def tovo_benasciutti(moments: Array) -> list[Density]:
    """Return the mean, weighted by b, of level-crossing and range counting, which bound rainflow damage (2005)."""
    nu_0, nu_p, a_1, a_2 = widths(moments)
    sigma = root(moments)
    is_narrow = a_2 > NARROW
    g, h = np.where(is_narrow, 0.5, a_2), np.where(is_narrow, 0.5, a_1)
    b = (h - g) * (1.112 * (1 + h * g - (h + g)) * np.exp(2.11 * g) + (h - g)) / (g - 1) ** 2
    b = np.where(is_narrow, 1.0, b)
    return [rayleigh(b * nu_0, sigma), rayleigh((1 - b) * nu_p, a_2 * sigma)]


def zhao_baker(moments: Array) -> list[Density]:
    """Return Zhao & Baker's (1992) Weibull density for small cycles and Rayleigh density for large ones."""
    _, nu_p, _, a_2 = widths(moments)
    sigma = root(moments)
    if ((a_2 < LEAST_ZHAO_BAKER) & (sigma > 0)).any():
        low = float(a_2[sigma > 0].min())
        raise FatigueError(
            f"spectral method zhao-baker: holds for l_2 / sqrt(l_0 l_4) of {LEAST_ZHAO_BAKER:g} or more, got {low:.3g}"
            '; take "dirlik" or "tovo-benasciutti"'
        )
    a_2 = np.where(sigma > 0, a_2, 1.0)
    a, b = 8 - 7 * a_2, np.where(a_2 < 0.9, 1.1, 1.1 + 9 * (a_2 - 0.9))
    w = (1 - a_2) / (1 - np.sqrt(2 / np.pi) * gamma(1 + 1 / b) * a ** (-1 / b))
    w = np.where(a_2 > NARROW, 0.0, w)
    return [Density(w * nu_p, a ** (-1 / b) * sigma, b), rayleigh((1 - w) * nu_p, sigma)]


def rayleigh(rate: Array, sigma: Array) -> Density:
    """Return the Rayleigh density for a standard deviation."""
    return Density(rate, np.sqrt(2) * sigma, np.full(len(sigma), 2.0))


def root(moments: Array) -> Array:
    """Return the standard deviation of the stress, (n,) [Pa]."""
    return np.asarray(np.sqrt(np.maximum(moments[0], 0.0)))


#: function from the moments, (4, n), to the densities of cycles, by name
SPECTRAL_METHODS: dict[str, Callable[[Array], list[Density]]] = {
    "dirlik": dirlik,
    "tovo-benasciutti": tovo_benasciutti,
    "zhao-baker": zhao_baker,
    "narrow-band": narrow_band,
    "wirsching-light": narrow_band,  # multiplied by a factor that depends on bandwidth and slope
}


def wirsching_light_factor(moments: Array, curve: SNCurve) -> Array:
    """Return the factor on narrow-band damage of Wirsching & Light (1980), for curves with one slope, (n,).

    a + (1 - a) (1 - e)^b, e = sqrt(1 - a_2²), a = 0.926 - 0.033 k, b = 1.587 k - 2.323.
    """
    k = float(curve.slope[0])
    if (curve.slope != k).any() or curve.fatigue_limit > 0:
        raise FatigueError(
            "spectral method wirsching-light: needs an S-N curve of one slope without fatigue limit; take "
            '"tovo-benasciutti" or "dirlik", or below = "elementary"'
        )
    _, _, _, a_2 = widths(moments)
    a, b = 0.926 - 0.033 * k, 1.587 * k - 2.323
    return np.asarray(a + (1 - a) * (1 - np.sqrt(1 - a_2**2)) ** b)


def damage_rates(
    moments: Array, curve: SNCurve, method: str, factor: Array | float = 1.0
) -> tuple[Array, Array, Array]:
    """Return the damage per second, its part beyond the largest amplitude of the curve, and cycles per second, (n,).

    Parameters
    ----------
    moments
        Spectral moments of orders 0, 1, 2, 4 in Hz, (4, n) [Pa² Hz^m].
    factor
        Factor on all amplitudes, such as that of a mean stress, (n,) or one number.

    Raises
    ------
    FatigueError
        If the method is unknown or does not hold for the curve or the spectra.
    """
    if method not in SPECTRAL_METHODS:
        from fe_models.foundation.words import nearest, quoted

        raise FatigueError(f"fatigue: unknown spectral method {quoted(method)}{nearest(method, SPECTRAL_METHODS)}")
    damage, beyond, cycles = (np.zeros(moments.shape[1]) for _ in range(3))
    for density in SPECTRAL_METHODS[method](moments):
        theta = density.theta * factor
        cycles += density.rate
        upper = np.inf
        for S, N, k, low in zip(curve.amplitude, curve.cycles, curve.slope, curve.bottom, strict=True):
            scale = density.rate * gamma(1 + k / density.shape) * (theta / S) ** k / N
            above = tails(theta, density.shape, k, low)
            damage += scale * (above - tails(theta, density.shape, k, upper))
            if upper > curve.greatest:
                beyond += scale * (tails(theta, density.shape, k, max(low, curve.greatest)) - tails(
                    theta, density.shape, k, upper))  # fmt: skip
            upper = low
    if method == "wirsching-light":
        correction = wirsching_light_factor(moments, curve)
        damage, beyond = damage * correction, beyond * correction
    return damage, beyond, cycles


def tails(theta: Array, shape: Array, k: float, amplitude: float) -> Array:
    """Return the part of int x^k p dx above an amplitude, (n,)."""
    if amplitude == 0:
        return np.ones(len(theta))
    if not np.isfinite(amplitude):
        return np.zeros(len(theta))
    with np.errstate(divide="ignore", over="ignore"):
        x = np.where(theta > 0, (amplitude / np.where(theta > 0, theta, 1.0)) ** shape, np.inf)
    return np.asarray(gammaincc(1 + k / shape, x))
