"""The command `cms check`: verdicts about a modal file, alone or compared with its full model."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import typer

from cms.assessment.quality.numbers import number
from cms.assessment.quality.record import QualityRecord, has_failed, worst
from cms.body.reduced_body import ReducedBody
from cms.cli.console import output_path, print_table, say, stages

__all__ = ["AcceptRequest", "check_file", "print_records", "quality_report", "run_accept"]


WORDS = {"pass": "passes", "warn": "passes with warnings", "fail": "fails", "info": "has nothing to judge"}


def check_file(file: Path, job: Path | None, *, band: float | None, as_json: bool, changes: Mapping[str, Any]) -> int:
    """Check a modal file and print the verdicts; return exit code 1 if one is "fail", else 0."""
    from cms.assessment.quality.body_check import check_body
    from cms.assessment.quality.errors import QualityError
    from cms.body.modal_file.file import read

    if band is not None and job is None:
        raise QualityError("--band: says how far the full model is compared; give its job with --job")
    if changes and job is None:
        raise QualityError("--set: changes parameters of the job; give it with --job")
    reduced = read(file)
    records = check_body(reduced) if job is None else check_against(reduced, job, band, changes)
    if as_json:
        typer.echo(json.dumps(quality_report(reduced, records), indent=2))
    else:
        print_records(f"Quality of {reduced.name}", reduced.name, records)
        if job is None:
            say("Not asked: frequencies, statics and responses against the full model; give its job with --job.")
    return int(has_failed(records))


def check_against(
    reduced: ReducedBody, path: Path, band: float | None, changes: Mapping[str, Any]
) -> tuple[QualityRecord, ...]:
    """Check a reduced body against the full model and the mode set of a job, with one factorisation."""
    from cms.assessment.quality.reduction_check import check_reduction, require_same_units, with_default_band
    from cms.assessment.quality.reference.full_reference import FullReference, usable_band
    from cms.cli.console import stages
    from cms.jobs.body_of_job import coupled_body, uncoupled_body
    from cms.jobs.job import read_job
    from cms.jobs.mode_set_of_job import job_mode_set, reduction_of, reduction_options
    from cms.modes.families.families import Families

    job = read_job(path, changes)
    with stages() as clock:
        uncoupled = uncoupled_body(job, clock)
        require_same_units(uncoupled, reduced)
        with clock("couple interfaces"):
            body = coupled_body(job, uncoupled)
        with Families(body, solver=job.reduction.solver) as families:
            with clock(f"mode set {job.reduction.set}"):
                modes = job_mode_set(families, reduction_of(job, body))
            top = usable_band(modes, reduced) if band is None else band
            with clock("compare"), FullReference(families, band=top) as reference:
                options = reduction_options(job, body)
                found = check_reduction(body, modes, reduced, reference=reference, uncoupled=uncoupled, options=options)
    return with_default_band(found) if band is None else found


def quality_report(reduced: ReducedBody, records: Sequence[QualityRecord]) -> dict[str, Any]:
    """Return the records in plain types, as `cms check --json` writes them."""
    return {
        "body": reduced.name,
        "mode_set": reduced.provenance.get("mode set", ""),
        "verdict": worst(records),
        "records": [record.as_dict() for record in records],
    }


def print_records(title: str, name: str, records: Sequence[QualityRecord]) -> None:
    """Print one row per record, advice for records that do not pass, and the verdict about the body or system."""
    rows = [
        (record.verdict, record.name, number(record.value), number(record.tolerance), record.reason)
        for record in records
    ]
    print_table(title, ("verdict", "check", "value>", "tolerance>", "found"), rows)
    loads = [row for record in records if record.name == "buckling" for row in record.data.get("loads", [])]
    if loads:
        print_table(
            "Loads that buckle the body, each alone, along the axes of B",
            ("load", "along>", "against>", "unit"),
            [(load, number(along), number(against), unit) for load, along, against, unit in loads],
        )
    todo = [record for record in records if record.action]
    if todo:
        print_table("Next", ("check", "what to do"), [(record.name, record.action) for record in todo])
    counts = {verdict: sum(r.verdict == verdict for r in records) for verdict in ("fail", "warn", "pass", "info")}
    say(
        f"{name} {WORDS[worst(records)]}: "
        + ", ".join(f"{count} {verdict}" for verdict, count in counts.items() if count)
    )


# the command `cms accept`: the acceptance document of a reduced body --------------------------------------------------


@dataclass(frozen=True)
class AcceptRequest:
    """Arguments of the command `cms accept`."""

    file: Path
    full: Path | None
    deck: Path | None
    program: str | None
    densities: tuple[str, ...]
    band: float | None
    most_dofs: int
    strict: bool
    outputs: tuple[Path, ...]
    changes: Mapping[str, Any]  #: values of parameters of the job


def run_accept(request: AcceptRequest) -> int:
    """Check the body, write the document, print the verdict; return exit code 1 if the body is not accepted."""
    from cms.assessment.quality.errors import QualityError
    from cms.cli.job import densities_of
    from cms.jobs.acceptance.accept import FullModel, accept
    from cms.jobs.acceptance.document import require_suffix, write_acceptance
    from fe_models.foundation.extras import extra_module

    if request.deck is None and (request.program or request.densities):
        option = "--program" if request.program else "--density"
        raise QualityError(f"{option}: says how a deck is read; give the deck with --deck")
    if request.changes and request.full is None:
        raise QualityError("--set: changes parameters of the job; give it with --job")
    if request.full is not None and request.deck is not None:
        raise QualityError("--job and --deck: expected one full model, got two")
    wanted = request.outputs or (request.file.with_name(f"{request.file.stem}_acceptance.pdf"),)
    inputs = [path for path in (request.file, request.full, request.deck) if path is not None]
    targets = [output_path(path, "", QualityError, overwrite_of=inputs) for path in wanted]
    for target in targets:
        require_suffix(target)
        if target.suffix.lower() == ".pdf":
            extra_module("reportlab", extra="pdf", purpose="write a document as PDF")
    model = FullModel(
        request.full, request.deck, request.program, densities_of(request.densities), changes=request.changes
    )
    with stages() as clock:
        found = accept(request.file, model, band=request.band, most_dofs=request.most_dofs, stages=clock)
        with clock("document"):
            write_acceptance(found, *targets)
    todo = [(r.verdict, r.name, r.reason, r.action) for r in found.records if r.verdict in ("fail", "warn")]
    if todo:
        print_table("To be looked at", ("verdict", "check", "found", "what to do"), todo)
    band = found.range.band
    say(f"Good for frequencies up to {band.highest:.5g} Hz: {band.words}")
    say(f"Mesh: {found.mesh_error.words}")
    for target in targets:
        say(f"wrote {target}")
    say(found.words)
    return int(found.verdict == "fail" or (request.strict and found.verdict == "warn"))
