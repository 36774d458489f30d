"""The command `cms formats`: what is read from other programs and what is written for them."""

import json
from dataclasses import asdict

import typer

from cms.cli.console import print_table
from cms.exporters.formats import FORMATS as EXPORTED
from cms.importers.formats import FORMATS as REDUCED
from fe_models.foundation.formats import FileFormat
from fe_models.importers.formats import FORMATS as MODELS

__all__ = ["list_formats", "markdown_table"]

FORMATS = (*MODELS, *REDUCED, *EXPORTED)
HEAD = ("program", "format", "holds", "files", "in", "out", "name", "tried", "what is lost", "extra")


def list_formats(*, as_json: bool, as_markdown: bool) -> None:
    """Print the table of formats, for readers, other programs or docs/formats.md."""
    if as_json:
        typer.echo(json.dumps([asdict(known) for known in FORMATS], indent=2))
    elif as_markdown:
        typer.echo(markdown_table())
    else:
        print_table("formats of other programs", HEAD, [row(known) for known in FORMATS])


def markdown_table() -> str:
    """Return the table as it stands in docs/formats.md."""
    rows = [HEAD, ("---",) * len(HEAD), *(row(known) for known in FORMATS)]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in rows)


def row(known: FileFormat) -> tuple[str, ...]:
    """Return the cells of one format."""
    reads, writes = ("yes" if done else "" for done in (known.reads, known.writes))
    ways = " ".join(known.suffixes), reads, writes, known.key
    return known.program, known.name, known.holds, *ways, known.tried, known.lost, known.extra
