"""Checks of the dimensions of a part."""

from dataclasses import fields
from typing import Any

import numpy as np

from fe_models.parts.errors import PartError

__all__ = ["require", "require_lengths"]


def require_lengths(part: Any, *, zero_allowed: tuple[str, ...] = ()) -> None:
    """Raise `PartError` unless every field of the part is finite and positive, or zero where this is allowed."""
    for field in fields(part):
        value = getattr(part, field.name)
        low_ok = value >= 0 if field.name in zero_allowed else value > 0
        if not (np.isfinite(value) and low_ok):
            wanted = "zero or a positive length" if field.name in zero_allowed else "a positive length"
            raise PartError(f"{type(part).__name__}: {field.name}: expected {wanted}, got {value}")


def require(part: Any, holds: bool, rule: str, advice: str) -> None:
    """Raise `PartError` with the violated rule and the advice, unless the rule holds."""
    if not holds:
        raise PartError(f"{type(part).__name__}: expected {rule}; {advice}")
