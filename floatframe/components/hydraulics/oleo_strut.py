"""An oleo-pneumatic shock absorber between two markers, with gas spring, metered orifice, seals and stops.

The forces are those of Milwitzky & Cook (1953), optionally with compressible oil.
"""

from dataclasses import dataclass, field
from math import pi, sqrt
from typing import Any

import numpy as np

from fe_models.foundation.arrays import GivenArray, given
from fe_models.foundation.records import checked_fields, frozen_copies
from fe_models.foundation.units import SPEED, Quantity
from floatframe.components.hydraulics.fluid import Fluid
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker
from floatframe.model.checked_values import number, unit_vector
from floatframe.model.elements import Element, ElementLaw, GapSpring, Placed
from floatframe.model.elements.curves import function_numbers
from floatframe.model.elements.unit_names import in_units, outputs_in
from floatframe.model.functions.time_functions import NOT_OF_TIME, TimeFunction, constant
from floatframe.model.shapes.drawn import Stretched

__all__ = ["OleoStrut"]

FRICTION_SPEED = Quantity(0.01, SPEED)

Z_AXIS: Any = (0.0, 0.0, 1.0)
#: volume, relative to the extended gas volume, below which the pressure curve continues along its tangent
LEAST_GAS = 0.02
OUTPUTS = (
    ("stroke", "m"), ("rate", "m/s"), ("force", "N"), ("gas pressure", "Pa"), ("oil pressure", "Pa"), ("flow", "m^3/s"),
    ("gas force", "N"), ("oil force", "N"), ("friction", "N"), ("stop force", "N"), ("power lost", "W"),
    ("power out", "W"), ("energy", "J"), ("stroke left", "m"),
)  # fmt: skip


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class OleoStrut(Element):
    """A shock absorber with stroke s = `extended_length` minus the distance of marker b from marker a along the axis.

    Pressures are absolute; p_a is the ambient pressure. With the gas volume V = V_0 - A_g s, the strut pushes its ends
    apart with the force

        (p_g - p_a) A_g + (p_o - p_g) A_o + seals + stops,      p_g = charge (V_0/V)^n,

    Oil flows through the orifice due to the pressure difference p_o - p_g = ρ/2 (q/(discharge area(s)))² with the sign
    of q = A_o ds/dt; `area` meters the compression and `recoil_area` the recoil. p_o stays above the vapour pressure
    (rounded over 1/50 of the difference between ambient and vapour pressure).

    With `oil_volume`, the oil is compressible and p_o is a state. The volume (v(charge) - v(p_o)) oil_volume, with v(p)
    of the fluid including air and cavities, is the part of A_o s that has not passed to the gas side: q = A_o ds/dt
    minus the rate of this volume. A cavity formed in the recoil has to close before the strut damps again.

    Seals: (friction + friction_area (p_g - p_a)) v/√(v² + friction_speed²). Stops: k x (1 + d dx/dt) beyond either end.
    """

    name: str
    marker_a: Marker  #: marker on the cylinder
    marker_b: Marker  #: marker on the piston
    fluid: Fluid
    gas_volume: float  #: gas volume V_0 of the extended strut [m³]
    charge: float  #: absolute gas pressure of the extended strut [Pa]
    gas_area: float  #: area A_g of the piston rod, which displaces gas [m²]
    oil_area: float  #: area A_o of the oil chamber [m²]
    #: area of the orifice, a number or a function of the stroke s [m²]
    area: TimeFunction | float = field(metadata=NOT_OF_TIME)
    stroke: float  #: stroke at which the strut bottoms [m]
    extended_length: float  #: distance between the markers along the axis at s = 0 [m]
    stop_stiffness: float  #: stiffness k of the stops [N/m]
    #: area of the orifice during extension [m²]; None: equal to `area`
    recoil_area: TimeFunction | float | None = field(default=None, metadata=NOT_OF_TIME)
    exponent: float = 1.3  #: polytropic exponent n of the gas
    discharge: float = 0.9  #: discharge coefficient of the orifice
    oil_volume: float | None = None  #: volume of the oil chamber [m³]; None: incompressible oil
    friction: float = 0.0  #: friction of the seals [N]
    friction_area: float = 0.0  #: additional friction of the seals divided by the gas pressure [m²]
    friction_speed: float = FRICTION_SPEED  #: speed scale of the seal friction [m/s]
    stop_damping: float = 0.0  #: damping d of the stops [s/m]
    axis: GivenArray = given(Z_AXIS)  #: direction from marker a to marker b, in the axes of marker a, (3,)

    def __post_init__(self) -> None:
        where = f"element {self.name!r}"
        above = ("gas_volume", "charge", "gas_area", "oil_area", "stroke", "stop_stiffness", "exponent", "discharge")
        for key in (*above, "friction_speed", "oil_volume"):
            if getattr(self, key) is not None:
                object.__setattr__(self, key, number(f"{where}: {key}", getattr(self, key), above=0.0))
        for key in ("extended_length", "friction", "friction_area", "stop_damping"):
            object.__setattr__(self, key, number(f"{where}: {key}", getattr(self, key), at_least=0.0))
        object.__setattr__(self, "axis", unit_vector(f"{where}: axis", self.axis))
        if self.gas_area * self.stroke >= self.gas_volume:
            raise ModelError(
                f"{where}: gas_volume: expected more than gas_area times stroke = {self.gas_area * self.stroke:.4g}, "
                f"got {self.gas_volume:.4g}: the gas volume must be above 0 at full stroke"
            )
        for key in ("area", "recoil_area"):
            self._metered(where, key)

    def _metered(self, where: str, key: str) -> None:
        """Check an area as a function of the stroke, and convert a number to a function."""
        given = getattr(self, key)
        if given is None:
            return
        if not isinstance(given, TimeFunction):
            given = constant(number(f"{where}: {key}", given, above=0.0))
            object.__setattr__(self, key, given)
        s = np.union1d(
            np.linspace(0.0, self.stroke, 201), given.begins[(given.begins > 0) & (given.begins < self.stroke)]
        )
        values = given.at(s)
        if values.min() <= 0:
            k = int(np.argmin(values))
            raise ModelError(
                f"{where}: {key}: expected areas above 0 over the stroke, got {values[k]:.4g} at s = {s[k]:.4g}"
            )

    def drawn(self) -> tuple[Stretched, ...]:
        """Return a drawn rod in a cylinder with the area that displaces gas."""
        return (Stretched("strut", radius=sqrt(self.gas_area / pi)),)

    def law(self, placed: Placed) -> ElementLaw:
        """Return the law of the strut; `ModelError` if it is assembled outside its stroke."""
        from floatframe.components.hydraulics.oleo_law import AREAS, oleo_law

        where = f"element {self.name!r}"
        distance = float((placed.A[0] @ self.axis) @ (placed.r[1] - placed.r[0]))
        s = self.extended_length - distance
        if distance <= 0:
            raise ModelError(
                f"{where}: marker_b lies {distance:.6g} along the axis from marker_a as placed; expected one above 0: "
                "does the axis point from marker_a to marker_b?"
            )
        if not -0.5 * self.stroke <= s <= 1.5 * self.stroke:
            raise ModelError(
                f"{where}: its markers are {distance:.6g} apart along the axis as placed, stroke {s:.6g}; expected "
                f"0 to {self.stroke:g}: check extended_length = {self.extended_length:g}"
            )
        area, recoil = function_numbers(self.area), []  # type: ignore[arg-type]
        if self.recoil_area is not None:
            recoil = function_numbers(self.recoil_area)  # type: ignore[arg-type]
        at_recoil = AREAS + len(area) if recoil else AREAS
        numbers = [*self.fluid.numbers, self.fluid.density, self.gas_volume, self.charge, self.gas_area, self.oil_area]
        numbers += [
            self.exponent,
            self.discharge,
            self.stroke,
            self.extended_length,
            self.stop_stiffness,
            self.stop_damping,
        ]
        numbers += [
            self.friction,
            self.friction_area,
            self.friction_speed,
            self.oil_volume or 0.0,
            at_recoil,
            *self.axis,
        ]
        start = []
        if self.oil_volume is not None:
            start = [
                self.charge
                * (self.gas_volume / (self.gas_volume - self.gas_area * min(s, self.stroke))) ** self.exponent
            ]
        stop = GapSpring(self.stop_stiffness)
        return ElementLaw(
            function=oleo_law,
            data=[*numbers, LEAST_GAS, *area, *recoil],
            states=["oil pressure"] if start else [],
            start=start,
            state_units=in_units(placed.units, ["Pa"] if start else []),
            **outputs_in(placed.units, OUTPUTS),
            tangent="complex",
            energy="energy",
            power_lost="power lost",
            gaps={"stroke": stop, "stroke left": stop},
        )
