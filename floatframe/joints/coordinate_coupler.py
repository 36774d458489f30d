"""Coordinate couplers: gears, racks, differentials."""

from collections.abc import Sequence
from dataclasses import dataclass

from fe_models.foundation.copies import frozen_copies
from floatframe.bodies.coordinates import Coordinate, coordinate_words
from floatframe.checked_values import number
from floatframe.errors import ModelError
from floatframe.functions.time_functions import TimeFunction, constant

__all__ = ["CoordinateCoupler"]


@frozen_copies
@dataclass(frozen=True, eq=False)
class CoordinateCoupler:
    """Holds a linear relation between coordinates: Σ a_k x_k = c; one constraint.

    A pair of gears with z_1 and z_2 teeth in mesh from outside: z_1 phi_1 + z_2 phi_2 = c, on a fixed frame; on a
    carrier the angles are those of their joints with it. A rack on a pinion of radius r: x - r phi = c. Its reaction is
    one number lam; the force along coordinate k is a_k lam, as two wheels share one tooth force. Angles go on beyond a
    full turn.
    """

    name: str
    terms: Sequence[tuple[Coordinate, float]]  #: coordinates and their coefficients a_k
    constant: float | TimeFunction | None = None  #: c, a number or a function of time; None: as placed

    def __post_init__(self) -> None:
        where = f"coupler {self.name!r}"
        try:
            terms = tuple((coordinate, factor) for coordinate, factor in self.terms)
        except (TypeError, ValueError):
            raise ModelError(f"{where}: terms: expected pairs (coordinate, coefficient), got {self.terms!r}") from None
        if not terms:
            raise ModelError(f"{where}: terms: expected one coordinate at least, got none")
        checked = []
        for k, (coordinate, factor) in enumerate(terms):
            value = number(f"{where}: coefficient {k + 1}", factor)
            if value == 0:
                raise ModelError(f"{where}: coefficient {k + 1}: expected a number other than zero; leave the term out")
            checked.append((coordinate_words(f"{where}: term {k + 1}", coordinate), value))
        object.__setattr__(self, "terms", tuple(checked))
        if isinstance(self.constant, int | float):
            object.__setattr__(self, "constant", constant(number(f"{where}: constant", self.constant)))
        elif not isinstance(self.constant, TimeFunction | None):
            raise ModelError(
                f"{where}: constant: expected a number or a function of floatframe.functions.time_functions, got "
                f"{self.constant!r}"
            )
