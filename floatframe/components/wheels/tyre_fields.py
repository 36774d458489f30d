"""The fields that all tyres share."""

from collections.abc import Mapping
from typing import Any, Self

from fe_models.foundation.arrays import Array
from fe_models.foundation.units import SPEED, TIME, Quantity
from floatframe.components.wheels.looks import tyre_looks
from floatframe.components.wheels.reading import Read, tyre_of_table
from floatframe.components.wheels.roads.road import FlatRoad, GridRoad, Road
from floatframe.errors import ModelError
from floatframe.model.checked_values import number, unit_vector
from floatframe.model.elements import Element
from floatframe.model.shapes import Arrow, MarkerShapes

__all__ = [
    "DEFAULT_LOW_SPEED", "SETTLING_TIME", "SimpleTyre", "check_common", "check_road", "common_numbers", "landing_depth",
]  # fmt: skip

#: steepest slope on which a wheel can follow the ground itself; an envelope is required for steeper ground
STEEPEST = 1.0
LANDINGS = 500  #: ratio of the radius to the landing depth
FIT = 1e-6  #: relative difference between the radii of wheel and envelope that counts as rounding


DEFAULT_LOW_SPEED = Quantity(1.0, SPEED)
SETTLING_TIME = Quantity(0.02, TIME)


class SimpleTyre(Element):
    """A tyre whose fields are the keys of its table."""

    radius: float
    axis: Array
    road: Road

    @classmethod
    def from_table(cls, name: str, table: Mapping[str, Any], read: Read) -> Self:
        """Return the tyre of [elements.NAME]."""
        return tyre_of_table(name, table, read, cls)

    def drawn(self) -> tuple[MarkerShapes | Arrow, ...]:
        """Return the drawn wheel, road and force."""
        return tyre_looks(self.radius, self.axis, self.road)


def check_common(
    tyre: Any, positive: tuple[str, ...], at_least_zero: tuple[str, ...], free: tuple[str, ...] = ()
) -> None:
    """Validate the numbers of a tyre and its road, and set them as floats.

    Raises
    ------
    ModelError
        If a number is out of its range, the road is not a road, or an envelope is for another wheel.
    """
    where = f"element {tyre.name!r}"
    for key in ("radius", "stiffness", "low_speed", *positive):
        object.__setattr__(tyre, key, number(f"{where}: {key}", getattr(tyre, key), above=0.0))
    zero = ("damping", "relaxation_x", "relaxation_y", "settling_time", *at_least_zero)
    for key in zero:
        object.__setattr__(tyre, key, number(f"{where}: {key}", getattr(tyre, key), at_least=0.0))
    if tyre.landing_depth is not None:
        depth = number(f"{where}: landing_depth", tyre.landing_depth, above=0.0)
        object.__setattr__(tyre, "landing_depth", depth)
    for key in free:
        object.__setattr__(tyre, key, number(f"{where}: {key}", getattr(tyre, key)))
    object.__setattr__(tyre, "axis", unit_vector(f"{where}: axis", tyre.axis))
    check_road(where, tyre.road, tyre.radius)


def check_road(where: str, road: Any, radius: float) -> None:
    """Raise `ModelError` unless the value is a road; an envelope must be made for a wheel of this radius."""
    if not isinstance(road, FlatRoad | GridRoad):
        raise ModelError(
            f"{where}: road: expected a FlatRoad or a GridRoad (from profile_road, iso_8608_road "
            f"or Polyline.enveloped), got {road!r}"
        )
    if isinstance(road, FlatRoad):
        return
    if road.envelope_radius is None:
        slope, at = road.steepest
        if slope > STEEPEST:
            raise ModelError(
                f"{where}: road: beyond x = {at:g} it rises with a slope of {slope:.3g}; a wheel cannot follow ground "
                f"that is steeper than {STEEPEST:g}: use its envelope, road.enveloped({radius:g})"
            )
    else:
        if abs(road.envelope_radius - radius) > FIT * radius:
            raise ModelError(
                f"{where}: road: it is the envelope of a disc of radius {road.envelope_radius:g}, but the radius of "
                f"the wheel is {radius:g}; make the envelope for the radius of the wheel"
            )


def landing_depth(given: float | None, radius: float) -> float:
    """Return the deflection over which damping and tread forces build up."""
    return radius / LANDINGS if given is None else given


def common_numbers(tyre: Any) -> list[float]:
    """Return the first parameters in the data in the order that `contact` reads."""
    return [
        tyre.radius,
        tyre.stiffness,
        tyre.damping,
        landing_depth(tyre.landing_depth, tyre.radius),
        tyre.low_speed,
        tyre.settling_time,
        tyre.relaxation_x,
        tyre.relaxation_y,
    ]
