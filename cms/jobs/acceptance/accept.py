"""Acceptance of a body: checks, comparison with its full model or deck, and range of use."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial import cKDTree

from cms.assessment.quality.body_check import check_body
from cms.assessment.quality.errors import QualityError
from cms.assessment.quality.limits import LIMITS
from cms.assessment.quality.mesh_refinement import MOST_DOFS, mesh_refinement
from cms.assessment.quality.of_body.effective_mass import EffectiveMass, can_be_held, effective_mass
from cms.assessment.quality.of_reduction.frequencies import compare_shapes, frequency_records, mac
from cms.assessment.quality.of_reduction.mass_properties import check_mass_properties
from cms.assessment.quality.record import QualityRecord, has_failed, information, judge
from cms.assessment.quality.reduction_check import check_reduction, require_same_units, with_default_band
from cms.assessment.quality.reference.full_reference import FullReference, usable_band
from cms.body.modal_file.file import digest as digest_of
from cms.body.modal_file.file import read
from cms.body.reduced_body import ReducedBody
from cms.errors import CmsError
from cms.jobs.acceptance.acceptance import Acceptance, LeftOut, MeshError, now
from cms.jobs.acceptance.origin import source_files
from cms.jobs.acceptance.range_of_use import custom_band, range_of_use
from cms.jobs.body_of_job import coupled_body, model_of_job, uncoupled_body
from cms.jobs.job import Job, read_job
from cms.jobs.mode_set_of_job import job_mode_set, reduction_of, reduction_options
from cms.jobs.studies.mesh_convergence import mesh_convergence
from cms.linear_algebra.solvers.mode_count import ModeCount
from cms.modes.families.families import Families
from cms.reduction.free_pencil import free_elastic_modes
from fe_models.assembly.assemble import assemble
from fe_models.assembly.tables.materials import solid_properties
from fe_models.body.fe_body import FEBody
from fe_models.body.rigid_motion import rigid_motion_of_points
from fe_models.errors import FeModelsError
from fe_models.files.model_of_deck import DeckOptions, model_of_deck
from fe_models.files.read_deck import parse_deck
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.stages import Stages
from fe_models.foundation.units import UNIT_SYSTEMS
from fe_models.foundation.words import quoted
from fe_models.meshes.mesh import drop_unused_nodes

if TYPE_CHECKING:
    from fe_models.files.decks.deck import Deck

__all__ = ["MODES_BEYOND", "FullModel", "accept", "compare_with_model"]


@dataclass(frozen=True)
class FullModel:
    """Full model for the comparison with a body: a job, or a deck of another program."""

    job: Path | str | None = None  #: path of the job; a body made by this project is also compared with its mode set
    deck: Path | str | None = None  #: path of a complete deck, which is read as by `cms job`
    program: str | None = None  #: program of a deck with suffix .inp: "calculix" or "abaqus"
    densities: Mapping[str, float] = field(default_factory=dict)  #: densities of materials for which the deck has none
    changes: Mapping[str, Any] = field(default_factory=dict)  #: values of parameters and key paths of the job

    def __post_init__(self) -> None:
        if self.job is not None and self.deck is not None:
            raise QualityError("acceptance: expected a job or a deck as the full model, got both")


def accept(
    source: ReducedBody | Path | str,
    full: FullModel | Path | str | None = None,
    *,
    band: float | None = None,
    most_dofs: int = MOST_DOFS,
    stages: Stages | None = None,
) -> Acceptance:
    """Check a reduced body from any program; the result can be signed.

    Parameters
    ----------
    source
        Body, or its modal file.
    full
        Full model of the part, or its job file; None: the file is checked by itself.
    band
        Highest frequency of interest [Hz]; None: the customary band of the body (its highest mode divided by 1.5).
    most_dofs
        Largest number of dofs of the refined model for the estimate of the mesh error; 0: no estimate.
    stages
        Called with the name of each stage.

    Raises
    ------
    CmsError, FeModelsError
        If a file is missing or damaged, or the full model is in other units.
    """
    stages = stages or Stages()
    file = None if isinstance(source, ReducedBody) else Path(source)
    reduced = source if isinstance(source, ReducedBody) else read(source)
    full = full if isinstance(full, FullModel) else FullModel(job=full)
    if band is not None and not (np.isfinite(band) and band > 0):
        raise QualityError(f"acceptance: band: expected a frequency above 0 [Hz], got {band:g}")
    compared, left_out, job = "", None, None
    own = check_body(reduced)
    records = own
    if full.job is not None:
        job = read_job(Path(full.job), full.changes)
        records, compared = against_job(job, Path(full.job), reduced, own, band, stages)
        if job.body.deck is not None:
            left_out = cards_left_out(parse_deck(job.body.deck))
    elif full.deck is not None:
        deck = parse_deck(Path(full.deck), program=full.program)
        left_out = cards_left_out(deck)
        with stages("full model"):
            body = body_of_deck(deck, full, reduced)
        records = (*own, *compare_with_model(body, reduced, band=band or band_of(reduced)))
        compared = f"the deck {full.deck}, {body.n_dof} dofs, its supports removed"
    elif (deck_path := reduced.provenance.get("deck")) and Path(deck_path).is_file():
        left_out = cards_left_out(parse_deck(Path(deck_path)))
    if left_out is not None:
        records = (*records, left_out_record(left_out))
    records = with_default_band(records) if band is None else (*records, band_record(reduced, records, band))
    error = with_estimate_of_file(mesh_error(job, most_dofs, stages), reduced)
    if error.estimate is not None:
        records = (*records, judge("mesh-error", error.largest, error.words, {"error": error.estimate.error}))
    return Acceptance(
        reduced,
        records,
        range_of_use(reduced, records),
        () if has_failed(own) else effective_masses(reduced),
        compared,
        error,
        left_out,
        "" if file is None else str(file),
        "" if file is None else digest_of(file),
        source_files(reduced.provenance, Path.cwd() if file is None else file.resolve().parent),
        now(),
    )


def against_job(
    job: Job, path: Path, reduced: ReducedBody, own: tuple[QualityRecord, ...], band: float | None, stages: Stages
) -> tuple[tuple[QualityRecord, ...], str]:
    """Compare a body with the full model of a job, and with the mode set if the body was made with it."""
    uncoupled = uncoupled_body(job, stages)
    require_same_units(uncoupled, reduced)
    with stages("couple interfaces"):
        body = coupled_body(job, uncoupled)
    name = f"the full model of {path}, {body.n_dof} dofs"
    if reduced.provenance.get("mode set") == job.reduction.set and is_of_one_model(body, reduced):
        with Families(body, solver=job.reduction.solver) as families:
            with stages(f"mode set {job.reduction.set}"):
                modes = job_mode_set(families, reduction_of(job, body))
            top = usable_band(modes, reduced) if band is None else band
            with stages("compare"), FullReference(families, band=top) as reference:
                options = reduction_options(job, body)
                records = check_reduction(
                    body, modes, reduced, reference=reference, uncoupled=uncoupled, own=own, options=options
                )
        return records, f"{name}, and its mode set"
    records = compare_with_model(body, reduced, band=band or band_of(reduced))
    return (*own, *records), f"{name}; the body was made otherwise"


def is_of_one_model(body: "FEBody", reduced: ReducedBody) -> bool:
    """Return whether the provenance of a reduced body states a model of this size."""
    return reduced.provenance.get("full dofs") == str(body.n_dof)


def band_record(reduced: ReducedBody, records: tuple[QualityRecord, ...], band: float) -> QualityRecord:
    """Return the record that states whether the body is valid up to the requested frequency [Hz]."""
    usable = range_of_use(reduced, records).band
    said = f"asked for {band:.6g} Hz; good for up to {usable.highest:.6g} Hz ({usable.words})"
    data = {"asked_hz": band, "usable_hz": usable.highest}
    share = band / usable.highest if usable.highest > 0 else np.inf  # NaN if there are no vibration modes
    return judge("band-asked", float(share), said, data)


def band_of(reduced: ReducedBody) -> float:
    """Return the customary band [Hz], raised by 0.1 % if necessary so that it includes the first free frequency."""
    band = 1.001 * custom_band(reduced).highest
    if not band > 0:
        raise QualityError(f"body {reduced.name!r}: has no elastic frequency to compare; give the band yourself")
    return band


def body_of_deck(deck: "Deck", full: FullModel, reduced: ReducedBody) -> FEBody:
    """Return the free body of a deck in units of the reduced body; unconverted data are omitted."""
    if reduced.units.name not in UNIT_SYSTEMS:
        raise QualityError(
            f"body {reduced.name!r}: is in units {quoted(reduced.units.name)} of its own; convert it (cms frame "
            "--units), so that the deck can be read in the same"
        )
    names = tuple(dict.fromkeys(entry.name for entry in deck.ledger.entries.values() if entry.is_body))
    model = model_of_deck(deck, DeckOptions(reduced.units.name, full.densities, names))
    return assemble(replace(model, tables=model.tables.model_copy(update={"interfaces": {}, "load_cases": {}})))


def cards_left_out(deck: "Deck") -> tuple[LeftOut, ...]:
    """Return the ledger of converted and omitted cards of a deck."""
    return tuple(
        LeftOut(entry.name, entry.count, entry.consequence, entry.is_body) for entry in deck.ledger.entries.values()
    )


def left_out_record(left_out: tuple[LeftOut, ...]) -> QualityRecord:
    """Return the record of the omitted cards of a deck: how many kinds have mass or stiffness."""
    body = [each for each in left_out if each.is_body]
    words = "; ".join(f"{each.count} {each.name}: {each.consequence}" for each in body)
    said = words or f"everything that carries mass or stiffness is taken over; {len(left_out)} kinds of other cards not"
    return judge("left-out", float(len(body)), said, {"cards": [[e.name, e.count, e.consequence] for e in left_out]})


def effective_masses(reduced: ReducedBody) -> tuple[EffectiveMass, ...]:
    """Return the effective masses with one interface fixed, for each interface that can be fixed."""
    if not reduced.n_q:
        return ()
    found = []
    for interface in reduced.interfaces:
        if reduced.is_held or can_be_held(reduced, interface.name):
            try:
                found.append(effective_mass(reduced, interface.name))
            except np.linalg.LinAlgError:  # the records describe the fault
                continue
    return tuple(found)


def mesh_error(job: Job | None, most_dofs: int, stages: Stages) -> MeshError:
    """Estimate the effect of the mesh size on the lowest frequencies, if the job allows it."""
    if job is None:
        return MeshError("not estimated: no job was given whose mesh could be refined")
    if not most_dofs:
        return MeshError("not estimated, as asked")
    try:
        if job.mesh_size is not None:
            found = mesh_convergence(job, n_modes=LOWEST, stages=stages)
            return MeshError(
                f"two sizes, {found.n_dof[0]} and {found.n_dof[1]} dofs: the lowest frequencies of the job's own lie "
                f"too high by up to {100 * float(np.abs(found.error).max()):.2g} %",
                found,
            )
        if job.body.mesh is None or job.shells or job.sections or job.ties:
            return MeshError("not estimated: only bodies of one solid mesh are refined; compare two meshes of your own")
        model = model_of_job(job, Stages())
        (of_group,) = solid_properties(model.tables.solids, model.tables.materials).values()
        refined = mesh_refinement(
            drop_unused_nodes(model.mesh),
            of_group.get("all", of_group),
            units=model.units,
            incompatible_modes=job.body.incompatible_modes,
            most_dofs=most_dofs,
            stages=stages,
        )
    except (CmsError, FeModelsError) as error:
        return MeshError(f"not estimated: {error}")
    return MeshError(
        f"the bare solid with cells of {refined.how}, "
        f"{refined.n_dof[1]} dofs for {refined.n_dof[0]}: the lowest free frequencies lie too high by up to "
        f"{100 * float(refined.error.max()):.2g} %",
        refined,
    )


LOWEST = 6  #: number of the lowest free frequencies whose error by the mesh is stated


def with_estimate_of_file(error: MeshError, reduced: ReducedBody) -> MeshError:
    """Add the estimates that the modal file has, from the modes on its mesh, if no mesh was refined."""
    of_modes = np.zeros(0) if reduced.errors is None else reduced.errors.mesh[:LOWEST]
    if error.estimate is not None or reduced.errors is None or np.isnan(of_modes).all():
        return error
    worst = float(of_modes[np.nanargmax(np.abs(of_modes))])
    too = "too high or too low" if reduced.errors.mesh_sign == "+-" else "too high" if worst > 0 else "too low"
    words = (
        f"{error.words}; by the modes on this mesh, which the file has on record, the lowest "
        f"{len(of_modes)} free frequencies lie {too} by up to {100 * abs(worst):.2g} %"
    )
    return replace(error, words=words, of_file=abs(worst))


# A received body against a full model of the same part: mass, free frequencies, and shapes at nodes in common ---------
# For bodies with an unknown mode set (reduced by another program); one of our own is compared with the mode set of its
# job, which is more informative (`check_reduction`). Nodes are paired by their positions in mesh coordinates.


SAME_PLACE = 1e-5  #: largest distance between nodes at the same position, divided by the size of the body
LEAST_NODES = 6  #: smallest number of common nodes for a comparison of shapes
MODES_BEYOND = 1.2  #: highest frequency of the full modes divided by the band


def compare_with_model(body: FEBody, reduced: ReducedBody, *, band: float) -> tuple[QualityRecord, ...]:
    """Compare a foreign reduced body with a full model.

    Parameters
    ----------
    body
        Full model, in the units and mesh coordinates of the reduced body.
    band
        Highest frequency of interest [Hz].

    Returns
    -------
    tuple of QualityRecord
        Record "model-mass"; unless it fails, also "frequency-error", and "mac-nodal" at the nodes in common.

    Raises
    ------
    QualityError
        If both are in different units.
    """
    require_same_units(body, reduced)
    mass = check_mass_properties(body, reduced)
    records = [judge("model-mass", mass.value, mass.reason, mass.data)]
    if body.is_held or reduced.is_held or records[0].verdict == "fail":
        return tuple(records)
    try:
        omega2, X, is_massive = free_elastic_modes(reduced)
    except np.linalg.LinAlgError as error:
        return (*records, information("frequency-error", f"no free modes of the reduced body: {error}"))
    own = np.sqrt(np.maximum(omega2[is_massive], 0.0)) / (2 * np.pi) / reduced.units.time
    with Families(body) as families:
        modes = families.free_modes(ModeCount(cutoff=MODES_BEYOND * band * body.units.time))
        full, Phi = modes.frequencies / body.units.time, modes.Phi
        n_band = int((full <= band).sum())
        if not n_band:
            lowest = full[0] if len(full) else families.free_modes(1).frequencies[0] / body.units.time
            words = f"the full model has no elastic free mode up to {band:.5g} Hz; its first is at {lowest:.5g} Hz"
            return (*records, information("frequency-error", words))
    here, there = nodes_in_common(body, reduced)
    if len(here) < LEAST_NODES:
        shapes_full, shapes_own = np.zeros((0, n_band)), np.zeros((0, int(is_massive.sum())))
        massed = np.eye(n_band, len(own))
    else:
        shapes_full = body.translations(Phi[:, :n_band])[here].reshape(-1, n_band)
        shapes_own = shapes_in_mesh(reduced, X[:, is_massive])[there].reshape(-1, int(is_massive.sum()))
        massed = mac(shapes_full, shapes_own)
    found = frequency_records(compare_shapes(full[:n_band], own, massed, shapes_full, shapes_own), band)
    for record in found:
        if record.name == "frequency-error":
            records.append(record)
        elif record.name == "mac-nodal" and len(here) >= LEAST_NODES:
            words = f"{record.reason}, at {len(here)} nodes in common"
            records.append(judge("mac-nodal", record.value, words, record.data))
    if len(here) < LEAST_NODES:
        words = f"{len(here)} nodes in common with the full model, at least {LEAST_NODES} are needed to compare shapes"
        records.append(information("mac-nodal", words, action=LIMITS["mac-nodal"].action))
    return tuple(records)


def nodes_in_common(body: FEBody, reduced: ReducedBody) -> tuple[IntArray, IntArray]:
    """Return the nodes of the full model and the kept nodes that have the same positions."""
    if not len(reduced.nodes):
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    places = reduced.frame.origin + np.asarray(reduced.nodes) @ reduced.frame.axes.T
    distance, nearest = cKDTree(body.nodes).query(places)
    there = np.flatnonzero(distance <= SAME_PLACE * body.length)
    return np.asarray(nearest[there], np.int64), there.astype(np.int64)


def shapes_in_mesh(reduced: ReducedBody, X: Array) -> Array:
    """Return translations of the kept nodes in free modes including rigid motion, mesh axes, (n_kept, 3, k)."""
    moved = rigid_motion_of_points(np.asarray(reduced.nodes), np.zeros(3)) @ X[:6] + reduced.Phi @ X[6:]
    return np.asarray(np.einsum("ab,nbk->nak", reduced.frame.axes, moved))
