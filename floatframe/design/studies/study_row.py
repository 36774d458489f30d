"""A point of a study and its result."""

from dataclasses import dataclass
from typing import Any

__all__ = ["StudyRow"]


@dataclass(frozen=True)
class StudyRow:
    """Parameter values of a point, and its outputs or error."""

    values: tuple[Any, ...]
    outputs: tuple[float, ...]  #: NaN if the point failed
    units: tuple[str, ...]
    error: str = ""  #: reason of a failure
    is_lasting: bool = True  #: whether a repeated attempt would give the same result; False for a killed process
