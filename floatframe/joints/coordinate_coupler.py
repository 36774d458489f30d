"""Coordinate couplers: gears, racks, differentials; latches, clutches and stops."""

from collections.abc import Sequence
from dataclasses import dataclass

from fe_models.foundation.copies import frozen_copies
from floatframe.bodies.coordinates import Coordinate, coordinate_words
from floatframe.checked_values import number
from floatframe.errors import ModelError
from floatframe.functions.time_functions import TimeFunction, constant

__all__ = ["CoordinateCoupler", "Limits"]


@dataclass(frozen=True)
class Limits:
    """Stops of a coupler: lower <= Σ a_k x_k <= upper, struck with Newton's coefficient of restitution.

    At a stop the velocities change by the impulse that turns the rate v of the sum into -restitution v with all joints
    closed (M du = Gᵀ i, flexible bodies with their modes). A bounce whose flight would be shorter than a step ends on
    the stop, which then holds the sum until it would have to pull.
    """

    lower: float | None = None  #: in the unit of the sum; None: no stop there
    upper: float | None = None
    restitution: float = 0.0  #: 0 (does not bounce) to 1 (keeps its energy)

    def __post_init__(self) -> None:
        if self.lower is None and self.upper is None:
            raise ModelError("limits: expected lower or upper or both, got neither")
        for side in ("lower", "upper"):
            if getattr(self, side) is not None:
                object.__setattr__(self, side, number(f"limits: {side}", getattr(self, side)))
        if self.lower is not None and self.upper is not None and not self.lower < self.upper:
            raise ModelError(f"limits: expected lower below upper, got {self.lower:g} and {self.upper:g}")
        value = number("limits: restitution", self.restitution)
        if not 0.0 <= value <= 1.0:
            raise ModelError(f"limits: restitution: expected 0 to 1, got {value:g}")
        object.__setattr__(self, "restitution", value)


@frozen_copies
@dataclass(frozen=True, eq=False)
class CoordinateCoupler:
    """Holds a linear relation between coordinates: Σ a_k x_k = c; one constraint.

    A pair of gears with z_1 and z_2 teeth in mesh from outside: z_1 phi_1 + z_2 phi_2 = c, on a fixed frame; on a
    carrier the angles are those of their joints with it. A rack on a pinion of radius r: x - r phi = c. Its reaction is
    one number lam; the force along coordinate k is a_k lam, as two wheels share one tooth force. Angles go on beyond a
    full turn.

    Not engaged it has no force until an event switches it on: a latch (one term), a clutch or a brake (two). What it
    holds then is the sum as caught, unless `constant` says otherwise; the rate of the sum that is left is taken out by
    one impulse, and the energy that is lost counts as taken. With `limits` it acts only while the sum is at one.
    """

    name: str
    terms: Sequence[tuple[Coordinate, float]]  #: coordinates and their coefficients a_k
    constant: float | TimeFunction | None = None  #: c, a number or a function of time; None: as placed, or as caught
    engaged: bool = True  #: False: no force until an event switches it on
    limits: Limits | None = None  #: it is not engaged, but stops the sum there

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
        if self.limits is not None:
            if not isinstance(self.limits, Limits):
                raise ModelError(f"{where}: limits: expected Limits(lower, upper, restitution), got {self.limits!r}")
            if self.constant is not None:
                raise ModelError(f"{where}: with limits there is no constant: what it holds is the stop; leave it out")
        if isinstance(self.constant, int | float):
            object.__setattr__(self, "constant", constant(number(f"{where}: constant", self.constant)))
        elif not isinstance(self.constant, TimeFunction | None):
            raise ModelError(
                f"{where}: constant: expected a number or a function of floatframe.functions.time_functions, got "
                f"{self.constant!r}"
            )

    @property
    def acts(self) -> bool:
        """Whether it holds its sum at the start, rather than waiting for an event or a stop."""
        return self.engaged and self.limits is None
