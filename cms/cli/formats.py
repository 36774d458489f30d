"""The command `cms formats`: formats of other programs that are read and written."""

import json
from dataclasses import asdict

import typer

from cms.cli.console import print_table
from cms.exchange.exporters.formats import FORMATS as EXPORTED
from cms.exchange.importers.import_body import FORMATS as REDUCED
from fe_models.files.formats import FORMATS as MODELS
from fe_models.foundation.formats import FileFormat

__all__ = ["FORMATS", "list_formats", "markdown_tables"]

HELD = ("mesh", "geometry", "deck", "matrices", "reduced body")  #: contents of files, from the part to the body
FORMATS = tuple(sorted((*MODELS, *REDUCED, *EXPORTED), key=lambda known: HELD.index(known.holds)))
IN = ("program", "format", "holds", "what is lost", "tried")
OUT = ("program", "format", "--to", "what is lost", "tried")


def list_formats(*, as_json: bool, as_markdown: bool) -> None:
    """Print the formats that are read and those that are written, as tables, as JSON, or for docs/formats.md."""
    if as_json:
        typer.echo(json.dumps([asdict(known) for known in FORMATS], indent=2))
    elif as_markdown:
        typer.echo(markdown_tables())
    else:
        print_table("What comes in", IN, rows_in())
        print_table("What goes out", OUT, rows_out())


def markdown_tables() -> str:
    """Return both tables as they stand in docs/formats.md."""
    parts = (("What comes in", IN, rows_in()), ("What goes out", OUT, rows_out()))
    return "\n\n".join(f"**{title}**\n\n{markdown(head, rows)}" for title, head, rows in parts)


def markdown(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    """Return a table in Markdown, with the stars of keywords escaped."""
    cells = [head, ("---",) * len(head), *(tuple(cell.replace("*", "\\*") for cell in row) for row in rows)]
    return "\n".join(f"| {' | '.join(row)} |" for row in cells)


def rows_in() -> list[tuple[str, ...]]:
    """Return the cells of the formats that are read."""
    return [(f.program, format_words(f), f.holds, f.lost, f.tried) for f in FORMATS if f.reads]


def rows_out() -> list[tuple[str, ...]]:
    """Return the cells of the formats that are written."""
    return [(f.program, format_words(f), f.key, f.lost, f.tried) for f in FORMATS if f.writes]


def format_words(known: FileFormat) -> str:
    """Return the name of a format with its file suffixes, and the extra that it needs."""
    extra = f"; extra {known.extra}" if known.extra else ""
    return f"{known.name} ({' '.join(known.suffixes)}{extra})"
