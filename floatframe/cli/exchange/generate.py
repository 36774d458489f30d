"""The command generate: the equations of one system as code."""

import json as json_module
from pathlib import Path
from typing import Annotated

import typer

from cms.cli.console import guarded, print_table, say

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command to an application."""
    app.command("generate")(generate_command)


@guarded
def generate_command(
    system: Annotated[Path, typer.Argument(help="System file (TOML) of rigid bodies in a tree.")],
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
) -> None:
    """Write the equations of one system as code, its numbers in it: forces, mass matrix, accelerations, derivatives.

    Example: floatframe generate robot.toml --what inverse --what mass --language c -o robot_code
    """
    from dataclasses import asdict

    from fe_models.foundation.paths import replace_files
    from floatframe.errors import ModelError
    from floatframe.generation.generate import generate
    from floatframe.system_file.read_system import read_system

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
