"""Spectra of channels by the name of their kind: what `floatframe plot --as` and `floatframe spectrum` make."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.words import nearest, quoted
from floatframe.errors import SignalError
from floatframe.files.signals.octaves import octave_levels
from floatframe.files.signals.orders import SpectralMap, angle_of_speed, frequency_map, order_map
from floatframe.files.signals.signal_units import signal_unit
from floatframe.files.signals.signals import Signal, Signals
from floatframe.files.signals.spectra import Spectrum, amplitude_spectrum, psd
from floatframe.files.signals.transfer import TransferEstimate, transfer_estimate

__all__ = ["SPECTRA", "SpectrumRequest", "spectra_of"]


@dataclass(frozen=True)
class SpectrumRequest:
    """What is asked of spectra; None: the default of the kind."""

    window: str = "hann"
    resolution: float | None = None  #: distance of lines [Hz]; of orders [-]
    is_rms: bool = False
    rotation: Signal | None = None  #: angle or speed of the rotation, for orders and over waterfalls
    input: Signal | None = None  #: of a response
    max_order: float = 10.0


def segment(signal: Signal, request: SpectrumRequest) -> int | None:
    """Return the samples of a segment for the resolution asked for."""
    if request.resolution is None:
        return None
    if not (np.isfinite(request.resolution) and request.resolution > 0):
        raise SignalError(f"resolution = {request.resolution!r}: expected a number above 0")
    return round(signal.rate / request.resolution)


def as_psd(signal: Signal, request: SpectrumRequest) -> Spectrum:
    """Power spectral density."""
    return psd(
        signal.values, signal.rate, window=request.window, n_segment=segment(signal, request), unit=signal.unit,
        name=signal.name,
    )  # fmt: skip


def as_amplitude(signal: Signal, request: SpectrumRequest) -> Spectrum:
    """Amplitudes of lines."""
    return amplitude_spectrum(
        signal.values, signal.rate, is_rms=request.is_rms, window=request.window, n_segment=segment(signal, request),
        unit=signal.unit, name=signal.name,
    )  # fmt: skip


def as_orders(signal: Signal, request: SpectrumRequest) -> SpectralMap:
    """Amplitudes over orders."""
    _, angle = rotation_of(signal, request.rotation)
    return order_map(
        signal, angle, max_order=request.max_order, resolution=request.resolution or 0.25, window=request.window,
        is_rms=request.is_rms,
    )  # fmt: skip


def as_waterfall(signal: Signal, request: SpectrumRequest) -> SpectralMap:
    """Amplitudes over frequencies and time, or speed."""
    speed = None if request.rotation is None else rotation_of(signal, request.rotation)[0]
    return frequency_map(
        signal, speed, n_segment=segment(signal, request), window=request.window, is_rms=request.is_rms
    )


def as_response(signal: Signal, request: SpectrumRequest) -> TransferEstimate:
    """Frequency response to the input, and coherence."""
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
    """Return speed [rad/s] and angle [rad] of a rotation; its unit says which of them is known."""
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
        If the kind is unknown, or a channel does not bear it.
    """
    if kind not in SPECTRA:
        raise SignalError(f"spectrum {quoted(kind)}: unknown{nearest(kind, SPECTRA)}")
    return [SPECTRA[kind](signals[k + 1], request) for k in range(len(signals))]  # type: ignore[return-value]
