"""All checks of a mode set and its reduced body against the full model."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from cms.assessment.quality.body_check import check_body
from cms.assessment.quality.errors import QualityError
from cms.assessment.quality.of_reduction.completeness import (
    completeness_records,
    held_mass,
    held_mass_record,
    static_completeness,
)
from cms.assessment.quality.of_reduction.conditioning import column_condition, conditioning_record, dropped_record
from cms.assessment.quality.of_reduction.contents import ReductionOptions, contents_records
from cms.assessment.quality.of_reduction.deformation import deformation_error, deformation_record
from cms.assessment.quality.of_reduction.frequencies import (
    compare_frequencies,
    frequency_records,
    residual_bounds,
    residual_record,
)
from cms.assessment.quality.of_reduction.frf import response_comparison, response_record
from cms.assessment.quality.of_reduction.full_shapes import full_shapes, same_body_record
from cms.assessment.quality.of_reduction.interface_stiffening import (
    has_both_kinds,
    interface_stiffening,
    stiffening_record,
)
from cms.assessment.quality.of_reduction.mass_properties import check_grounding, check_mass_properties
from cms.assessment.quality.record import QualityRecord, information, judge
from cms.assessment.quality.reference.full_reference import FullReference, Reference, usable_band
from cms.assessment.quality.reference.port_model import port_model
from cms.assessment.quality.reference.transient import Snapshots
from cms.body.reduced_body import ReducedBody
from cms.modes.mode_set import ModeSet
from cms.reduction.basis.free_basis import FreeBasis, free_basis
from fe_models.body.fe_body import FEBody
from fe_models.foundation.tall.columns import of_this_process

__all__ = ["basis_records", "check_reduction", "require_same_units", "with_default_band"]

#: origin of the band of a comparison for which nobody gave one
DEFAULT_BAND = "this band is the default, to the last vibration mode divided by 1.5; set another with --band or band="


def check_reduction(
    body: FEBody,
    modes: ModeSet,
    reduced: ReducedBody,
    *,
    reference: FullReference | None = None,
    uncoupled: FEBody | None = None,
    snapshots: Snapshots | None = None,
    own: tuple[QualityRecord, ...] | None = None,
    options: ReductionOptions | None = None,
) -> tuple[QualityRecord, ...]:
    """Check a reduced body alone and against its full model.

    Parameters
    ----------
    body
        Coupled body from which `modes` and `reduced` were made.
    modes
        The mode set of the reduction.
    reduced
        The reduced body that was made from them.
    reference
        Full model up to a band, which several mode sets can share; None: it is solved here for the band in which the
        mode set is customarily used (`usable_band`).
    uncoupled
        Body before `couple`; if given, rigid and distributing interfaces are compared (two more factorisations).
    snapshots
        Reference motion; if given, the deformation error is computed.
    own
        Records of `check_body` for the reduced body; None: they are computed here.
    options
        Expected content of the file; None: damping is compared with the provenance, recovery tables are not compared.

    Returns
    -------
    tuple of QualityRecord
        Records of `check_body`, then records of the comparison with the full model.

    Raises
    ------
    QualityError
        If mode set or reference belong to another body.
    """
    if modes.columns.shape[0] != body.n_dof:
        raise QualityError(
            f"check: mode set {modes.name!r} has columns of {modes.columns.shape[0]} dofs, body {body.name!r} has "
            f"{body.n_dof}; check with the body from which it was made"
        )
    require_same_units(body, reduced)
    if (columns := of_this_process(modes.columns)) is not modes.columns:
        modes = replace(modes, columns=columns)
    if reference is None:
        with FullReference(body, band=usable_band(modes, reduced)) as made:
            found = check_reduction(
                body, modes, reduced, reference=made, uncoupled=uncoupled, snapshots=snapshots, own=own, options=options
            )
        return with_default_band(found)
    if reference.body is not body:
        raise QualityError(f"check: the reference belongs to another body than {body.name!r}")
    found = check_body(reduced) if own is None else own
    records = [record for record in found if record.name != "dropped-columns"]
    grounding = check_grounding(body)
    records += [grounding, check_mass_properties(body, reduced)]
    if grounding.verdict == "fail":
        return tuple(records)  # no free body: its rigid-body motions cost energy
    basis = free_basis(body, modes, reference.families)
    shapes = full_shapes(body, basis, reduced)
    records.append(same_body_record(body, basis, reduced, shapes))
    records += contents_records(body, modes, reduced, shapes, reference.families, basis, options)
    response = []
    if body.interfaces and [each.name for each in reduced.interfaces] != [each.name for each in body.interfaces]:
        response.append(information("frequency-response", "the interfaces of the file are not those of the model"))
    elif body.interfaces:
        response.append(response_of(reference, reduced))
    records += basis_records(reference, basis, *response)
    condition, _ = column_condition(body, modes, float(basis.omega2[0]))
    records += [conditioning_record(condition, modes.columns.shape[1]), dropped_record(basis, modes.columns.shape[1])]
    if uncoupled is not None and has_both_kinds(uncoupled):
        records.append(stiffening_record(interface_stiffening(uncoupled)))
    if snapshots is not None:
        records.append(deformation_record(deformation_error(body, basis, snapshots)))
    return tuple(records)


def with_default_band(records: Iterable[QualityRecord]) -> tuple[QualityRecord, ...]:
    """Return the records of a comparison without a given band; "frequency-error" says how its band was chosen."""
    return tuple(
        replace(each, reason=f"{each.reason}; {DEFAULT_BAND}") if each.name == "frequency-error" else each
        for each in records
    )


def basis_records(reference: Reference, basis: FreeBasis, *others: QualityRecord) -> list[QualityRecord]:
    """Return records of frequencies, shapes and static responses, other records, residual bounds and effective mass."""
    static = completeness_records(static_completeness(reference, basis))
    is_complete = any(record.name == "static-inertia" and record.verdict == "pass" for record in static)
    return [
        *frequency_records(compare_frequencies(reference, basis), reference.band),
        *static,
        *others,
        residual_record(residual_bounds(reference, basis)),
        held_mass_record(held_mass(reference, basis), is_static_complete=is_complete),
    ]


def response_of(reference: FullReference, reduced: ReducedBody) -> QualityRecord:
    """Compare the responses at the interfaces; the check fails if the mass in the file is not positive."""
    try:
        return response_record(response_comparison(reference, port_model(reduced)))
    except np.linalg.LinAlgError as error:
        return judge("frequency-response", np.inf, f"the file has no response: {error}")


def require_same_units(body: FEBody, reduced: ReducedBody) -> None:
    """Raise `QualityError` unless full model and reduced body have the same units."""
    if body.units != reduced.units:
        raise QualityError(
            f"check: body {body.name!r} is in units {body.units.name}, the reduced body {reduced.name!r} in "
            f"{reduced.units.name}; check with the job from which the file was made"
        )
