"""Types of numbers and names in the tables of the system file."""

from typing import Annotated, Any

from pydantic import BeforeValidator, Field, StringConstraints

from fe_models.foundation.toml_file import numbers

__all__ = [
    "Count",
    "Name",
    "NotNegative",
    "Number",
    "Numbers",
    "Parameters4",
    "Positive",
    "tuple_of_list",
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


Parameters4 = Annotated[tuple[float, float, float, float], BeforeValidator(four_numbers)]


Number = Annotated[float, Field(allow_inf_nan=False)]


def tuple_of_list(value: Any) -> Any:
    """Return a list of the file as a tuple, which is validated afterwards."""
    return tuple(value) if isinstance(value, list) else value


Numbers = Annotated[tuple[Number, ...], BeforeValidator(tuple_of_list)]
