"""The command `cms correlate`: measured modes compared with those of a model, and the updated job."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from cms.cli.console import output_path, print_table, say, stages
from cms.cli.outputs import DOCUMENTS, TABLES, output_files, write_outputs
from cms.cli.verdicts.check import print_records

if TYPE_CHECKING:
    from cms.assessment.correlation.correlate import Correlation
    from cms.assessment.correlation.update import Parameter, Update
    from fe_models.foundation.arrays import Array

__all__ = ["CorrelateRequest", "run_correlate"]


@dataclass(frozen=True)
class CorrelateRequest:
    """Arguments of the command `cms correlate`."""

    file: Path
    outputs: tuple[Path, ...]
    updated: Path | None
    as_json: bool


def run_correlate(request: CorrelateRequest) -> None:
    """Compare; update if the file has [update]; print pairs and parameters; write report and updated job."""
    from cms.assessment.correlation.errors import CorrelationError
    from cms.jobs.studies.correlation_file import correlate, read_correlation
    from cms.jobs.studies.correlation_report import correlation_document

    asked = read_correlation(request.file)

    def updated(_: Path) -> bytes:
        assert asked.model.job is not None
        assert result.update is not None
        return updated_text(asked.model.job, result.update.parameters, result.update.values).encode()

    inputs = [path for path in (request.file, asked.test.file, asked.model.job, asked.model.body) if path is not None]
    default = () if request.as_json else (request.file.with_suffix(".html"),)
    endings = (*DOCUMENTS, *TABLES)
    paths = output_files(request.outputs, default, endings, CorrelationError, overwrite_of=inputs, needs_file=True)
    others = {}
    if request.updated is not None:
        if asked.update is None or asked.model.job is None:
            raise CorrelationError("--updated-job: the file has no table [update]")
        job = output_path(request.updated, "", CorrelationError, overwrite_of=inputs, needs_file=True)
        if job.resolve().parent != asked.model.job.resolve().parent:
            raise CorrelationError(
                f"--updated-job {job}: expected a file beside {asked.model.job}, whose paths are relative to its folder"
            )
        paths.append(job)
        others[job.suffix.lower()] = updated
    with stages() as clock:
        result = correlate(asked, clock)
    record, last = result.as_dict(), result.last
    if request.as_json:
        typer.echo(json.dumps(record, indent=2))
    else:
        print_pairs(last, "updated model" if result.update else "model")
        if result.update is not None:
            print_parameters(result.update)
        for fit in result.damping:
            say(f"damping, {fit.kind}: {', '.join(f'{v:.4g}' for v in fit.values)}, misfit {100 * fit.misfit:.2g} %")
        print_records("Test and model", last.model.name, last.records)

    write_outputs(
        paths, table=last.to_table, record=record, document=lambda: correlation_document(result),
        others=others, is_quiet=request.as_json,
    )  # fmt: skip


def print_pairs(c: "Correlation", what: str) -> None:
    """Print one row for each measured mode."""
    partner = {pair.measured: (pair, off) for pair, off in zip(c.pairs, c.errors, strict=True)}
    rows = []
    for k, f in enumerate(c.measured.frequencies):
        row = (str(k + 1), f"{f:.6g}", "none", "", "", f"{c.mac[k].max():.3f}")
        if k in partner:
            pair, off = partner[k]
            computed = f"{c.model.frequencies[pair.computed]:.6g}"
            row = (str(k + 1), f"{f:.6g}", str(pair.computed + 1), computed, f"{100 * off:+.2f}", f"{pair.mac:.3f}")
        rows.append(row)
    headings = ("measured>", "Hz>", "computed>", "Hz>", "error %>", "MAC>")
    print_table(f"{c.model.name}: modes of the test and of the {what}", headings, rows)


def print_parameters(update: "Update") -> None:
    """Print the updated parameters with their standard deviations."""
    u = update
    rows = [
        (p.path, f"{p.start:.6g}", f"{v:.6g}", f"{100 * s:.2g}", f"{100 * told:.0f}")
        for p, v, s, told in zip(u.parameters, u.values, u.spread, u.determined, strict=True)
    ]
    print_table("Updated", ("parameter", "start>", "updated>", "spread %>", "from the test %>"), rows)
    if not u.is_converged:
        say("the update did not converge; look at the parameters that the test does not tell")


def updated_text(path: Path, parameters: "tuple[Parameter, ...]", values: "Array") -> str:
    """Return the job text with updated values; comments and order remain."""
    import tomlkit

    from cms.assessment.correlation.errors import CorrelationError
    from fe_models.foundation.toml_file import first_key

    document = tomlkit.parse(path.read_text(encoding="utf-8-sig"))
    for parameter, value in zip(parameters, values, strict=True):
        is_parameter = parameter.path in document.get("parameters", {})
        here, left = document, f"parameters.{parameter.path}" if is_parameter else parameter.path
        while True:
            key, rest = first_key(here, left)
            if rest is None:
                break
            if key is None:
                raise CorrelationError(f"{path}: the key path {parameter.path!r} is not there")
            here, left = here[key], rest
        here[int(left) if isinstance(here, list) else left] = float(f"{value:.8g}")
    return str(tomlkit.dumps(document))
