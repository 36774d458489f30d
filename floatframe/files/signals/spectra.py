"""Spectra of sampled signals: power spectral density (Welch) and amplitudes, with the corrections of the windows named.

A window w_j of n samples, with the sums S1 = Σ w_j and S2 = Σ w_j², multiplies a line by its coherent gain S1/n and
noise power by its noise bandwidth n S2/S1² [lines]. With the transform X_k of the samples times the window and the rate
f_s, both one-sided (twice the power of lines between 0 and f_s/2):

(1) density        G_k = 2 |X_k|² / (f_s S2)       its sum times the resolution is the mean square (Parseval)
(2) mean square    P_k = 2 |X_k|² / S1²            of a line on the resolution: amplitude √(2 P_k), rms √P_k

averaged over segments that overlap (Welch (1967)).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array, frozen
from fe_models.foundation.records import frozen_copies
from fe_models.foundation.words import nearest, quoted
from floatframe.errors import SignalError
from floatframe.files.signals.signal_units import per_hertz

__all__ = ["WINDOWS", "Spectrum", "WindowCorrections", "amplitude_spectrum", "psd", "window_corrections"]

WINDOWS = {
    "hann": "hann",
    "hamming": "hamming",
    "blackman": "blackman",
    "blackman-harris": "blackmanharris",
    "flattop": "flattop",
    "rectangular": "boxcar",
}  #: by their names in scipy.signal
DETRENDS = ("constant", "linear", "none")
AVERAGES = 8  #: number of segments of a density, unless a length is given
LEAST_SAMPLES = 8  #: smallest number of samples of a segment


@frozen_copies
@dataclass(frozen=True, eq=False)
class Spectrum:
    """Values over frequencies."""

    kind: str  #: "power spectral density", "amplitude (peak)", "amplitude (rms)", "octave (rms)", ...
    name: str  #: name of the signal
    frequencies: Array  #: (n_f,) [Hz]; midband frequencies of bands
    values: Array  #: (n_f,) in `unit`
    unit: str
    signal_unit: str
    resolution: float  #: spacing of lines [Hz]
    n_averages: int  #: number of segments
    notes: tuple[str, ...] = ()
    edges: Array | None = None  #: edges of bands, (n_f, 2) [Hz]

    def __post_init__(self) -> None:
        for key in ("frequencies", "values") + (() if self.edges is None else ("edges",)):
            object.__setattr__(self, key, frozen(np.array(getattr(self, key), dtype=float)))
        object.__setattr__(self, "notes", tuple(self.notes))

    @property
    def mean_square(self) -> float:
        """Mean square of the signal without its mean: the integral of a density, or the sum of squares of bands."""
        if self.edges is not None:
            return float(np.sum(self.values**2))
        if self.kind != "power spectral density":
            raise SignalError(f"spectrum of {self.name!r}: {self.kind} has no mean square; take psd")
        return float(np.sum(self.values) * self.resolution)


@dataclass(frozen=True)
class WindowCorrections:
    """The effect of a window on lines and on noise."""

    coherent_gain: float  #: factor of the window on a line, which is divided out
    noise_bandwidth: float  #: noise bandwidth in lines
    scalloping: float  #: smallest fraction shown of a line half-way between two lines of the resolution


def window_samples(window: str, n: int) -> Array:
    """Return the periodic window of n samples; `SignalError` for an unknown name."""
    from scipy.signal import get_window

    if window not in WINDOWS:
        raise SignalError(f"window {quoted(window)}: there is none of this name{nearest(window, WINDOWS)}")
    return get_window(WINDOWS[window], n, fftbins=True)


def window_corrections(window: str, n: int = 1024) -> WindowCorrections:
    """Return coherent gain, noise bandwidth and scalloping of a window of n samples."""
    w = window_samples(window, n)
    half_way = np.abs(np.sum(w * np.exp(-1j * np.pi * np.arange(n) / n))) / w.sum()
    return WindowCorrections(float(w.mean()), float(n * (w @ w) / w.sum() ** 2), float(half_way))


def segment_length(n_t: int, n_segment: int | None, overlap: float, averages: int, where: str) -> int:
    """Return the number of samples of a segment: as requested, or for a number of segments in the record."""
    if not 0 <= overlap < 1:
        raise SignalError(f"{where}: overlap = {overlap:g}: expected a number from 0 to below 1")
    n = n_segment if n_segment is not None else int(n_t / (1 + (averages - 1) * (1 - overlap)))
    while n_segment is None and n > LEAST_SAMPLES and number_of_segments(n_t, n, overlap) < averages:
        n -= 1  # an odd segment overlaps by half a sample less
    if not LEAST_SAMPLES <= n <= n_t:
        raise SignalError(
            f"{where}: a segment of {n} samples: expected {LEAST_SAMPLES} up to the {n_t} samples of the record; take "
            "another resolution, or a longer record"
        )
    return n


def checked_samples(values: Array, rate: float, detrend: str, where: str) -> Array:
    """Return samples as an array; `SignalError` unless they are finite and the rate is above zero."""
    values = np.array(values, dtype=float)
    if values.ndim != 1 or len(values) < LEAST_SAMPLES or not np.isfinite(values).all():
        raise SignalError(f"{where}: expected {LEAST_SAMPLES} or more finite samples, (n_t,), got shape {values.shape}")
    if not (np.isfinite(rate) and rate > 0):
        raise SignalError(f"{where}: rate = {rate!r}: expected a number above 0 [Hz]")
    if detrend not in DETRENDS:
        raise SignalError(f"{where}: detrend {quoted(detrend)}: expected one of {', '.join(DETRENDS)}")
    return values


def squared(values: Array, rate: float, where: str, **options: Any) -> tuple[Array, Array]:
    """Return frequencies and lines by Welch's method; `SignalError` if squares of the samples overflow."""
    from scipy.signal import welch

    with np.errstate(over="ignore", invalid="ignore"):
        f, lines = welch(values, rate, **options)
    if not np.isfinite(lines).all():
        raise SignalError(
            f"{where}: samples of up to {np.abs(values).max():.3g} are too large to be squared; check their unit"
        )
    return f, lines


def psd(
    values: Array,
    rate: float,
    *,
    window: str = "hann",
    n_segment: int | None = None,
    overlap: float = 0.5,
    detrend: str = "constant",
    unit: str = "",
    name: str = "signal",
) -> Spectrum:
    """Return the one-sided power spectral density of samples (Welch), equation (1) of this module.

    Parameters
    ----------
    values
        Samples, (n_t,) in `unit`.
    rate
        Samples per second [Hz].
    window
        One of `WINDOWS`.
    n_segment
        Number of samples of a segment; default: such that there are eight segments.
    overlap
        Fraction of a segment that it shares with the next one.
    detrend
        Part that is removed from each segment: "constant" (its mean), "linear" (its straight line) or "none".
    unit, name
        Unit and name of the signal.

    Returns
    -------
    Spectrum
        Values in unit²/Hz.

    Raises
    ------
    SignalError
        If an argument is impossible.

    References
    ----------
    Welch (1967).
    """
    where = f"psd of {name!r}"
    values = checked_samples(values, rate, detrend, where)
    n = segment_length(len(values), n_segment, overlap, AVERAGES, where)
    f, G = squared(
        values, rate, where, window=window_samples(window, n), nperseg=n, noverlap=int(overlap * n),
        detrend=False if detrend == "none" else detrend, scaling="density",
    )  # fmt: skip
    n_averages = number_of_segments(len(values), n, overlap)
    return Spectrum(
        "power spectral density", name, f, G, per_hertz(unit), unit, rate / n, n_averages, (f"window {window}",)
    )


def amplitude_spectrum(
    values: Array,
    rate: float,
    *,
    is_rms: bool = False,
    window: str = "hann",
    n_segment: int | None = None,
    overlap: float = 0.5,
    detrend: str = "constant",
    unit: str = "",
    name: str = "signal",
) -> Spectrum:
    """Return amplitudes of lines, equation (2) of this module: peak values A of A sin(2 pi f t), or rms values A/√2.

    A line between two multiples of the resolution appears too small by the scalloping of the window (hann 15 %, flattop
    0.1 %, rectangular 36 %); see `window_corrections`. Parameters are those of `psd`; by default there is one segment,
    the whole record. Several segments are averaged in power. Broad-band noise has no amplitude, because its lines
    depend on the resolution; use `psd`.
    """
    where = f"amplitude spectrum of {name!r}"
    values = checked_samples(values, rate, detrend, where)
    n = segment_length(len(values), n_segment, overlap, 1, where)
    f, P = squared(
        values, rate, where, window=window_samples(window, n), nperseg=n, noverlap=int(overlap * n),
        detrend=False if detrend == "none" else detrend, scaling="spectrum",
    )  # fmt: skip
    rms = np.sqrt(P)
    is_paired = np.ones(len(f), dtype=bool)  # paired with its line of negative frequency
    is_paired[0] = False
    if n % 2 == 0:
        is_paired[-1] = False
    amplitudes = rms if is_rms else np.where(is_paired, np.sqrt(2.0), 1.0) * rms
    c = window_corrections(window, n)
    notes = (f"window {window}, coherent gain {c.coherent_gain:.4g}, noise bandwidth {c.noise_bandwidth:.4g} lines",)
    kind = f"amplitude ({'rms' if is_rms else 'peak'})"
    return Spectrum(kind, name, f, amplitudes, unit, unit, rate / n, number_of_segments(len(values), n, overlap), notes)


def number_of_segments(n_t: int, n: int, overlap: float) -> int:
    """Return the number of segments of n samples in a record."""
    return 1 + (n_t - n) // max(n - int(overlap * n), 1)
