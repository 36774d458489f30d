"""Signals: measured channels over common times, each with its name and the unit given in the file."""

from dataclasses import dataclass, replace

import numpy as np

from fe_models.foundation.arrays import Array, frozen
from fe_models.foundation.records import frozen_copies
from fe_models.foundation.words import nearest, quoted
from floatframe.errors import SignalError
from floatframe.files.signals.signal_units import unit_factor

__all__ = ["Signal", "Signals", "equidistant_step"]

EVEN = 1e-3  #: largest deviation of times from equidistant ones, relative to the step (rounded times of a file)


def equidistant_step(time: Array) -> float | None:
    """Return the step of equidistant times (within 1e-3 of the step); None for other times."""
    if len(time) < 2:
        return None
    step = float(time[-1] - time[0]) / (len(time) - 1)
    even = time[0] + step * np.arange(len(time))
    return step if step > 0 and float(np.abs(time - even).max()) <= EVEN * step else None


@frozen_copies
@dataclass(frozen=True, eq=False)
class Signal:
    """One channel."""

    name: str
    time: Array  #: (n_t,) [s]
    values: Array  #: (n_t,) in `unit`
    unit: str  #: unit, "" if the file gives none
    notes: tuple[str, ...] = ()  #: processing since the measurement

    def __post_init__(self) -> None:
        time, values = np.array(self.time, dtype=float), np.array(self.values, dtype=float)
        if time.ndim != 1 or time.shape != values.shape or not len(time):
            raise SignalError(
                f"signal {self.name!r}: expected as many values as times, (n_t,), got shapes {time.shape} and "
                f"{values.shape}"
            )
        if not np.isfinite(time).all() or not np.isfinite(values).all() or (np.diff(time) <= 0).any():
            raise SignalError(f"signal {self.name!r}: expected finite numbers at rising times")
        object.__setattr__(self, "time", frozen(time))
        object.__setattr__(self, "values", frozen(values))
        object.__setattr__(self, "notes", tuple(self.notes))

    @property
    def step(self) -> float | None:
        """Step of the times [s]; None if they are not equidistant."""
        return equidistant_step(self.time)

    @property
    def rate(self) -> float:
        """Samples per second [Hz]; `SignalError` if the times are not equidistant."""
        step = self.step
        if step is None:
            dt = np.diff(self.time)
            raise SignalError(
                f"signal {self.name!r}: expected equidistant times, got steps from {dt.min(initial=np.inf):.6g} to "
                f"{dt.max(initial=0):.6g} s; resample it first (floatframe.files.signals.resampled)"
            )
        return 1.0 / step

    def to(self, unit: str) -> "Signal":
        """Return the signal in another unit; `SignalError` if its unit is unknown or measures another quantity."""
        factor = unit_factor(self.unit, unit, f"signal {self.name!r}")
        return replace(self, values=self.values * factor, unit=unit)


@frozen_copies
@dataclass(frozen=True, eq=False)
class Signals:
    """Channels over common times."""

    time: Array  #: (n_t,) [s]
    values: Array  #: (n_t, n_channels), each column in its unit
    names: tuple[str, ...]
    units: tuple[str, ...]  #: units in the file, "" if it gives none
    source: str = ""  #: path of the file
    notes: tuple[str, ...] = ()  #: findings and processing at reading

    def __post_init__(self) -> None:
        time, values = np.array(self.time, dtype=float), np.array(self.values, dtype=float)
        object.__setattr__(self, "names", tuple(self.names))
        object.__setattr__(self, "units", tuple(self.units))
        object.__setattr__(self, "notes", tuple(self.notes))
        n = len(self.names)
        if time.ndim != 1 or not len(time) or values.shape != (len(time), n) or len(self.units) != n:
            raise SignalError(
                f"signals: expected times (n_t,), values (n_t, {n}) and {n} units, got {time.shape}, {values.shape} "
                f"and {len(self.units)} units"
            )
        if not np.isfinite(time).all() or not np.isfinite(values).all() or (np.diff(time) <= 0).any():
            raise SignalError("signals: expected finite numbers at rising times")
        object.__setattr__(self, "time", frozen(time))
        object.__setattr__(self, "values", frozen(values))

    def __len__(self) -> int:
        return len(self.names)

    def __getitem__(self, channel: str | int) -> Signal:
        """Return a channel by its name, or by its number from 1.

        Raises
        ------
        SignalError
            If there is no such channel (the message has the nearest name), or several channels have the name.
        """
        where = f"{self.source or 'signals'}: channel"
        if isinstance(channel, int):
            if not 1 <= channel <= len(self.names):
                raise SignalError(f"{where} {channel}: expected a number of 1 to {len(self.names)}")
            k = channel - 1
        else:
            found = [k for k, name in enumerate(self.names) if name == channel]
            if not found:
                raise SignalError(f"{where} {quoted(channel)}: there is no such channel{nearest(channel, self.names)}")
            if len(found) > 1:
                numbers = " or ".join(str(k + 1) for k in found)
                raise SignalError(f"{where} {quoted(channel)}: several have this name; take the number, {numbers}")
            k = found[0]
        return Signal(self.names[k], self.time, self.values[:, k], self.units[k], self.notes)
