"""Pieces of a self-contained HTML page: escaped text, tables, figures, and the page itself."""

import html
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from typing import Any

__all__ = ["Cell", "Section", "figure", "page", "table", "text"]


@dataclass(frozen=True)
class Cell:
    """A cell of a table."""

    words: str
    kind: str = ""  #: "n" for numbers, "name", "pass", "warn", "fail", "blank"; several separated by blanks
    note: str = ""  #: smaller text below
    markup: str = ""  #: HTML before the text
    span: int = 1


@dataclass(frozen=True)
class Section:
    """A section of a page, with its entry in the table of contents."""

    key: str
    title: str
    short: str  #: title in the table of contents
    body: str  #: HTML
    lead: str = ""  #: first sentence
    charts: dict[str, Any] = field(default_factory=dict)  #: plotly figure by id


def text(words: object) -> str:
    """Return text as HTML; numbers are not separated from their percent signs."""
    return html.escape(str(words)).replace(" %", "\u00a0%")


def table(headings: Sequence[str], rows: Iterable[Sequence[Cell] | tuple[str, Sequence[Cell]]]) -> str:
    """Return a table; a heading that ends in '>' is right-aligned; a row may have a CSS class."""
    head = "".join(f"<th{' class=n' if h.endswith('>') else ''}>{text(h.removesuffix('>'))}</th>" for h in headings)
    lines = []
    for row in rows:
        style, cells = row if isinstance(row, tuple) and row and isinstance(row[0], str) else ("", row)
        lines.append(f'<tr class="{style}">' + "".join(_cell(cell) for cell in cells) + "</tr>")
    return f'<div class="scroll"><table><thead><tr>{head}</tr></thead><tbody>{"".join(lines)}</tbody></table></div>'


def _cell(cell: Cell) -> str:
    note = f'<span class="why">{text(cell.note)}</span>' if cell.note else ""
    span = f' colspan="{cell.span}"' if cell.span > 1 else ""
    return f'<td class="{cell.kind}"{span}>{cell.markup}{text(cell.words)}{note}</td>'


def figure(key: str, caption: str, *, title: str = "", height: int = 330, kind: str = "") -> str:
    """Return the placeholder of a chart with its title and caption."""
    heading = f"<h3>{text(title)}</h3>" if title else ""
    return (
        f'<figure>{heading}<div class="chart {kind}" id="{key}" style="height:{height}px" role="img" '
        f'aria-label="{text(title or caption)}"></div><figcaption>{text(caption)}</figcaption></figure>'
    )


def page(title: str, brand: str, header: str, sections: Sequence[Section], scripts: dict[str, str], footer: str) -> str:
    """Return a complete, self-contained page.

    Parameters
    ----------
    scripts
        JSON that the scripts of the page read, by id.
    """
    charts = {key: chart for section in sections for key, chart in section.charts.items()}
    contents = "".join(f'<a href="#{s.key}">{text(s.short)}</a>' for s in sections)
    body = "".join(
        f'<section id="{s.key}"><h2>{text(s.title)}</h2>'
        + (f'<p class="lead">{text(s.lead)}</p>' if s.lead else "")
        + f"{s.body}</section>"
        for s in sections
    )
    plotly = ""
    if charts:
        from plotly.offline import get_plotlyjs

        plotly = f"<script>{get_plotlyjs()}</script>\n"
    data = "".join(_json_script(key, words) for key, words in {"charts": json.dumps(charts), **scripts}.items())
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f'<title>{text(title)}</title><link rel="icon" href="data:,"><style>{asset("page.css")}</style></head>\n<body>'
        f'<div class="frame"><nav aria-label="Contents"><div class="brand">{brand}</div>{contents}</nav>'
        f"<main>{header}{body}<footer>{footer}</footer></main></div>\n"
        f"{data}{plotly}<script>{asset('page.js')}</script>\n"
        f"<script>{asset('viewer.js')}</script></body></html>\n"
    )


def _json_script(key: str, words: str) -> str:
    """Return JSON inside a page; '<' is escaped, so that no text of a name can end the script."""
    return f'<script type="application/json" id="{key}">{words.replace("<", chr(92) + "u003c")}</script>\n'


def asset(name: str) -> str:
    """Return a file that is included with the reports."""
    return (files("cms.assessment.report") / "data" / name).read_text(encoding="utf-8")
