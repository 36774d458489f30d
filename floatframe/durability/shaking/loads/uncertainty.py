"""Model uncertainty: factors on responses, and uncertain frequencies.

With the relative uncertainty delta of frequencies, the response at f is the level at f times the largest transfer
function between f/(1 + delta) and f/(1 - delta), as if all frequencies of the model could change by up to delta.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.records import checked_fields
from floatframe.errors import ModelError

__all__ = ["Uncertainty"]

SAME = 1e-9  #: relative distance of frequencies that differ by rounding alone


@dataclass(frozen=True)
@checked_fields(ModelError)
class Uncertainty:
    """Factor on responses and relative uncertainty of frequencies, constant or by frequency band.

    Parameters
    ----------
    factor
        Dynamic or model uncertainty factor, 1 or more.
    frequency
        Relative uncertainty of frequencies, 0.05 for 5 %.
    bands
        Rows (from [Hz], to [Hz], factor, frequency), which replace the values above.
    """

    factor: float = 1.0
    frequency: float = 0.0
    bands: Sequence[Sequence[float]] = ()

    def __post_init__(self) -> None:
        rows = [(0.0, math.inf, self.factor, self.frequency), *self.bands]
        for row in rows:
            if len(row) != 4 or not row[0] < row[1]:
                raise ModelError(
                    f"uncertainty: bands: expected rows (from Hz, to Hz, factor, share), got {list(row)!r}"
                )
            if not (math.isfinite(row[2]) and row[2] >= 1):
                raise ModelError(f"uncertainty: factor: expected a number of 1 or more, got {row[2]!r}")
            if not 0 <= row[3] < 0.5:
                raise ModelError(
                    f"uncertainty: frequency: expected a share between 0 and 0.5 (0.05 for 5 %), got {row[3]!r}"
                )

    @property
    def is_none(self) -> bool:
        """Whether there is no uncertainty."""
        return not len(self.bands) and self.factor == 1.0 and self.frequency == 0.0

    @property
    def largest(self) -> tuple[float, float]:
        """Largest factor and frequency uncertainty of all bands, used for responses in time."""
        return (
            max([self.factor, *(row[2] for row in self.bands)]),
            max([self.frequency, *(row[3] for row in self.bands)]),
        )

    def of(self, frequencies: Array) -> tuple[Array, Array]:
        """Return factor and frequency uncertainty at frequencies [Hz], (n_f,) each."""
        f = np.asarray(frequencies)
        factor, share = np.full(len(f), self.factor), np.full(len(f), self.frequency)
        for low, high, own, off in self.bands:
            inside = (f >= low) & (f < high)
            factor[inside], share[inside] = own, off
        return factor, share

    def windows(self, frequencies: Array) -> tuple[Array, IntArray, IntArray]:
        """Return the factor at each frequency, and the indices of its window, from low to below high, (n_f,) each."""
        f = np.asarray(frequencies)
        factor, share = self.of(f)
        low = np.searchsorted(f, f / (1 + share) * (1 - SAME), side="left")
        high = np.searchsorted(f, f / (1 - share) * (1 + SAME), side="right")
        return factor, low, np.maximum(high, low + 1)

    def widened(self, frequencies: Array, sizes: Array) -> Array:
        """Return transfer functions, (n_f, ...), times their factor, with the maximum over uncertain frequencies."""
        factor, low, high = self.windows(frequencies)
        widest = np.stack([sizes[a:b].max(axis=0) for a, b in zip(low, high, strict=True)])
        return np.asarray(widest * factor.reshape(-1, *([1] * (sizes.ndim - 1))))

    @property
    def description(self) -> str:
        """Description of the uncertainty."""
        if self.is_none:
            return "none"
        rows = [(0.0, math.inf, self.factor, self.frequency), *self.bands]
        return "; ".join(
            f"{'' if high == math.inf else f'{low:g} to {high:g} Hz: '}factor {factor:g}, frequencies "
            f"±{100 * share:g} %"
            for low, high, factor, share in rows
        )
