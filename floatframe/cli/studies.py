"""The commands that vary parameters: sweep, study, gradient."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cms.cli.arguments import Journal, SetValues, Workers, changes_of
from cms.cli.console import USER_ERROR, guarded, output_path, print_error, print_table, say, stages
from cms.cli.outputs import PICTURES, TABLES, json_text, output_files, write_outputs

if TYPE_CHECKING:
    from floatframe.design.gradients import Sensitivities
    from floatframe.design.laboratory.laboratory import LaboratoryResult
    from floatframe.design.studies.study import StudyTable

__all__ = ["compare_command", "gradient_command", "sweep_command"]


# the command sweep: parameter studies of a system ---------------------------------------------------------------------


MOST_ROWS = 60  #: largest number of printed rows


@guarded
def sweep_command(
    study: Annotated[Path, typer.Argument(help="Study file (TOML), see docs/sweeps.md.")],
    outputs: Annotated[
        list[Path],
        typer.Option(
            "--output",
            "-o",
            help="A page (.html), table (.csv, .json, .mat, .npz, .parquet) or picture (.png, .svg, .pdf); repeatable.",
        ),
    ] = [],  # noqa: B006
    journal: Journal = None,
    workers: Workers = None,
    set_values: SetValues = [],  # noqa: B006
    json: Annotated[bool, typer.Option("--json", help="Write the table as JSON, for other programs.")] = False,
) -> None:
    """Vary parameters of a system, by parallel workers.

    Each point is a run, an equilibrium or a set of modes.

    A failed point is a row with its reason; the others continue. Every point is recorded in a journal (study.toml:
    study.journal); after an interruption, the same command continues. Without -o, a table is written next to the study:
    study.toml gives study.csv.

    Example: floatframe sweep study.toml -o study.csv -o study.png

    With --set, other parameters of the system have these values at all points.

    Example: floatframe sweep study.toml --set length=0.4

    Example: floatframe sweep study.toml --workers dask://cluster:8786
    """
    from dataclasses import replace

    from fe_models.foundation.documents.html import html_page
    from fe_models.foundation.tasks.workers import tasks_of
    from floatframe.design.studies.study import run_study
    from floatframe.design.studies.study_file import read_study
    from floatframe.design.studies.study_plots import plot_study
    from floatframe.design.studies.study_report import study_document
    from floatframe.errors import ModelError
    from floatframe.files.system_file.read_system import read_system

    described = replace(read_study(study), given=changes_of(set_values))
    inputs = (study, Path(described.system), *read_system(described.system, described.given)[0].files)
    kept = output_path(journal, study.with_suffix(".journal"), ModelError, overwrite_of=inputs, needs_file=True)
    default = [] if json else [study.with_suffix(".csv")]
    endings = (*TABLES, *PICTURES, ".html")
    paths = output_files(outputs, default, endings, ModelError, overwrite_of=(*inputs, kept))
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
        typer.echo(json_text(record), nl=False)
    else:
        print_study(table)
    write_outputs(
        paths, table=table.to_table, record=record, figure=lambda: plot_study(table), is_quiet=json,
        others={".html": lambda _: html_page(study_document(table)).encode()},
    )  # fmt: skip
    if table.n_failed == len(table.rows):
        print_error(f"no point gave a result; the first one: {table.rows[0].error}")
        raise typer.Exit(USER_ERROR)


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
    names = table.to_table().heads[:-1]
    print_table("Study", tuple([*names[:n], *(f"{name}>" for name in names[n:])]), rows[:MOST_ROWS])
    if len(rows) > MOST_ROWS:
        say(f"... and {len(rows) - MOST_ROWS} more points in the written files")
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


# the command compare: models of a flexible body compared with a reference ---------------------------------------------


@guarded
def compare_command(
    file: Annotated[Path, typer.Argument(help="Laboratory file (TOML), see docs/laboratory.md.")],
    outputs: Annotated[
        list[Path] | None,
        typer.Option(
            "--output",
            "-o",
            help="A page (.html), table (.csv, .json, .mat, .npz, .parquet) or picture (.png, .svg, .pdf); repeatable.",
        ),
    ] = None,
) -> None:
    """Run a mechanism with many models of its flexible body.

    Mode sets, body frames, numbers of modes, stiffening and parts are compared.

    The result contains error against a reference, cost, and the first limit that is exceeded. A failed case is a row
    with its reason. Without -o, a table and a picture are written next to the file: blade.toml gives blade.csv and
    blade.png.

    Example: floatframe compare blade.toml -o blade.csv -o blade.pdf
    """
    from fe_models.foundation.documents.html import html_page
    from floatframe.design.laboratory.figures import convergence_figure
    from floatframe.design.laboratory.laboratory_file import read_laboratory, run_laboratory
    from floatframe.design.laboratory.report import laboratory_document
    from floatframe.errors import ModelError

    asked = read_laboratory(file)
    default = [file.with_suffix(".csv"), file.with_suffix(".png")]
    inputs = (file, asked.system, asked.job)
    endings = (*TABLES, *PICTURES, ".html")
    paths = output_files(outputs, default, endings, ModelError, overwrite_of=inputs, needs_file=True)
    with stages() as clock:
        result = run_laboratory(asked, clock)
    print_result(result)
    record = {"name": result.name, "reference": result.reference, "settled": result.settled, "cases": result.table()}
    write_outputs(
        paths, table=result.to_table, record=record, figure=lambda: convergence_figure(result), dpi=200,
        others={".html": lambda _: html_page(laboratory_document(result)).encode()},
    )  # fmt: skip
    if all(row.failure for row in result.cases):
        raise typer.Exit(USER_ERROR)


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
        typer.Option("--out", help='A column, "tip x"; "tip x:rms"; of modes "frequency 1"; repeatable.'),
    ] = [],  # noqa: B006
    parameters: Annotated[
        list[str], typer.Option("--parameter", "-p", help="KEY.PATH of a number in the file; repeatable.")
    ] = [],  # noqa: B006
    analysis: Annotated[str, typer.Option(help="run, static, rotation or modes.")] = "run",
    omega: Annotated[
        str | None, typer.Option(help='For rotation: angular velocity "x,y,z", rad per time unit.')
    ] = None,
    center: Annotated[str, typer.Option(help='For rotation: a point of the axis, "x,y,z".')] = "0,0,0",
    method: Annotated[str, typer.Option(help="direct or adjoint.")] = "direct",
    output: Annotated[Path | None, typer.Option("--output", "-o", help="A table (.csv, .json, .mat, ...).")] = None,
    json: Annotated[bool, typer.Option("--json", help="Write the result as JSON, for other programs.")] = False,
) -> None:
    """Derivatives of results by numbers of the system file.

    Results are motions, equilibria, steady rotations or frequencies; one run gives all derivatives.

    Sensors as `floatframe info` lists them. The cost of direct grows with the number of parameters, that of adjoint
    with the number of outputs.

    Example: floatframe gradient crank.toml --out "tip x" -p bodies.rod.mass -p forces.spring.stiffness

    Example: floatframe gradient governor.toml --analysis rotation --omega 0,0,6 --out "arm.distance value" -p
    forces.spring.stiffness

    Example: floatframe gradient arm.toml --analysis modes --out "frequency 1" -p forces.bush.stiffness
    """
    from floatframe.cli.analyses import vector
    from floatframe.design.gradients import sensitivities
    from floatframe.design.studies.study_file import TAKES
    from floatframe.errors import ModelError

    paths = output_files(None if output is None else [output], [], TABLES, ModelError, overwrite_of=(system,))
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
        typer.echo(json_text(record), nl=False)
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
    write_outputs(paths, table=found.to_table, record=record, is_quiet=json)


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
