"""Cases of the laboratory: descriptions of a flexible body."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

from fe_models.foundation.records import checked_fields
from floatframe.errors import ModelError

__all__ = ["Case", "grid"]


@dataclass(frozen=True)
@checked_fields(ModelError)
class Case:
    """One description of the body.

    Parameters
    ----------
    mode_set
        Name of a mode set, as in a job.
    n_modes
        Number of vibration modes of each part.
    frame
        "tisserand", "buckens", or "nodal:INTERFACE".
    stiffening
        Whether geometric stiffness is included.
    parts
        Number of parts of equal length, each with its own frame (mean axes if there are several).
    """

    mode_set: str = "craig-bampton"
    n_modes: int = 10
    frame: str = "tisserand"
    stiffening: bool = True
    parts: int = 1

    def __post_init__(self) -> None:
        kind, _, at = self.frame.partition(":")
        if kind not in ("tisserand", "buckens", "nodal") or (kind == "nodal") != bool(at):
            raise ModelError(f'case: frame: expected "tisserand", "buckens" or "nodal:INTERFACE", got {self.frame!r}')
        if self.n_modes < 0 or self.parts < 1:
            raise ModelError(f"case: expected modes from 0 and parts from 1, got {self.n_modes} and {self.parts}")

    @property
    def family(self) -> tuple[str, str, bool, int]:
        """The description without the number of modes."""
        return (self.mode_set, self.frame, self.stiffening, self.parts)

    @property
    def description(self) -> str:
        """The case as text, without the number of modes."""
        parts = f", {self.parts} parts" if self.parts > 1 else ""
        return f"{self.mode_set}, {self.frame}{'' if self.stiffening else ', linear'}{parts}"


def grid(
    *,
    mode_sets: Sequence[str] = ("craig-bampton",),
    n_modes: Sequence[int] = (10,),
    frames: Sequence[str] = ("tisserand",),
    stiffening: Sequence[bool] = (True,),
    parts: Sequence[int] = (1,),
) -> tuple[Case, ...]:
    """Return all combinations, with the number of modes varying fastest; several parts always have mean axes.

    Parameters
    ----------
    mode_sets
        Names of mode sets, as in a job.
    n_modes
        Numbers of vibration modes of each part.
    frames
        "tisserand", "buckens" or "nodal:INTERFACE".
    stiffening
        Whether geometric stiffness is included.
    parts
        Numbers of parts of equal length.
    """
    made = [
        Case(mode_set, n, frame if k == 1 else "tisserand", stiff, k)
        for mode_set, frame, stiff, k, n in itertools.product(mode_sets, frames, stiffening, parts, n_modes)
    ]
    return tuple(dict.fromkeys(made))
