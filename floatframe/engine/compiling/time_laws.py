"""The functions of time of a system: of its forces, joints, couplers and elements.

They are found in the fields of forces, joints, couplers and elements, and of the objects in these fields (controllers,
components of circuits), unless a field declares that its functions have another argument (`NOT_OF_TIME`).
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from typing import Any, NamedTuple

import numpy as np

from floatframe.model.functions.time_functions import TimeFunction
from floatframe.model.system import System

__all__ = ["FunctionOfTime", "functions_in", "functions_of_time", "parts_of_time", "rate_of_functions"]


class FunctionOfTime(NamedTuple):
    """A function of time that acts in a system."""

    where: str  #: path of the function in the system, such as "forces.push.amplitude"
    function: TimeFunction
    is_motion: bool  #: whether the function prescribes a motion
    holder: Any  #: dataclass that has the function as a field
    field: str


def functions_of_time(system: System) -> Iterator[FunctionOfTime]:
    """Yield every function of time that acts in a system."""
    for group in ("forces", "joints", "couplers", "elements"):
        for part in getattr(system, group):
            is_motion = group in ("joints", "couplers")
            yield from functions_in(part, f"{group}.{getattr(part, 'name', '')}", is_motion, part, "")


def functions_in(value: Any, where: str, is_motion: bool, holder: Any, field: str) -> Iterator[FunctionOfTime]:
    """Yield the functions of time in a value, which is a function or a container of functions."""
    if isinstance(value, TimeFunction):
        yield FunctionOfTime(where, value, is_motion, holder, field)
    elif is_dataclass(value) and not isinstance(value, type):
        for each in fields(value):
            if each.metadata.get("of_time", True):
                found = getattr(value, each.name)
                yield from functions_in(found, f"{where}.{each.name}", is_motion, value, each.name)
    elif isinstance(value, Mapping):
        for key, each in value.items():
            yield from functions_in(each, f"{where}.{key}", is_motion, holder, field)
    elif isinstance(value, list | tuple):
        for k, each in enumerate(value):
            if is_dataclass(each):
                name = getattr(each, "name", "") or k + 1
                yield from functions_in(each, f"{where}.{name}", is_motion, holder, field)


def parts_of_time(system: System) -> Iterator[tuple[str, Any]]:
    """Yield the forces and elements made of expressions, with their paths in the system."""
    for group in ("forces", "elements"):
        for part in getattr(system, group):
            if hasattr(part, "parts_of_time"):
                yield f"{group}.{part.name}", part


def rate_of_functions(functions: Iterable[FunctionOfTime]) -> float:
    """Return the highest rate of change [1/s]: angular frequency of a sine, or 1/duration of the shortest piece."""
    fastest = 0.0
    for each in functions:
        lengths = np.diff(each.function.begins)
        fastest = max(fastest, float(np.abs(each.function.pieces[:, 7]).max()))
        fastest = max(fastest, 1 / float(lengths.min()) if len(lengths) else 0.0)
    return fastest
