"""The fluid of a circuit: compressible, with cavitation at low pressure and, optionally, entrained air.

Pressures are absolute. A unit of volume at ambient pressure p_a has, at the pressure p, the volume

    v(p) = (1 - a) exp(-(p - p_a)/K) + a (p_a/p)^(1/n) + exp((p_v - p)/d),        v(p_a) = 1,

with the bulk modulus K of the liquid, the volume fraction a of entrained air at ambient pressure, its polytropic
exponent n, and vapour below the vapour pressure p_v. The cavities are as large as the liquid at p_v, grow by a factor e
for each width d = (p_a - p_v)/50 below it, and are 2e-22 of the volume at ambient pressure. The pressure therefore
stays near p_v however much a chamber expands, and every tangent is finite.

h(p), the integral of v from p_a to p, is the work that a unit of volume at ambient pressure adds when it flows in at
the pressure p; its internal energy is h - (p - p_a) v. A chamber of volume V has the content V/v and the energy V (h/v
- (p - p_a)). The rate of this energy is exactly h times the inflow minus (p - p_a) times the rate of V.
"""

from dataclasses import dataclass

import numpy as np
from numba.extending import register_jitable

from fe_models.foundation.arrays import Array
from floatframe.errors import ModelError
from floatframe.model.checked_values import number

__all__ = ["Fluid", "compression"]

CAVITY_WIDTHS = 50  #: number of widths d between vapour and ambient pressure
#: pressure relative to ambient below which the compression curve of the air continues along its tangent
LEAST_PRESSURE = 1e-3
MOST_EXPONENT = 30.0  #: exponent above which, at cavities of 1e13 volumes, the exponential continues along its tangent


@dataclass(frozen=True)
class Fluid:
    """A hydraulic fluid, with values in units of the system and absolute pressures.

    Example, mineral oil in SI units: density 870 kg/m³, bulk modulus 1.4e9 Pa, viscosity 0.03 Pa s, ambient 101325 Pa.
    """

    density: float  #: density at ambient pressure [kg/m³]
    bulk_modulus: float  #: bulk modulus K of the liquid without air [Pa]
    ambient: float  #: absolute ambient pressure p_a [Pa]
    viscosity: float | None = None  #: dynamic viscosity [Pa s]; None: no laminar friction in pipes
    air: float = 0.0  #: volume fraction of entrained air at ambient pressure
    air_exponent: float = 1.4  #: polytropic exponent n of the entrained air
    vapour_pressure: float = 0.0  #: absolute vapour pressure p_v [Pa]

    def __post_init__(self) -> None:
        for name in ("density", "bulk_modulus", "ambient", "air_exponent"):
            object.__setattr__(self, name, number(f"fluid: {name}", getattr(self, name), above=0.0))
        for name in ("air", "vapour_pressure"):
            object.__setattr__(self, name, number(f"fluid: {name}", getattr(self, name), at_least=0.0))
        if self.viscosity is not None:
            object.__setattr__(self, "viscosity", number("fluid: viscosity", self.viscosity, above=0.0))
        if self.air >= 1.0:
            raise ModelError(f"fluid: air: expected a fraction of the volume below 1, got {self.air:g}")
        if self.vapour_pressure >= self.ambient:
            raise ModelError(
                f"fluid: vapour_pressure: expected an absolute pressure below the ambient {self.ambient:g}, got "
                f"{self.vapour_pressure:g}"
            )

    @property
    def numbers(self) -> list[float]:
        """Parameters K, a, 1/n, p_a, p_v, d in the order in which `compression` reads them."""
        width = (self.ambient - self.vapour_pressure) / CAVITY_WIDTHS
        return [self.bulk_modulus, self.air, 1 / self.air_exponent, self.ambient, self.vapour_pressure, width]

    def compression(self, p: float) -> tuple[float, float, float]:
        """Return the relative volume v, dv/dp and h at an absolute pressure p."""
        v, dv, h = compression(p, np.array(self.numbers), 0)
        return float(v), float(dv), float(h)


@register_jitable
def compression(p, data: Array, at: int):
    """Return v, dv/dp and h at pressure p, for the fluid whose parameters begin at data[at]."""
    K, air, m = data[at], data[at + 1], data[at + 2]
    p_a, p_v, width = data[at + 3], data[at + 4], data[at + 5]
    liquid = (1.0 - air) * np.exp(-(p - p_a) / K)
    y = (p_v - p) / width
    if y.real > MOST_EXPONENT:
        edge = np.exp(MOST_EXPONENT)
        x = y - MOST_EXPONENT
        cavity, slope, below = edge * (1.0 + x), edge, edge * (1.0 + x + 0.5 * x * x)
    else:
        cavity = np.exp(y)
        slope, below = cavity, cavity
    v = liquid + cavity
    dv = -liquid / K - slope / width
    h = K * (1.0 - air - liquid) + width * (np.exp((p_v - p_a) / width) - below)
    if air > 0.0:
        low = LEAST_PRESSURE * p_a
        x = p - low if p.real < low else 0.0 * p
        q = low + 0.0 * p if p.real < low else p
        gas = air * (p_a / q) ** m
        dgas = -m * gas / q
        v += gas + dgas * x
        dv += dgas
        if m == 1.0:
            h += air * p_a * np.log(q / p_a)
        else:
            h += air * p_a / (1.0 - m) * ((q / p_a) ** (1.0 - m) - 1.0)
        h += gas * x + 0.5 * dgas * x * x
    return v, dv, h
