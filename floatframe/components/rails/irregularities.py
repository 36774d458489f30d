"""Irregularities of the rails: tables over the arc length, random ones from a spectrum, a short defect.

There are four signals as functions of the arc length: lateral (to the left) and vertical (upward) deviations of the
left and of the right rail. Spectra are one-sided over the angular wavenumber Omega [rad/m]: the variance is the
integral over Omega > 0.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.records import frozen_copies
from floatframe.errors import ModelError
from floatframe.model.checked_values import number

__all__ = ["SPECTRA", "Irregularities", "TrackSpectrum", "random_irregularities", "wheel_envelope"]

HALF_BASE = 0.75  #: half the distance between the rails, which converts cross level to roll [m]
MOST = 0.2  #: largest deviation of a rail [m]


@dataclass(frozen=True)
class TrackSpectrum:
    """Spectra of alignment (lateral), profile (vertical) and cross level (roll), rational functions of W².

    S_lateral = A_l W_c² / D(W), S_vertical = A_v W_c² / D(W), D = (W² + W_r²)(W² + W_c²), [m²/(rad/m)];
    S_roll = roll_factor A_v W_c² W²/(D (W² + W_s²)) with W_r in D, [rad²/(rad/m)].
    """

    lateral: float  #: amplitude A_l of alignment [m rad]
    vertical: float  #: amplitude A_v of profile [m rad]
    w_c: float  #: cut-off wavenumber W_c [rad/m]
    w_r: float  #: cut-off wavenumber W_r of long waves [rad/m]; 0: none
    w_s: float  #: cut-off wavenumber W_s of cross level [rad/m]
    roll_factor: float  #: factor 1/b² of roll, with half base b [1/m²]

    def densities(self, W: Array) -> tuple[Array, Array, Array]:
        """Return the spectral densities of alignment, profile and roll at wavenumber W [rad/m]."""
        common = self.w_c**2 / ((W**2 + self.w_r**2) * (W**2 + self.w_c**2))
        return (
            self.lateral * common,
            self.vertical * common,
            self.roll_factor * self.vertical * common * W**2 / (W**2 + self.w_s**2),
        )


def fra(vertical: float, lateral: float, w_s: float) -> TrackSpectrum:
    """Return the spectrum of an FRA class, from numbers in cm² rad/m; S = 0.25 A W_c²/(W² (W² + W_c²)).

    The cross level, 4 · 0.25 A_v W_c²/((W² + W_c²)(W² + W_s²)) cm²/(rad/m), is the difference in height of the two
    rails over 1.5 m. Divided by (1.5 m)², it is the spectrum of the roll.
    """
    return TrackSpectrum(0.25e-4 * lateral, 0.25e-4 * vertical, 0.8245, 0.0, w_s, 4 / (2 * HALF_BASE) ** 2)


#: spectra by name: ERRI B176 (low and high disturbance), FRA classes 1 (worst) to 6
SPECTRA = {
    "erri-low": TrackSpectrum(2.119e-7, 4.032e-7, 0.8246, 0.0206, 0.4380, 1 / HALF_BASE**2),
    "erri-high": TrackSpectrum(6.125e-7, 1.080e-6, 0.8246, 0.0206, 0.4380, 1 / HALF_BASE**2),
    "fra-1": fra(1.2107, 3.3634, 0.6046),
    "fra-2": fra(1.0181, 1.2107, 0.9308),
    "fra-3": fra(0.6816, 0.4128, 0.8520),
    "fra-4": fra(0.5376, 0.3027, 1.1312),
    "fra-5": fra(0.2095, 0.0762, 0.8209),
    "fra-6": fra(0.0339, 0.0339, 0.4380),
}


@frozen_copies
@dataclass(frozen=True, eq=False)
class Irregularities:
    """Deviations of the two rails at equally spaced positions; zero before the first and after the last.

    Raises
    ------
    ModelError
        If lengths differ, positions are not equally spaced, or a deviation seems to be in millimetres.
    """

    s: Array  #: equally spaced arc lengths, (n,) [m]
    left_y: Array  #: lateral deviation of the left rail, positive to the left [m]
    left_z: Array  #: vertical deviation of the left rail, positive upwards [m]
    right_y: Array
    right_z: Array

    def __post_init__(self) -> None:
        values = {}
        for name in ("s", "left_y", "left_z", "right_y", "right_z"):
            try:
                values[name] = np.array(getattr(self, name), dtype=float)
            except (TypeError, ValueError):
                raise ModelError(f"irregularities: {name}: expected numbers") from None
            if values[name].ndim != 1 or values[name].shape != values["s"].shape or len(values["s"]) < 4:
                raise ModelError(
                    f"irregularities: {name}: expected as many numbers as s has, 4 or more, "
                    f"got shape {values[name].shape}"
                )
            if not np.isfinite(values[name]).all():
                raise ModelError(f"irregularities: {name}: expected finite numbers")
        steps = np.diff(values["s"])
        if steps.min() <= 0 or np.ptp(steps) > 1e-6 * steps.mean():
            raise ModelError(
                "irregularities: s: expected equally spaced, increasing positions; resample the measurement"
            )
        for name, array in values.items():
            if name != "s" and np.abs(array).max() > MOST:
                raise ModelError(
                    f"irregularities: {name}: deviations up to {np.abs(array).max():g} m: these look like millimetres; "
                    "give metres (times 0.001)"
                )
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    def __add__(self, other: "Irregularities") -> "Irregularities":
        """Return the sum of both, at the positions of the finer one, over the union of their ranges."""
        step = min(self.s[1] - self.s[0], other.s[1] - other.s[0])
        low, high = min(self.s[0], other.s[0]), max(self.s[-1], other.s[-1])
        s = low + step * np.arange(round((high - low) / step) + 1)
        sums = (
            np.interp(s, self.s, getattr(self, name), 0.0, 0.0) + np.interp(s, other.s, getattr(other, name), 0.0, 0.0)
            for name in ("left_y", "left_z", "right_y", "right_z")
        )
        return Irregularities(s, *sums)

    def seen_by_wheels(self, radius: float) -> "Irregularities":
        """Return the deviations with vertical ones filtered by the wheel, see `wheel_envelope`."""
        step = float(self.s[1] - self.s[0])
        return Irregularities(
            self.s,
            self.left_y,
            wheel_envelope(self.left_z, step, radius),
            self.right_y,
            wheel_envelope(self.right_z, step, radius),
        )

    @classmethod
    def from_table(cls, table: Any, where: str = "irregularities") -> "Irregularities":
        """Return the deviations of a table of a system file: s and signals, or spectrum, length, seed, ..."""
        if not isinstance(table, dict):
            raise ModelError(f"{where}: expected a table, got {table!r}")
        if "spectrum" in table:
            options = {key: value for key, value in table.items() if key not in ("spectrum", "length")}
            allowed = {"seed", "start", "longest", "shortest", "spacing", "fade"}
            unknown = sorted(set(options) - allowed)
            if unknown:
                raise ModelError(f"{where}: unknown key {unknown[0]!r}; choose among {', '.join(sorted(allowed))}")
            if "length" not in table:
                raise ModelError(f"{where}: length is missing [m]")
            return random_irregularities(table["spectrum"], table["length"], **options)
        if "s" not in table:
            raise ModelError(f"{where}: expected spectrum and length, or s with left_y, left_z, right_y, right_z")
        unknown = sorted(set(table) - {"s", "left_y", "left_z", "right_y", "right_z"})
        if unknown:
            raise ModelError(f"{where}: unknown key {unknown[0]!r}; choose among s, left_y, left_z, right_y, right_z")
        zero = np.zeros(len(table["s"]))
        return cls(table["s"], *(table.get(name, zero) for name in ("left_y", "left_z", "right_y", "right_z")))


def random_irregularities(
    spectrum: str | TrackSpectrum, length: float, *, seed: int = 0, start: float = 0.0, longest: float = 100.0,
    shortest: float = 1.0, spacing: float = 0.2, fade: float = 20.0,
) -> Irregularities:  # fmt: skip
    """Return a random track with a spectrum: waves with equally spaced wavenumbers and random phases.

    z(s) = sum_k sqrt(2 S(W_k) dW) cos(W_k s + phase_k), with separate phases for alignment, profile and cross level,
    summed by an inverse Fourier transform over twice the length.

    Parameters
    ----------
    spectrum
        A name in `SPECTRA`, or a spectrum.
    length
        Length of the track [m].
    seed
        Seed of the phases; the same seed gives the same track.
    start
        Position of the beginning [m].
    longest, shortest
        Range of wavelengths [m].
    spacing
        Spacing of the table [m], at most a quarter of the shortest wavelength.
    fade
        Length over which the deviations rise from zero at the beginning and fall to zero at the end [m].
    """
    if isinstance(spectrum, str):
        if spectrum not in SPECTRA:
            raise ModelError(f"irregularities: spectrum: expected one of {', '.join(SPECTRA)}, got {spectrum!r}")
        spectrum = SPECTRA[spectrum]
    length = number("irregularities: length", length, above=0.0)
    longest, shortest = (number("irregularities: wavelengths", value, above=0.0) for value in (longest, shortest))
    spacing, fade = (
        number("irregularities: spacing", spacing, above=0.0),
        number("irregularities: fade", fade, at_least=0.0),
    )
    if shortest >= longest:
        raise ModelError(f"irregularities: shortest wave {shortest:g} m is not shorter than the longest, {longest:g} m")
    if spacing > shortest / 4:
        raise ModelError(
            f"irregularities: spacing {spacing:g} m is more than a quarter of the shortest wave, {shortest:g} m"
        )
    if length / spacing > 2e6:
        raise ModelError(
            f"irregularities: {length / spacing:.3g} points are too many; choose a longer spacing or a shorter track"
        )
    n = int(np.ceil(length / spacing)) + 1
    period = 2 * n  # in points: twice the track length, so that the track does not repeat
    dW = 2 * np.pi / (period * spacing)
    k = np.arange(int(np.ceil(2 * np.pi / longest / dW)), int(2 * np.pi / shortest / dW) + 1)
    if len(k) < 2:
        raise ModelError(
            f"irregularities: length {length:g} m is too short for waves of {shortest:g} m to {longest:g} m"
        )
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, (3, len(k)))
    s = np.asarray(spacing * np.arange(n), dtype=np.float64)
    lines = np.zeros((3, period // 2 + 1), dtype=complex)
    lines[:, k] = (
        np.sqrt(2 * np.array(spectrum.densities(np.asarray(dW * k, dtype=np.float64))) * dW)
        * np.exp(1j * phases)
        * period
        / 2
    )
    signals = np.fft.irfft(lines, period)[:, :n]
    if fade > 0:
        rise = np.clip(np.minimum(s, s[-1] - s) / fade, 0, 1)
        signals *= rise * rise * (3 - 2 * rise)
    lateral, vertical, roll = signals
    return Irregularities(start + s, lateral, vertical + HALF_BASE * roll, lateral, vertical - HALF_BASE * roll)


def wheel_envelope(z: Array, spacing: float, radius: float) -> Array:
    """Return the height of a wheel on a rail with heights z: the height of its centre minus its radius.

    e(s) = max over x of z(s + x) - (r - sqrt(r² - x²)); short dents are bridged, and edges become arcs of the wheel.

    Parameters
    ----------
    z
        Heights of the rail [m], (n,), equally spaced.
    spacing
        Spacing of the heights [m].
    radius
        Radius r of the wheel [m].
    """
    z = np.asarray(z, dtype=float)
    reach = float(np.ptp(z))
    if reach == 0 or reach >= radius:
        if reach:
            raise ModelError(f"wheel_envelope: heights differ by {reach:g} m, more than the radius {radius:g} m")
        return z.copy()
    n = int(np.sqrt(reach * (2 * radius - reach)) / spacing) + 1
    padded = np.pad(z, n, mode="edge")
    envelope = np.full_like(z, -np.inf)
    for k in range(-n, n + 1):
        x = k * spacing
        if abs(x) < radius:
            sag = x * x / (radius + np.sqrt(radius * radius - x * x))
            envelope = np.maximum(envelope, padded[n + k : n + k + len(z)] - sag)
    return envelope
