"""Static completeness: whether responses to interface loads and rigid-body accelerations are exact in a mode set."""

from dataclasses import dataclass, field

import numpy as np

from cms.assessment.quality.record import QualityRecord, information, judge
from cms.assessment.quality.reference.full_reference import Reference
from cms.reduction.basis.free_basis import FreeBasis
from cms.reduction.error_estimates import energy_error
from fe_models.foundation.arrays import Array, frozen

__all__ = ["StaticCompleteness", "completeness_records", "static_completeness"]


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
