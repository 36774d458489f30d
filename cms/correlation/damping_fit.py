"""Damping of a model from measured ratios: one ratio for all modes, or Rayleigh's, by least squares."""

from dataclasses import dataclass

import numpy as np

from cms.correlation.errors import CorrelationError
from fe_models.foundation.arrays import Array

__all__ = ["DampingFit", "fit_damping"]


@dataclass(frozen=True, eq=False)
class DampingFit:
    """A damping with its uncertainty."""

    kind: str  #: "ratio" or "rayleigh"
    values: Array  #: ratio; or alpha [1/s] and beta [s]
    spread: Array  #: standard deviation of each
    misfit: float  #: root mean square of measured less fitted ratio

    def table(self) -> str:
        """Return the table [damping] of a job."""
        names = ("ratio",) if self.kind == "ratio" else ("alpha", "beta")
        return "\n".join(["[damping]", *(f"{n} = {v:.6g}" for n, v in zip(names, self.values, strict=True))])


def fit_damping(frequencies: Array, ratios: Array) -> tuple[DampingFit, ...]:
    """Fit zeta = const, and zeta = alpha / (4 pi f) + beta pi f, to measured ratios.

    The spread is that of the misfit: residuals over (n - number of constants). Rayleigh's constants are those of D =
    alpha M + beta K; one that comes out negative is set to zero, since a job takes none.

    Raises
    ------
    CorrelationError
        If there are fewer than two ratios, or one is negative.
    """
    f, zeta = np.asarray(frequencies, float), np.asarray(ratios, float)
    if len(zeta) < 2 or (zeta < 0).any():
        raise CorrelationError(f"damping: expected two or more measured ratios from 0, got {zeta}")
    fits = []
    for kind, A in (("ratio", np.ones((len(f), 1))), ("rayleigh", np.column_stack([1 / (4 * np.pi * f), np.pi * f]))):
        active = list(range(A.shape[1]))
        x = np.linalg.lstsq(A, zeta, rcond=None)[0]
        if (x < 0).any():
            active = [int(np.argmax(x))]
            x = np.zeros(A.shape[1])
            x[active] = np.linalg.lstsq(A[:, active], zeta, rcond=None)[0]
        left = zeta - A @ x
        freedom = max(len(f) - len(active), 1)
        spread = np.zeros(A.shape[1])
        spread[active] = np.sqrt(np.diag(np.linalg.inv(A[:, active].T @ A[:, active])) * (left @ left) / freedom)
        fits.append(DampingFit(kind, x, spread, float(np.sqrt(np.mean(left**2)))))
    return tuple(fits)
