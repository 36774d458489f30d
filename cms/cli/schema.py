"""The command schema: the JSON schema of a kind of file, with which editors complete its keys."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from cms.cli.console import guarded, output_path, say
from fe_models.foundation.file_kinds import KINDS

__all__ = ["schema_command_of"]


def schema_command_of(program: str) -> Callable[..., None]:
    """Return the command for the kinds of files that a program runs."""
    kinds = [kind for kind, each in KINDS.items() if each.command.startswith(f"{program} ")]

    @guarded
    def schema_command(
        kind: Annotated[str, typer.Argument(help=f"Kind of file: {', '.join(kinds)}.")],
        output: Annotated[Path | None, typer.Option("--output", "-o", help="File to write; default: print.")] = None,
    ) -> None:
        """Print the JSON schema of a kind of file.

        An editor such as VS Code with Even Better TOML completes keys and shows their meanings if the first line of a
        file names the schema: #:schema system.schema.json

        Example: floatframe schema system -o system.schema.json

        Example: cms schema job -o job.schema.json
        """
        from cms.errors import JobError
        from fe_models.foundation.parametric_file import schema_text
        from fe_models.foundation.words import nearest

        if kind not in kinds:
            raise JobError(f"schema: there is no kind of file {kind!r} here{nearest(kind, kinds)}")
        text = schema_text(kind)
        if output is None:
            typer.echo(text, nl=False)
            return
        path = output_path(output, output, JobError)
        path.write_text(text, encoding="utf-8")
        say(f"wrote {path}")

    return schema_command
