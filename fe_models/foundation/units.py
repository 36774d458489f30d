"""Coherent unit systems: numbers are stored in the units of the model, together with the name of the system."""

from dataclasses import dataclass, fields, replace
from typing import Any

from fe_models.foundation.errors import ArgumentError, UnitsError
from fe_models.foundation.records import checked_fields
from fe_models.foundation.words import nearest, quoted

__all__ = [
    "LENGTH", "RATE", "SPEED", "TIME", "UNIT_SYSTEMS", "Dimensions", "Quantity", "Units", "unit_system", "unit_text",
    "unit_words",
]  # fmt: skip


@dataclass(frozen=True)
@checked_fields(ArgumentError)
class Units:
    """A coherent unit system: force = mass * length / time². Nothing is converted internally.

    The factors give the SI value of one unit: a length of 1 in this system is `length` metres.

    Parameters
    ----------
    name
        Key in `UNIT_SYSTEMS`, such as "mm-t-s".
    length
        One length unit in metres.
    mass
        One mass unit in kilograms.
    time
        One time unit in seconds.
    length_symbol
        Symbol of the length unit, such as "mm".
    mass_symbol
        Symbol of the mass unit, such as "t".
    time_symbol
        Symbol of the time unit, such as "s".
    force_symbol
        Symbol of the force unit, such as "N".
    stress_symbol
        Symbol of the stress unit, such as "MPa".
    """

    name: str
    length: float
    mass: float
    time: float
    length_symbol: str
    mass_symbol: str
    time_symbol: str
    force_symbol: str
    stress_symbol: str

    @staticmethod
    def of_name(name: str) -> "Units":
        """Return the unit system with this name, as `unit_system` does."""
        return unit_system(name)

    def to_si(self, *, length: int = 0, mass: int = 0, time: int = 0) -> float:
        """Return the SI value of one unit with the given exponents, e.g. density: `to_si(mass=1, length=-3)`."""
        return self.length**length * self.mass**mass * self.time**time


UNIT_SYSTEMS = {
    "m-kg-s": Units("m-kg-s", 1.0, 1.0, 1.0, "m", "kg", "s", "N", "Pa"),
    "mm-t-s": Units("mm-t-s", 1e-3, 1e3, 1.0, "mm", "t", "s", "N", "MPa"),
    "mm-kg-s": Units("mm-kg-s", 1e-3, 1.0, 1.0, "mm", "kg", "s", "mN", "kPa"),
    "mm-kg-ms": Units("mm-kg-ms", 1e-3, 1.0, 1e-3, "mm", "kg", "ms", "kN", "GPa"),
    "mm-g-ms": Units("mm-g-ms", 1e-3, 1e-3, 1e-3, "mm", "g", "ms", "N", "MPa"),
    "cm-g-s": Units("cm-g-s", 1e-2, 1e-3, 1.0, "cm", "g", "s", "dyn", "dyn/cm²"),
    "in-slinch-s": Units("in-slinch-s", 0.0254, 175.12683524647636, 1.0, "in", "slinch", "s", "lbf", "psi"),
    "ft-slug-s": Units("ft-slug-s", 0.3048, 14.593902937206364, 1.0, "ft", "slug", "s", "lbf", "psf"),
}  # slinch = lbf s²/in and slug = lbf s²/ft with lbf = 4.4482216152605 N


def unit_system(name: str) -> Units:
    """Return the unit system with this name.

    Parameters
    ----------
    name
        Name of a coherent unit system, such as "m-kg-s" or "mm-t-s".

    Raises
    ------
    UnitsError
        If the name is unknown; the message lists the choices and the nearest name.
    """
    if name not in UNIT_SYSTEMS:
        raise UnitsError(f"units: unknown unit system {quoted(name)}{nearest(name, UNIT_SYSTEMS)}")
    return UNIT_SYSTEMS[name]


@dataclass(frozen=True)
class Dimensions:
    """Exponents of mass, length and time."""

    mass: float = 0.0
    length: float = 0.0
    time: float = 0.0

    def factor(self, old: Units, new: Units) -> float:
        """Return the factor that converts numbers from the old unit system to the new one."""
        ratio = (old.mass / new.mass) ** self.mass * (old.length / new.length) ** self.length
        return float(ratio * (old.time / new.time) ** self.time)


def unit_text(units: Units, dimensions: Dimensions) -> str:
    """Return a unit in ASCII, such as 't^(1/2) mm' or 's^-2'; '1' if it is dimensionless."""
    parts = []
    for field in fields(dimensions):
        power, symbol = getattr(dimensions, field.name), getattr(units, f"{field.name}_symbol")
        if power:
            exponent = f"{power:g}" if power == int(power) else f"({2 * power:g}/2)"
            parts.append(symbol if power == 1 else f"{symbol}^{exponent}")
    return " ".join(parts) or "1"


def unit_words(units: Units, dimensions: Dimensions) -> str:
    """Return a unit with the names of force and stress if it has such a name ('N mm', 'MPa'), else as `unit_text`."""
    if (dimensions.mass, dimensions.time) != (1.0, -2.0):
        return unit_text(units, dimensions)
    if dimensions.length == -1:
        return units.stress_symbol
    rest = unit_text(units, Dimensions(0.0, dimensions.length - 1, 0.0))
    return units.force_symbol if rest == "1" else f"{units.force_symbol} {rest}"


SI = unit_system("m-kg-s")
LENGTH, TIME = Dimensions(length=1), Dimensions(time=1)
SPEED, RATE = Dimensions(length=1, time=-1), Dimensions(time=-1)  #: dimensions of rates of positions and of angles


class Quantity(float):
    """A number in SI units with its dimensions."""

    dimensions: Dimensions

    def __new__(cls, value: float, dimensions: Dimensions) -> "Quantity":
        """Create a quantity from a value in SI units."""
        made = super().__new__(cls, value)
        made.dimensions = dimensions
        return made

    def __reduce__(self) -> tuple[Any, ...]:
        return Quantity, (float(self), self.dimensions)

    def in_units(self, units: Units, *, of_angle: bool = False) -> float:
        """Return the number in the units of a system; for an angle, the dimension length means radian."""
        dimensions = replace(self.dimensions, length=0) if of_angle else self.dimensions
        return float(self) * dimensions.factor(SI, units)
