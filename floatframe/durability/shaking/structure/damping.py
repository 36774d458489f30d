"""Damping of modes with fixed bases: by ratio, table over frequency, band, single mode, or from the body."""

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from cms.reduction.basis.damping import HEAVY, heavy_words
from fe_models.foundation.arrays import Array
from fe_models.foundation.records import checked_fields
from floatframe.errors import ModelError

__all__ = ["Damping"]


@dataclass(frozen=True)
@checked_fields(ModelError)
class Damping:
    """Damping ratios zeta = 1/(2 Q); later entries override earlier ones: `ratio`, `table`, `bands`, `modes`.

    Parameters
    ----------
    ratio
        Ratio of all modes.
    Q
        Amplification of all modes.
    table
        Rows (frequency [Hz], ratio), linear in log f, constant beyond the ends.
    bands
        Rows (from [Hz], to [Hz], ratio), from <= f < to.
    modes
        Ratios of single modes by number, from 1.
    own
        Whether the damping of the body or of the dampers of the system is used.
    heavy
        Whether ratios above 0.2 are intended; otherwise they are refused. `Q` needs no confirmation.

    Raises
    ------
    ModelError
        If nothing is given, entries contradict each other, or a ratio is not between 0 and 1.
    """

    ratio: float | None = None
    Q: float | None = None
    table: Sequence[Sequence[float]] = ()
    bands: Sequence[Sequence[float]] = ()
    modes: Mapping[int, float] = field(default_factory=dict)
    own: bool = False
    heavy: bool = False

    def __post_init__(self) -> None:
        if self.ratio is not None and self.Q is not None:
            raise ModelError("damping: expected either ratio or Q, got both")
        if self.Q is not None:
            if not (math.isfinite(self.Q) and self.Q > 0.5):
                raise ModelError(f"damping: Q: expected a number above 0.5, got {self.Q!r}")
            object.__setattr__(self, "ratio", 1 / (2 * self.Q))
        given = self.ratio is not None or len(self.table) or len(self.bands) or len(self.modes)
        if self.own and given:
            raise ModelError("damping: expected either own = true or ratios, got both")
        if not self.own and not given:
            raise ModelError("damping: expected ratio, Q, table, bands, modes or own = true, got nothing")
        for row in self.table:
            if len(row) != 2:
                raise ModelError(f"damping: table: expected rows (Hz, ratio), got {list(row)!r}")
        f = [float(row[0]) for row in self.table]
        for k, (low, high) in enumerate(itertools.pairwise(f)):
            if not 0 < low < high:
                raise ModelError(
                    f"damping: table: frequencies must rise above 0: row {k + 2} has {high:g} after {low:g}"
                )
        for row in self.bands:
            if len(row) != 3 or not 0 <= row[0] < row[1]:
                raise ModelError(
                    f"damping: bands: expected rows (from Hz, to Hz, ratio) with from < to, got {list(row)!r}"
                )
        ratios = [self.ratio or 0.0, *(row[-1] for row in self.table), *(row[-1] for row in self.bands)]
        for value in [*ratios, *self.modes.values()]:
            if not (math.isfinite(value) and 0 <= value < 1):
                raise ModelError(f"damping: expected ratios of critical damping from 0 to below 1, got {value!r}")
            if value > HEAVY and not self.heavy and not (self.Q is not None and value == self.ratio):
                raise ModelError(f"damping: ratio {value:g}: {heavy_words(value)}")

    def ratios(self, frequencies: Array) -> Array:
        """Return the ratio of every mode, (n_m,), by its frequency [Hz] and number.

        Raises
        ------
        ModelError
            If a mode has no ratio, or a number in `modes` is not that of a mode.
        """
        zeta = np.full(len(frequencies), np.nan if self.ratio is None else self.ratio)
        if len(self.table):
            f, z = np.array(self.table, dtype=float).T
            zeta = np.interp(np.log(frequencies), np.log(f), z)
        for low, high, value in self.bands:
            zeta[(frequencies >= low) & (frequencies < high)] = value
        for number, value in self.modes.items():
            if not 1 <= int(number) <= len(frequencies):
                raise ModelError(f"damping: modes: no mode {number}; there are {len(frequencies)} with the bases held")
            zeta[int(number) - 1] = value
        if np.isnan(zeta).any():
            k = int(np.flatnonzero(np.isnan(zeta))[0])
            raise ModelError(
                f"damping: mode {k + 1} at {frequencies[k]:.4g} Hz is in none of the bands and no ratio is given "
                "for all modes; give such a ratio, or a band that contains the mode"
            )
        return zeta

    @property
    def description(self) -> str:
        """Description of the damping."""
        if self.own:
            return "damping of the model itself"
        parts = (
            []
            if self.ratio is None
            else [f"{100 * self.ratio:g} % of critical (Q = {1 / (2 * self.ratio):.4g})" if self.ratio else "none"]
        )
        parts += [f"table of {len(self.table)} frequencies"] * bool(len(self.table))
        parts += [f"{len(self.bands)} bands"] * bool(len(self.bands))
        parts += [f"{len(self.modes)} modes by number"] * bool(self.modes)
        return ", ".join(parts)
