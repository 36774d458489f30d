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
        "docs/cluster.md; default: one process a processor.",
    ),
]

Solver = Annotated[
    str | None,
    typer.Option(
        "--solver",
        help="What factorises: pardiso, cholesky, superlu (docs/memory.md), petsc (docs/cluster_mpi.md), ....",
    ),
]

Memory = Annotated[
    str | None,
    typer.Option(
        "--memory",
        help="Most memory the process may take, such as 8GB: above it factor and columns go to disk (docs/memory.md).",
    ),
]

Journal = Annotated[
    Path | None,
    typer.Option("--journal", help="File that keeps every result, to go on from; default: beside the input file."),
]
