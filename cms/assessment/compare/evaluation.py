"""Assess one mode set with a given number of modes, in the coordinates of a small basis (`coordinates.py`).

The results are records of `cms.assessment.quality`.
"""

from dataclasses import dataclass, replace

import numpy as np

from cms.assessment.compare.coordinates import Coordinates
from cms.assessment.compare.free_shapes import Subset
from cms.assessment.compare.full_model import ReferenceSolution
from cms.assessment.quality.of_reduction.conditioning import conditioning_record, dropped_record
from cms.assessment.quality.of_reduction.deformation import deformation_error, deformation_record
from cms.assessment.quality.of_reduction.frf import ResponseComparison, compare_responses, response_record
from cms.assessment.quality.record import QualityRecord, information
from cms.assessment.quality.reduction_check import basis_records
from cms.assessment.quality.reference.full_reference import MovingMass, StaticResponse
from cms.assessment.quality.reference.port_model import FrequencyResponse, PortModel, modal_response
from cms.assessment.quality.reference.transient import Snapshots
from cms.reduction.basis.free_basis import FreeBasis
from fe_models.foundation.arrays import Array

__all__ = ["ProjectedReference", "SharedReference", "drawn_entry", "judge_subset"]


@dataclass(frozen=True, eq=False)
class SharedReference:
    """Results of the full model by which every subset is assessed, the same for all sets."""

    full: ReferenceSolution
    response: FrequencyResponse  #: frequency response of the full model at its ports
    damping: float  #: damping ratio of every mode in this response
    port_names: tuple[str, ...]
    drawn: tuple[int, int]  #: entry of the response shown in the chart: (output, input)
    static_labels: tuple[tuple[str, ...], ...]  #: names of the loads of Psi_A, Psi_H and Psi_L
    length: float  #: body length, which converts rotations to translations
    time: float  #: time unit of the body [s]


class ProjectedReference:
    """The `Reference` of quality checks in the coordinates of a comparison."""

    def __init__(self, shared: SharedReference, c: Coordinates) -> None:
        """Find the parts of the reference columns."""
        full, self.space, self.time = shared.full, c, shared.time
        self.band, self.frequencies = full.band / self.time, full.frequencies / self.time
        self.part = {name: c.reference[:, columns] for name, columns in full.parts.items()}
        self.Phi = self.part["Phi"]
        responses = (self.part[name] for name in ("Psi_A", "Psi_H", "Psi_L"))
        self.statics = tuple(map(StaticResponse, shared.static_labels, responses))
        self.mass = MovingMass(self.part["directions"], full.held_mass, full.mass)

    def fixed_rows(self, X: Array) -> Array:
        """Return the rows that are zero while the interfaces are fixed, (n_h, k)."""
        return self.space.fixed @ X

    def bounds(self, basis: FreeBasis, n: int) -> tuple[Array, Array]:
        """Return bounds and estimates of (f_reduced / f)² - 1 of the lowest n frequencies, (n,) each.

        |phi - theta G M phi|²_K / theta = theta phiᵀ M G M phi - 1 for phiᵀ M phi = 1; known to about 1e-8.
        """
        theta, phi = basis.omega2[:n], basis.Phi[:, :n]
        b = np.sqrt(np.maximum(theta * np.einsum("nk,nl,lk->k", phi, self.space.MGM, phi, optimize=True) - 1.0, 0.0))
        ratio = theta[:, None] / basis.omega2[basis.is_massive][None]
        ratio[np.arange(n), np.arange(n)] = np.inf
        gap = np.abs(ratio - 1).min(axis=1, initial=np.inf)
        return b, np.minimum(b, b**2 / np.where(gap > 0, gap, np.finfo(float).tiny))


def judge_subset(shared: SharedReference, c: Coordinates, subset: Subset) -> tuple[QualityRecord, ...]:
    """Return the records of a subset: frequencies, shapes, statics, response, motion, mass, bound, columns."""
    basis, reference = subset.basis, ProjectedReference(shared, c)
    has_cases = bool(reference.statics[2].labels)
    none = () if has_cases else (information("static-load-cases", "the body has no load cases"),)
    motion = Snapshots(reference.part["moved"], shared.full.amplitudes, shared.full.t)
    deformation = deformation_record(deformation_error(c, basis, motion))
    return (
        *basis_records(reference, basis, *none, response_part(shared, c, basis), deformation),
        conditioning_record(subset.condition, subset.n_columns),
        dropped_record(basis, subset.n_columns),
    )


def response_part(reference: SharedReference, c: Coordinates, basis: FreeBasis) -> QualityRecord:
    """Assess the frequency response at the interfaces over the band."""
    model = PortModel(
        reference.port_names, basis.omega2, basis.is_massive, c.at_ports @ basis.Phi, c.at_ports @ basis.N
    )
    full = reference.response
    reduced = modal_response(model, full.frequencies, damping=reference.damping, time=reference.time)
    error = compare_responses(full, reduced, reference.length)
    record = response_record(ResponseComparison(full, reduced, error, reference.full.port_error))
    drawn = (slice(None), *reference.drawn)
    data = {**record.data, "drawn": np.abs(reduced.H[drawn]), "drawn_full": np.abs(full.H[drawn])}
    return replace(record, data=data)


def drawn_entry(full: FrequencyResponse) -> tuple[int, int]:
    """Choose the entry for the chart: force on the first port, motion of the last, in the direction with most peaks."""
    curves = [np.abs(full.H[:, len(full.outputs) - 6 + k, k]) for k in range(3)]
    peaks = [int(((h[1:-1] > h[:-2]) & (h[1:-1] > h[2:])).sum()) for h in curves]
    k = int(np.argmax(peaks))
    return len(full.outputs) - 6 + k, k
