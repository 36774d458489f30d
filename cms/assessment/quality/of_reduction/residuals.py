"""Error bounds of reduced eigenpairs, computed from their residuals alone.

Let phiᵀ M phi = 1, theta = phiᵀ K phi and Psi_Rᵀ M phi = 0, and expand phi = sum c_j phi_j in the true elastic modes.
With the flexibility G of the free body, the residual r = K phi - theta M phi satisfies
|r|²_G = sum (lambda_j - theta)² c_j² / lambda_j. Since sum lambda_j c_j² = theta,

    min_j |lambda_j - theta| / lambda_j <= |r|_G / sqrt(theta) = |phi - theta G M phi|_K / sqrt(theta) =: b

There is a true frequency f with |(f_reduced / f)² - 1| <= b. In the energy product 1 / theta is the Rayleigh quotient
of G M, so the error is of second order (Temple-Kato): |theta / lambda_j - 1| <= b² / gap, where gap is the smallest
|theta / lambda - 1| of the other modes. The estimate uses the other reduced frequencies for lambda; those nearer than b
belong to the same cluster and do not count.
"""

from dataclasses import dataclass

import numpy as np

from cms.assessment.quality.record import QualityRecord, information, judge
from cms.assessment.quality.reference.free_basis import FreeBasis
from cms.assessment.quality.reference.full_reference import FullReference
from fe_models.foundation.arrays import Array, frozen

__all__ = ["ResidualBounds", "residual_bounds", "residual_record"]


@dataclass(frozen=True, eq=False)
class ResidualBounds:
    """Error bounds of reduced free-free frequencies, which need no exact frequencies."""

    frequencies: Array  #: reduced frequencies, (n,) [Hz]
    bound: Array  #: bound b of each frequency: |(f_reduced / f)² - 1| <= b for some exact f, (n,)
    estimate: Array  #: estimate b² / gap between reduced frequencies, at most b, (n,)

    def __post_init__(self) -> None:
        for name in ("frequencies", "bound", "estimate"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    @property
    def frequency_distance(self) -> Array:
        """Largest f_reduced / f - 1 within the bound, (n,); Ritz frequencies are upper bounds."""
        return np.sqrt(1 + self.bound) - 1


def residual_bounds(reference: FullReference, basis: FreeBasis) -> ResidualBounds:
    """Compute the bounds of the reduced frequencies in the band (at least of the first): one solve per mode."""
    body = reference.body
    frequencies = basis.frequencies(body.units.time)
    n = max(1, int((frequencies <= reference.band).sum()))
    theta, phi = basis.omega2[:n], basis.Phi[:, :n]
    e = phi - theta * reference.families.flexibility(body.M @ phi)
    b = np.sqrt(np.maximum(np.einsum("nk,nk->k", e, body.K @ e), 0.0) / theta)
    ratio = theta[:, None] / basis.omega2[basis.is_massive][None]
    distance = np.abs(ratio - 1)
    gap = np.where(distance > b[:, None], distance, np.inf).min(axis=1, initial=np.inf)
    return ResidualBounds(frequencies[:n], b, np.minimum(b, b**2 / gap))


def residual_record(bounds: ResidualBounds) -> QualityRecord:
    """Return the record "residual-bound"."""
    if not len(bounds.bound):
        return information("residual-bound", "the reduced body has no elastic mode")
    distance = bounds.frequency_distance
    k = int(np.argmax(distance))
    reason = (
        f"a true frequency lies within {100 * distance[k]:.2g} % of {bounds.frequencies[k]:.5g} Hz, probably within "
        f"{100 * (np.sqrt(1 + bounds.estimate[k]) - 1):.2g} %; the others are nearer"
    )
    data = {"frequencies_hz": bounds.frequencies, "bound": bounds.bound, "estimate": bounds.estimate}
    return judge("residual-bound", distance[k], reason, data)
