"""Functions shared by drives on a shaft: two markers, an axis, a gear ratio and a controller."""

from typing import Any

from fe_models.foundation.arrays import Array
from fe_models.foundation.words import nearest
from floatframe.components.drives.pid import Pid
from floatframe.errors import ModelError
from floatframe.model.checked_values import number, unit_vector
from floatframe.model.elements import Placed
from floatframe.model.elements.pairs import angle_numbers
from floatframe.model.functions.time_functions import TimeFunction, constant

__all__ = ["Z_AXIS", "check_controller", "check_shaft", "required", "shaft_numbers", "time_functions"]

Z_AXIS: Any = (0.0, 0.0, 1.0)


def check_shaft(element: Any) -> None:
    """Check the axis of a drive, and make it a unit vector."""
    where = f"element {element.name!r}"
    object.__setattr__(element, "axis", unit_vector(f"{where}: axis", element.axis))


def required(
    element: Any, *, above: tuple[str, ...] = (), at_least: tuple[str, ...] = (), real: tuple[str, ...] = ()
) -> None:
    """Check numbers of a drive against their bounds; None is accepted."""
    where = f"element {element.name!r}"
    for keys, bounds in ((above, {"above": 0.0}), (at_least, {"at_least": 0.0}), (real, {})):
        for key in keys:
            if getattr(element, key) is not None:
                object.__setattr__(element, key, number(f"{where}: {key}", getattr(element, key), **bounds))


def time_functions(element: Any, *keys: str) -> None:
    """Convert fields that are numbers to constant time functions; None is kept."""
    for key in keys:
        value = getattr(element, key)
        if value is not None and not isinstance(value, TimeFunction):
            object.__setattr__(element, key, constant(number(f"element {element.name!r}: {key}", value)))


def check_controller(element: Any, quantities: tuple[str, ...]) -> None:
    """Check the controller of a drive and its controlled quantity."""
    where = f"element {element.name!r}"
    if not isinstance(element.controller, Pid | None):
        raise ModelError(f"{where}: controller: expected a Pid, got {element.controller!r}")
    if element.controlled not in quantities:
        raise ModelError(
            f"{where}: controlled: expected one of {', '.join(quantities)}, got {element.controlled!r}"
            f"{nearest(str(element.controlled), quantities)}"
        )


def shaft_numbers(axis: Array, placed: Placed) -> list[float]:
    """Return the data of `turns.turned_angle`: axis and normals of the assembled shaft, rate 1/s of its state."""
    return [*angle_numbers(axis, placed.A[0], placed.A[1]), placed.units.time]
