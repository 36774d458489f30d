"""Measured and computed signals: files, units, gaps, resampling, spectra, orders (docs/signals.md)."""

from floatframe.files.signals.drift import DRIFTS, integrated_twice, without_drift
from floatframe.files.signals.octaves import band_edges, octave_levels
from floatframe.files.signals.orders import SpectralMap, angle_of_speed, frequency_map, order_cut, order_map
from floatframe.files.signals.read_signals import SIGNAL_FORMATS, read_signals
from floatframe.files.signals.resampling import ResamplingReport, filtered, resampled
from floatframe.files.signals.rpc_file import read_rpc, write_rpc
from floatframe.files.signals.signal_units import unit_factor
from floatframe.files.signals.signals import Signal, Signals
from floatframe.files.signals.spectra import WINDOWS, Spectrum, amplitude_spectrum, psd, window_corrections
from floatframe.files.signals.transfer import TransferEstimate, transfer_estimate

__all__ = [
    "DRIFTS",
    "SIGNAL_FORMATS",
    "WINDOWS",
    "ResamplingReport",
    "Signal",
    "Signals",
    "SpectralMap",
    "Spectrum",
    "TransferEstimate",
    "amplitude_spectrum",
    "angle_of_speed",
    "band_edges",
    "filtered",
    "frequency_map",
    "integrated_twice",
    "octave_levels",
    "order_cut",
    "order_map",
    "psd",
    "read_rpc",
    "read_signals",
    "resampled",
    "transfer_estimate",
    "unit_factor",
    "window_corrections",
    "without_drift",
    "write_rpc",
]
