"""The document of an acceptance as one page that works offline and prints."""

import base64

from cms.assessment.report.html import Cell, Section, page, table, text
from cms.jobs.acceptance.document import Document, Paragraph, Part, Picture, Table

__all__ = ["html_page"]

MARKS = {"pass": "\u2713", "warn": "!", "fail": "\u2715", "info": ""}


def html_page(document: Document) -> str:
    """Return the page."""
    figures = "".join(f"<div><b>{text(value)}</b>{text(words)}</div>" for value, words in document.figures)
    badge = f'<span class="badge {document.verdict}">{MARKS[document.verdict]} {text(document.verdict_words)}</span>'
    kind = {"fail": " none", "warn": " doubtful", "info": " doubtful"}.get(document.verdict, "")
    signatures = table(
        ["", "name", "date", "signature"],
        [[Cell(words, "name"), Cell("\u00a0"), Cell(""), Cell("")] for words in document.signatures],
    )
    header = (
        f'<h1>{text(document.title)}</h1><p class="facts">{text(document.subtitle)}</p>'
        f'<section class="answer{kind}">{badge}<p>{text(document.answer)}</p><div class="figures">{figures}</div>'
        f'</section><section id="signatures">{signatures}</section>'
    )
    sections = [
        Section(part.key, f"{k}. {part.title}", part.short, body_of(part)) for k, part in enumerate(document.parts, 1)
    ]
    brand = f"{text(document.title.removeprefix('Acceptance of the reduced body '))}<small>acceptance</small>"
    return page(document.title, brand, header, sections, {}, text(document.footer))


def body_of(part: Part) -> str:
    """Return the blocks of a part."""
    made = []
    for block in part.blocks:
        if isinstance(block, Paragraph):
            made.append(f"<p>{text(block.words)}</p>")
        elif isinstance(block, Picture):
            made.append(
                f'<figure><img style="width:{100 * block.share:.0f}%" alt="{text(block.caption)}" '
                f'src="data:image/png;base64,{base64.b64encode(block.png).decode()}">'
                f"<figcaption>{text(block.caption)}</figcaption></figure>"
            )
        else:
            caption = f"<p>{text(block.caption)}</p>" if block.caption else ""
            made.append(caption + table_of(block))
    return "".join(made)


def table_of(block: Table) -> str:
    """Return a table; second lines of cells are smaller."""
    is_number = [heading.endswith(">") for heading in block.headings]
    rows = []
    for row in block.rows:
        cells = []
        for k, words in enumerate(row):
            first, _, second = words.partition("\n")
            kind = "n" if is_number[k] else "name" if k == 0 and block.verdict != 0 else ""
            if block.verdict == k:
                kind = verdict_kind(words)
            cells.append(Cell(first, kind, second))
        rows.append(cells)
    return table(block.headings, rows)


def verdict_kind(words: str) -> str:
    """Return the colour of a word."""
    if words in MARKS:
        return words
    return {"unchanged": "pass", "not found": "warn"}.get(words, "fail")
