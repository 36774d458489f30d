"""Damping of a model from measured ratios by least squares: one ratio for all modes, or Rayleigh damping."""

from dataclasses import dataclass

import numpy as np

from cms.assessment.correlation.errors import CorrelationError
from fe_models.foundation.arrays import Array

__all__ = ["DampingFit", "fit_damping"]


@dataclass(frozen=True, eq=False)
class DampingFit:
    """A fitted damping with its uncertainty."""

    kind: str  #: "ratio" or "rayleigh"
    values: Array  #: ratio; or alpha [1/s] and beta [s]
    spread: Array  #: standard deviation of each value
    misfit: float  #: root mean square of measured minus fitted ratio
    time: float = 1.0  #: time unit of the job that receives the table [s]

    def table(self) -> str:
        """Return the table [damping] of a job in its units: alpha per time unit, beta in time units."""
        factors = {"ratio": 1.0} if self.kind == "ratio" else {"alpha": self.time, "beta": 1 / self.time}
        rows = (f"{name} = {v * factor:.6g}" for (name, factor), v in zip(factors.items(), self.values, strict=True))
        return "\n".join(["[damping]", *rows])


def fit_damping(frequencies: Array, ratios: Array, *, time: float = 1.0) -> tuple[DampingFit, ...]:
    """Fit zeta = const, and zeta = alpha / (4 pi f) + beta pi f, to measured ratios at frequencies [Hz].

    time: time unit of the job for which the fits write their table [s].

    The standard deviation follows from the residuals, divided by (n - number of constants). The Rayleigh constants are
    those of D = alpha M + beta K; a negative one is set to zero, because a job does not accept it.

    Raises
    ------
    CorrelationError
        If there are fewer than two ratios, or a ratio is negative.
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
        fits.append(DampingFit(kind, x, spread, float(np.sqrt(np.mean(left**2))), time))
    return tuple(fits)
