"""Numbers in SI units with their dimensions: defaults, which a system turns into its own units.

A field such as `friction_speed: float = FRICTION_SPEED` holds a `Quantity` until it is given; what a user gives is a
number in the units of the system and stays as it is.
"""

from dataclasses import replace
from typing import Any

from fe_models.foundation.units import Dimensions, Units, unit_system

__all__ = ["LENGTH", "RATE", "SPEED", "TIME", "Quantity"]

SI = unit_system("m-kg-s")
LENGTH, TIME = Dimensions(length=1), Dimensions(time=1)
SPEED, RATE = Dimensions(length=1, time=-1), Dimensions(time=-1)  #: of places, of angles


class Quantity(float):
    """A number in SI units with its dimensions."""

    dimensions: Dimensions

    def __new__(cls, value: float, dimensions: Dimensions) -> "Quantity":
        """Make a quantity of a value in SI units."""
        made = super().__new__(cls, value)
        made.dimensions = dimensions
        return made

    def __reduce__(self) -> tuple[Any, ...]:
        return Quantity, (float(self), self.dimensions)

    def in_units(self, units: Units, *, of_angle: bool = False) -> float:
        """Return the number in the units of a system; of an angle, its length is one radian."""
        dimensions = replace(self.dimensions, length=0) if of_angle else self.dimensions
        return float(self) * dimensions.factor(SI, units)
