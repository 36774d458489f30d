"""Arguments that several commands take."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    pass

__all__ = ["ModalFile", "Output"]

ModalFile = Annotated[Path, typer.Argument(help="A modal file, as cms reduce writes it.")]


Output = Annotated[Path | None, typer.Option("--output", "-o", help="Modal file to write.")]
