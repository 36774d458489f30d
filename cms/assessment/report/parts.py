"""Texts, symbols and tables that reports share."""

from collections.abc import Iterable

from cms.assessment.compare.comparison import Comparison
from cms.assessment.quality.limits import LIMITS
from cms.assessment.quality.numbers import number
from cms.assessment.quality.record import QualityRecord
from cms.assessment.report.formatting import share
from cms.assessment.report.palette import style_of
from fe_models.foundation.documents.document import Cell, Paragraph, TextTable
from fe_models.foundation.documents.html import text

__all__ = [
    "COLUMNS",
    "MARKS",
    "legend",
    "limit_words",
    "nothing_to_show",
    "records_table",
    "sentence_case",
    "swatch",
    "verdict_cell",
]

MARKS = {
    "pass": "\u2713 good enough",
    "warn": "! misses a limit",
    "fail": "\u2715 not good enough",
    "error": "! could not be made",
}
WORST_FIRST = ("fail", "warn", "pass", "info")
#: short headings of the deciding records, and descriptions of their charts
COLUMNS = {
    "frequency-error": "free frequencies",
    "mac": "shapes (1\u2009\u2212\u2009MAC)",
    "static-interface": "static, interface loads",
    "static-inertia": "static, inertia loads",
    "static-load-cases": "static, load cases",
    "frequency-response": "frequency response",
    "deformation-error": "motion, \u03b5(t)",
}


def limit_words(name: str) -> str:
    """Return the limit of a record as text."""
    tolerance = LIMITS[name].tolerance
    return "" if tolerance is None else f"\u2264 {share(tolerance)}"


def verdict_cell(record: QualityRecord) -> Cell:
    """Return a table cell with the value of a record in the colour of its verdict."""
    kind = record.verdict if record.verdict != "info" else "blank"
    return Cell(share(record.value) if record.verdict != "info" else "n/a", f"n {kind}")


def records_table(records: Iterable[QualityRecord]) -> TextTable:
    """Return a table of records, the worst verdicts first: value, limit, finding and remedy."""
    rows = tuple(
        (
            record.verdict, record.title, number(record.value), number(record.tolerance),
            record.reason + (f". To do: {record.action}" if record.action else ""),
        )
        for record in sorted(records, key=lambda record: WORST_FIRST.index(record.verdict))
    )  # fmt: skip
    return TextTable(("verdict", "check", "value>", "limit>", "found"), rows, (0.08, 0.24, 0.09, 0.08, 0.51), 0)


def swatch(k: int) -> tuple[str, str]:
    """Return a short line in colour and dash of set k, as in the charts."""
    return style_of(k).color, style_of(k).dash


def sentence_case(words: str) -> str:
    """Return a sentence with a capital letter and a full stop."""
    return f"{words[:1].upper()}{words[1:]}{'' if words.endswith('.') else '.'}"


def legend(comparison: Comparison) -> str:
    """Return the legend that all charts of a section share."""
    dashes = {"solid": "", "dash": "7 4", "dot": "2 3", "dashdot": "7 3 2 3", "longdash": "11 4"}
    items = []
    for k, result in enumerate(comparison.sets):
        if result.points:
            style = style_of(k)
            line = f'<line x1="0" y1="8" x2="34" y2="8" stroke="{style.color}" stroke-width="2.4" stroke-dasharray="'
            line += dashes.get(style.dash, "11 4 2 4") + '"/>'
            mark = (
                f'<g transform="translate(17 8)" fill="{style.color}" stroke="{style.color}">{GLYPHS[style.symbol]}</g>'
            )
            drawn = f'<svg width="34" height="16" aria-hidden="true">{line}{mark}</svg>'
            items.append(f"<li>{drawn}{text(result.name)}</li>")
    return f'<ul class="legend">{"".join(items)}</ul>'


#: markers of the charts, drawn about the origin
GLYPHS = {
    "circle": '<circle r="4"/>',
    "square": '<rect x="-3.6" y="-3.6" width="7.2" height="7.2"/>',
    "diamond": '<path d="M0-5L5 0L0 5L-5 0z"/>',
    "triangle-up": '<path d="M0-4.6L4.6 3.6H-4.6z"/>',
    "cross": '<path d="M-4.5 0H4.5M0-4.5V4.5" stroke-width="3"/>',
    "x": '<path d="M-3.6-3.6L3.6 3.6M-3.6 3.6L3.6-3.6" stroke-width="3"/>',
    "triangle-down": '<path d="M0 4.6L4.6-3.6H-4.6z"/>',
    "star": '<path d="M0-5.4L1.3-1.8L5.1-1.7L2.1.7L3.2 4.4L0 2.2L-3.2 4.4L-2.1.7L-5.1-1.7L-1.3-1.8z"/>',
}


def nothing_to_show() -> Paragraph:
    """Return the text for a comparison in which no set could be computed."""
    words = "No set could be made, so there is nothing to show here; the reasons stand with the verdicts."
    return Paragraph(words, "notice")
