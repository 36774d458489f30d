"""Completeness of a mode set: static responses to loads and accelerations, and effective mass with fixed interfaces."""

from dataclasses import dataclass, field, replace

import numpy as np

from cms.assessment.quality.record import QualityRecord, information, judge
from cms.assessment.quality.reference.full_reference import Reference
from cms.linear_algebra.elastic_pencil import elastic_eigenvectors
from cms.reduction.basis.free_basis import FreeBasis
from cms.reduction.error_estimates import energy_error
from fe_models.foundation.arrays import Array, frozen

__all__ = [
    "HeldMass",
    "StaticCompleteness",
    "completeness_records",
    "held_mass",
    "held_mass_record",
    "static_completeness",
]

DIRECTIONS = ("ux", "uy", "uz", "rx", "ry", "rz")
HELD = 1e-8  #: relative singular value of the interface motions, below which a combination keeps them fixed
NO_MASS = 1e-9  #: moving mass divided by the body mass, below which a direction has no moving mass


@dataclass(frozen=True, eq=False)
class StaticCompleteness:
    """Relative errors, sqrt(eᵀ K e / uᵀ K u), of static responses approximated in the span of a mode set."""

    interface_loads: tuple[str, ...]  #: name of each unit load, one for each excess boundary dof E: 'load big_end ux'
    interface: Array  #: error under each unit load, with the body fixed at R, (n_e,); NaN: no deformation
    inertia_loads: tuple[str, ...]
    inertia: Array  #: error under each rigid-body acceleration, with the interfaces fixed, (n_r,); NaN: no deformation
    load_cases: tuple[str, ...] = ()  #: names of the load cases of the body
    #: error of the free body under each load case, (n_load_cases,); NaN: no deformation
    load_case: Array = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        object.__setattr__(self, "interface", frozen(self.interface))
        object.__setattr__(self, "inertia", frozen(self.inertia))
        object.__setattr__(self, "load_case", frozen(self.load_case))


def static_completeness(reference: Reference, basis: FreeBasis) -> StaticCompleteness:
    """Return the error for each of the `static_responses`; every load case has its own scale of energy."""
    interface, inertia, cases = reference.statics
    space = reference.space
    return StaticCompleteness(
        interface.labels,
        energy_error(space, basis, interface.u),
        inertia.labels,
        energy_error(space, basis, inertia.u),
        cases.labels,
        np.array([energy_error(space, basis, cases.u[:, [k]])[0] for k in range(len(cases.labels))]),
    )


def completeness_records(statics: StaticCompleteness) -> tuple[QualityRecord, ...]:
    """Return the records "static-interface", "static-inertia" and, if there are load cases, "static-load-cases"."""
    records = []
    for name, labels, errors in (
        ("static-interface", statics.interface_loads, statics.interface),
        ("static-inertia", statics.inertia_loads, statics.inertia),
        ("static-load-cases", statics.load_cases, statics.load_case),
    ):
        if name == "static-load-cases" and not labels:
            continue
        data = {"labels": labels, "errors": errors}
        if not np.isfinite(errors).any():
            records.append(information(name, "no such load deforms the body", data))
            continue
        k = int(np.nanargmax(errors))
        reason = f"largest of {len(errors)} loads is {errors[k]:.2e}, of {labels[k]!r}"
        records.append(judge(name, errors[k], reason, data))
    return tuple(records)


@dataclass(frozen=True, eq=False)
class HeldMass:
    """Effective masses with fixed interfaces, about the centre of mass, in mesh axes, by direction."""

    frequencies: Array  #: frequencies of the mode set with all interfaces fixed, (n,) [Hz]
    mass: Array  #: effective mass and inertia of each mode, (n, 6) [kg, kg m²]
    total: Array  #: sum of effective masses over all modes of the full model, (6,)
    rigid: Array  #: mass and inertia of the whole body, (6,)

    def __post_init__(self) -> None:
        for name in ("frequencies", "mass", "total", "rigid"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    @property
    def remainder(self) -> Array:
        """Fraction of the moving mass missing from the sum over the modes of the set, (6,); 0 if no mass moves."""
        has_mass = self.total > NO_MASS * self.rigid
        return np.where(has_mass, 1 - self.mass.sum(axis=0) / np.where(has_mass, self.total, 1.0), 0.0)


def held_mass(reference: Reference, basis: FreeBasis) -> HeldMass:
    """Compute the effective masses of a mode set with all interfaces fixed.

    (1) find combinations of [N Phi] that do not move the fixed dofs: null space of their rows, rotations times length
    (2) find their modes z; participation L = zᵀ M d of unit rigid-body motions d, effective mass L²

    The sum for the full model does not subtract the mean motions that distributing interfaces prevent.
    """
    known = reference.mass
    X = np.hstack([basis.N, basis.Phi])
    rows = reference.fixed_rows(X)
    size = np.linalg.norm(rows, axis=0)
    size = np.where(size > 1e-12 * size.max(initial=0.0), size, 1.0)
    _, singular, Vt = np.linalg.svd(rows / size)
    rank = int((singular > HELD * singular.max(initial=0.0)).sum())
    V = Vt[rank:].T / size[:, None]  # (1)
    V = V / np.where((length := np.linalg.norm(V, axis=0)) > 0, length, 1.0)
    mass = np.concatenate([np.ones(basis.N.shape[1]), basis.is_massive.astype(float)])
    stiffness = np.concatenate([np.zeros(basis.N.shape[1]), basis.omega2])
    G_K, G_M = V.T @ (stiffness[:, None] * V), V.T @ (mass[:, None] * V)
    if V.shape[1]:
        Z, is_massive = elastic_eigenvectors((G_K + G_K.T) / 2, (G_M + G_M.T) / 2, float(basis.omega2[0]))  # (2)
        Z = Z[:, is_massive]
    else:
        Z = np.zeros((0, 0))
    omega2 = np.einsum("kq,kl,lq->q", Z, G_K, Z)
    L = Z.T @ V.T @ (X.T @ (reference.space.M @ known.directions))
    order = np.argsort(omega2)
    frequencies = np.sqrt(np.maximum(omega2[order], 0.0)) / (2 * np.pi) / reference.time
    return HeldMass(frequencies, L[order] ** 2, known.total, known.rigid)


def held_mass_record(held: HeldMass, *, is_static_complete: bool = False) -> QualityRecord:
    """Return the record "effective-mass" for the translation with the largest share of mass in no mode.

    If the static response of the mode set to rigid-body accelerations is exact, missing modes lose nothing: then there
    is no verdict.
    """
    data = {
        "frequencies_hz": held.frequencies,
        "mass": held.mass,
        "total": held.total,
        "rigid": held.rigid,
        "remainder": held.remainder,
    }
    if not (held.total > NO_MASS * held.rigid).any():
        return information("effective-mass", "nothing but the interfaces has mass", data)
    remainder = held.remainder
    k = int(np.argmax(remainder[:3]))
    reason = f"with fixed interfaces {len(held.frequencies)} modes carry these shares of moving mass: " + ", ".join(
        f"{name} {100 * (1 - r):.0f} %" for name, r in zip(DIRECTIONS, remainder, strict=True)
    )
    record = judge("effective-mass", max(0.0, remainder[k]), reason, data)
    return answered_statically(record) if is_static_complete else record


def answered_statically(record: QualityRecord) -> QualityRecord:
    """Return the record of a mode set that is exact for rigid accelerations: missing mass is not an error."""
    if record.verdict == "pass":
        return record
    return replace(record, verdict="info", reason=f"{record.reason}; the rest answers statically", action="")
