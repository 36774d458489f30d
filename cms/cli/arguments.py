"""Arguments that several commands share."""

from pathlib import Path
from typing import Annotated

import typer

__all__ = ["Journal", "Memory", "ModalFile", "Output", "Solver", "Workers"]

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
