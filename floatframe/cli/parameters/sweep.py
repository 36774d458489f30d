"""The command sweep: parameter studies of a system."""

import json as json_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cms.cli.arguments import Journal, Workers
from cms.cli.console import USER_ERROR, guarded, output_path, print_error, print_table, say, stages

if TYPE_CHECKING:
    from floatframe.design.studies.study import StudyTable

__all__ = ["register"]

KINDS = ("csv", "json", "png", "svg", "pdf")
MOST_ROWS = 60  #: largest number of printed rows


def register(app: typer.Typer) -> None:
    """Add the command to an application."""
    app.command("sweep")(sweep_command)


@guarded
def sweep_command(
    study: Annotated[Path, typer.Argument(help="Study file (TOML), see docs/analyses.md.")],
    outputs: Annotated[
        list[Path],
        typer.Option("--output", "-o", help="A .csv, .json, .png, .svg or .pdf file; repeatable."),
    ] = [],  # noqa: B006
    journal: Journal = None,
    workers: Workers = None,
    json: Annotated[bool, typer.Option("--json", help="Write the table as JSON, for other programs.")] = False,
) -> None:
    """Vary parameters of a system: a run, an equilibrium or a set of modes for every point, by parallel workers.

    A failed point is a row with its reason; the others continue. Every point is recorded in a journal (study.toml:
    study.journal); after an interruption, the same command continues. Without -o, a table is written next to the study:
    study.toml gives study.csv.

    Example: floatframe sweep study.toml -o study.csv -o study.png

    Example: floatframe sweep study.toml --workers dask://cluster:8786
    """
    import io

    from fe_models.foundation.paths import replace_file
    from fe_models.foundation.tasks.workers import tasks_of
    from floatframe.design.studies.study import run_study
    from floatframe.design.studies.study_file import read_study
    from floatframe.design.studies.study_plots import plot_study
    from floatframe.errors import ModelError
    from floatframe.files.system_file.read_system import read_system

    described = read_study(study)
    inputs = (study, Path(described.system), *read_system(described.system)[0].files)
    kept = output_path(journal, study.with_suffix(".journal"), ModelError, overwrite_of=inputs, needs_file=True)
    wanted = outputs or ([] if json else [study.with_suffix(".csv")])
    paths = [output_path(path, None, ModelError, overwrite_of=(*inputs, kept)) for path in wanted]
    for path in paths:
        if path.suffix.lower().removeprefix(".") not in KINDS:
            raise ModelError(f"--output {path}: expected a file name that ends in {', '.join('.' + k for k in KINDS)}")
    n = sum(1 for _ in described.points())
    asked = described.workers if workers is None else workers
    with stages(remaining=True) as clock, tasks_of(asked, n) as tasks:
        if described.analysis == "run":
            from floatframe.engine.kernels.entry import prepare

            with clock("compiled code (made at first use)"):
                prepare()  # once, before many processes need it
        with clock(f"{n} points") as advance:
            table = run_study(described, workers=tasks, journal=kept, progress=lambda done, all_: advance(done / all_))
    record = study_record(table)
    if json:
        typer.echo(json_module.dumps(record, indent=2))
    else:
        print_study(table)
    for path in paths:
        kind = path.suffix.lower().removeprefix(".")
        if kind == "csv":
            replace_file(path, csv_of(table).encode())
        elif kind == "json":
            replace_file(path, (json_module.dumps(record, indent=2) + "\n").encode())
        else:
            picture = io.BytesIO()
            plot_study(table).savefig(picture, format=kind, dpi=130)
            replace_file(path, picture.getvalue())
        if not json:
            say(f"wrote {path} ({path.stat().st_size / 1e6:.2f} MB)")
    if table.n_failed == len(table.rows):
        print_error(f"no point gave a result; the first one: {table.rows[0].error}")
        raise typer.Exit(USER_ERROR)


def headers(table: "StudyTable") -> list[str]:
    """Return the names of the columns: parameters, and outputs with their units."""
    study = table.study
    named = [f"{o.name} [{unit}]" if unit else o.name for o, unit in zip(study.outputs, table.units, strict=True)]
    return [parameter.name for parameter in study.parameters] + named


def print_study(table: "StudyTable") -> None:
    """Print the table, and the reasons of failed points."""
    from floatframe.design.studies.study_plots import shown

    rows = [
        (
            *(shown(value) for value in row.values),
            *(("failed",) * len(row.outputs) if row.error else (f"{value:.6g}" for value in row.outputs)),
        )
        for row in table.rows
    ]
    n = len(table.study.parameters)
    names = headers(table)
    print_table("Study", tuple([*names[:n], *(f"{name}>" for name in names[n:])]), rows[:MOST_ROWS])
    if len(rows) > MOST_ROWS:
        say(f"... and {len(rows) - MOST_ROWS} more points, in the files written")
    for row in [row for row in table.rows if row.error][:5]:
        point = ", ".join(f"{p.name} = {shown(v)}" for p, v in zip(table.study.parameters, row.values, strict=True))
        say(f"failed at {point}: {row.error}")
    if table.n_known:
        say(f"{table.n_known} of {len(table.rows)} points were in the journal")
    if table.n_failed:
        say(f"{table.n_failed} of {len(table.rows)} points failed")


def study_record(table: "StudyTable") -> dict[str, Any]:
    """Return a study in plain types; values of failed points are null."""
    study = table.study
    return {
        "system": study.system,
        "analysis": study.analysis,
        "parameters": {parameter.name: parameter.path for parameter in study.parameters},
        "outputs": {
            output.name: {"of": output.of, "take": output.take, "unit": unit}
            for output, unit in zip(study.outputs, table.units, strict=True)
        },
        "points": [
            {
                "parameters": {p.name: value for p, value in zip(study.parameters, row.values, strict=True)},
                "outputs": {
                    o.name: None if row.error else value for o, value in zip(study.outputs, row.outputs, strict=True)
                },
                "error": row.error or None,
            }
            for row in table.rows
        ],
    }


def csv_of(table: "StudyTable") -> str:
    """Return a study as comma-separated values with 17 digits; a failed point has empty cells and a reason."""
    import csv
    import io

    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*headers(table), "error"])
    for row in table.rows:
        numbers = ["" if row.error else repr(value) for value in row.outputs]
        writer.writerow([*(repr(v) if isinstance(v, float) else v for v in row.values), *numbers, row.error])
    return text.getvalue()
