"""The command machine: copies of ready machines."""

from pathlib import Path
from typing import Annotated

import typer

from cms.cli.console import guarded, print_table, say

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command to an application."""
    app.command("machine")(machine_command)


@guarded
def machine_command(
    name: Annotated[str | None, typer.Argument(help="A machine; without it the command lists them.")] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Folder to copy it into; default: its name.")
    ] = None,
) -> None:
    """Copy a ready machine with its jobs and systems into a folder, or list the machines.

    Example: floatframe machine antenna -o my_antenna
    """
    from floatframe.machines.catalogue import MACHINES, copy_machine

    if name is None:
        print_table(
            "Machines", ("machine", "what", "shows"), [(key, each.title, each.shows) for key, each in MACHINES.items()]
        )
        return
    folder = output or Path(name)
    for path in copy_machine(name, folder):
        say(f"{path}")
    say(f"its README.md names the commands in their order: {folder / 'README.md'}")
