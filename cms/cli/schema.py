"""The command schema: the JSON schema of a kind of file, with which editors complete its keys."""

import json
from collections.abc import Callable, Mapping
from importlib import import_module
from pathlib import Path
from typing import Annotated

import typer

from cms.cli.console import guarded, output_path, say

__all__ = ["schema_command_of"]

PARAMETRIC = ("job", "system")  #: kinds of files with parameters, base files and repeated tables


def schema_command_of(models: Mapping[str, str]) -> Callable[..., None]:
    """Return the command for the kinds of files of a program, given as "module:class" by kind."""

    @guarded
    def schema_command(
        kind: Annotated[str, typer.Argument(help=f"Kind of file: {', '.join(models)}.")],
        output: Annotated[Path | None, typer.Option("--output", "-o", help="File to write; default: print.")] = None,
    ) -> None:
        """Print the JSON schema of a kind of file.

        An editor such as VS Code with Even Better TOML completes keys and shows their meanings if the first line of a
        file names the schema: #:schema system.schema.json

        Example: floatframe schema system -o system.schema.json

        Example: cms schema job -o job.schema.json
        """
        from cms.errors import JobError
        from fe_models.foundation.parametric_file import json_schema
        from fe_models.foundation.words import nearest

        if kind not in models:
            raise JobError(f"schema: there is no kind of file {kind!r} here{nearest(kind, models)}")
        module, _, name = models[kind].partition(":")
        model = getattr(import_module(module), name)
        text = json.dumps(json_schema(model, is_parametric=kind in PARAMETRIC), indent=2)
        if output is None:
            typer.echo(text)
            return
        path = output_path(output, output, JobError)
        path.write_text(text + "\n", encoding="utf-8")
        say(f"wrote {path}")

    return schema_command
