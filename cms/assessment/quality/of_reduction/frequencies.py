"""Free-free frequencies of a reduced body: against those of the full model, and their errors by residuals alone."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from cms.assessment.quality.record import QualityRecord, information, judge
from cms.assessment.quality.reference.full_reference import Reference
from cms.reduction.basis.free_basis import FreeBasis
from fe_models.foundation.arrays import Array, IntArray, frozen

__all__ = [
    "FrequencyComparison",
    "ResidualBounds",
    "compare_frequencies",
    "compare_shapes",
    "frequency_records",
    "mac",
    "residual_bounds",
    "residual_record",
]

CLUSTER = 1e-3  #: relative gap between two frequencies below which their shapes are compared as a common subspace


@dataclass(frozen=True, eq=False)
class FrequencyComparison:
    """Elastic free-free modes in the band: full model compared with reduced body."""

    full: Array  #: frequencies of the full model, (n_full,) [Hz]
    reduced: Array  #: all frequencies of the reduced body, ascending, (n_reduced,) [Hz]
    #: reduced frequency divided by full frequency, in order, minus 1, (n_full,); NaN if the reduced body has none
    error: Array
    mac: Array  #: MAC weighted by mass, (n_full, n_reduced)
    mac_nodal: Array  #: MAC of the translations of all nodes, (n_full, n_reduced)
    partner: IntArray  #: reduced mode with the largest mass-weighted MAC for each full mode, (n_full,); -1: none
    partner_error: Array  #: frequency of the partner divided by the frequency of the full mode, minus 1, (n_full,)
    #: part of each full shape in the span of the partners of its cluster, mass-weighted, 0 to 1, (n_full,)
    recovered: Array
    recovered_nodal: Array  #: the same in nodal translations; for a single mode, its MAC with the partner, (n_full,)

    def __post_init__(self) -> None:
        for name in ("full", "reduced", "error", "mac", "mac_nodal", "partner_error", "recovered", "recovered_nodal"):
            object.__setattr__(self, name, frozen(getattr(self, name)))
        object.__setattr__(self, "partner", frozen(self.partner, np.int64))


def mac(A: Array, B: Array, M_B: Array | None = None) -> Array:
    """Return the modal assurance criterion (a·b)² / (a·a b·b) for all pairs of columns, (n_a, n_b).

    Parameters
    ----------
    A, B
        Shapes, (n, n_a) and (n, n_b).
    M_B
        M B for the mass-weighted criterion of M-orthonormal shapes, (n, n_b); None: the unweighted criterion.
    """
    if M_B is not None:
        return np.asarray((A.T @ M_B) ** 2)
    size = np.outer(np.einsum("nk,nk->k", A, A), np.einsum("nk,nk->k", B, B))
    return np.asarray((A.T @ B) ** 2 / np.where(size > 0, size, 1.0))


def compare_frequencies(reference: Reference, basis: FreeBasis) -> FrequencyComparison:
    """Compare the free-free modes of a mode set with those of the full model in its band."""
    Phi, shapes = reference.Phi, basis.vibrating
    full, reduced = reference.frequencies[: Phi.shape[1]], basis.frequencies(reference.time)
    a, b = (reference.space.translation_rows(X) for X in (Phi, shapes))
    return compare_shapes(full, reduced, mac(Phi, shapes, reference.space.M @ shapes), a, b)


def compare_shapes(full: Array, reduced: Array, massed: Array, a: Array, b: Array) -> FrequencyComparison:
    """Compare frequencies and shapes of two models.

    Shapes of equal or nearly equal frequencies are arbitrary up to a rotation among them, so `recovered` is the part of
    a full shape in the span of all partners of its cluster.

    Parameters
    ----------
    full, reduced
        Frequencies, ascending, (n_full,) and (n_reduced,) [Hz].
    massed
        Mass-weighted MAC of their shapes, (n_full, n_reduced).
    a, b
        Translations of all nodes in the shapes, in any coordinates that keep their scalar products, (n, n_full) and
        (n, n_reduced).
    """
    n = len(full)
    error = np.full(n, np.nan)
    common = min(n, len(reduced))
    error[:common] = reduced[:common] / full[:common] - 1
    partner = np.full(n, -1, np.int64)
    rows, columns = linear_sum_assignment(-massed)
    partner[rows] = columns
    partner_error = np.full(n, np.nan)
    partner_error[rows] = reduced[columns] / full[rows] - 1
    recovered, recovered_nodal = np.zeros(n), np.zeros(n)
    for cluster in clusters(full):
        members = partner[cluster]
        members = members[members >= 0]
        recovered[cluster] = massed[np.ix_(cluster, members)].sum(axis=1)
        recovered_nodal[cluster] = span_share(a[:, cluster], b[:, members])
    return FrequencyComparison(
        full, reduced, error, massed, mac(a, b), partner, partner_error, np.minimum(recovered, 1.0), recovered_nodal
    )


def clusters(frequencies: Array) -> list[IntArray]:
    """Return groups of indices of frequencies with relative gaps below `CLUSTER`."""
    is_apart = np.diff(frequencies) > CLUSTER * frequencies[1:]
    return np.split(np.arange(len(frequencies)), np.flatnonzero(is_apart) + 1)


def span_share(A: Array, B: Array) -> Array:
    """Return the squared part of each column of A in the span of B, (n_a,)."""
    if not B.shape[1]:
        return np.zeros(A.shape[1])
    Q, _ = np.linalg.qr(B)
    size = np.einsum("nk,nk->k", A, A)
    return np.asarray(np.minimum(((Q.T @ A) ** 2).sum(axis=0) / np.where(size > 0, size, 1.0), 1.0))


def frequency_records(comparison: FrequencyComparison, band: float) -> tuple[QualityRecord, ...]:
    """Return the records "frequency-error", "mac" and "mac-nodal" for the modes in the band [Hz]."""
    c = comparison
    size = np.where(np.isnan(c.error), np.inf, np.abs(c.error))
    k = int(np.argmax(size))
    if np.isfinite(size[k]):
        reason = f"largest of {len(c.full)} modes up to {band:.4g} Hz: {100 * c.error[k]:.3g} % at {c.full[k]:.5g} Hz"
    else:
        reason = (
            f"the reduced body has {len(c.reduced)} elastic modes, the full model {len(c.full)} up to {band:.4g} Hz"
        )
    data = {
        "full_hz": c.full,
        "reduced_hz": c.reduced,
        "error": c.error,
        "partner": c.partner,
        "partner_error": c.partner_error,
        "band_hz": band,
    }
    records = [judge("frequency-error", size[k], reason, data)]
    for name, recovered, matrix in (("mac", c.recovered, c.mac), ("mac-nodal", c.recovered_nodal, c.mac_nodal)):
        k = int(np.argmin(recovered))
        reason = f"least recovered is the mode at {c.full[k]:.5g} Hz, to {100 * recovered[k]:.2f} %"
        records.append(judge(name, 1 - recovered[k], reason, {"recovered": recovered, "mac": matrix}))
    return tuple(records)


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
