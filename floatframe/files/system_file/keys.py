"""Types of numbers and names in the tables of the system file."""

from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field, StringConstraints

from fe_models.foundation.toml_file import numbers

__all__ = [
    "Count",
    "Name",
    "NotNegative",
    "NotNegativeOrSix",
    "Number",
    "NumberOrSix",
    "Numbers",
    "Parameters4",
    "Positive",
]

Name = Annotated[str, StringConstraints(min_length=1)]


Positive = Annotated[float, Field(gt=0)]


NotNegative = Annotated[float, Field(ge=0)]


Count = Annotated[int, Field(ge=0)]


def four_numbers(value: Any) -> tuple[float, ...]:
    """Return four numbers, the Euler parameters."""
    try:
        return (*numbers(value[:3]), *numbers([value[3], 0.0, 0.0])[:1]) if len(value) == 4 else numbers(None)
    except (ValueError, TypeError):
        raise ValueError("expected four numbers, [w, x, y, z]") from None


def number_or_six(value: Any) -> Any:
    """Return a number; for a bushing also six numbers, or six rows of six."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    try:
        rows = np.array(value, dtype=float)
    except (TypeError, ValueError):
        rows = np.zeros(0)
    if rows.shape not in ((6,), (6, 6)) or not np.isfinite(rows).all():
        raise ValueError("expected a number; for a bushing six numbers, or six rows of six numbers")
    return rows.tolist()


def not_negative_or_six(value: Any) -> Any:
    """Return the result of `number_or_six`; a single number must not be below zero."""
    result = number_or_six(value)
    if isinstance(result, float) and result < 0:
        raise ValueError("expected a number, 0 or more; for a bushing six numbers, or six rows of six numbers")
    return result


NumberOrSix = Annotated[float | list, BeforeValidator(number_or_six)]


NotNegativeOrSix = Annotated[float | list, BeforeValidator(not_negative_or_six)]


Parameters4 = Annotated[tuple[float, float, float, float], BeforeValidator(four_numbers)]


Number = Annotated[float, Field(allow_inf_nan=False)]


def list_of_numbers(value: Any) -> Any:
    """Return a list of the file as a tuple, which is validated afterwards."""
    return tuple(value) if isinstance(value, list) else value


Numbers = Annotated[tuple[Number, ...], BeforeValidator(list_of_numbers)]
