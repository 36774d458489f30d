"""Assess one mode set with a given number of modes, in the coordinates of a small basis (`coordinates.py`).

The results are records of `cms.assessment.quality`.
"""

from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg as la

from cms.assessment.compare.coordinates import Coordinates
from cms.assessment.compare.free_shapes import Subset
from cms.assessment.compare.full_model import FullModel
from cms.assessment.quality.of_reduction.completeness import StaticCompleteness, completeness_records
from cms.assessment.quality.of_reduction.conditioning import conditioning_record, dropped_record
from cms.assessment.quality.of_reduction.deformation import (
    DeformationError,
    deformation_record,
    lengths,
    nodal_lengths,
    relative,
)
from cms.assessment.quality.of_reduction.frequencies import compare_shapes, frequency_records, mac
from cms.assessment.quality.of_reduction.frf import ResponseComparison, compare_responses, response_record
from cms.assessment.quality.of_reduction.held_mass import answered_statically
from cms.assessment.quality.of_reduction.residuals import ResidualBounds, residual_record
from cms.assessment.quality.record import QualityRecord, information, judge
from cms.assessment.quality.reference.port_model import FrequencyResponse, PortModel, modal_response
from cms.reduction.basis.free_basis import FreeBasis
from cms.reduction.error_estimates import NO_ENERGY
from fe_models.foundation.arrays import Array

__all__ = ["Reference", "drawn_entry", "judge_subset"]

#: ratio of a combination's interface motion to the largest such motion, below which interfaces count as fixed
HELD = 1e-9


@dataclass(frozen=True, eq=False)
class Reference:
    """Reference data for the assessment of every subset, the same for all sets."""

    full: FullModel
    response: FrequencyResponse  #: frequency response of the full model at its ports
    damping: float  #: damping ratio of every mode in this response
    port_names: tuple[str, ...]
    drawn: tuple[int, int]  #: entry of the response shown in the chart: (output, input)
    static_labels: tuple[tuple[str, ...], ...]  #: names of the loads of Psi_A, Psi_H and Psi_L
    length: float  #: body length, which converts rotations to translations
    time: float  #: time unit of the body [s]


def judge_subset(reference: Reference, c: Coordinates, subset: Subset) -> tuple[QualityRecord, ...]:
    """Return the records of a subset: frequencies, shapes, statics, response, motion, mass, bound, columns."""
    basis = subset.basis
    targets = {name: c.reference[:, part] for name, part in reference.full.parts.items()}
    root = nodal_root(c)
    static = static_part(reference, c, basis, targets)
    mass = mass_part(reference, c, basis, targets["directions"])
    is_complete = any(record.name == "static-inertia" and record.verdict == "pass" for record in static)
    return (
        *frequency_part(reference, c, basis, targets["Phi"], root),
        *static,
        response_part(reference, c, basis),
        motion_part(reference, c, basis, targets["moved"], root),
        answered_statically(mass) if is_complete else mass,
        residual_part(reference, c, basis),
        conditioning_record(subset.condition, subset.n_columns),
        dropped_record(basis, subset.n_columns),
    )


def nodal_root(c: Coordinates) -> Array:
    """Return L, (n_Q, n_Q), with Lᵀ L = Qᵀ Q over nodal translations: |L x| is the nodal norm of the field Q x."""
    values, vectors = la.eigh(c.nodal)
    return np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T


def frequency_part(
    reference: Reference, c: Coordinates, basis: FreeBasis, Phi: Array, root: Array
) -> tuple[QualityRecord, ...]:
    """Assess free-free frequencies and shapes in the band; see `cms.assessment.quality.of_reduction.frequencies`."""
    n, time, shapes = reference.full.n_band, reference.time, basis.vibrating
    massed = np.minimum(mac(Phi, shapes, c.M @ shapes), 1.0)
    full, reduced = reference.full.frequencies[:n] / time, basis.frequencies(time)
    comparison = compare_shapes(full, reduced, massed, root @ Phi, root @ shapes)
    return frequency_records(comparison, reference.full.band / time)


def static_part(
    reference: Reference, c: Coordinates, basis: FreeBasis, targets: dict[str, Array]
) -> tuple[QualityRecord, ...]:
    """Assess static completeness for interface loads, rigid-body accelerations and load cases of the body."""
    interface_loads, inertia_loads, cases = reference.static_labels
    loaded = targets["Psi_L"]
    records = completeness_records(
        StaticCompleteness(
            interface_loads, energy_error(c, basis, targets["Psi_A"]),
            inertia_loads, energy_error(c, basis, targets["Psi_H"]),
            cases, np.array([energy_error(c, basis, loaded[:, [k]])[0] for k in range(loaded.shape[1])]),
        )
    )  # fmt: skip
    none = () if cases else (information("static-load-cases", "the body has no load cases"),)
    return (*records, *none)


def energy_error(c: Coordinates, basis: FreeBasis, U: Array) -> Array:
    """Return the relative energy error of the best approximation of columns U, (k,); NaN if they have no energy."""
    E = U - basis.Phi @ ((basis.Phi.T @ (c.K @ U)) / basis.omega2[:, None])
    energy, error = (np.einsum("nk,nk->k", X, c.K @ X) for X in (U, E))
    has_energy = energy > NO_ENERGY * energy.max(initial=0.0)
    return np.sqrt(np.maximum(error, 0.0) / np.where(has_energy, energy, np.nan))


def response_part(reference: Reference, c: Coordinates, basis: FreeBasis) -> QualityRecord:
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


def motion_part(reference: Reference, c: Coordinates, basis: FreeBasis, U: Array, root: Array) -> QualityRecord:
    """Assess the deformation error of the reference motion; see `deformation_error` of `cms.assessment.quality`."""
    a, X = reference.full.amplitudes, basis.vibrating
    in_M = U - X @ (X.T @ (c.M @ U))
    in_K = U - basis.Phi @ ((basis.Phi.T @ (c.K @ U)) / basis.omega2[:, None])
    error = {"M": lengths(in_M, c.M @ in_M, a), "K": lengths(in_K, c.K @ in_K, a)}
    size = {"M": lengths(U, c.M @ U, a), "K": lengths(U, c.K @ U, a)}
    error["nodal"], size["nodal"] = nodal_lengths(root @ U, root @ basis.N, root @ basis.Phi, a)
    deformation: DeformationError = relative(reference.full.t, error, size)
    return deformation_record(deformation)


def mass_part(reference: Reference, c: Coordinates, basis: FreeBasis, directions: Array) -> QualityRecord:
    """Assess the effective mass with all interfaces fixed against that of all fixed-interface modes."""
    full = reference.full
    B = np.hstack([basis.N, basis.Phi])
    B = B / np.linalg.norm(B, axis=0)
    _, sizes, Vt = la.svd(c.at_b @ B)
    rank = int((sizes > HELD * sizes.max(initial=0.0)).sum())
    held = B @ Vt[rank:].T
    carried = np.zeros(6)
    if held.shape[1]:
        G_M = held.T @ c.M @ held
        values, vectors = la.eigh((G_M + G_M.T) / 2)
        has_mass = values > 1e-12 * values.max(initial=0.0)
        L = (vectors[:, has_mass] / np.sqrt(values[has_mass])).T @ (held.T @ (c.M @ directions))
        carried = (L**2).sum(axis=0)
    can_move = full.held_mass > 1e-12 * np.repeat([full.mass[:3].max(), full.mass[3:].max()], 3)
    share = np.where(can_move, carried / np.where(can_move, full.held_mass, 1.0), 1.0)
    remainder = np.clip(1 - share, 0.0, 1.0)
    names = ("along x", "along y", "along z", "about x", "about y", "about z")
    worst = int(remainder[:3].argmax())
    reason = (
        f"with all interfaces fixed the modes carry {100 * share[worst]:.1f} % of the mass that moves {names[worst]}; "
        + ", ".join(f"{name} {100 * s:.0f} %" for name, s in zip(names, share, strict=True))
    )
    data = {"carried": carried, "share": share, "remainder": remainder}
    return judge("effective-mass", float(remainder[worst]), reason, data)


def residual_part(reference: Reference, c: Coordinates, basis: FreeBasis) -> QualityRecord:
    """Compute residual bounds of frequencies in the band; see `cms.assessment.quality.of_reduction.residuals`.

    |phi - theta G M phi|²_K / theta = theta phiᵀ M G M phi - 1 for phiᵀ M phi = 1, known to about 1e-8 in the bound.
    """
    frequencies = basis.frequencies(reference.time)
    if not len(frequencies):
        return residual_record(ResidualBounds(*(np.zeros(0),) * 3))
    n = max(1, int((frequencies <= reference.full.band / reference.time).sum()))
    theta, phi = basis.omega2[:n], basis.Phi[:, :n]
    b = np.sqrt(np.maximum(theta * np.einsum("nk,nl,lk->k", phi, c.MGM, phi, optimize=True) - 1.0, 0.0))
    ratio = theta[:, None] / basis.omega2[basis.is_massive][None]
    ratio[np.arange(n), np.arange(n)] = np.inf
    gap = np.abs(ratio - 1).min(axis=1, initial=np.inf)
    estimate = np.minimum(b, b**2 / np.where(gap > 0, gap, np.finfo(float).tiny))
    return residual_record(ResidualBounds(frequencies[:n], b, estimate))
