"""The commands that find parameters: identify, optimize."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cms.cli.arguments import Journal, SetValues, Workers, changes_of
from cms.cli.console import guarded, output_path, print_table, say, stages
from cms.cli.outputs import DOCUMENTS, PICTURES, TABLES, json_text, output_files, write_outputs

if TYPE_CHECKING:
    from fe_models.foundation.documents.table import Table
    from floatframe.design.identification.excitation import ExcitingMotion
    from floatframe.design.identification.regressors import LinearForm
    from floatframe.design.optimization.optimize import Evaluated, OptimizationResult

__all__ = ["identify_command", "optimize_command"]


# the command identify: inertial parameters of a tree from a measured motion -------------------------------------------


@guarded
def identify_command(
    system: Annotated[Path, typer.Argument(help="System file (TOML) of a tree of rigid bodies, or with loops.")],
    data: Annotated[Path, typer.Argument(help="Measured motion (.csv, .mat, ...), see docs/identification.md.")],
    outputs: Annotated[
        list[Path],
        typer.Option("--output", "-o", help="A .html, .pdf or .json file; repeatable."),
    ] = [],  # noqa: B006
    terms: Annotated[
        str,
        typer.Option("--terms", help="Of each drive, with commas: motor-inertia, viscous, coulomb, offset; none."),
    ] = "viscous,coulomb",
    method: Annotated[str, typer.Option("--method", help="ordinary, weighted or robust.")] = "weighted",
    cutoff: Annotated[float | None, typer.Option("--cutoff", help="Filter all channels above this [Hz].")] = None,
    thin: Annotated[int | None, typer.Option("--thin", min=1, help="Use every n-th row only.")] = None,
    check: Annotated[
        Path | None, typer.Option("--check", help="Another measured motion, on which the estimate is tried.")
    ] = None,
    real: Annotated[
        bool, typer.Option("--real/--no-real", help="Find real bodies (positive masses and inertias) too.")
    ] = True,
    motion: Annotated[
        Path | None, typer.Option("--motion", help="Write a more informative motion, a table (.csv, ...) of positions.")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Write the result as JSON, for other programs.")] = False,
) -> None:
    """Inertial parameters of a robot from a measured motion.

    Base parameters are given with their deviations.

    Columns of the data are the positions of all coordinates, named as in results (joint1/angle), and their torques
    (joint1/angle torque) or the reactions at the base (base F_x to base M_z), or both. Rates and accelerations
    (joint1/angle rate, joint1/angle acceleration) may be included if they were measured. If joints close loops, the
    positions and torques of an independent set of coordinates are needed.

    Example: floatframe identify robot.toml measured.csv --cutoff 10 -o report.html
    """
    from floatframe.design.identification.estimation import estimate
    from floatframe.design.identification.identify_report import identification_document, identification_record
    from floatframe.design.identification.measured_file import measured_coordinates, read_measured
    from floatframe.design.identification.next_motion import next_motion
    from floatframe.design.identification.physical import real_parameters
    from floatframe.design.identification.regressors import linear_form
    from floatframe.errors import ModelError
    from floatframe.files.system_file.read_system import read_system

    described = read_system(system)[0]
    inputs = tuple(path for path in (system, data, check) if path is not None)
    default = [] if json else [data.with_suffix(".html")]
    paths = output_files(outputs, default, (*DOCUMENTS, ".json"), ModelError, overwrite_of=inputs)
    motions = output_files([] if motion is None else [motion], [], TABLES, ModelError, overwrite_of=inputs)
    named = [term.strip() for term in terms.split(",") if term.strip() not in ("", "none")]
    with stages() as clock:
        with clock("measured motion"):
            form = linear_form(described, named, independent=measured_coordinates(data, described))
            read = read_measured(data, form, cutoff=cutoff, thin=thin)
            other = None if check is None else read_measured(check, form, cutoff=cutoff, thin=thin).measured
        with clock("base parameters"):
            made = estimate(form, read.measured, method=method)
        bodies = None
        if real:
            with clock("real bodies"):
                bodies = real_parameters(made)
        better, notes = None, read.notes
        if paths or motions:
            with clock("motion that would help"):
                try:
                    better = next_motion(made)
                    if better is None:
                        notes = (
                            *notes,
                            "no other motion within its range, rates and accelerations excites the parameters better",
                        )
                except ModelError as error:
                    notes = (*notes, f"no more informative motion was found: {error}")
        with clock("record"):
            record = identification_record(made, bodies, other, notes, better)
    if json:
        typer.echo(json_text(record), nl=False)
    else:
        print_estimate(record)
    write_outputs(paths, record=record, document=lambda: identification_document(made, record, other), is_quiet=json)
    if better is not None:
        write_outputs(motions, table=lambda: motion_table(better.motion, form), is_quiet=json)
    elif motions and not json:
        say(f"{motions[0]} is not written: no better motion was found")


def motion_table(motion: "ExcitingMotion", form: "LinearForm") -> "Table":
    """Return the positions of one period, at 100 times per period of the fastest harmonic, as a table."""
    import numpy as np

    from fe_models.foundation.documents.table import Table

    n = 100 * ((motion.coefficients.shape[1] - 1) // 2)
    t = np.arange(n + 1) * motion.period / n
    units = [form.system.units.length_symbol if column.unit == "m" else "rad" for column in form.columns]
    columns = {"time": t, **dict(zip(motion.names, motion.at(t)[0].T, strict=True))}
    return Table(columns, {"time": "s", **dict(zip(motion.names, units, strict=True))})


def print_estimate(record: dict[str, Any]) -> None:
    """Print parameter combinations, channels, and doubtful results."""
    rows = [
        (each["name"], f"{each['value']:.5g}", f"{each['deviation']:.2g}", each["unit"], each["verdict"])
        for each in record["parameters"]
    ]
    print_table("Base parameters", ("combination", "value>", "deviation>", "", ""), rows)
    channels = [(c["name"], f"{c['noise']:.4g}", c["unit"], f"{c['misfit']:.2%}") for c in record["channels"]]
    print_table("Channels", ("channel", "noise>", "", "misfit>"), channels)
    if record["validation"] is not None:
        print_table(
            "Another motion", ("channel", "misfit>"), [(k, f"{v:.2%}") for k, v in record["validation"].items()]
        )
    if record["without_effect"]:
        say(f"without effect on the measurement: {', '.join(record['without_effect'])}")
    for words in (*record["notes"], *record["warnings"]):
        say(words)


# the command optimize: the best values of parameters of a system ------------------------------------------------------


@guarded
def optimize_command(
    design: Annotated[Path, typer.Argument(help="Design file (TOML), see docs/optimization.md.")],
    outputs: Annotated[
        list[Path],
        typer.Option(
            "--output",
            "-o",
            help="A table (.csv, .json, .mat, .npz, .parquet), a picture (.png, .svg, .pdf), or .toml, the system with "
            "the best values; repeatable.",
        ),
    ] = [],  # noqa: B006
    journal: Journal = None,
    workers: Workers = None,
    set_values: SetValues = [],  # noqa: B006
    json: Annotated[bool, typer.Option("--json", help="Write the result as JSON, for other programs.")] = False,
) -> None:
    """Find the best values of parameters within limits.

    Objectives are fits to tables, peaks, frequencies and damping.

    Every evaluation is recorded in a journal (study.toml: study.journal); after an interruption, the same command
    continues. A failed evaluation is a row with its reason. Without -o, the history is written next to the design file
    as a table and a picture: study.csv and study.png.

    Example: floatframe optimize study.toml -o history.csv -o history.png -o best.toml

    With --set, other parameters of the system have these values in all evaluations.

    Example: floatframe optimize study.toml --set length=0.4

    Example: floatframe optimize study.toml --workers dask://cluster:8786
    """
    from fe_models.foundation.tasks.workers import tasks_of
    from floatframe.design.optimization.design_file import read_design
    from floatframe.design.optimization.history_plots import plot_history
    from floatframe.design.optimization.optimize import optimize
    from floatframe.errors import ModelError
    from floatframe.files.system_file.read_system import read_system

    described = read_design(design, changes_of(set_values))
    files = read_system(described.study.system, described.study.given)[0].files
    inputs = (design, Path(described.study.system), *files, *described.tables)
    kept = output_path(journal, design.with_suffix(".journal"), ModelError, overwrite_of=inputs, needs_file=True)
    default = [] if json else [design.with_suffix(".csv"), design.with_suffix(".png")]
    endings = (*TABLES, *PICTURES, ".toml")
    paths = output_files(outputs, default, endings, ModelError, overwrite_of=(*inputs, kept))
    for path in paths:
        if path.suffix.lower() == ".toml" and path.resolve().parent != Path(described.study.system).resolve().parent:
            raise ModelError(
                f"--output {path}: expected the folder of {described.study.system}, which names files relative to it"
            )
    with stages() as clock, tasks_of(described.workers if workers is None else workers) as tasks:
        if "run" in described.analyses:
            from floatframe.engine.kernels.entry import prepare

            with clock("compiled code (made at first use)"):
                prepare()  # once, before many processes need it
        with clock(f"{described.method}"):
            result = optimize(described, workers=tasks, journal=kept)
    record = optimization_record(result)
    if json:
        typer.echo(json_text(record), nl=False)
    else:
        print_optimum(result)
    write_outputs(
        paths, table=result.to_table, record=record, figure=lambda: plot_history(result),
        others={".toml": lambda _: best_system(result).encode()}, is_quiet=json,
    )  # fmt: skip


def print_optimum(result: "OptimizationResult") -> None:
    """Print the best point, and how it was found."""
    parameters = [
        (p.name, ", ".join(p.paths), f"{p.start:.8g}", f"{result.values[p.name]:.8g}", bound_of(p, result))
        for p in result.design.parameters
    ]
    print_table("Best values", ("parameter", "key path", "start>", "best>", "note"), parameters)
    rows = []
    for q in result.design.quantities:
        of = f"{q.output.of}, rms deviation" if q.values is not None else q.output.of
        rows.append((q.output.name, of, f"{result.numbers[q.output.name]:.6g}"))
    print_table("Objectives and constraints", ("name", "of", "at the best point>"), rows)
    say(f"{'converged' if result.is_converged else 'NOT CONVERGED'}: {result.message}")
    n = len(result.history)
    say(f"{n} evaluations, {n - result.n_computed} of them from the journal, {result.n_failed} failed")
    for row in [row for row in result.history if row.evaluation.error][:3]:
        say(f"failed at {', '.join(f'{v:.6g}' for v in row.evaluation.values)}: {row.evaluation.error}")


def bound_of(parameter: Any, result: "OptimizationResult") -> str:
    """Return a note if a parameter is at a bound."""
    near = 1e-6 * (parameter.upper - parameter.lower)
    value = result.values[parameter.name]
    if value - parameter.lower < near:
        return "at its lower bound"
    return "at its upper bound" if parameter.upper - value < near else ""


def row_record(result: "OptimizationResult", row: "Evaluated") -> dict[str, Any]:
    """Return a row of the history in plain types; values missing in a failed evaluation are null."""
    from floatframe.design.optimization.optimize import numbers_by_name, purpose_of

    is_failed = bool(row.evaluation.error)
    numbers = numbers_by_name(result.design, row.evaluation)
    return {
        "parameters": {p.name: v for p, v in zip(result.design.parameters, row.evaluation.values, strict=True)},
        "numbers": {name: None if is_failed else number for name, number in numbers.items()},
        "objective": None if is_failed else row.objective,
        "violation": None if is_failed else row.violation,
        "purpose": purpose_of(row),
        "error": row.evaluation.error or None,
    }


def optimization_record(result: "OptimizationResult") -> dict[str, Any]:
    """Return an optimisation in plain types."""
    return {
        "system": result.design.study.system,
        "method": result.design.method,
        "converged": result.is_converged,
        "message": result.message,
        "best": row_record(result, result.best),
        "computed": result.n_computed,
        "history": [row_record(result, row) for row in result.history],
    }


def best_system(result: "OptimizationResult") -> str:
    """Return the system file with the best values of the parameters.

    Comments and order are kept. If a value is in a file that this one extends, or in a repeated table, the resolved
    file is returned instead.
    """
    import tomlkit

    from fe_models.foundation.parametric_file import read_parametric
    from fe_models.foundation.toml_file import holder_of
    from floatframe.errors import SystemFileError

    design = result.design
    path = Path(design.study.system)
    document: Any = tomlkit.parse(path.read_text(encoding="utf-8-sig"))
    values = design.study.changes(design.point(result.best.evaluation.values))
    parameters = read_parametric(path, SystemFileError).parameters
    try:
        for name, value in values.items():
            if name in parameters:
                document.setdefault("parameters", tomlkit.table())[name] = value
            else:
                holder, key = holder_of(document, name, str(path), SystemFileError)
                holder[key] = value
    except SystemFileError:
        document = dict(read_parametric(path, SystemFileError, values))
    return str(tomlkit.dumps(document))
