"""Spectra of modal coordinates, and the moments from which the spectral moments of stresses follow."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fe_models.foundation.arrays import Array, frozen
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields, frozen_copies
from floatframe.errors import FatigueError, ModelError

__all__ = ["ORDERS", "ModalSpectra", "modal_moments", "spectra_of_history"]

ORDERS = (0.0, 1.0, 2.0, 4.0)  #: orders of the spectral moments that the methods need
HERMITIAN = 1e-8  #: largest defect of a cross spectrum, and its most negative eigenvalue, relative to its largest entry


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class ModalSpectra:
    """Stationary Gaussian motion of the modal coordinates, as one-sided cross spectra, with its duration.

    Parameters
    ----------
    name
        Name of the load.
    frequencies
        Ascending frequencies, (n_f,) [Hz].
    spectra
        One-sided cross spectra, G_kl(f) = G_lk(f)*, (n_f, n_q, n_q) [unit of q² / Hz].
    duration
        Duration of one pass [s].
    mean
        Constant part of the modal coordinates, (n_q,); None: zero.
    repeats
        How often the load is repeated.
    scale
        Factor on the loads; spectra are multiplied by its square.
    weights
        Weights of integrals over the frequencies, (n_f,) [Hz]; None: trapezoidal rule.
    """

    name: str
    frequencies: Array
    spectra: NDArray[np.complex128]
    duration: float
    mean: Array | None = None
    repeats: float = 1.0
    scale: float = 1.0
    weights: Array | None = None

    def __post_init__(self) -> None:
        where = f"spectrum {self.name!r}"
        f = frozen(self.frequencies)
        G = np.ascontiguousarray(self.spectra, dtype=np.complex128)
        object.__setattr__(self, "frequencies", f)
        object.__setattr__(self, "spectra", G)
        if f.ndim != 1 or len(f) < 2 or G.ndim != 3 or G.shape != (len(f), G.shape[1], G.shape[1]):
            raise FatigueError(
                f"{where}: expected frequencies (n_f,) and cross spectra (n_f, n_q, n_q) at two frequencies or more, "
                f"got {f.shape} and {G.shape}"
            )
        if not (np.isfinite(f).all() and np.isfinite(G).all()):
            raise FatigueError(f"{where}: expected finite numbers, got NaN or infinity")
        if f[0] < 0 or not (np.diff(f) > 0).all():
            i = int(np.argmin(np.diff(f)))
            raise FatigueError(
                f"{where}: expected increasing frequencies from 0 on, got {f[i]:.6g} and then {f[i + 1]:.6g} Hz"
            )
        largest = np.abs(G).max()
        defect = np.abs(G - G.conj().transpose(0, 2, 1)).max()
        if defect > HERMITIAN * largest:
            words = f"got a defect of {defect / largest:.1e} of the largest"
            raise FatigueError(f"{where}: expected G_kl = conj(G_lk), {words}")
        lowest = np.linalg.eigvalsh(G)[:, 0]
        if lowest.min() < -HERMITIAN * largest:
            i = int(np.argmin(lowest))
            raise FatigueError(
                f"{where}: at {f[i]:.6g} Hz the cross spectra have the eigenvalue {lowest[i]:.3g}; expected 0 or "
                "more, otherwise a combination of the modes has a negative spectrum"
            )
        if self.mean is not None:
            object.__setattr__(self, "mean", frozen(self.mean))
            if self.mean.shape != G.shape[1:2]:
                raise FatigueError(f"{where}: mean: expected {G.shape[1]} modal coordinates, got {self.mean.shape}")
        if self.weights is not None:
            object.__setattr__(self, "weights", frozen(self.weights))
            if self.weights.shape != f.shape or not (np.isfinite(self.weights).all() and (self.weights >= 0).all()):
                raise FatigueError(f"{where}: weights: expected {len(f)} numbers of 0 or more, one per frequency")
        for name in ("duration", "repeats"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise FatigueError(f"{where}: {name}: expected a number above 0, got {value:g}")
        if not (math.isfinite(self.scale) and self.scale != 0):
            raise FatigueError(f"{where}: scale: expected a number other than 0, got {self.scale:g}")


def modal_moments(spectra: ModalSpectra, orders: Sequence[float] = ORDERS) -> Array:
    """Return the integrals of scale² f^m Re G over f, (n_orders, n_q, n_q).

    For a row of numbers a, the stress a · S q has the spectral moments (a S) M_m (a S).T; imaginary parts cancel.
    """
    f, G = spectra.frequencies, spectra.spectra.real
    widths = np.zeros(len(f)) if spectra.weights is None else spectra.weights
    if spectra.weights is None:
        widths[:-1] += 0.5 * np.diff(f)
        widths[1:] += 0.5 * np.diff(f)
    return np.stack([spectra.scale**2 * np.einsum("f,fkl->kl", widths * f**m, G) for m in orders])


def spectra_of_history(
    name: str, t: Array, q: Array, *, n_segment: int | None = None, duration: float | None = None
) -> ModalSpectra:
    """Return the cross spectra of a stationary modal history by Welch's method (Hann windows that overlap by half).

    Parameters
    ----------
    name
        Name of the spectra in reports.
    t, q
        Times at equal steps, (n_t,) [s], and modal coordinates, (n_t, n_q); their mean goes into `mean`.
    n_segment
        Number of times in a segment; None: an eighth of all.
    duration
        Duration of the motion [s]; None: that of the history.

    Raises
    ------
    FatigueError
        If the time steps are not equal.
    """
    from scipy.signal import csd

    steps = np.diff(t)
    if len(t) < 16 or not (steps > 0).all() or np.ptp(steps) > 1e-6 * steps.mean():
        raise FatigueError(f"spectrum {name!r}: expected 16 times or more at equal steps")
    n = len(t) // 8 if n_segment is None else n_segment
    if not 8 <= n <= len(t):
        raise FatigueError(f"spectrum {name!r}: n_segment: expected 8 to {len(t)}, got {n}")
    mean = q.mean(axis=0)
    n_q = q.shape[1]
    G = np.zeros((n // 2 + 1, n_q, n_q), complex)
    for k in range(n_q):
        for j in range(k, n_q):
            f, G[:, k, j] = csd(q[:, k] - mean[k], q[:, j] - mean[j], fs=1 / steps.mean(), nperseg=n)
            G[:, j, k] = G[:, k, j].conj()
    return ModalSpectra(name, f, G, float(t[-1] - t[0]) if duration is None else duration, mean)
