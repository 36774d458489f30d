"""The command `cms check`: verdicts about a modal file, alone or against its full model."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import typer

from cms.cli.console import print_table, say
from cms.quality.record import QualityRecord, has_failed, worst
from cms.reduced_body import ReducedBody

__all__ = ["check_file", "print_records", "quality_report"]

WORDS = {"pass": "passes", "warn": "passes with warnings", "fail": "fails", "info": "has nothing to judge"}


def check_file(file: Path, job: Path | None, *, as_json: bool) -> int:
    """Check a modal file and print the verdicts; the exit code is 1 if one fails, else 0."""
    from cms.modal_file import read
    from cms.quality.body_check import check_body

    reduced = read(file)
    records = check_body(reduced) if job is None else check_against(reduced, job)
    if as_json:
        typer.echo(json.dumps(quality_report(reduced, records), indent=2))
    else:
        print_records(reduced, records)
    return int(has_failed(records))


def check_against(reduced: ReducedBody, job: Path) -> tuple[QualityRecord, ...]:
    """Check a reduced body against the full model of a job."""
    from cms.cli.console import stages
    from cms.cli.full_model import full_model
    from cms.job import read_job
    from cms.quality.reduction_check import check_reduction

    with stages() as clock:
        model = full_model(read_job(job), clock)
        with clock("compare"):
            return check_reduction(model.body, model.modes, reduced, uncoupled=model.uncoupled)


def quality_report(reduced: ReducedBody, records: Sequence[QualityRecord]) -> dict[str, Any]:
    """Return records in plain types: what `cms check --json` writes."""
    return {
        "body": reduced.name,
        "mode_set": reduced.provenance.get("mode set", ""),
        "verdict": worst(records),
        "records": [record.as_dict() for record in records],
    }


def print_records(reduced: ReducedBody, records: Sequence[QualityRecord]) -> None:
    """Print one row per record, worst last, then what to do about those that do not pass."""
    rows = [
        (record.verdict, record.name, number(record.value), number(record.tolerance), record.reason)
        for record in records
    ]
    print_table(f"Quality of {reduced.name}", ("verdict", "check", "value>", "tolerance>", "found"), rows)
    todo = [record for record in records if record.action]
    if todo:
        print_table("Next", ("check", "what to do"), [(record.name, record.action) for record in todo])
    counts = {verdict: sum(r.verdict == verdict for r in records) for verdict in ("fail", "warn", "pass", "info")}
    say(
        f"{reduced.name} {WORDS[worst(records)]}: "
        + ", ".join(f"{count} {verdict}" for verdict, count in counts.items() if count)
    )


def number(value: float | None) -> str:
    """Return a value with three digits; none where there is none."""
    return "" if value is None or value != value else f"{value:.3g}"
