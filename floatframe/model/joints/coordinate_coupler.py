"""Coordinate couplers: gears, racks, differentials; latches, clutches and stops.

Evaluated in `floatframe.engine.kernels.connections.coupler`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from fe_models.foundation.records import checked_fields, frozen_copies
from floatframe.errors import ModelError
from floatframe.model.bodies.coordinates import Coordinate, coordinate_of
from floatframe.model.checked_values import number
from floatframe.model.functions.time_functions import TimeFunction, constant

__all__ = ["CoordinateCoupler", "Limits"]


@dataclass(frozen=True)
@checked_fields(ModelError)
class Limits:
    """Stops of a coupler: lower <= Σ a_k x_k <= upper, with Newton's coefficient of restitution.

    At a stop an impulse changes the rate v of the sum to -restitution v, with all joints satisfied (M du = Gᵀ i,
    including the modes of flexible bodies). A bounce with a flight shorter than a step ends at the stop, which then
    holds the sum until it would have to pull.

    Parameters
    ----------
    lower
        Lower bound in the unit of the sum; None: no lower stop.
    upper
        Upper bound in the unit of the sum; None: no upper stop.
    restitution
        Coefficient of restitution, 0 (no bounce) to 1 (no loss of energy).
    """

    lower: float | None = None
    upper: float | None = None
    restitution: float = 0.0

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
@checked_fields(ModelError)
class CoordinateCoupler:
    """A linear relation between coordinates, Σ a_k x_k = c, which is one constraint.

    A pair of gears with z_1 and z_2 teeth and external mesh on a fixed frame: z_1 phi_1 + z_2 phi_2 = c. On a carrier,
    the angles are those of the joints with the carrier. A rack on a pinion of radius r: x - r phi = c. The reaction is
    one number lam; the force along coordinate k is a_k lam, as two gears share one tooth force. Angles are counted
    beyond full turns.

    If it is not engaged, it has no force until an event engages it: a latch (one term), a clutch or a brake (two
    terms). It then holds the current value of the sum, unless `constant` is given. An impulse removes the remaining
    rate of the sum, and the energy balance records the loss. With `limits` it only acts while the sum is at a limit.

    Parameters
    ----------
    name
        Name of the coupler, unique in the system.
    terms
        Coordinates and their coefficients a_k.
    constant
        c as a number or a function of time; None: as assembled, or the value when engaged.
    engaged
        False: no force until an event engages it.
    limits
        Stops of the sum; the coupler is then not engaged.
    """

    name: str
    terms: Sequence[tuple[Coordinate | str, float]]
    constant: float | TimeFunction | None = None
    engaged: bool = True
    limits: Limits | None = None

    def __post_init__(self) -> None:
        where = f"coupler {self.name!r}"
        try:
            terms = tuple((coordinate, factor) for coordinate, factor in self.terms)
        except (TypeError, ValueError):
            raise ModelError(f"{where}: terms: expected pairs (coordinate, coefficient), got {self.terms!r}") from None
        if not terms:
            raise ModelError(f"{where}: terms: expected at least one coordinate, got none")
        checked = []
        for k, (coordinate, factor) in enumerate(terms):
            value = number(f"{where}: coefficient {k + 1}", factor)
            if value == 0:
                raise ModelError(f"{where}: coefficient {k + 1}: expected a number other than zero; remove the term")
            checked.append((coordinate_of(f"{where}: term {k + 1}", coordinate), value))
        object.__setattr__(self, "terms", tuple(checked))
        if self.limits is not None:
            if not isinstance(self.limits, Limits):
                raise ModelError(f"{where}: limits: expected Limits(lower, upper, restitution), got {self.limits!r}")
            if self.constant is not None:
                raise ModelError(
                    f"{where}: a coupler with limits has no constant, because the limits determine its value; remove "
                    "the constant"
                )
        if isinstance(self.constant, int | float):
            object.__setattr__(self, "constant", constant(number(f"{where}: constant", self.constant)))
        elif not isinstance(self.constant, TimeFunction | None):
            raise ModelError(
                f"{where}: constant: expected a number or a function of floatframe.functions, got {self.constant!r}"
            )

    @property
    def acts(self) -> bool:
        """Whether the relation applies from the start, rather than after an event or at a stop."""
        return self.engaged and self.limits is None
