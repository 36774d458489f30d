"""Double integration of measured accelerations to motions, with removal of drift.

The acceleration a(t) is linear between samples (`floatframe.model.functions.tables.acceleration_table`). The removed
part is linear between the same samples, so that the integral remains exact.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.words import nearest, quoted
from floatframe.errors import SignalError
from floatframe.files.signals.resampling import filtered
from floatframe.files.signals.signal_units import parsed_unit
from floatframe.files.signals.signals import Signal
from floatframe.model.functions.tables import acceleration_table
from floatframe.model.functions.time_functions import TimeFunction

__all__ = ["DRIFTS", "integrated_twice", "without_drift"]

QUANTITIES = ("acceleration", "angular acceleration")


def as_measured(signal: Signal, corner: float | None) -> Array:
    """Remove nothing."""
    return np.array(signal.values)


def less_mean(signal: Signal, corner: float | None) -> Array:
    """Remove the mean over time, so that the final velocity equals the initial velocity."""
    t = signal.time
    gained = acceleration_table(t, signal.values).at(t[-1:], 1)[0]
    return signal.values - gained / (t[-1] - t[0])


def on_baseline(signal: Signal, corner: float | None) -> Array:
    """Remove c0 + c1 τ, with τ from 0 to 1 over the record, such that velocity and position end as they began.

    Over the duration T a correction changes the velocity by T (c0 + c1/2) and the position by T² (c0/2 + c1/6).
    """
    t = signal.time
    T = t[-1] - t[0]
    motion = acceleration_table(t, signal.values)
    gained = motion.at(t[-1:], 1)[0] / T, motion.at(t[-1:])[0] / T**2
    c = np.linalg.solve(np.array([[1.0, 1 / 2], [1 / 2, 1 / 6]]), np.array(gained))
    return signal.values - c[0] - c[1] * (t - t[0]) / T


def high_passed(signal: Signal, corner: float | None) -> Array:
    """Remove frequencies below a corner frequency (`filtered`)."""
    if corner is None:
        raise SignalError(f"signal {signal.name!r}: drift by high-pass: expected its corner frequency [Hz], got none")
    return np.array(filtered(signal, high_pass=corner).values)


DRIFTS: dict[str, Callable[[Signal, float | None], Array]] = {
    "none": as_measured,
    "mean": less_mean,
    "baseline": on_baseline,
    "high-pass": high_passed,
}


def without_drift(signal: Signal, drift: str, corner: float | None = None) -> Signal:
    """Return an acceleration without its drift, with a note on the removed part.

    Parameters
    ----------
    signal
        An acceleration.
    drift
        "none", "mean" (velocity ends as it began), "baseline" (straight line: velocity and position end as they began),
        "high-pass".
    corner
        Corner frequency of the high-pass [Hz].

    Raises
    ------
    SignalError
        If the signal is not an acceleration, or the method is unknown.
    """
    unit = parsed_unit(signal.unit)
    if unit is None or unit.quantity not in QUANTITIES:
        raise SignalError(
            f"signal {signal.name!r}: expected an acceleration to integrate twice, got the unit "
            f"{quoted(signal.unit)}{'' if unit is None else f' ({unit.quantity})'}"
        )
    if drift not in DRIFTS:
        raise SignalError(f"signal {signal.name!r}: drift {quoted(drift)}: unknown{nearest(drift, DRIFTS)}")
    if drift != "high-pass" and corner is not None:
        raise SignalError(f"signal {signal.name!r}: a corner frequency belongs to the drift 'high-pass', not {drift!r}")
    if len(signal.time) < 2:
        raise SignalError(f"signal {signal.name!r}: expected two or more samples to integrate")
    values = DRIFTS[drift](signal, corner)
    peak = float(np.abs(signal.values).max())
    off = float(np.abs(signal.values - values).max())
    note = f"drift {drift}: up to {off:.6g} {signal.unit} removed, {100 * off / peak if peak else 0:.3g} % of the peak"
    return replace(signal, values=values, notes=(*signal.notes, *(() if drift == "none" else (note,))))


def integrated_twice(
    signal: Signal, *, position: float = 0.0, velocity: float = 0.0, drift: str = "none", corner: float | None = None
) -> tuple[TimeFunction, tuple[str, ...]]:
    """Return the position whose acceleration is a signal, and notes on its end and on the removed drift.

    Parameters
    ----------
    signal
        Acceleration, in the unit of the position divided by s².
    position, velocity
        Position and velocity at the first sample.
    drift, corner
        As for `without_drift`.

    Returns
    -------
    TimeFunction
        Its second derivative is the signal without its drift, at the samples and linearly between them.
    """
    steady = without_drift(signal, drift, corner)
    motion = acceleration_table(steady.time, steady.values, position, velocity)
    end = steady.time[-1:]
    unit = steady.unit
    words = (
        f"integrated twice from {unit}: at its end, t = {end[0]:.6g} s, velocity {motion.at(end, 1)[0]:.6g} ({unit} s) "
        f"and position {motion.at(end)[0]:.6g} ({unit} s²)"
    )
    return motion, (*steady.notes, words)
