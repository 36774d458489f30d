"""One point of a study and what came out."""

from dataclasses import dataclass
from typing import Any

__all__ = ["StudyRow"]


@dataclass(frozen=True)
class StudyRow:
    """Values of the parameters at a point, and what came out."""

    values: tuple[Any, ...]
    outputs: tuple[float, ...]  #: NaN where the point failed
    units: tuple[str, ...]
    error: str = ""  #: why it failed
    is_lasting: bool = True  #: another try would give the same; not so for a process that was killed
