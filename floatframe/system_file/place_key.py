"""A place on a body as a key of the system file: the name of an interface, or a position."""

from typing import Annotated, Any

from pydantic import BeforeValidator

from fe_models.foundation.toml_file import numbers

__all__ = ["PlaceOnBody"]


def place_on_body(value: Any) -> Any:
    """Return the name of an interface, or a position as three numbers."""
    if isinstance(value, str) and value:
        return value
    try:
        return numbers(value)
    except ValueError:
        raise ValueError('expected the name of an interface ("big_end") or a position [x, y, z] in the body') from None


PlaceOnBody = Annotated[str | tuple[float, float, float], BeforeValidator(place_on_body)]
