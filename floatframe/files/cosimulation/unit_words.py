"""Units of variables for FMI: the symbols of a unit system as factors and exponents of SI base units."""

import re
from typing import NamedTuple

from fe_models.foundation.units import Units

__all__ = ["BaseUnit", "base_unit"]

EXPONENTS = {"": 1, "²": 2, "³": 3}


class BaseUnit(NamedTuple):
    """One unit in SI: factor · kg^kg m^m s^s rad^rad."""

    factor: float
    kg: int = 0
    m: int = 0
    s: int = 0
    rad: int = 0


def base_unit(units: Units, words: str) -> BaseUnit | None:
    """Return a unit such as "mm/s²" or "N mm" in SI; None for one without, or one that FMI cannot hold.

    words: symbols of the system, those to the power of 2 or 3 with ² or ³, parted by spaces; divisors after "/".
    """
    force = BaseUnit(units.to_si(mass=1, length=1, time=-2), 1, 1, -2)
    symbols = {
        units.length_symbol: BaseUnit(units.length, m=1),
        units.mass_symbol: BaseUnit(units.mass, kg=1),
        units.time_symbol: BaseUnit(units.time, s=1),
        units.force_symbol: force,
        units.stress_symbol: BaseUnit(units.to_si(mass=1, length=-1, time=-2), 1, -1, -2),
        "rad": BaseUnit(1.0, rad=1),
        "s": BaseUnit(1.0, s=1),
        "1": BaseUnit(1.0),
    }
    if words in symbols:
        return symbols[words]
    result = BaseUnit(1.0)
    for place, part in enumerate(words.split("/")):
        for symbol in part.split():
            name, exponent = re.fullmatch(r"(.*?)([²³]?)", symbol).groups()  # type: ignore[union-attr]
            if name not in symbols:
                return None
            k = EXPONENTS[exponent] * (1 if place == 0 else -1)
            each = symbols[name]
            powers = (old + k * new for old, new in zip(result[1:], each[1:], strict=True))
            result = BaseUnit(result.factor * each.factor**k, *powers)
    return result
