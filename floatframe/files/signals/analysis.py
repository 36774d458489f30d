"""Spectra of channels by kind, for `floatframe plot --as` and `floatframe spectrum`."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.documents.table import Table
from fe_models.foundation.units import Units
from fe_models.foundation.words import nearest, quoted
from floatframe.errors import SignalError
from floatframe.files.signals.octaves import octave_levels
from floatframe.files.signals.orders import SpectralMap, angle_of_speed, frequency_map, order_map
from floatframe.files.signals.resampling import resampled
from floatframe.files.signals.signal_units import signal_unit
from floatframe.files.signals.signals import Signal, Signals, equidistant_step
from floatframe.files.signals.spectra import Spectrum, amplitude_spectrum, psd
from floatframe.files.signals.transfer import TransferEstimate, transfer_estimate
from floatframe.results.sensors.measurement import Measurement

__all__ = [
    "SPECTRA", "SpectrumRequest", "even_signals", "signals_of", "spectra_of", "spectral_table",
]  # fmt: skip


# spectra as tables and records for other programs ---------------------------------------------------------------------


AnySpectrum = Spectrum | SpectralMap | TransferEstimate


def spectral_table(spectra: Sequence[AnySpectrum]) -> Table:
    """Return spectra as a table: side by side over common frequencies, maps one below the other.

    `meta["spectra"]` states of each how it was computed.
    """
    first = spectra[0]
    meta = {"spectra": [settings_of(each) for each in spectra]}
    if isinstance(first, SpectralMap):
        line, size = "order" if first.kind == "order" else "frequency", "rms" if first.is_rms else "peak"
        rows = []
        for each in spectra:
            assert isinstance(each, SpectralMap)  # all spectra have the kind of the first
            speeds = [None] * len(each.times) if each.speeds is None else each.speeds.tolist()
            for t, speed, row in zip(each.times.tolist(), speeds, each.amplitudes.tolist(), strict=True):
                rows += [(each.name, t, speed, x, a, each.unit) for x, a in zip(each.lines.tolist(), row, strict=True)]
        names = ("name", "time", "speed", line, f"amplitude ({size})", "unit")
        units = {"time": "s", "speed": "rad/s"} | ({} if line == "order" else {line: "Hz"})
        return Table.of_rows(names, rows, units, meta)
    columns: dict[str, Array] = {"frequency": first.frequencies}
    if isinstance(first, Spectrum) and first.edges is not None:
        columns |= {"from": first.edges[:, 0], "to": first.edges[:, 1]}
    units = dict.fromkeys(columns, "Hz")
    for each in spectra:
        if isinstance(each, TransferEstimate):
            name = f"{each.output} / {each.input}"
            for word, H in (("H1", each.H1), ("H2", each.H2)):
                columns |= {f"{name} {word}": np.abs(H), f"{name} {word} phase": np.angle(H, deg=True)}
                units |= {f"{name} {word}": each.unit, f"{name} {word} phase": "degrees"}
            columns[f"{name} coherence"] = each.coherence
        elif isinstance(each, Spectrum):
            columns[f"{each.name} {each.kind}"] = each.values
            units[f"{each.name} {each.kind}"] = each.unit
    if len({len(values) for values in columns.values()}) != 1:
        raise SignalError("spectra over different frequencies do not fit into one table; write them separately")
    return Table(columns, units, meta)


def settings_of(spectrum: AnySpectrum) -> dict[str, Any]:
    """Return how a spectrum was computed: its fields that are no arrays, in plain types."""
    return {key: plain(value) for key, value in vars(spectrum).items() if not isinstance(value, np.ndarray)}


def plain(value: Any) -> Any:
    """Return nested lists for arrays."""
    if isinstance(value, np.ndarray):
        if np.iscomplexobj(value):
            return {"real": plain(value.real), "imaginary": plain(value.imag)}
        whole = value.astype(object)
        whole[~np.isfinite(value)] = None
        return whole.tolist()
    return list(value) if isinstance(value, tuple) else value


# measurements of sensors during a motion, as signals -----------------------------------------------------------------


def signals_of(measurements: Sequence[Measurement], units: Units) -> Signals:
    """Return the measured quantities as channels "sensor column"; times in seconds, values in units of the system.

    Raises
    ------
    SignalError
        If there is no column, or no time.
    """
    columns = [
        (one.channel(name), values, one.units[name]) for one in measurements for name, values in one.quantities.items()
    ]
    if not columns or not len(measurements[0].t):
        raise SignalError("signals: expected a measurement, got none; name a sensor or a joint coordinate")
    names, values, words = zip(*columns, strict=True)
    return Signals(measurements[0].t * units.time, np.column_stack(values), names, words)


def even_signals(signals: Signals, rate: float | None = None) -> Signals:
    """Return channels at equidistant times, unchanged or resampled to a rate; default: the rate of the usual step.

    This removes rows that events added between the others, and makes steps of a step-size control equal, with a note.
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


# analysis -------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class SpectrumRequest:
    """Options of spectra; None: the default of the kind."""

    window: str = "hann"
    resolution: float | None = None  #: spacing of lines [Hz], or of orders [-]
    is_rms: bool = False
    rotation: Signal | None = None  #: angle or speed of the rotation, for orders and for waterfalls over speed
    input: Signal | None = None  #: input signal of a frequency response
    max_order: float = 10.0


def segment(signal: Signal, request: SpectrumRequest) -> int | None:
    """Return the number of samples of a segment for the requested resolution."""
    if request.resolution is None:
        return None
    if not (np.isfinite(request.resolution) and request.resolution > 0):
        raise SignalError(f"resolution = {request.resolution!r}: expected a number above 0")
    return round(signal.rate / request.resolution)


def as_psd(signal: Signal, request: SpectrumRequest) -> Spectrum:
    """Return the power spectral density."""
    return psd(
        signal.values, signal.rate, window=request.window, n_segment=segment(signal, request), unit=signal.unit,
        name=signal.name,
    )  # fmt: skip


def as_amplitude(signal: Signal, request: SpectrumRequest) -> Spectrum:
    """Return amplitudes of lines."""
    return amplitude_spectrum(
        signal.values, signal.rate, is_rms=request.is_rms, window=request.window, n_segment=segment(signal, request),
        unit=signal.unit, name=signal.name,
    )  # fmt: skip


def as_orders(signal: Signal, request: SpectrumRequest) -> SpectralMap:
    """Return amplitudes over orders."""
    _, angle = rotation_of(signal, request.rotation)
    return order_map(
        signal, angle, max_order=request.max_order, resolution=request.resolution or 0.25, window=request.window,
        is_rms=request.is_rms,
    )  # fmt: skip


def as_waterfall(signal: Signal, request: SpectrumRequest) -> SpectralMap:
    """Return amplitudes over frequencies, and over time or speed."""
    speed = None if request.rotation is None else rotation_of(signal, request.rotation)[0]
    return frequency_map(
        signal, speed, n_segment=segment(signal, request), window=request.window, is_rms=request.is_rms
    )


def as_response(signal: Signal, request: SpectrumRequest) -> TransferEstimate:
    """Return the frequency response to the input, and the coherence."""
    if request.input is None:
        raise SignalError("response: expected the sensor that is its input (--input)")
    return transfer_estimate(
        request.input.values, signal.values, signal.rate, window=request.window, n_segment=segment(signal, request),
        names=(request.input.name, signal.name), units=(request.input.unit, signal.unit),
    )  # fmt: skip


SPECTRA: dict[str, Callable[[Signal, SpectrumRequest], Spectrum | SpectralMap | TransferEstimate]] = {
    "psd": as_psd,
    "amplitude": as_amplitude,
    "octave": lambda signal, request: octave_levels(as_psd(signal, request), 1),
    "third-octave": lambda signal, request: octave_levels(as_psd(signal, request), 3),
    "orders": as_orders,
    "waterfall": as_waterfall,
    "response": as_response,
}


def rotation_of(signal: Signal, rotation: Signal | None) -> tuple[Array, Array]:
    """Return speed [rad/s] and angle [rad] of a rotation, which is given by one of them, depending on its unit."""
    if rotation is None:
        raise SignalError("orders: expected the channel with the angle or the speed of the rotation (--rotation)")
    unit = signal_unit(rotation.unit, f"rotation {quoted(rotation.name)}")
    values = rotation.values * unit.factor
    if unit.quantity == "angle":
        return np.gradient(values, rotation.time), values
    if unit.quantity in ("angular velocity", "frequency"):
        speed = values * (1.0 if unit.quantity == "angular velocity" else 2 * np.pi)
        return speed, angle_of_speed(rotation.time, speed)
    raise SignalError(
        f"rotation {quoted(rotation.name)}: expected an angle (rad, deg) or speed (rad/s, rpm, Hz), got {rotation.unit}"
    )


def spectra_of(
    signals: Signals, kind: str, request: SpectrumRequest
) -> list[Spectrum] | list[SpectralMap] | list[TransferEstimate]:
    """Return the spectra of all channels.

    Raises
    ------
    SignalError
        If the kind is unknown, or a channel does not support it.
    """
    if kind not in SPECTRA:
        raise SignalError(f"spectrum {quoted(kind)}: unknown{nearest(kind, SPECTRA)}")
    return [SPECTRA[kind](signals[k + 1], request) for k in range(len(signals))]  # type: ignore[return-value]
