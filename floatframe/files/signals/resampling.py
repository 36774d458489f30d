"""Resampling and filtering of signals, and their effect on accelerations."""

from dataclasses import dataclass, replace

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.errors import SignalError
from floatframe.files.signals.signal_units import parsed_unit
from floatframe.files.signals.signals import Signal
from floatframe.files.signals.spectra import psd
from floatframe.model.functions.tables import monotone_table, quintic_table

__all__ = ["ResamplingReport", "accelerations", "filtered", "resampled"]

STOP = 80.0  #: attenuation of the anti-aliasing filter above the new Nyquist frequency [dB]
PASS = 0.8  #: upper end of its pass band, relative to the new Nyquist frequency
ORDER = 4  #: order of the Butterworth filters, which run forward and backward
MOST_SAMPLES = 5e7
#: order of the derivative that is an acceleration
ORDERS = {"length": 2, "angle": 2, "velocity": 1, "angular velocity": 1}


@dataclass(frozen=True)
class ResamplingReport:
    """Effect of resampling on the acceleration of a signal, or on the signal itself if it is not a motion."""

    of: str  #: "acceleration", or the quantity of the signal
    rate_before: float  #: rate before [Hz]; for unequal times, the mean rate
    rate_after: float
    peak_before: float  #: largest magnitude at the samples [unit of the signal, or of its first or second rate]
    peak_after: float
    rms_before: float
    rms_after: float
    above_nyquist: float  #: fraction of the mean square (without the mean) above half the new rate

    @property
    def description(self) -> str:
        """One line of text."""
        change = [100 * (b - a) / a if a else 0.0 for a, b in ((self.peak_before, self.peak_after),
                                                                (self.rms_before, self.rms_after))]  # fmt: skip
        return (
            f"resampled from {self.rate_before:.6g} to {self.rate_after:.6g} Hz: peak {self.of} {change[0]:+.3g} %, "
            f"rms {change[1]:+.3g} %, {100 * self.above_nyquist:.3g} % of its mean square lay above "
            f"{self.rate_after / 2:.6g} Hz"
        )


def accelerations(signal: Signal) -> tuple[Array, str]:
    """Return the acceleration of a motion at its samples, and its name; other signals are unchanged.

    Positions, angles and velocities are differentiated along a quintic spline.
    """
    unit = parsed_unit(signal.unit)
    quantity = "signal" if unit is None or unit.quantity == "other" else unit.quantity
    order = ORDERS.get(quantity, 0)
    if not order or len(signal.time) < 6:
        return np.array(signal.values), quantity
    curve = quintic_table(signal.time, signal.values)
    times = np.array(signal.time)
    times[-1] = np.nextafter(times[-1], -np.inf)  # before the end, beyond which the spline continues as a tangent
    return curve.at(times, order), "acceleration"


def resampled(signal: Signal, rate: float, *, anti_alias: bool = True) -> tuple[Signal, ResamplingReport]:
    """Return a signal at another rate, and the effect on its acceleration.

    1. Uneven times are first made equidistant along the monotone cubic, at their mean rate or at the new rate if that
       is higher.
    2. If the rate decreases, a symmetric (zero-phase) low-pass passes frequencies up to 0.8 of the new Nyquist
       frequency and attenuates those above the Nyquist frequency by 80 dB.
    3. New samples are taken from the quintic spline, or are every n-th old sample if the ratio n of the rates is whole.

    Parameters
    ----------
    signal
        Any signal.
    rate
        New number of samples per second [Hz]; the first sample keeps its time.
    anti_alias
        False: step 2 is skipped, and frequencies above the new Nyquist frequency are aliased.

    Raises
    ------
    SignalError
        If the rate is impossible.
    """
    length = float(signal.time[-1] - signal.time[0])
    if not (np.isfinite(rate) and 0 < rate * length <= MOST_SAMPLES):
        raise SignalError(
            f"signal {signal.name!r}: resample = {rate!r} Hz: expected a rate above 0 that makes up to "
            f"{MOST_SAMPLES:.0e} samples of {length:g} s"
        )
    given = signal
    notes = []
    if signal.step is None:
        mean = (len(signal.time) - 1) / length
        n_even = int(np.ceil(length * max(mean, rate) - 1e-9)) + 1
        even = np.linspace(signal.time[0], signal.time[-1], n_even)
        curve = monotone_table(signal.time, signal.values)
        signal = replace(signal, time=even, values=np.append(curve.at(even[:-1]), signal.values[-1]))
        notes.append(f"uneven times, {np.diff(given.time).min():.6g} to {np.diff(given.time).max():.6g} s, made even "
                     "along the monotone cubic")  # fmt: skip
    old = signal.rate
    values = signal.values
    if rate < old * (1 - 1e-9) and anti_alias:
        values = low_passed(values, old, rate)
    n_new = int(np.floor(length * rate * (1 + 1e-12) + 1e-9)) + 1
    times = signal.time[0] + np.arange(n_new) / rate
    every = round(old / rate)
    if every >= 1 and abs(old / rate - every) < 1e-9 * every:
        new_values = values[::every][:n_new]
    elif len(values) >= 6:
        curve = quintic_table(signal.time, values)
        new_values = curve.at(times)
    else:
        new_values = np.interp(times, signal.time, values)
    result = Signal(signal.name, times[: len(new_values)], new_values, signal.unit, (*signal.notes, *notes))
    report = compared(given, result, rate)
    return replace(result, notes=(*result.notes, report.description)), report


def low_passed(values: Array, old: float, new: float) -> Array:
    """Return samples without frequencies above half a new rate, by a symmetric filter, odd about both ends."""
    from scipy.signal import fftconvolve, firwin, kaiserord

    n_taps, beta = kaiserord(STOP, (1 - PASS) * new / old)
    n_taps += 1 - n_taps % 2
    taps = firwin(n_taps, (1 + PASS) / 2 * new / old, window=("kaiser", beta))
    half = n_taps // 2
    index = np.arange(-half, len(values) + half)
    last = len(values) - 1
    padded = values[np.clip(index, 0, last)]
    before, after = index < 0, index > last
    padded[before] = 2 * values[0] - values[np.clip(-index[before], 0, last)]
    padded[after] = 2 * values[-1] - values[np.clip(2 * last - index[after], 0, last)]
    return fftconvolve(padded, taps, mode="valid")


def compared(before: Signal, after: Signal, rate: float) -> ResamplingReport:
    """Return the change of the acceleration."""
    a, what = accelerations(before)
    b, _ = accelerations(after)
    old = (len(before.time) - 1) / float(before.time[-1] - before.time[0])
    even = a if before.step is not None else np.interp(
        np.linspace(before.time[0], before.time[-1], len(a)), before.time, a
    )  # fmt: skip
    part = 0.0
    if rate < old and len(even) >= 8 and np.ptp(even) > 0:
        density = psd(even, old, n_segment=len(even))
        above = density.frequencies > rate / 2
        total = float(density.values.sum())
        part = float(density.values[above].sum()) / total if total else 0.0
    sizes = [(float(np.abs(x).max()), float(np.sqrt(np.mean(x**2)))) for x in (a, b)]
    return ResamplingReport(what, old, rate, sizes[0][0], sizes[1][0], sizes[0][1], sizes[1][1], part)


def filtered(signal: Signal, *, low_pass: float | None = None, high_pass: float | None = None) -> Signal:
    """Return a signal without frequencies above `low_pass` or below `high_pass` [Hz], without phase shift.

    Butterworth filters of order 4, forward and backward: half the amplitude at the corner.

    Raises
    ------
    SignalError
        If times are not equidistant, a corner does not lie between 0 and half the rate, or the record is too short.
    """
    from scipy.signal import butter, sosfiltfilt

    rate, values, notes = signal.rate, np.array(signal.values), list(signal.notes)
    for corner, kind in ((high_pass, "highpass"), (low_pass, "lowpass")):
        if corner is None:
            continue
        where = f"signal {signal.name!r}: {kind[:-4]}_pass = {corner!r} Hz"
        if not (np.isfinite(corner) and 0 < corner < rate / 2):
            raise SignalError(f"{where}: expected a frequency above 0 and below half the rate, {rate / 2:g} Hz")
        sos = butter(ORDER, corner, kind, fs=rate, output="sos")
        n_pad = min(len(values) - 1, int(3 * rate / corner) + 1)
        if len(values) < 6 * (ORDER + 1):
            raise SignalError(f"{where}: a record of {len(values)} samples is too short for the filter")
        values = sosfiltfilt(sos, values, padtype="odd", padlen=n_pad)
        notes.append(f"{kind[:-4]}-pass at {corner:g} Hz, Butterworth of order {ORDER} forward and backward")
    return replace(signal, values=values, notes=tuple(notes))
