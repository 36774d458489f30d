"""The command generate: the equations of a system as code."""

import json as json_module
from pathlib import Path
from typing import Annotated

import typer

from cms.cli.console import guarded, print_table, say

__all__ = ["register"]

MOST_ROWS = 60  #: largest number of printed rows


def register(app: typer.Typer) -> None:
    """Add the command to an application."""
    app.command("generate")(generate_command)


@guarded
def generate_command(
    system: Annotated[Path, typer.Argument(help="System file (TOML) of bodies in a tree.")],
    what: Annotated[
        list[str],
        typer.Option(
            "--what",
            help="inverse, residual, mass, forward, kinematics, jacobian or sensitivity; may be repeated.",
        ),
    ] = ["inverse"],  # noqa: B006
    language: Annotated[str, typer.Option("--language", help="c, python, casadi or matlab.")] = "c",
    parameters: Annotated[
        list[str],
        typer.Option(
            "--parameter",
            help="A number that stays a symbol: BODY/m, BODY (all ten), gravity, or a pattern; may be repeated.",
        ),
    ] = [],  # noqa: B006
    name: Annotated[str | None, typer.Option("--name", help="What functions begin with; default: the system.")] = None,
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder to write.")] = Path(),
    json: Annotated[bool, typer.Option("--json", help="Say what was written as JSON, for other programs.")] = False,
    fmu: Annotated[
        Path | None,
        typer.Option("--fmu", help="Write an FMU of compiled C instead, which needs nothing where it runs."),
    ] = None,
    fmi: Annotated[int, typer.Option("--fmi", help="With --fmu: version of FMI, 2 or 3.")] = 2,
    step: Annotated[float, typer.Option("--step", help="With --fmu: longest step in co-simulation [s].")] = 1e-3,
) -> None:
    """Write the equations of a system as code with its numbers: forces, mass matrix, accelerations, derivatives.

    With --fmu, they become an FMU for model exchange and co-simulation: inputs are the forces along the joints, outputs
    are positions and rates. It is compiled by cc, or by the compiler in the environment variable CC.

    Example: floatframe generate robot.toml --what inverse --what mass --language c -o robot_code

    Example: floatframe generate robot.toml --fmu robot.fmu --fmi 3
    """
    from dataclasses import asdict

    from fe_models.foundation.paths import replace_files
    from floatframe.design.generation.generate import generate
    from floatframe.errors import ModelError
    from floatframe.files.system_file.read_system import read_system

    if fmu is not None:
        if (what, language, name, output, json) != (["inverse"], "c", None, Path(), False):
            raise ModelError("--fmu: writes forward dynamics in C; leave out --what, --language, --name, -o and --json")
        write_unit(system, fmu, fmi, step, parameters)
        return
    described = read_system(system)[0]
    names = {each: None if name is None else f"{name}_{each}" for each in what}
    codes = [
        generate(described, what=each, language=language, parameters=parameters, name=names[each]) for each in names
    ]
    files = {output / file: text.encode() for code in codes for file, text in code.files.items()}
    if any(path.resolve() == system.resolve() for path in files):
        raise ModelError(f"--output {output}: would overwrite {system}")
    try:
        output.mkdir(parents=True, exist_ok=True)
        replace_files(files)
    except OSError as error:
        raise ModelError(f"--output {output}: cannot be written: {error.strerror}") from error
    if json:
        record = {
            "files": [str(path) for path in files],
            "functions": {
                code.name: {
                    "what": code.what, **asdict(code.operations),
                    "general additions": code.general[0], "general multiplications": code.general[1],
                    "parameters": dict(zip(code.parameter_names, code.parameter_values.tolist(), strict=True)),
                }
                for code in codes
            },
        }  # fmt: skip
        typer.echo(json_module.dumps(record, indent=2, ensure_ascii=True))
        return
    print_table(
        "Operations of a call, and of the same recursion with all zeros and ones",
        ("function", "additions>", "multiplications>", "divisions>", "sines, cosines>", "general + >", "general * >"),
        [
            (code.name, *(str(n) for n in (
                code.operations.additions, code.operations.multiplications, code.operations.divisions,
                code.operations.functions, *code.general)))
            for code in codes
        ],
    )  # fmt: skip
    for path in files:
        say(f"wrote {path}")


def write_unit(system: Path, fmu: Path, fmi: int, step: float, parameters: list[str]) -> None:
    """Write a system as an FMU of generated C, and report its contents."""
    from floatframe.design.generation.units.generated_unit import generate_fmu
    from floatframe.files.system_file.read_system import read_system

    described, run = read_system(system)
    stop = 1.0 if run is None else run.t_end * described.units.time
    made = generate_fmu(described, fmu, fmi=fmi, step=step, parameters=parameters, stop_time=stop)
    shown = [each for each in made.variables if each.causality in ("input", "output", "parameter")]
    rows = [(each.name, each.causality, each.unit, f"{each.start:g}") for each in shown]
    print_table("Variables", ("", "", "unit", "start>"), rows[:MOST_ROWS])
    if len(rows) > MOST_ROWS:
        say(f"and {len(rows) - MOST_ROWS} more")
    say(f"FMI {fmi}.0 for {made.platform}, model exchange and co-simulation; its sources are in it")
    say(f"wrote {fmu} ({fmu.stat().st_size / 1e6:.2f} MB)")
