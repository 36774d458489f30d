"""Sections of a comparison about the body and the sets: mode shapes, columns, meaning of the numbers."""

from collections.abc import Sequence

from cms.assessment.compare.comparison import Comparison
from cms.assessment.compare.verdicts import DECIDING, DOUBTS
from cms.assessment.quality.limits import LIMITS
from cms.assessment.report.html import Cell, Section, table, text
from cms.assessment.report.parts import COLUMNS, sentence_case, swatch, verdict_cell
from cms.assessment.report.shapes import still_pictures
from cms.assessment.report.words import count, factor, hertz, seconds, share

__all__ = ["columns_section", "method_section", "shape_section"]


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
