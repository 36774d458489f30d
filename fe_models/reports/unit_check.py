"""Whether size, density and modulus are plausible in the unit system they are said to be in."""

from collections.abc import Iterable
from typing import Protocol

from fe_models.foundation.units import UNIT_SYSTEMS, Units

__all__ = ["implausible_units"]

SIZE = (1e-4, 1e3)  #: diagonal of a body [m]
DENSITY = (10.0, 25_000.0)  #: from rigid foam to osmium [kg/m³]
MODULUS = (1e3, 2e12)  #: from soft gel to above diamond [Pa]
WAVE_SPEED = (10.0, 30_000.0)  #: sqrt(E / rho): from soft rubber to above diamond [m/s]
STEEL = 7850.0  #: [kg/m³]


class _Elastic(Protocol):
    @property
    def name(self) -> str: ...
    @property
    def E(self) -> float: ...
    @property
    def rho(self) -> float: ...


def implausible_units(units: Units, size: float, materials: Iterable[_Elastic]) -> list[tuple[bool, str]]:
    """Return (is an error, text) for every number that is implausible in the unit system.

    Parameters
    ----------
    units
        The declared unit system.
    size
        Diagonal of the body, in its length unit.
    materials
        Materials with name, E and rho in its units.
    """
    materials = list(materials)
    texts: list[tuple[bool, str]] = []
    fitting = [u.name for u in UNIT_SYSTEMS.values() if u.name != units.name and _fits(u, size, materials)]
    advice = f"all numbers would fit {' or '.join(fitting)}" if fitting else "no known unit system fits all numbers"
    advice = f"{advice}; change the units or the numbers"
    metres = size * units.length
    if not SIZE[0] <= metres <= SIZE[1]:
        texts.append(
            (
                True,
                f"units {units.name}: the body is {size:.4g} {units.length_symbol} = {metres:.4g} m large; "
                f"expected {SIZE[0]:g} to {SIZE[1]:g} m. {advice}",
            )
        )
    for material in materials:
        rho = material.rho * units.to_si(mass=1, length=-3)
        E = material.E * units.to_si(mass=1, length=-1, time=-2)
        if not DENSITY[0] <= rho <= DENSITY[1]:
            steel = STEEL / units.to_si(mass=1, length=-3)
            texts.append(
                (
                    True,
                    f"units {units.name}: density of {material.name!r} {material.rho:.4g} "
                    f"{units.mass_symbol}/{units.length_symbol}³ = {rho:.4g} kg/m³; expected "
                    f"{DENSITY[0]:g} to {DENSITY[1]:g} kg/m³ (steel in {units.name} is {steel:.4g}). "
                    f"{advice}",
                )
            )
        if not MODULUS[0] <= E <= MODULUS[1]:
            steel = 2.1e11 / units.to_si(mass=1, length=-1, time=-2)
            texts.append(
                (
                    True,
                    f"units {units.name}: modulus of {material.name!r} {material.E:.4g} "
                    f"{units.stress_symbol} = {E:.4g} Pa; expected {MODULUS[0]:g} to {MODULUS[1]:g} Pa "
                    f"(steel in {units.name} is {steel:.4g}). {advice}",
                )
            )
        elif DENSITY[0] <= rho <= DENSITY[1]:
            speed = (E / rho) ** 0.5
            if not WAVE_SPEED[0] <= speed <= WAVE_SPEED[1]:
                texts.append(
                    (
                        False,
                        f"units {units.name}: waves in {material.name!r} run at sqrt(E/rho) = {speed:.4g} "
                        f"m/s; expected {WAVE_SPEED[0]:g} to {WAVE_SPEED[1]:g} m/s (steel: 5170): do "
                        f"modulus and density have the same units? {advice}",
                    )
                )
    return texts


def _fits(units: Units, size: float, materials: list[_Elastic]) -> bool:
    is_plausible = SIZE[0] <= size * units.length <= SIZE[1]
    for material in materials:
        rho = material.rho * units.to_si(mass=1, length=-3)
        E = material.E * units.to_si(mass=1, length=-1, time=-2)
        is_plausible &= DENSITY[0] <= rho <= DENSITY[1] and MODULUS[0] <= E <= MODULUS[1]
        is_plausible &= WAVE_SPEED[0] <= (E / rho) ** 0.5 <= WAVE_SPEED[1]
    return is_plausible
