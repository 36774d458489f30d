"""The commands that vary parameters: sweep, study, gradient."""

import json as json_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cms.cli.arguments import Journal, Workers
from cms.cli.console import USER_ERROR, guarded, output_path, print_error, print_table, say, stages

if TYPE_CHECKING:
    from floatframe.design.gradients import Sensitivities
    from floatframe.design.laboratory.laboratory import LaboratoryResult
    from floatframe.design.studies.study import StudyTable

__all__ = ["compare_command", "gradient_command", "sweep_command"]


# the command sweep: parameter studies of a system ---------------------------------------------------------------------


SWEEP_KINDS = ("csv", "json", "png", "svg", "pdf")
MOST_ROWS = 60  #: largest number of printed rows


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
    """Vary parameters of a system, by parallel workers.

    Each point is a run, an equilibrium or a set of modes.

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
        if path.suffix.lower().removeprefix(".") not in SWEEP_KINDS:
            raise ModelError(
                f"--output {path}: expected a file name that ends in {', '.join('.' + k for k in SWEEP_KINDS)}"
            )
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
            replace_file(path, sweep_csv(table).encode())
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
    from floatframe.design.studies.study_plots import value_label

    rows = [
        (
            *(value_label(value) for value in row.values),
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
        point = ", ".join(
            f"{p.name} = {value_label(v)}" for p, v in zip(table.study.parameters, row.values, strict=True)
        )
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


def sweep_csv(table: "StudyTable") -> str:
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


# the command compare: models of a flexible body compared with a reference ---------------------------------------------


STUDY_KINDS = (".csv", ".json", ".png", ".svg", ".pdf")


@guarded
def compare_command(
    file: Annotated[Path, typer.Argument(help="Laboratory file (TOML), see docs/laboratory.md.")],
    outputs: Annotated[
        list[Path] | None, typer.Option("--output", "-o", help="A .csv, .json, .png, .svg or .pdf file; repeatable.")
    ] = None,
) -> None:
    """Run a mechanism with many models of its flexible body.

    Mode sets, body frames, numbers of modes, stiffening and parts are compared.

    The result contains error against a reference, cost, and the first limit that is exceeded. A failed case is a row
    with its reason. Without -o, a table and a picture are written next to the file: blade.toml gives blade.csv and
    blade.png.

    Example: floatframe compare blade.toml -o blade.csv -o blade.pdf
    """
    import io

    from fe_models.foundation.paths import replace_files
    from floatframe.design.laboratory.figures import convergence_figure
    from floatframe.design.laboratory.laboratory_file import read_laboratory, run_laboratory
    from floatframe.errors import ModelError

    asked = read_laboratory(file)
    wanted = outputs or [file.with_suffix(".csv"), file.with_suffix(".png")]
    inputs = (file, asked.system, asked.job)
    paths = [output_path(path, None, ModelError, overwrite_of=inputs, needs_file=True) for path in wanted]
    for path in paths:
        if path.suffix.lower() not in STUDY_KINDS:
            raise ModelError(f"--output {path}: expected a file name that ends in {', '.join(STUDY_KINDS)}")
    with stages() as clock:
        result = run_laboratory(asked, clock)
    contents: dict[Path, bytes] = {}
    for path in paths:
        if path.suffix.lower() == ".json":
            record = {"name": result.name, "reference": result.reference, "settled": result.settled,
                      "cases": result.table()}  # fmt: skip
            contents[path] = json_module.dumps(record, indent=2).encode()
        elif path.suffix.lower() == ".csv":
            contents[path] = csv_text(result).encode()
        else:
            target = io.BytesIO()
            convergence_figure(result).savefig(target, format=path.suffix.lower().removeprefix("."), dpi=200)
            contents[path] = target.getvalue()
    try:
        replace_files(contents)
    except OSError as error:
        raise ModelError(f"study: cannot be written: {error.strerror or error}; check folder and space") from error
    print_result(result)
    for path in paths:
        say(f"wrote {path}")
    if all(row.failure for row in result.cases):
        raise typer.Exit(USER_ERROR)


def csv_text(result: "LaboratoryResult") -> str:
    """Return the tidy table as CSV."""
    import csv
    import io

    rows = result.table()
    text = io.StringIO()
    writer = csv.DictWriter(text, fieldnames=list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def print_result(result: "LaboratoryResult") -> None:
    """Print one row per case."""
    rows = []
    for r in result.cases:
        if r.failure:
            rows.append((r.case.description, str(r.case.n_modes), "", "fails", "", "", "", r.failure))
            continue
        note = "" if not r.notes else r.notes[0] + (f" ({len(r.notes)} notes)" if len(r.notes) > 1 else "")
        told = (str(r.n_q), f"{100 * r.error:.3g}", r.worst, r.fails_first, f"{r.seconds:.3g}", note)
        rows.append((r.case.description, str(r.case.n_modes), *told))
    settled = "" if result.settled is None else f", itself settled to {100 * result.settled:.2g} %"
    print_table(
        f"{result.name}, against {result.reference}{settled}",
        ("description", "modes>", "coordinates>", "error %>", "of", "fails first", "time [s]>", "note"),
        rows,
    )


# the command gradient: derivatives of outputs by parameters of a system file ------------------------------------------


@guarded
def gradient_command(
    system: Annotated[Path, typer.Argument(help="System file (TOML), see docs/system_file.md.")],
    outputs: Annotated[
        list[str],
        typer.Option("--out", "-m", help='A column, "tip x"; "tip x:rms"; of modes "frequency 1"; repeatable.'),
    ] = [],  # noqa: B006
    parameters: Annotated[
        list[str], typer.Option("--parameter", "-p", help="KEY.PATH of a number in the file; repeatable.")
    ] = [],  # noqa: B006
    analysis: Annotated[str, typer.Option(help="run, static, rotation or modes.")] = "run",
    omega: Annotated[str | None, typer.Option(help='Of rotation: angular velocity "x,y,z", rad per time unit.')] = None,
    center: Annotated[str, typer.Option(help='Of rotation: a point of the axis, "x,y,z".')] = "0,0,0",
    method: Annotated[str, typer.Option(help="direct or adjoint.")] = "direct",
    output: Annotated[Path | None, typer.Option("--output", "-o", help="A .csv or .json file.")] = None,
    json: Annotated[bool, typer.Option("--json", help="Write the result as JSON, for other programs.")] = False,
) -> None:
    """Derivatives of results by numbers of the system file.

    Results are motions, equilibria, steady rotations or frequencies; one run gives all derivatives.

    Sensors as `floatframe info` lists them. The cost of direct grows with the number of parameters, that of adjoint
    with the number of outputs.

    Example: floatframe gradient crank.toml -m "tip x" -p bodies.rod.mass -p forces.spring.stiffness

    Example: floatframe gradient governor.toml --analysis rotation --omega 0,0,6 -m "arm.distance value" -p
    forces.spring.stiffness

    Example: floatframe gradient arm.toml --analysis modes -m "frequency 1" -p forces.bush.stiffness
    """
    from fe_models.foundation.paths import replace_file
    from floatframe.cli.analyses import vector
    from floatframe.design.gradients import sensitivities
    from floatframe.design.studies.study_file import TAKES
    from floatframe.errors import ModelError

    path = None if output is None else output_path(output, None, ModelError, overwrite_of=(system,))
    if path is not None and path.suffix.lower() not in (".csv", ".json"):
        raise ModelError(f"--output {path}: expected a file name that ends in .csv or .json")
    if not outputs or not parameters:
        raise ModelError("gradient: expected at least one --out and one --parameter")
    wanted: dict[str, str | tuple[str, str]] = {}
    for text in outputs:
        of, colon, take = text.rpartition(":")
        wanted[text] = (of, take) if colon and take in TAKES else text
    with stages() as clock, clock("derivatives"):
        found = sensitivities(
            system, wanted, parameters, analysis=analysis, method=method,
            omega=None if omega is None else vector(omega, "--omega"), center=vector(center, "--center"),
        )  # fmt: skip
    record = record_of(found)
    if json:
        typer.echo(json_module.dumps(record, indent=2))
    else:
        for k, name in enumerate(found.outputs):
            rows = [
                (parameter, f"{value:.6g}", f"{slope:.9g}", f"{share:.4g}")
                for parameter, value, slope, share in zip(
                    found.parameters, found.parameter_values, found.gradient[k], found.relative[k], strict=True
                )
            ]
            unit = f" {found.units[k]}" if found.units[k] else ""
            print_table(
                f"{name} = {found.values[k]:.9g}{unit}", ("parameter", "value>", "derivative>", "% for 1 %>"), rows
            )
    if path is not None:
        text = gradient_csv(found) if path.suffix.lower() == ".csv" else json_module.dumps(record, indent=2) + "\n"
        replace_file(path, text.encode())
        if not json:
            say(f"wrote {path} ({path.stat().st_size / 1e6:.2f} MB)")


def record_of(found: "Sensitivities") -> dict[str, Any]:
    """Return a result in plain types."""
    return {
        "outputs": {
            name: {"value": float(value), "unit": unit}
            for name, value, unit in zip(found.outputs, found.values, found.units, strict=True)
        },
        "parameters": dict(zip(found.parameters, map(float, found.parameter_values), strict=True)),
        "gradient": {
            name: dict(zip(found.parameters, map(float, row), strict=True))
            for name, row in zip(found.outputs, found.gradient, strict=True)
        },
        "repeated": list(found.repeated),
    }


def gradient_csv(found: "Sensitivities") -> str:
    """Return one row per output and parameter, with 17 digits."""
    import csv
    import io

    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["output", "unit", "value", "parameter", "at", "derivative"])
    for name, unit, value, row in zip(found.outputs, found.units, found.values, found.gradient, strict=True):
        for parameter, at, slope in zip(found.parameters, found.parameter_values, row, strict=True):
            writer.writerow([name, unit, repr(float(value)), parameter, repr(float(at)), repr(float(slope))])
    return text.getvalue()
