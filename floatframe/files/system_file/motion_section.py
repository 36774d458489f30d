"""Functions of time in a system file: notes on tables that overshoot, and the quantities of signals."""

from collections.abc import Iterator, Mapping
from typing import Any

from fe_models.foundation.toml_file import Table
from floatframe.errors import SignalError
from floatframe.files.system_file.described import FunctionTable, Signals
from floatframe.files.system_file.signal_section import function_named
from floatframe.model.functions.tables import interpolated, overshoot

__all__ = ["overshoot_notes", "require_quantity"]

OVERSHOOT = 0.1  #: largest overshoot of a table without a note, relative to the range of its values


def overshoot_notes(section: Any, place: str = "") -> Iterator[str]:
    """Yield a note on each table within a section whose spline, if none is chosen, leaves the range of its values."""
    inside = dict(section) if isinstance(section, Mapping | Table) else {}
    is_table = isinstance(section, FunctionTable) and section.described is interpolated
    if is_table and inside["interpolation"] is None:
        size, where = overshoot(section.object_named(), inside["t"], inside["values"])
        if size > OVERSHOOT:
            yield (
                f"{place}: its cubic spline leaves the range of the values by {100 * size:.3g} % of it, at "
                f'{where:.4g}; interpolation = "monotone" stays within, "cubic" ends this note'
            )
    if isinstance(section, list | tuple):
        inside = {str(k): each for k, each in enumerate(section)}
    for key, each in inside.items():
        yield from overshoot_notes(each, f"{place}.{key}".removeprefix("."))


def require_quantity(where: str, section: FunctionTable, signals: Signals, expected: tuple[str, ...]) -> None:
    """Raise `SignalError` if a table uses a signal of another quantity than expected."""
    for name in section.signals():
        found = function_named(name, signals or {}).quantity
        if found not in expected:
            hint = "; integrate = true makes a motion of an acceleration" if found.endswith("acceleration") else ""
            raise SignalError(f"{where}: expected {' or '.join(expected)}, but signal {name!r} is: {found}{hint}")
