"""A comparison as one HTML page that works offline: verdicts first, then the evidence."""

from collections.abc import Sequence

from cms.assessment.compare.comparison import Comparison
from cms.assessment.compare.verdicts import DECIDING, DOUBTS
from cms.assessment.quality.limits import LIMITS
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
from cms.assessment.report.shapes import shapes_json, still_pictures
from cms.assessment.report.words import count, factor, hertz, seconds, share

__all__ = ["columns_section", "comparison_html", "method_section", "shape_section"]


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


# sections of a comparison about the body and the sets: mode shapes, columns, meaning of the numbers -------------------


def shape_section(comparison: Comparison, stills: int) -> Section:
    """Return the section with mode shapes of the full model, interactive and as pictures."""
    drawing, full = comparison.drawing, comparison.full
    if not len(drawing.nodes):
        return Section("shapes-section", "Mode shapes", "Mode shapes", '<p class="notice">The body has no surface.</p>')
    buttons = "".join(
        f'<button aria-pressed="false"><span>mode {k + 1}</span><span>{hertz(full.frequencies_hz[k])} '
        f"Hz</span></button>"
        for k in range(len(drawing.shapes))
    )
    scale = (
        '<div class="scale">displacement / largest<i style="background:linear-gradient(90deg,#3b6fb6,#4fa3c7,#8fcfb0,'
        '#e6e28a,#f2a65a,#d6513f,#9b1d3c)"></i><span><b>0</b><b>1</b></span></div>'
    )
    viewer = (
        '<p class="notice" id="no-webgl" hidden>This browser draws no 3D (WebGL 2); the pictures below show the same '
        "modes.</p>"
        '<div class="viewer" id="viewer"><div class="stage"><canvas tabindex="0" aria-label="Mode shape in '
        '3D"></canvas>'
        f"{scale}"
        '<div class="tools"><button data-do="play" aria-pressed="false">move</button><button '
        'data-do="reset">reset</button>'
        '</div><div class="hint">drag to turn \u00b7 ctrl + wheel to zoom \u00b7 arrow keys turn</div></div>'
        f'<div class="list">{buttons}</div></div>'
    )
    pictures = "".join(
        f'<figure><img alt="{text(comparison.name)}: {text(title)}" src="data:image/png;base64,{png}">'
        f"<figcaption>{text(sentence_case(title))}</figcaption></figure>"
        for title, png in still_pictures(comparison, stills)
    )
    thinned = drawing.n_triangles_full > len(drawing.triangles)
    note = (
        f" {count(drawing.n_triangles_full)} triangles are thinned out to {count(len(drawing.triangles))}."
        if thinned
        else ""
    )
    lead = f"Elastic free modes of the full model in the band, coloured by displacement; thin lines: undeformed.{note}"
    return Section(
        "shapes-section", "Mode shapes", "Mode shapes", f'{viewer}<div class="stills">{pictures}</div>', lead
    )


def columns_section(comparison: Comparison) -> Section:
    """Return the section about the columns of the sets."""
    rows: list[tuple[str, Sequence[Cell]]] = []
    for k, result in enumerate(comparison.sets):
        point = result.detail
        name = Cell(result.name, "name", markup=swatch(k))
        if point is None:
            rows.append(
                ("", [name, Cell(result.words, note=sentence_case(result.sentence)), *[Cell("\u2013", "n blank")] * 6])
            )
            continue
        made = ", ".join(f"{count} {family}" for family, count in result.columns.items())
        dropped = f"Redundant and dropped: {', '.join(point.dropped)}." if point.dropped else ""
        cells = [
            name,
            Cell(made, note=f"{sentence_case(result.words)} {dropped}"),
            Cell(str(point.n_columns), "n"),
            Cell(str(len(point.dropped)), "n"),
            Cell(str(point.n_q), "n"),
            verdict_cell(point.record("residual-bound")),
            Cell(factor(point.record("conditioning").value), f"n {point.record('conditioning').verdict}"),
            Cell(seconds(result.seconds), "n"),
        ]
        rows.append(("", cells))
    headings = ["set", "columns", "columns>", "dropped>", "coordinates>", "residual bound>", "condition>", "time>"]
    lead = (
        "What every set consists of at its shown number of modes. Coordinates are the independent elastic shapes that "
        "are left when redundant columns and rigid-body motion are taken out; the time is that of the set with the "
        "most modes and of judging all numbers of modes."
    )
    return Section("columns", "Columns, rank and conditioning", "Columns", table(headings, rows), lead)


def method_section(comparison: Comparison) -> Section:
    """Return the section about the meaning and the source of the numbers."""
    terms = [(COLUMNS[name], name) for name in DECIDING] + [(DOUBTS[name], name) for name in DOUBTS]
    meanings = "".join(
        f"<dt>{text(sentence_case(title)[:-1])}</dt><dd>{text(sentence_case(LIMITS[name].title))} "
        f"{text('Limit: ' + share(LIMITS[name].tolerance) + '.' if LIMITS[name].tolerance else 'Told, not judged.')} "  # type: ignore[arg-type]
        f"{text('If missed: ' + LIMITS[name].action + '.' if LIMITS[name].tolerance else '')}</dd>"
        for title, name in terms
    )
    source = "taken from an earlier comparison" if comparison.full.was_cached else "solved for this comparison"
    facts = {
        "reference": f"full model, {source}; digest {comparison.full.digest[:16]}",
        "units": comparison.units.name,
        "time": ", ".join(f"{stage} {seconds(value)}" for stage, value in comparison.seconds.items()),
        **comparison.provenance,
    }
    rows = [[Cell(key, "name"), Cell(value)] for key, value in facts.items()]
    body = (
        f'<dl class="terms">{meanings}</dl><h3 style="margin:22px 0 8px">Provenance</h3>'
        f"<details open><summary>Model, versions, times</summary>{table(['', ''], rows)}</details>"
    )
    lead = (
        "A set is good enough when the first six numbers keep their limits; the others are told beside them. Every "
        "set is made once, with the most modes, from one factorisation; the sets with fewer modes are its subspaces."
    )
    return Section("method", "What the numbers mean", "Method", body, lead)
