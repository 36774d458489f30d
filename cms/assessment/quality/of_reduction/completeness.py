"""Static completeness: whether responses to interface loads and rigid-body accelerations are exact in a mode set."""

from dataclasses import dataclass, field

import numpy as np

from cms.assessment.quality.record import QualityRecord, information, judge
from cms.assessment.quality.reference.full_reference import FullReference
from cms.modes.families.families import Families
from cms.reduction.basis.free_basis import FreeBasis
from cms.reduction.error_estimates import energy_error
from fe_models.body.load_cases import load_columns
from fe_models.foundation.arrays import Array, frozen

__all__ = [
    "StaticCompleteness", "completeness_records", "load_case_responses", "static_completeness",
]  # fmt: skip

NO_LOAD = 1e-10  #: relative difference of a load and the inertia forces that balance it, below which it is rounding
ACCELERATIONS = ("ax", "ay", "az", "alpha x", "alpha y", "alpha z")


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


def static_completeness(reference: FullReference, basis: FreeBasis) -> StaticCompleteness:
    """Return the error for each unit interface load and each unit rigid-body acceleration.

    Interface loads are balanced by the reactions at R (attachment modes Psi_A; together with R they give any balanced
    combination of interface forces). Accelerations act with all interfaces fixed (inertia-relief modes Psi_H).
    """
    body, families = reference.body, reference.families
    Psi_H, labels = families.Psi_H, families.held_names("load")[0]
    cases = tuple(case.name for case in body.load_cases)
    return StaticCompleteness(
        tuple(labels[k] for k in families.free.e),
        energy_error(body, basis, families.Psi_A),
        acceleration_labels(Psi_H.shape[1]),
        energy_error(body, basis, Psi_H),
        cases,
        load_case_error(reference, basis) if cases else np.zeros(0),
    )


def load_case_error(reference: FullReference, basis: FreeBasis) -> Array:
    """Return the relative energy error of the accelerating free body under each load case, (n_load_cases,).

    A load that only accelerates the body, such as gravity, gives NaN.
    """
    U = load_case_responses(reference.families)
    error = np.full(U.shape[1], np.nan)
    for k in np.flatnonzero(U.any(axis=0)):
        error[k] = energy_error(reference.body, basis, U[:, [k]])[0]
    return error


def load_case_responses(families: Families) -> Array:
    """Return the static response of the free body to each of its load cases, (n_dof, n_load_cases).

    The response is zero if a load only accelerates the body.
    """
    body = families.body
    F = load_columns(body.load_cases, body.n_dof)
    balanced = families.project(F)
    deforms = np.linalg.norm(balanced, axis=0) > NO_LOAD * np.linalg.norm(F, axis=0)
    U = np.zeros(F.shape)
    if deforms.any():
        U[:, deforms] = families.flexibility(F[:, deforms])
    return U


def acceleration_labels(n_r: int) -> tuple[str, ...]:
    """Return the names of the rigid-body accelerations; numbers if the body has fewer than six."""
    return ACCELERATIONS if n_r == 6 else tuple(f"acceleration {k + 1}" for k in range(n_r))


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
