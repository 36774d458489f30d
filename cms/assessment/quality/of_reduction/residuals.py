"""Errors of reduced frequencies from their residuals alone (`cms.reduction.error_estimates`), as a record."""

from dataclasses import dataclass

import numpy as np

from cms.assessment.quality.record import QualityRecord, information, judge
from cms.assessment.quality.reference.full_reference import Reference
from cms.reduction.basis.free_basis import FreeBasis
from fe_models.foundation.arrays import Array, frozen

__all__ = ["ResidualBounds", "residual_bounds", "residual_record"]


@dataclass(frozen=True, eq=False)
class ResidualBounds:
    """Errors of reduced free-free frequencies, found without exact frequencies."""

    frequencies: Array  #: reduced frequencies, (n,) [Hz]
    bound: Array  #: bound b of each frequency: |(f_reduced / f)² - 1| <= b for some exact f, (n,)
    estimate: Array  #: estimate of (f_reduced / f)² - 1, at most b, (n,)

    def __post_init__(self) -> None:
        for name in ("frequencies", "bound", "estimate"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    @property
    def frequency_distance(self) -> Array:
        """Largest f_reduced / f - 1 within the bound, (n,); Ritz frequencies are upper bounds."""
        return np.sqrt(1 + self.bound) - 1


def residual_bounds(reference: Reference, basis: FreeBasis) -> ResidualBounds:
    """Compute the errors of the reduced frequencies in the band (at least of the first)."""
    frequencies = basis.frequencies(reference.time)
    n = min(max(1, int((frequencies <= reference.band).sum())), len(frequencies))
    return ResidualBounds(frequencies[:n], *reference.bounds(basis, n))


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
