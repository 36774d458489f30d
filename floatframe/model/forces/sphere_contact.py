"""Contact of a sphere with a plane or another sphere: Hertz force, restitution, friction.

Evaluated in `floatframe.engine.kernels.connections.contact`.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from fe_models.foundation.arrays import GivenArray, given
from fe_models.foundation.records import checked_fields, frozen_copies
from fe_models.foundation.units import SPEED, Quantity
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker
from floatframe.model.checked_values import number, unit_vector

__all__ = ["DISSIPATIONS", "SphereContact", "exact_dissipation", "hertz_stiffness"]

SLOW = Quantity(1e-3, SPEED)


def exact_dissipation(e: float) -> float:
    """Return the dissipation factor h for which bodies separate with e times their approach speed.

    With f = k xⁿ (1 + h x_dot/v_0), the energy integral over the contact, v dv/(1 + h v/v_0) = -(k/m) xⁿ dx, from v_0
    to -e v_0 gives h (1 + e) = log((1 + h)/(1 - h e)), for any k, n, m.
    """
    from scipy.optimize import brentq  # slow to import, and seldom needed

    if e >= 1.0:
        return 0.0

    def defect(h: float) -> float:
        return float(np.log1p(h) - np.log1p(-h * e) - h * (1 + e))

    low = 1e-3 * (1 - e)
    high = (1 - 1e-12) / e
    while high < 1 / e * (1 - 1e-15) and defect(high) < 0:
        high = 0.5 * (high + 1 / e)
    return float(brentq(defect, low, high, xtol=1e-14, rtol=1e-14)) if defect(low) < 0 else low


#: functions from the coefficient of restitution e to the dissipation factor h, by name
DISSIPATIONS = {
    "exact": exact_dissipation,
    "hunt-crossley": lambda e: 1.5 * (1 - e),
    "lankarani-nikravesh": lambda e: 0.75 * (1 - e**2),
    "flores": lambda e: 1.6 * (1 - e) / e,
}


def hertz_stiffness(modulus: float, radius: float, other_radius: float | None = None) -> float:
    """Return k of the Hertz force f = k x^(3/2), 4/3 E* sqrt(R*), for a sphere on a plane or another sphere.

    Parameters
    ----------
    modulus
        E*, 1/E* = (1 - nu_1²)/E_1 + (1 - nu_2²)/E_2 [Pa].
    radius
        Radius of the sphere [m].
    other_radius
        Radius of the other sphere [m]; None: a plane.
    """
    E = number("hertz_stiffness: modulus", modulus, above=0.0)
    R = number("hertz_stiffness: radius", radius, above=0.0)
    if other_radius is not None:
        R = 1 / (1 / R + 1 / number("hertz_stiffness: other_radius", other_radius, above=0.0))
    return 4 / 3 * E * R**0.5


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class SphereContact:
    """Contact of a sphere around marker B with a plane through marker A, or with a sphere around marker A.

    f = k xⁿ (1 + h x_dot/v_0) for a depth x > 0, and never negative; v_0 is the approach speed at the start of each
    contact. Friction is mu f V/sqrt(|V|² + v_s²) against the slip velocity V. Without radius_a the contact is with a
    plane.

    Parameters
    ----------
    name
        Name of the force, unique in the system.
    marker_a
        Marker A.
    marker_b
        Marker B.
    radius_b
        Radius of the sphere on B [m].
    radius_a
        Radius of the sphere on A [m]; None: a plane.
    axis
        Normal of the plane, axes of A, towards B.
    modulus
        Hertz modulus E* [Pa]; determines stiffness and exponent 3/2.
    stiffness
        k, instead of the modulus [N/mⁿ].
    exponent
        Exponent n of the depth.
    restitution
        Coefficient of restitution e, above 0.
    dissipation
        Law of h(e): exact, hunt-crossley, lankarani-nikravesh or flores.
    friction
        Coefficient of friction mu.
    friction_speed
        v_s, the slip at which friction is 0.71 of its value [m/s].
    slow
        Smallest speed of impact v_0 [m/s].
    """

    name: str
    marker_a: Marker
    marker_b: Marker
    radius_b: float
    radius_a: float | None = None
    axis: GivenArray = given((0.0, 0.0, 1.0))
    modulus: float | None = None
    stiffness: float | None = None
    exponent: float = 1.5
    restitution: float = 1.0
    dissipation: Literal["exact", "hunt-crossley", "lankarani-nikravesh", "flores"] = "exact"
    friction: float = 0.0
    friction_speed: float = SLOW
    slow: float = SLOW

    def __post_init__(self) -> None:
        where = f"force {self.name!r}"
        for name in ("radius_b", "radius_a", "modulus", "stiffness"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, number(f"{where}: {name}", getattr(self, name), above=0.0))
        for name in ("friction_speed", "slow"):
            object.__setattr__(self, name, number(f"{where}: {name}", getattr(self, name), above=0.0))
        object.__setattr__(self, "exponent", number(f"{where}: exponent", self.exponent, at_least=1.0))
        object.__setattr__(self, "friction", number(f"{where}: friction", self.friction, at_least=0.0))
        object.__setattr__(self, "axis", unit_vector(f"{where}: axis", self.axis))
        e = number(f"{where}: restitution", self.restitution, above=0.0)
        if e > 1:
            raise ModelError(f"{where}: restitution: expected 0 < e <= 1, got {e:g}")
        object.__setattr__(self, "restitution", e)
        if (self.modulus is None) == (self.stiffness is None):
            given = "neither" if self.modulus is None else "both"
            raise ModelError(f"{where}: expected either modulus (E* of Hertz) or stiffness, got {given}")
        if self.modulus is not None and self.exponent != 1.5:
            raise ModelError(f"{where}: exponent: expected 3/2 with modulus (Hertz), got {self.exponent:g}")

    @property
    def coefficients(self) -> dict[str, float]:
        """Numbers for the kernels, by field names of `kernels.model.Contacts`."""
        k = self.stiffness
        if k is None:
            assert self.modulus is not None  # checked above
            k = hertz_stiffness(self.modulus, self.radius_b, self.radius_a)
        h = DISSIPATIONS[self.dissipation](self.restitution)
        return {
            "is_sphere": self.radius_a is not None,
            "radius_a": self.radius_a or 0.0,
            "radius_b": self.radius_b,
            "stiffness": k,
            "exponent": self.exponent,
            "dissipation": h,
            "friction": self.friction,
            "slip_speed": self.friction_speed,
            "slow": self.slow,
        }
