"""The command show: a job or system file with its parameters, base files and repeated tables resolved."""

from pathlib import Path
from typing import Annotated

import typer

from cms.cli.arguments import SetValues, changes_of
from cms.cli.console import guarded

__all__ = ["show_command"]


@guarded
def show_command(
    file: Annotated[Path, typer.Argument(help="Job or system file (TOML).")],
    set_values: SetValues = [],  # noqa: B006
) -> None:
    """Print a file with its parameters resolved.

    Base files (extends) are merged and repeated tables are copied.

    Every expression is replaced by its value, so the output is a file without parameters that describes the same.

    Example: cms show rod.toml --set length=0.4

    Example: floatframe show chain.toml --set n=20 > chain20.toml
    """
    import tomlkit

    from cms.errors import JobError
    from fe_models.foundation.parametric_file import read_parametric

    typer.echo(tomlkit.dumps(dict(read_parametric(file, JobError, changes_of(set_values)))), nl=False)
