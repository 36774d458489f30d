"""The command gradient: derivatives of outputs by parameters of a system file."""

import json as json_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cms.cli.console import guarded, output_path, print_table, say, stages

if TYPE_CHECKING:
    from floatframe.design.gradients import Sensitivities

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command to an application."""
    app.command("gradient")(gradient_command)


@guarded
def gradient_command(
    system: Annotated[Path, typer.Argument(help="System file (TOML), see docs/system_file.md.")],
    outputs: Annotated[
        list[str], typer.Option("--out", "-m", help='A column, "tip x"; "tip x:rms"; of eig "frequency 1"; repeatable.')
    ] = [],  # noqa: B006
    parameters: Annotated[
        list[str], typer.Option("--parameter", "-p", help="KEY.PATH of a number in the file; repeatable.")
    ] = [],  # noqa: B006
    analysis: Annotated[str, typer.Option(help="run, static, rotation or eig.")] = "run",
    omega: Annotated[str | None, typer.Option(help='Of rotation: angular velocity "x,y,z", rad per time unit.')] = None,
    center: Annotated[str, typer.Option(help='Of rotation: a point of the axis, "x,y,z".')] = "0,0,0",
    method: Annotated[str, typer.Option(help="direct or adjoint.")] = "direct",
    output: Annotated[Path | None, typer.Option("--output", "-o", help="A .csv or .json file.")] = None,
    json: Annotated[bool, typer.Option("--json", help="Write the result as JSON, for other programs.")] = False,
) -> None:
    """Derivatives of motions, equilibria, steady rotations or frequencies by numbers of the system file, in one run.

    Sensors as `floatframe info` lists them. direct costs a solution a parameter in every step, adjoint one an output.

    Example: floatframe gradient crank.toml -m "tip x" -p bodies.rod.mass -p forces.spring.stiffness

    Example: floatframe gradient governor.toml --analysis rotation --omega 0,0,6 -m "arm.distance value" -p
    forces.spring.stiffness

    Example: floatframe gradient arm.toml --analysis eig -m "frequency 1" -p forces.bush.stiffness
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
        text = csv_of(found) if path.suffix.lower() == ".csv" else json_module.dumps(record, indent=2) + "\n"
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


def csv_of(found: "Sensitivities") -> str:
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
