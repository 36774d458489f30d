"""Arguments that several commands share."""

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from cms.errors import CmsError

__all__ = ["Journal", "Memory", "ModalFile", "Output", "SetValues", "Solver", "Workers", "changes_of"]

ModalFile = Annotated[Path, typer.Argument(help="A modal file, as cms reduce writes it.")]


Output = Annotated[Path | None, typer.Option("--output", "-o", help="Modal file to write.")]


Workers = Annotated[
    str | None,
    typer.Option(
        "--workers",
        "-j",
        help="Where tasks are computed: a number of processes, dask (dask:4), or dask://host:port, see "
        "docs/cluster.md; default: one process per processor.",
    ),
]

Solver = Annotated[
    str | None,
    typer.Option(
        "--solver",
        help="Solver for the factor: pardiso, cholesky, superlu (docs/memory.md), petsc (docs/cluster_mpi.md), ....",
    ),
]

Memory = Annotated[
    str | None,
    typer.Option(
        "--memory",
        help="Memory limit, such as 8GB: beyond it, factor and columns are on disk (docs/memory.md).",
    ),
]

Journal = Annotated[
    Path | None,
    typer.Option("--journal", help="File that records every result, to resume from; default: beside the input file."),
]

SetValues = Annotated[
    list[str],
    typer.Option(
        "--set",
        metavar="NAME=VALUE",
        help="Value of a parameter of the file, or of a key path such as run.h; may be repeated.",
    ),
]


def changes_of(given: Sequence[str]) -> dict[str, Any]:
    """Return the values of the options --set by name; a value that is not valid TOML is a text.

    Raises
    ------
    CmsError
        If an option has no name, or no "=", or a name occurs twice.
    """
    changes: dict[str, Any] = {}
    for each in given:
        name, equals, value = each.partition("=")
        if not name.strip() or not equals:
            raise CmsError(f"--set {each}: expected NAME=VALUE, such as length=0.4")
        if name.strip() in changes:
            raise CmsError(f"--set {each}: {name.strip()!r} already has a value; give each name once")
        try:
            changes[name.strip()] = tomllib.loads(f"value = {value}")["value"]
        except tomllib.TOMLDecodeError:
            changes[name.strip()] = value.strip()
    return changes
