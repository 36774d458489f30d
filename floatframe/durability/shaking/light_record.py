"""A compact shake record: long curves are written to a separate file of arrays."""

from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array

__all__ = ["MOST_NUMBERS", "light_record"]

MOST_NUMBERS = 300_000  #: largest number of values in curves that remain in the record, about three megabytes
LONG = 50  #: length above which a list counts as a curve


def light_record(record: dict[str, Any], file_name: str) -> tuple[dict[str, Any], dict[str, Array]]:
    """Return the record without its curves, and the curves by their paths; unchanged if there are few numbers.

    Curves are lists of more than 50 numbers, or of lists of more than 50. In the record {"array": "random/0/densities",
    "shape": [12, 804]} stands for each, and "curves" says in which file they are.

    Parameters
    ----------
    record
        As `shake_record` returns it.
    file_name
        Of the file of arrays (.npz).
    """
    if sum(size_of_curves(value) for value in record.values()) <= MOST_NUMBERS:
        return record, {}
    arrays: dict[str, Array] = {}
    light = {key: without_curves(value, key, arrays) for key, value in record.items()}
    return {**light, "curves": {"file": file_name, "key": "array", "missing": "NaN"}}, arrays


def is_curve(value: Any) -> bool:
    """Return whether a value is a long list of numbers, or of lists."""
    if not isinstance(value, list) or not value:
        return False
    if isinstance(value[0], list):
        return len(value[0]) > LONG and all(is_curve(each) for each in value)
    return len(value) > LONG and all(isinstance(each, float | int | None) for each in value)


def size_of_curves(value: Any) -> int:
    """Return the number of values in the curves of a value."""
    if is_curve(value):
        return int(np.size(value))
    if isinstance(value, dict):
        return sum(size_of_curves(each) for each in value.values())
    return sum(size_of_curves(each) for each in value) if isinstance(value, list) else 0


def without_curves(value: Any, place: str, arrays: dict[str, Array]) -> Any:
    """Return a value with references in place of its curves, which are added to the arrays."""
    if is_curve(value):
        arrays[place] = np.array(value, dtype=float)  # None becomes NaN
        return {"array": place, "shape": list(arrays[place].shape)}
    if isinstance(value, dict):
        return {key: without_curves(each, f"{place}/{key}", arrays) for key, each in value.items()}
    if isinstance(value, list):
        return [without_curves(each, f"{place}/{k}", arrays) for k, each in enumerate(value)]
    return value
