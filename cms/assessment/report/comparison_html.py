"""A comparison as one HTML page that works offline: verdicts first, then the evidence."""

import math
from collections.abc import Sequence

from cms.assessment.compare.comparison import Comparison
from cms.assessment.compare.verdicts import DECIDING, DOUBTS, crossings, modes_words
from cms.assessment.quality.limits import LIMITS
from cms.assessment.report.charts import (
    CONVERGENCE_HEIGHT,
    MAC_HEIGHT,
    Chart,
    convergence_chart,
    deformation_chart,
    effective_mass_chart,
    mac_chart,
    response_chart,
    response_error_chart,
)
from cms.assessment.report.formatting import count, factor, hertz, seconds, share, signed_percent
from cms.assessment.report.html import Cell, Section, figure, page, table, text
from cms.assessment.report.parts import (
    COLUMNS,
    MARKS,
    legend,
    limit_words,
    nothing_to_show,
    sentence_case,
    swatch,
    verdict_cell,
)
from cms.assessment.report.shapes import shapes_json, still_pictures

__all__ = [
    "columns_section",
    "comparison_html",
    "convergence_section",
    "frequency_section",
    "mac_section",
    "mass_section",
    "method_section",
    "motion_section",
    "response_section",
    "shape_section",
]


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


def judged(comparison: Comparison) -> list[str]:
    """Return the deciding quantities that were judged for at least one set; a body may have no load cases."""
    points = [result.detail for result in comparison.sets if result.detail is not None]
    return [name for name in DECIDING if any(point.record(name).verdict != "info" for point in points)]


def verdict_section(comparison: Comparison) -> Section:
    """Return the verdict of every set, with the numbers that it depends on."""
    names = judged(comparison)
    headings = ["set", "verdict", "modes>", "coordinates>", *(f"{COLUMNS[name]}>" for name in names)]
    limits = [Cell("limit", "name"), Cell(""), Cell(""), Cell("")]
    limits += [Cell(limit_words(name), "n") for name in names]
    rows: list[tuple[str, Sequence[Cell]]] = [("", limits)]
    for k, result in enumerate(comparison.sets):
        point = result.detail
        badge = f'<span class="badge {result.verdict}">{MARKS[result.verdict]}</span>'
        cells = [Cell(result.name, "name", markup=swatch(k)), Cell("", markup=badge)]
        if point is None:
            cells += [Cell("\u2013", "n blank") for _ in range(2 + len(names))]
        else:
            cells += [Cell(str(point.n_modes), "n"), Cell(str(point.n_q), "n")]
            cells += [verdict_cell(point.record(name)) for name in names]
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


# sections of a comparison with the evidence for its verdicts: convergence, frequencies, shapes, response, motion ------


#: descriptions of the charts of the records
SEEN = {
    "frequency-error": "Largest error of the elastic free-free frequencies in the band. Reduced frequencies are bounds "
    "from above, so the lines can only fall; where a set has fewer modes than the band it has no point yet.",
    "mac": "Part of the least recovered mode shape that the set misses, mass-weighted.",
    "static-interface": "Error in energy of the static response to forces and moments on the interfaces. Sets with "
    "constraint or attachment modes answer them exactly, down to rounding.",
    "static-inertia": "Error in energy of the static response to rigid-body accelerations with the interfaces held. "
    "Sets with inertia-relief or residual modes answer it exactly from the start.",
    "static-load-cases": "Error in energy of the static response of the free body to its load cases. Residual vectors "
    "of the load cases answer it exactly.",
    "frequency-response": "Error of all receptances between the interfaces, root mean square over the band.",
    "deformation-error": "Largest part of the deformation in the reference motion that lies outside the set, in "
    "energy.",
    "residual-bound": "What the residuals guarantee without knowing the full model: no true frequency is farther away. "
    "The true error is mostly near the square of it.",
    "effective-mass": "Largest share, over x, y and z, of the effective mass that the set leaves out while its "
    "interfaces are held. A set that answers rigid-body accelerations statically is not judged by it.",
}


def convergence_section(comparison: Comparison) -> Section:
    """Return the section with error against number of modes, one chart per record."""
    charts: dict[str, Chart] = {}
    figures = []
    for name in (*judged(comparison), "residual-bound", "effective-mass"):
        chart = convergence_chart(comparison, name)
        title = {**COLUMNS, "residual-bound": "residual bound", "effective-mass": "missing effective mass"}[name]
        if not chart["data"]:
            figures.append(f"<figure><h3>{text(sentence_case(title)[:-1])}</h3><p>No set has this number.</p></figure>")
            continue
        charts[f"chart-{name}"] = chart
        caption = f"{SEEN[name]} {crossings(comparison.sets, name)}"
        title = sentence_case(title)[:-1]
        figures.append(figure(f"chart-{name}", caption, title=title, height=CONVERGENCE_HEIGHT, kind="convergence"))
    switch = (
        '<div class="switch screen-only" role="group" aria-label="Horizontal axis">'
        '<button data-column="0" aria-pressed="true">by vibration modes</button>'
        '<button data-column="1" aria-pressed="false">by coordinates</button></div>'
    )
    lead = (
        "Each line is one set; the dashed line is the limit; values below an axis stand at its lower end. Lines that "
        "cover one another belong to sets of one span. By coordinates the sets are compared at equal size of the "
        "reduced body: some bring more static columns than others."
    )
    body = f'<div class="row">{switch}{legend(comparison)}</div><div class="grid">{"".join(figures)}</div>'
    return Section("convergence", "Error against number of modes", "Convergence", body, lead, charts)


def frequency_section(comparison: Comparison) -> Section:
    """Return the section with elastic free frequencies of the full model and of every set at its shown point."""
    full = comparison.full
    shown = [(result, result.detail) for result in comparison.sets if result.detail is not None]
    headings = ["mode>", "full model [Hz]>"]
    headings += [f"{result.name}, {point.n_modes}>" for result, point in shown]
    rows = []
    for k in range(full.n_band):
        cells = [Cell(str(k + 1), "n"), Cell(hertz(full.frequencies_hz[k]), "n name")]
        for _, point in shown:
            data = point.record("frequency-error").data
            error = float(data["error"][k])
            reduced = float(data["reduced_hz"][k]) if k < len(data["reduced_hz"]) else math.nan
            cells.append(Cell(signed_percent(error), f"n {error_kind(error)}", note=hertz(reduced)))
        rows.append(cells)
    lead = (
        f"Elastic frequencies of the free body up to {hertz(full.band_hz)} Hz, recomputed from every reduced body at "
        "the number of modes that stands beside its name: the error, and below it the frequency [Hz]."
    )
    return Section("frequencies", "Free-free frequencies", "Frequencies", table(headings, rows), lead)


def error_kind(error: float) -> str:
    """Return the verdict of one frequency, according to the limit of the record."""
    limit = LIMITS["frequency-error"]
    if math.isnan(error) or (limit.failing is not None and abs(error) > limit.failing):
        return "fail"
    return "pass" if limit.tolerance is None or abs(error) <= limit.tolerance else "warn"


def mac_section(comparison: Comparison) -> Section:
    """Return the section with MAC matrices of every set at its shown point."""
    charts: dict[str, Chart] = {}
    figures = []
    for k, result in enumerate(comparison.sets):
        point = result.detail
        if point is None or not point.record("mac").data["mac"].shape[1]:
            continue
        key = f"mac-{k}"
        charts[key] = mac_chart(result, point, comparison.full.frequencies_hz)
        caption = sentence_case(point.record("mac").reason)
        figures.append(figure(key, caption, title=f"{result.name}, {modes_words(point.n_modes)}", height=MAC_HEIGHT))
    lead = (
        "Down: the modes of the full model; across: those of the reduced body. Dark is 1, the same shape; white is 0. "
        "A dark diagonal says that shapes and order agree, dark off the diagonal that modes have changed places."
    )
    body = f'<div class="grid three">{"".join(figures)}</div>' if figures else nothing_to_show()
    return Section("mac", "Mode shapes: MAC", "MAC", body, lead, charts)


def response_section(comparison: Comparison) -> Section:
    """Return the section with the frequency response: overlay and error."""
    full = comparison.full
    if not any(result.detail for result in comparison.sets):
        return Section("response", "Frequency response", "Response", nothing_to_show())
    words = ", ".join(
        f"{result.name} {share(result.detail.record('frequency-response').value)}"
        for result in comparison.sets
        if result.detail is not None
    )
    body = figure(
        "response",
        f"{sentence_case(full.response_words)} The thick grey line is the full model; a set that is good enough covers "
        "it, peaks and valleys alike.",
        title="Receptance from the first interface to the last",
        height=430,
    ) + figure(
        "response-error",
        f"Error of the whole receptance matrix of all interfaces at each frequency. Over the band: {words}. Narrow "
        f"peaks "
        "stand where a resonance is shifted.",
        title="Error at each frequency",
    )
    lead = (
        f"The free body is driven at its interfaces with {100 * full.damping:.3g} % damping in every mode, full and "
        f"reduced "
        f"alike; the full model's own response is known to {share(full.response_error)}."
    )
    charts = {"response": response_chart(comparison), "response-error": response_error_chart(comparison)}
    return Section("response", "Frequency response at the interfaces", "Response", body, lead, charts)


def motion_section(comparison: Comparison) -> Section:
    """Return the section with the deformation error over time."""
    if not any(result.detail for result in comparison.sets):
        return Section("motion", "Deformation error", "Motion", nothing_to_show())
    rows = []
    for k, result in enumerate(comparison.sets):
        if result.detail is not None:
            error = result.detail.record("deformation-error").data["error"]
            cells = [Cell(f"{result.name}, {result.detail.n_modes}", "name", markup=swatch(k))]
            rows.append(cells + [Cell(share(float(max(error[norm]))), "n") for norm in ("K", "M", "nodal")])
    norms = table(["largest \u03b5 over time", "energy (K)>", "mass (M)>", "nodes>"], rows)
    lead = (
        f"\u03b5(t) is the part of the full model's deformation that no combination of the set's shapes can follow, "
        f"over "
        f"the largest deformation. The motion: {comparison.full.motion_words}."
    )
    caption = (
        "In the energy norm. The grey hill is the force; while it acts the local deformation under it counts, "
        "afterwards the free vibration."
        if comparison.full.force is not None
        else "In the energy norm."
    )
    charts = {"motion": deformation_chart(comparison)}
    body = figure("motion", caption, height=400) + norms
    return Section("motion-section", "Deformation error in a motion", "Motion", body, lead, charts)


def mass_section(comparison: Comparison) -> Section:
    """Return the section with the effective mass by direction."""
    if not any(result.detail for result in comparison.sets):
        return Section("mass", "Effective mass", "Effective mass", nothing_to_show())
    full = comparison.full
    held = 100 * float(full.held_mass[0]) / float(full.mass[0]) if full.mass[0] > 0 else 0.0
    caption = (
        f"100 % is what all fixed-interface modes of the full model carry ({held:.0f} % of the mass along x; the rest "
        "sits at the interfaces and moves with them). A low bar says that accelerations in this direction deform the "
        "body in ways the set leaves out; it decides nothing by itself."
    )
    charts = {"effective-mass": effective_mass_chart(comparison)}
    return Section(
        "mass", "Effective mass with the interfaces held", "Effective mass",
        figure("effective-mass", caption, height=360), "", charts,
    )  # fmt: skip
