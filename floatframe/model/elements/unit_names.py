"""Units of the outputs of elements, converted from SI names to the units of a system."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from fe_models.foundation.units import Dimensions, Units, unit_words

__all__ = ["in_units", "outputs_in", "states_in"]

DIMENSIONS = {
    "m": Dimensions(0, 1, 0),
    "m/s": Dimensions(0, 1, -1),
    "m^2": Dimensions(0, 2, 0),
    "m^3": Dimensions(0, 3, 0),
    "m^3/s": Dimensions(0, 3, -1),
    "N": Dimensions(1, 1, -2),
    "N m": Dimensions(1, 2, -2),
    "J": Dimensions(1, 2, -2),
    "Pa": Dimensions(1, -1, -2),
    "W": Dimensions(1, 2, -3),
    "rad/s": Dimensions(0, 0, -1),
    "Hz": Dimensions(0, 0, -1),
}
SI = "m-kg-s"


def in_units(units: Units, names: Sequence[str]) -> list[str]:
    """Return SI unit names converted to those of a system; non-mechanical units are unchanged.

    >>> from fe_models.foundation.units import unit_system
    >>> in_units(unit_system("mm-t-s"), ["Pa", "m^3/s", "N m", "rad/s", "A"])
    ['MPa', 'mm^3 s^-1', 'N mm', 'rad/s', 'A']
    """
    if units.name == SI:
        return list(names)
    return [in_unit(units, name) for name in names]


def outputs_in(units: Units, outputs: Mapping[str, str] | Iterable[tuple[str, str]]) -> dict[str, Any]:
    """Return `outputs` and `output_units` of a law, from SI unit names by output."""
    found = dict(outputs)
    return {"outputs": tuple(found), "output_units": in_units(units, list(found.values()))}


def states_in(units: Units, states: Sequence[tuple[str, str, float]]) -> dict[str, Any]:
    """Return `states`, `start` and `state_units` of a law, from name, SI unit name and start of each state."""
    names, named, start = zip(*states, strict=True) if states else ((), (), ())
    return {"states": names, "start": start, "state_units": in_units(units, named)}


def in_unit(units: Units, name: str) -> str:
    """Return one converted unit name."""
    if name not in DIMENSIONS:
        return name
    if name in ("rad/s", "Hz"):
        time = units.time_symbol
        return name if time == "s" else f"rad/{time}" if name == "rad/s" else f"1/{time}"
    return unit_words(units, DIMENSIONS[name])
