"""What sensors measured on a motion, as signals."""

from collections.abc import Sequence

import numpy as np

from fe_models.foundation.units import Units
from floatframe.errors import SignalError
from floatframe.files.signals.resampling import resampled
from floatframe.files.signals.signals import Signal, Signals, equidistant_step
from floatframe.results.sensors.measurement import Measurement

__all__ = ["even_signals", "signals_of"]

NO_SIGNALS = ("number in the mesh",)  #: units of columns that are no quantity over time


def signals_of(measurements: Sequence[Measurement], units: Units) -> Signals:
    """Return the columns of measurements as channels "sensor column"; times in seconds, values in units of the system.

    Raises
    ------
    SignalError
        If there is no column, or no time.
    """
    columns = [
        (one.sensor if one.sensor.endswith(f".{name}") else f"{one.sensor} {name}", one.columns[name], one.units[name])
        for one in measurements
        for name in one.columns
        if one.units[name] not in NO_SIGNALS
    ]
    if not columns or not len(measurements[0].t):
        raise SignalError("signals: no sensor has measured anything; name one, or a joint coordinate")
    names, values, words = zip(*columns, strict=True)
    return Signals(measurements[0].t * units.time, np.column_stack(values), names, words)


def even_signals(signals: Signals, rate: float | None = None) -> Signals:
    """Return channels at equidistant times: as they are, or resampled to a rate, by default that of their usual step.

    Rows that events put between the others are so left out, and steps that followed the motion made even; the notes
    say it.
    """
    if rate is None and equidistant_step(signals.time) is not None:
        return signals
    if len(signals.time) < 2:
        raise SignalError("signals: expected two or more times")
    rate = 1.0 / float(np.median(np.diff(signals.time))) if rate is None else rate
    parts: list[Signal] = []
    notes: list[str] = list(signals.notes)
    for k, name in enumerate(signals.names):
        part, _ = resampled(Signal(name, signals.time, signals.values[:, k], signals.units[k]), rate)
        parts.append(part)
        notes += [f"{name}: {note}" for note in part.notes]
    values = np.stack([part.values for part in parts], axis=1)
    return Signals(parts[0].time, values, signals.names, signals.units, signals.source, tuple(notes))
