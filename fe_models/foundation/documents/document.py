"""Documents: headings, text, tables, charts and pictures with a verdict, before they become a page, a PDF or JSON.

document = Document("Rod", "rod.h5", answer=Answer("It holds.", "pass"), sections=(Section("mass", "Mass", blocks),))
write_document(document, "rod.html")  # or "rod.pdf", "rod.json"
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fe_models.foundation.documents.charts import Chart, chart_record

__all__ = [
    "MARKS", "Answer", "Block", "Cell", "Document", "Figure", "Gallery", "Heading", "Markup", "Paragraph", "Picture",
    "Section", "Terms", "TextTable", "cells_of", "document_record",
]  # fmt: skip

MARKS = {"pass": "\u2713", "warn": "!", "fail": "\u2715", "error": "!", "info": ""}  #: symbols of the verdicts


@dataclass(frozen=True)
class Cell:
    """A cell of a table."""

    text: str
    kind: str = ""  #: cell kinds, separated by blanks: "n" for numbers, "name", "pass", "warn", "fail", "blank"
    note: str = ""  #: smaller text below
    badge: str = ""  #: verdict that gives the colour of the badge around the text
    line: tuple[str, str] | None = None  #: colour and dash of a line before the text
    span: int = 1


@dataclass(frozen=True)
class TextTable:
    """A table of text; a heading that ends in '>' is right-aligned.

    Parameters
    ----------
    headings
        Headings, (n_columns,).
    rows
        Text or cells; a second line of a text becomes a note.
    widths
        Width of each column as a share of the page width; empty: determined by the text.
    verdict
        Column whose texts are verdicts and determine its colours.
    caption
        Sentence above the table.
    """

    headings: Sequence[str]
    rows: Sequence[Sequence[str | Cell]]
    widths: tuple[float, ...] = ()
    verdict: int | None = None
    caption: str = ""


@dataclass(frozen=True)
class Paragraph:
    """Paragraph of one or more sentences; kind: "", "why" (small) or "notice" (framed)."""

    text: str
    kind: str = ""


@dataclass(frozen=True)
class Heading:
    """A heading inside a section."""

    text: str


@dataclass(frozen=True)
class Picture:
    """A picture with its caption."""

    png: bytes
    caption: str = ""
    share: float = 1.0  #: share of the page width


@dataclass(frozen=True, eq=False)
class Figure:
    """A chart with its title and caption."""

    key: str  #: id of the element on the page
    chart: Chart
    caption: str
    title: str = ""


@dataclass(frozen=True)
class Terms:
    """Words with their meanings."""

    items: Sequence[tuple[str, str]]


@dataclass(frozen=True)
class Gallery:
    """Blocks side by side."""

    blocks: Sequence["Block"]
    columns: int = 2


@dataclass(frozen=True)
class Markup:
    """HTML for the page only, such as a 3D view, with its script, and data by element id."""

    html: str
    script: str = ""
    data: dict[str, str] = field(default_factory=dict)


Block = TextTable | Paragraph | Heading | Picture | Figure | Terms | Gallery | Markup


@dataclass(frozen=True)
class Section:
    """A section with its entry in the contents."""

    key: str
    title: str
    blocks: Sequence[Block]
    lead: str = ""  #: first sentence
    short: str = ""  #: title in the contents; empty: the title of the section


@dataclass(frozen=True)
class Answer:
    """Answer at the top of the document.

    Parameters
    ----------
    text
        Answer in one sentence.
    verdict
        "pass", "warn", "fail", or "info" if there is no verdict; determines the colour.
    badge
        Verdict in words; empty: none.
    figures
        Numbers with their meanings.
    notes
        Further sentences.
    """

    text: str
    verdict: str = "info"
    badge: str = ""
    figures: Sequence[tuple[str, str]] = ()
    notes: Sequence[str] = ()


@dataclass(frozen=True)
class Document:
    """Content of a document."""

    title: str
    facts: str  #: sentence about the object of the document
    answer: Answer
    sections: Sequence[Section]
    brand: str = ""  #: name of the object, above the contents
    kind: str = ""  #: kind of document, below the name
    signatures: Sequence[str] = ()  #: labels of signature lines
    footer: str = ""

    def blocks(self) -> Iterator[Block]:
        """Yield all blocks; blocks of galleries are yielded one by one."""
        for section in self.sections:
            for block in section.blocks:
                yield from block.blocks if isinstance(block, Gallery) else (block,)


def cells_of(table: TextTable) -> list[list[Cell]]:
    """Return the cells of a table; column headings that end in ">" mark columns of numbers."""
    is_number = [heading.endswith(">") for heading in table.headings]
    rows = []
    for row in table.rows:
        cells = []
        for k, words in enumerate(row):
            if isinstance(words, Cell):
                cells.append(words)
                continue
            first, _, second = words.partition("\n")
            kind = "n" if is_number[k] else "name" if k == 0 and table.verdict != 0 else ""
            cells.append(Cell(first, verdict_kind(words) if table.verdict == k else kind, second))
        rows.append(cells)
    return rows


def verdict_kind(words: str) -> str:
    """Return the colour class of a verdict word."""
    return words if words in MARKS else {"": "", "unchanged": "pass", "not found": "warn"}.get(words, "fail")


def document_record(document: Document) -> dict[str, Any]:
    """Return a document in plain types: text, tables and charts, but only captions of pictures."""
    return {
        "title": document.title,
        "facts": document.facts,
        "answer": plain(document.answer),
        "sections": [
            {"title": each.title, "lead": each.lead, "blocks": [plain(block) for block in each.blocks]}
            for each in document.sections
        ],
        "footer": document.footer,
    }


def plain(value: Any) -> Any:
    """Return a block in plain types."""
    if isinstance(value, Chart):
        return chart_record(value)
    if isinstance(value, bytes):
        return f"{len(value)} bytes"
    if hasattr(value, "__dataclass_fields__"):
        return {"block": type(value).__name__, **{name: plain(each) for name, each in vars(value).items()}}
    if isinstance(value, dict):
        return {key: plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [plain(each) for each in value]
    return value.item() if isinstance(value, np.generic) else value
