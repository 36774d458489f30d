"""The command fmu: a system as an FMU for other programs."""

from pathlib import Path
from typing import Annotated

import typer

from cms.cli.console import guarded, output_path, print_table, say, stages

__all__ = ["register"]

MOST_ROWS = 60  #: largest number of printed rows


def register(app: typer.Typer) -> None:
    """Add the command to an application."""
    app.command("fmu")(fmu_command)


@guarded
def fmu_command(
    system: Annotated[Path, typer.Argument(help="System file (TOML), see docs/system_file.md.")],
    output: Annotated[Path | None, typer.Option("--output", "-o", help="FMU to write.")] = None,
    fmi: Annotated[int, typer.Option("--fmi", help="Version of FMI, 2 or 3.")] = 2,
    inputs: Annotated[
        list[str], typer.Option("--input", "-i", help="forces.NAME.amplitude, joints.NAME.angle, a name of [inputs].")
    ] = [],  # noqa: B006
    outputs: Annotated[list[str], typer.Option("--out", "-m", help="A sensor, or joint.coordinate; repeatable.")] = [],  # noqa: B006
    parameters: Annotated[
        list[str], typer.Option("--parameter", "-p", help="NAME=KEY.PATH of a number in the file; repeatable.")
    ] = [],  # noqa: B006
) -> None:
    """Write a system as an FMU for co-simulation with FMPy and other masters.

    Without -o, arm.toml gives arm.fmu. Inputs, outputs and parameters are those of the table [fmu], unless named here.
    Without both, they are the tables [inputs.NAME], constant forces and drives; all sensors; all numbers of bodies and
    forces. The FMU needs Python with floatframe on the machine where it runs.

    Example: floatframe fmu arm.toml -o arm.fmu --fmi 3

    Example: floatframe fmu arm.toml --input forces.motor.motor --out hinge.angle --parameter m=bodies.arm.mass
    """
    from floatframe.engine.kernels.entry import prepare
    from floatframe.errors import ModelError
    from floatframe.files.cosimulation.archive import write_fmu

    path = output_path(output, system.with_suffix(".fmu"), ModelError, overwrite_of=(system,))
    if path.suffix.lower() != ".fmu":
        raise ModelError(f"--output {path}: expected a file name that ends in .fmu")
    pairs = [text.partition("=") for text in parameters]
    for text, (name, equals, key) in zip(parameters, pairs, strict=True):
        if not (name and equals and key):
            raise ModelError(f"--parameter {text}: expected NAME=KEY.PATH, such as m=bodies.arm.mass")
    with stages() as clock:
        with clock("compiled code (made at first use)"):
            prepare()
        with clock("FMU"):
            written = write_fmu(
                system, path, fmi=fmi, inputs=inputs or None, outputs=outputs or None,
                parameters={name: key for name, _, key in pairs} or None,
            )  # fmt: skip
    rows = [(v.name, v.causality, v.unit, f"{v.start:g}" if v.causality != "output" else "") for v in written.variables]
    print_table("Variables", ("", "", "unit", "start>"), rows[:MOST_ROWS])
    if len(rows) > MOST_ROWS:
        say(f"and {len(rows) - MOST_ROWS} more")
    say(f"FMI {fmi}.0 for {', '.join(written.platforms)}; it needs Python with floatframe where it runs")
    say(f"wrote {path} ({path.stat().st_size / 1e6:.2f} MB)")
