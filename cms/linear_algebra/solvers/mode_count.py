"""Number of vibration modes: given as a number or a cutoff frequency, with or without proof of completeness."""

import math
import operator
from dataclasses import dataclass

from cms.errors import ModeSetError
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.records import checked_fields

__all__ = ["ModeCount", "mode_count"]


@dataclass(frozen=True)
@checked_fields(ArgumentError)
class ModeCount:
    """Requested vibration modes: the lowest n, or all up to a cutoff.

    Wherever a function takes `n_modes`, an integer means that many of the lowest modes; this type covers the other
    cases:

    >>> ModeCount(cutoff=5000.0, verify=True)
    ModeCount(n=None, cutoff=5000.0, verify=True)

    Parameters
    ----------
    n
        Number of modes, 0 or more.
    cutoff
        All modes up to this frequency, instead of n [Hz, or 1/time unit of the body].
    verify
        Whether to prove by the inertia of a factorisation that no mode was missed.

    Raises
    ------
    ModeSetError
        If not exactly one of `n` and `cutoff` is given, or the number is invalid.
    """

    n: int | None = None
    cutoff: float | None = None
    verify: bool = False

    def __post_init__(self) -> None:
        if (self.n is None) == (self.cutoff is None):
            raise ModeSetError(
                f"n_modes: expected either a number or a cutoff, got n = {self.n}, cutoff = {self.cutoff}"
            )
        if self.n is not None:
            try:
                object.__setattr__(self, "n", operator.index(self.n))
            except TypeError:
                raise ModeSetError(
                    f"n_modes = {self.n!r}: expected a whole number, or ModeCount(cutoff=...) for a frequency"
                ) from None
            if self.n < 0:
                raise ModeSetError(f"n_modes = {self.n}: expected 0 or more")
        if self.cutoff is not None and not 0 < self.cutoff < math.inf:
            raise ModeSetError(f"n_modes: cutoff = {self.cutoff}: expected a finite frequency above 0")

    @property
    def omega2(self) -> float | None:
        """Squared angular frequency of the cutoff; None if a number of modes is given."""
        return None if self.cutoff is None else (2 * math.pi * self.cutoff) ** 2

    @property
    def description(self) -> str:
        """Description of the request, for messages and records."""
        return f"n_modes = {self.n}" if self.cutoff is None else f"cutoff = {self.cutoff:g}"


def mode_count(n_modes: "int | ModeCount") -> ModeCount:
    """Return the number or `ModeCount` as a `ModeCount`."""
    return n_modes if isinstance(n_modes, ModeCount) else ModeCount(n_modes)
