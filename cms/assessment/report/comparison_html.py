"""A comparison as one HTML page that works offline: verdicts first, then the evidence."""

from collections.abc import Sequence

from cms.assessment.compare.comparison import Comparison
from cms.assessment.compare.verdicts import DECIDING
from cms.assessment.report.body_sections import columns_section, method_section, shape_section
from cms.assessment.report.evidence import (
    convergence_section,
    frequency_section,
    mac_section,
    mass_section,
    motion_section,
    response_section,
)
from cms.assessment.report.html import Cell, Section, page, table, text
from cms.assessment.report.parts import COLUMNS, MARKS, limit_words, sentence_case, swatch, verdict_cell
from cms.assessment.report.shapes import shapes_json
from cms.assessment.report.words import count, hertz, share

__all__ = ["comparison_html"]


def comparison_html(comparison: Comparison, *, stills: int = 4) -> str:
    """Return the report.

    Parameters
    ----------
    stills
        Number of still pictures of mode shapes, for printing; each takes some seconds.
    """
    sections = [
        verdict_section(comparison),
        convergence_section(comparison),
        frequency_section(comparison),
        mac_section(comparison),
        response_section(comparison),
        motion_section(comparison),
        mass_section(comparison),
        shape_section(comparison, stills),
        columns_section(comparison),
        method_section(comparison),
    ]
    has_shapes = len(comparison.drawing.shapes) > 0
    return page(
        f"{comparison.name}: comparison of mode sets",
        f"{text(comparison.name)}<small>comparison of mode sets</small>",
        header(comparison),
        [section for section in sections if section is not None],
        {"shapes": shapes_json(comparison.drawing)} if has_shapes else {},
        text("Written by cms compare. The same numbers stand in the JSON and CSV files beside this page."),
    )


def header(comparison: Comparison) -> str:
    """Return the title, the facts, and the answer."""
    full, units = comparison.full, comparison.units
    ends = ", ".join(f"{name} ({kind})" for name, kind, _ in comparison.interfaces)
    facts = (
        f"{count(comparison.n_dof)} dofs, {count(comparison.n_nodes)} nodes; interfaces {ends}; {full.n_band} elastic "
        f"free modes "
        f"up to {hertz(full.band_hz)} Hz; mass {full.mass[0]:.4g} {units.mass_symbol}"
    )
    best = comparison.set(comparison.ranking[0]).detail if comparison.ranking else None
    figures = ""
    if best is not None:
        values = [
            (comparison.ranking[0], "mode set"),
            (str(best.n_modes), "vibration modes"),
            (str(best.n_q), f"coordinates, of {count(comparison.n_dof)} dofs"),
            (share(best.record("frequency-error").value), "largest frequency error"),
            (share(best.record("frequency-response").value), "response error"),
            (share(best.record("deformation-error").value), "deformation error"),
        ]
        figures = "".join(f"<div><b>{text(value)}</b>{text(words)}</div>" for value, words in values)
        figures = f'<div class="figures">{figures}</div>'
    return (
        f"<h1>Which mode set is good enough for {text(comparison.name)}?</h1>"
        f'<p class="facts">{text(facts)}</p>'
        f'<section class="answer{"" if best is not None else " none"}"><p>{text(comparison.sentence)}</p>{figures}'
        "</section>"
    )


def verdict_section(comparison: Comparison) -> Section:
    """Return the verdict of every set, with the numbers that it depends on."""
    headings = ["set", "verdict", "modes>", "coordinates>", *(f"{COLUMNS[name]}>" for name in DECIDING)]
    limits = [Cell("limit", "name"), Cell(""), Cell(""), Cell("")]
    limits += [Cell(limit_words(name), "n") for name in DECIDING]
    rows: list[tuple[str, Sequence[Cell]]] = [("", limits)]
    for k, result in enumerate(comparison.sets):
        point = result.detail
        badge = f'<span class="badge {result.verdict}">{MARKS[result.verdict]}</span>'
        cells = [Cell(result.name, "name", markup=swatch(k)), Cell("", markup=badge)]
        if point is None:
            cells += [Cell("\u2013", "n blank") for _ in range(2 + len(DECIDING))]
        else:
            cells += [Cell(str(point.n_modes), "n"), Cell(str(point.n_q), "n")]
            cells += [verdict_cell(point.record(name)) for name in DECIDING]
        rows.append(("has-why", cells))
        reason = Cell("", note=sentence_case(result.sentence), span=len(headings))
        rows.append(("why-row", [reason]))
    return Section(
        "verdicts",
        "Verdicts",
        "Verdicts",
        table(headings, rows) + f"<p class=screen-only style='margin-top:12px;font-size:13px'>{text(VERDICT_NOTE)}</p>",
        "Every set at its fewest modes with which all numbers keep their limits; a set that never does, at its most.",
    )


VERDICT_NOTE = "Green keeps the limit, amber misses it, red misses it by far."
