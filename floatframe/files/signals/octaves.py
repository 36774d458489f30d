"""Levels in octave and fractional-octave bands, with the band edges of IEC 61260-1:2014 (base ten)."""

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.errors import SignalError
from floatframe.files.signals.spectra import Spectrum

__all__ = ["band_edges", "nominal_frequency", "octave_levels"]

G = 10**0.3  #: octave frequency ratio, base ten
REFERENCE = 1000.0  #: reference frequency [Hz]
LINES = 2.0  #: smallest width of a band in lines
NOMINAL = (1.0, 1.25, 1.6, 2.0, 2.5, 3.15, 4.0, 5.0, 6.3, 8.0)  #: nominal third-octave frequencies in a decade


def band_edges(fraction: int, low: float, high: float) -> tuple[Array, Array]:
    """Return midband frequencies, (n,), and edges, (n, 2) [Hz], of the 1/fraction-octave bands between two frequencies.

    f_m = 1000 Hz G^(x/b) for odd b = fraction, 1000 Hz G^((2x + 1)/(2b)) for even; edges f_m G^(-1/(2b)) and
    f_m G^(1/(2b)). Only bands that are completely between low and high are returned.
    """
    if fraction < 1 or not 0 < low < high:
        raise SignalError(
            f"octave bands: expected a fraction of 1 or more and rising frequencies above 0, got 1/{fraction} octave "
            f"from {low:g} to {high:g} Hz"
        )
    b = fraction
    shift = 0.0 if b % 2 else 0.5
    first = int(np.ceil(b * np.log(low / REFERENCE) / np.log(G) + 0.5 - shift - 1e-9))
    last = int(np.floor(b * np.log(high / REFERENCE) / np.log(G) - 0.5 - shift + 1e-9))
    middle = REFERENCE * G ** ((np.arange(first, last + 1) + shift) / b)
    return middle, np.stack([middle * G ** (-0.5 / b), middle * G ** (0.5 / b)], axis=1)


def nominal_frequency(middle: float) -> float:
    """Return the nominal frequency (31.5, 63, 125, ... Hz) of an octave or third-octave band by its exact one."""
    x = round(3 * np.log(middle / REFERENCE) / np.log(G))
    return NOMINAL[x % 10] * 10.0 ** (3 + x // 10)


def octave_levels(density: Spectrum, fraction: int = 1) -> Spectrum:
    """Return rms levels in 1/fraction-octave bands from a power spectral density.

    The density is constant about each line, over the resolution. A band contains the part of each line that is within
    its edges, so that the sum of the squared levels is the mean square in all bands. Bands that are narrower than two
    lines or extend beyond half the rate are omitted.

    Parameters
    ----------
    density
        Density from `psd`.
    fraction
        1: octaves, 3: third octaves.

    Returns
    -------
    Spectrum
        Values in the unit of the signal (rms), edges [Hz].

    Raises
    ------
    SignalError
        If no band is resolved.
    """
    df, f = density.resolution, density.frequencies
    if density.kind != "power spectral density" or len(f) < 2:
        raise SignalError(f"octave bands of {density.name!r}: expected a power spectral density, got {density.kind}")
    relative = G ** (0.5 / fraction) - G ** (-0.5 / fraction)  # width of a band divided by its midband frequency
    least = LINES * df / relative * G ** (-0.5 / fraction)  # lower edge of the first band that is wide enough
    top = float(f[-1])
    if least * G ** (1 / fraction) >= top:
        raise SignalError(
            f"octave bands of {density.name!r}: none lies between {least:.4g} Hz, from where a band has two lines, and "
            f"{top:.4g} Hz; take a finer resolution or a longer record"
        )
    middle, edges = band_edges(fraction, least, top)
    if not len(middle):
        raise SignalError(
            f"octave bands of {density.name!r}: none lies as a whole between {least:.4g} and {top:.4g} Hz"
        )
    bounds = np.concatenate([[0.0], f[:-1] + df / 2, [top]])
    widths = np.diff(bounds)
    power = density.values * df  # power of each line; lines at the ends are narrower and contain their whole power
    total = np.concatenate([[0.0], np.cumsum(power)])
    below = np.interp(edges, bounds, total)
    assert (widths > 0).all()
    levels = np.sqrt(np.maximum(below[:, 1] - below[:, 0], 0.0))
    kind = "octave (rms)" if fraction == 1 else f"1/{fraction} octave (rms)"
    notes = (*density.notes, f"bands from {edges[0, 0]:.4g} Hz, where they are two lines wide")
    return Spectrum(
        kind,
        density.name,
        middle,
        levels,
        density.signal_unit,
        density.signal_unit,
        df,
        density.n_averages,
        notes,
        edges,
    )
