"""Conversion of the default values of joints, forces and elements to the units of a system; user values stay."""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any

from fe_models.foundation.units import Quantity, Units
from floatframe.model.bodies.markers import Marker

__all__ = ["in_units_of"]


def in_units_of(units: Units, part: Any) -> Any:
    """Return a part of a system (a dataclass) with its defaults, also nested ones, in the units of the system."""
    of_angle = bool(getattr(part, "is_angular", False))
    changed = {}
    for each in fields(part):
        value = getattr(part, each.name)
        found = value.in_units(units, of_angle=of_angle) if isinstance(value, Quantity) else held_in_units(units, value)
        if found is not value:
            changed[each.name] = found
    return replace(part, **changed) if changed else part


def held_in_units(units: Units, value: Any) -> Any:
    """Return the value of a field with its defaults in the units of the system, or the value itself if it has none."""
    if isinstance(value, Marker):
        return value
    if is_dataclass(value) and not isinstance(value, type):
        return in_units_of(units, value)
    if isinstance(value, list | tuple) and any(is_dataclass(each) for each in value):
        items = [held_in_units(units, each) for each in value]
        return type(value)(items) if any(a is not b for a, b in zip(items, value, strict=True)) else value
    if isinstance(value, Mapping) and any(is_dataclass(each) for each in value.values()):
        held = {key: held_in_units(units, each) for key, each in value.items()}
        return held if any(held[key] is not each for key, each in value.items()) else value
    return value
