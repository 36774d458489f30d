"""The command identify: inertial parameters of a tree from a measured motion."""

import json as json_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cms.cli.console import guarded, output_path, print_table, say, stages

if TYPE_CHECKING:
    from floatframe.design.identification.excitation import ExcitingMotion
    from floatframe.design.identification.regressors import LinearForm

__all__ = ["register"]

KINDS = ("html", "json")


def register(app: typer.Typer) -> None:
    """Add the command to an application."""
    app.command("identify")(identify_command)


@guarded
def identify_command(
    system: Annotated[Path, typer.Argument(help="System file (TOML) of a tree of rigid bodies, or with loops.")],
    data: Annotated[Path, typer.Argument(help="Measured motion (.csv, .mat, ...), see docs/identification.md.")],
    outputs: Annotated[
        list[Path],
        typer.Option("--output", "-o", help="A .html or .json file; repeatable."),
    ] = [],  # noqa: B006
    terms: Annotated[
        str,
        typer.Option("--terms", help="Of each drive, with commas: motor-inertia, viscous, coulomb, offset; none."),
    ] = "viscous,coulomb",
    method: Annotated[str, typer.Option("--method", help="ordinary, weighted or robust.")] = "weighted",
    cutoff: Annotated[float | None, typer.Option("--cutoff", help="Filter all channels above this [Hz].")] = None,
    thin: Annotated[int | None, typer.Option("--thin", min=1, help="Take every so many rows.")] = None,
    check: Annotated[
        Path | None, typer.Option("--check", help="Another measured motion, on which the estimate is tried.")
    ] = None,
    real: Annotated[
        bool, typer.Option("--real/--no-real", help="Find real bodies (positive masses and inertias) too.")
    ] = True,
    motion: Annotated[
        Path | None, typer.Option("--motion", help="Write the motion that would tell more, a .csv of positions.")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Write the result as JSON, for other programs.")] = False,
) -> None:
    """Find the inertial parameters of a robot from a measured motion: base parameters with their deviations.

    Columns of the data are the positions of all coordinates, named as in results (joint1/angle), and their torques
    (joint1/angle torque) or the reactions at the base (base F_x to base M_z), or both. Rates and accelerations
    (joint1/angle rate, joint1/angle acceleration) may be included if they were measured. If joints close loops, the
    positions and torques of an independent set of coordinates are needed.

    Example: floatframe identify robot.toml measured.csv --cutoff 10 -o report.html
    """
    from fe_models.foundation.paths import replace_file
    from floatframe.design.identification.estimation import estimate
    from floatframe.design.identification.identify_report import identification_html, identification_record
    from floatframe.design.identification.measured_file import measured_coordinates, read_measured
    from floatframe.design.identification.next_motion import next_motion
    from floatframe.design.identification.physical import real_parameters
    from floatframe.design.identification.regressors import linear_form
    from floatframe.errors import ModelError
    from floatframe.files.system_file.read_system import read_system

    described = read_system(system)[0]
    inputs = tuple(path for path in (system, data, check) if path is not None)
    wanted = outputs or ([] if json else [data.with_suffix(".html")])
    paths = [output_path(path, None, ModelError, overwrite_of=inputs) for path in wanted]
    for path in paths:
        if path.suffix.lower().removeprefix(".") not in KINDS:
            raise ModelError(f"--output {path}: expected a file name that ends in {', '.join('.' + k for k in KINDS)}")
    if motion is not None:
        motion = output_path(motion, None, ModelError, overwrite_of=inputs)
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
        if paths or motion is not None:
            with clock("motion that would help"):
                try:
                    better = next_motion(made)
                    if better is None:
                        notes = (
                            *notes,
                            "of other motions within its range, rates and accelerations none excites better",
                        )
                except ModelError as error:
                    notes = (*notes, f"no motion that would tell more was found: {error}")
        with clock("record"):
            record = identification_record(made, bodies, other, notes, better)
    if json:
        typer.echo(json_module.dumps(record, indent=2))
    else:
        print_estimate(record)
    for path in paths:
        if path.suffix.lower() == ".json":
            replace_file(path, (json_module.dumps(record, indent=2) + "\n").encode())
        else:
            replace_file(path, identification_html(made, record, other).encode())
        if not json:
            say(f"wrote {path} ({path.stat().st_size / 1e6:.2f} MB)")
    if motion is not None and better is None and not json:
        say(f"{motion} is not written: no better motion was found")
    if motion is not None and better is not None:
        replace_file(motion, motion_table(better.motion, form).encode())
        if not json:
            say(f"wrote {motion}")


def motion_table(motion: "ExcitingMotion", form: "LinearForm") -> str:
    """Return the positions of one period, at 100 times per period of the fastest harmonic, as a table."""
    import numpy as np

    n = 100 * ((motion.coefficients.shape[1] - 1) // 2)
    t = np.arange(n + 1) * motion.period / n
    units = [form.system.units.length_symbol if column.unit == "m" else "rad" for column in form.columns]
    heads = ["time [s]", *(f"{name} [{unit}]" for name, unit in zip(motion.names, units, strict=True))]
    rows = np.column_stack([t, motion.at(t)[0]])
    return "\n".join([",".join(heads), *(",".join(f"{x:.9g}" for x in row) for row in rows)]) + "\n"


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
        say(f"without effect on what was measured: {', '.join(record['without_effect'])}")
    for words in (*record["notes"], *record["warnings"]):
        say(words)
