"""Frequency responses and coherence estimated from two signals."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fe_models.foundation.arrays import Array, frozen
from fe_models.foundation.records import frozen_copies
from floatframe.errors import SignalError
from floatframe.files.signals.spectra import (
    AVERAGES,
    checked_samples,
    number_of_segments,
    segment_length,
    window_samples,
)

__all__ = ["TransferEstimate", "transfer_estimate"]


@frozen_copies
@dataclass(frozen=True, eq=False)
class TransferEstimate:
    """Estimates of the response of y to x."""

    input: str
    output: str
    frequencies: Array  #: (n_f,) [Hz]
    H1: NDArray[np.complex128]  #: S_xy/S_xx, (n_f,), free of bias from noise in y
    H2: NDArray[np.complex128]  #: S_yy/S_yx, (n_f,), free of bias from noise in x
    coherence: Array  #: |S_xy|²/(S_xx S_yy), (n_f,), 0 to 1
    unit: str  #: of H
    n_averages: int

    def __post_init__(self) -> None:
        for key in ("frequencies", "coherence"):
            object.__setattr__(self, key, frozen(np.array(getattr(self, key), dtype=float)))


def transfer_estimate(
    x: Array,
    y: Array,
    rate: float,
    *,
    window: str = "hann",
    n_segment: int | None = None,
    overlap: float = 0.5,
    detrend: str = "constant",
    names: tuple[str, str] = ("x", "y"),
    units: tuple[str, str] = ("", ""),
) -> TransferEstimate:
    """Return the frequency responses H1, H2 of y to x and their coherence, by segments as in `psd`.

    H and coherence are NaN at frequencies where x or y has no power.

    Raises
    ------
    SignalError
        If the records differ in length, or there is only one segment, whose coherence is 1 for all signals.
    """
    from scipy.signal import csd, welch

    where = f"response of {names[1]!r} to {names[0]!r}"
    x, y = (checked_samples(each, rate, detrend, where) for each in (x, y))
    if len(x) != len(y):
        raise SignalError(f"{where}: expected records of one length, got {len(x)} and {len(y)} samples")
    n = segment_length(len(x), n_segment, overlap, AVERAGES, where)
    n_averages = number_of_segments(len(x), n, overlap)
    if n_averages < 2:
        raise SignalError(f"{where}: one segment of {n} samples: coherence needs two or more; take shorter segments")
    options = {
        "fs": rate, "window": window_samples(window, n), "nperseg": n, "noverlap": int(overlap * n),
        "detrend": False if detrend == "none" else detrend,
    }  # fmt: skip
    f, S_xx = welch(x, **options)
    _, S_yy = welch(y, **options)
    _, S_xy = csd(x, y, **options)
    with np.errstate(divide="ignore", invalid="ignore"):
        H1, H2 = S_xy / S_xx, S_yy / np.conj(S_xy)
        coherence = np.abs(S_xy) ** 2 / (S_xx * S_yy)
    return TransferEstimate(*names, f, H1, H2, coherence, quotient(units[1], units[0]), n_averages)


def quotient(above: str, below: str) -> str:
    """Return the unit of a quotient."""
    if not below:
        return above
    return f"({above or '1'})/({below})"
