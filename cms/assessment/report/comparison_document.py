"""A comparison as a document: verdicts first, then the evidence."""

import math
from collections.abc import Sequence
from importlib.resources import files

from cms.assessment.compare.comparison import Comparison
from cms.assessment.compare.verdicts import DECIDING, DOUBTS, crossings, modes_words
from cms.assessment.quality.limits import LIMITS
from cms.assessment.report.charts import (
    convergence_chart,
    deformation_chart,
    effective_mass_chart,
    mac_chart,
    response_chart,
    response_error_chart,
)
from cms.assessment.report.formatting import count, factor, hertz, seconds, share, signed_percent
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
from fe_models.foundation.documents.document import (
    Answer,
    Block,
    Cell,
    Document,
    Figure,
    Gallery,
    Heading,
    Markup,
    Paragraph,
    Picture,
    Section,
    Terms,
    TextTable,
)

__all__ = [
    "columns_section",
    "comparison_document",
    "convergence_section",
    "frequency_section",
    "mac_section",
    "mass_section",
    "method_section",
    "motion_section",
    "response_section",
    "shape_section",
]


def comparison_document(comparison: Comparison, *, stills: int = 4) -> Document:
    """Return the document.

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
    facts, answer = head(comparison)
    return Document(
        f"Which mode set is good enough for {comparison.name}?",
        facts,
        answer,
        sections,
        comparison.name,
        "comparison of mode sets",
        footer="Written by cms compare. The JSON and CSV files beside this page contain the same numbers.",
    )


def head(comparison: Comparison) -> tuple[str, Answer]:
    """Return the head of the document: the facts and the answer."""
    full, units = comparison.full, comparison.units
    ends = ", ".join(f"{name} ({kind})" for name, kind, _ in comparison.interfaces)
    facts = (
        f"{count(comparison.n_dof)} dofs, {count(comparison.n_nodes)} nodes; interfaces {ends}; {full.n_band} elastic "
        f"free modes "
        f"up to {hertz(full.band_hz)} Hz; mass {full.mass[0]:.4g} {units.mass_symbol}"
    )
    best = comparison.set(comparison.ranking[0]).detail if comparison.ranking else None
    figures: list[tuple[str, str]] = []
    if best is not None:
        figures = [
            (comparison.ranking[0], "mode set"),
            (str(best.n_modes), "vibration modes"),
            (str(best.n_q), f"coordinates, of {count(comparison.n_dof)} dofs"),
            (share(best.record("frequency-error").value), "largest frequency error"),
            (share(best.record("frequency-response").value), "response error"),
            (share(best.record("deformation-error").value), "deformation error"),
        ]
    return facts, Answer(comparison.sentence, "fail" if best is None else "pass", figures=figures)


def judged(comparison: Comparison) -> list[str]:
    """Return the deciding quantities that were assessed for at least one set; a body may have no load cases."""
    points = [result.detail for result in comparison.sets if result.detail is not None]
    return [name for name in DECIDING if any(point.record(name).verdict != "info" for point in points)]


def verdict_section(comparison: Comparison) -> Section:
    """Return the section with the verdict of every set and the numbers that determine it."""
    names = judged(comparison)
    headings = ["set", "verdict", "modes>", "coordinates>", *(f"{COLUMNS[name]}>" for name in names)]
    limits = [Cell("limit", "name"), Cell(""), Cell(""), Cell("")]
    limits += [Cell(limit_words(name), "n") for name in names]
    rows: list[Sequence[Cell]] = [limits]
    for k, result in enumerate(comparison.sets):
        point = result.detail
        cells = [Cell(result.name, "name", line=swatch(k)), Cell(MARKS[result.verdict], badge=result.verdict)]
        if point is None:
            cells += [Cell("\u2013", "n blank") for _ in range(2 + len(names))]
        else:
            cells += [Cell(str(point.n_modes), "n"), Cell(str(point.n_q), "n")]
            cells += [verdict_cell(point.record(name)) for name in names]
        rows += [cells, [Cell("", note=sentence_case(result.sentence), span=len(headings))]]
    return Section(
        "verdicts",
        "Verdicts",
        (TextTable(headings, rows), Paragraph(VERDICT_NOTE, "why")),
        "Each set is shown with the fewest modes with which all numbers keep their limits, else with the most modes.",
    )


VERDICT_NOTE = "Green keeps the limit, amber misses it, red misses it by far."


# sections of a comparison about the body and the sets: mode shapes, columns, meaning of the numbers -------------------


def shape_section(comparison: Comparison, stills: int) -> Section:
    """Return the section with mode shapes of the full model, interactive and as pictures."""
    drawing, full = comparison.drawing, comparison.full
    if not len(drawing.nodes):
        return Section("shapes-section", "Mode shapes", (Paragraph("The body has no surface.", "notice"),))
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
    pictures = [Picture(png, sentence_case(title)) for title, png in still_pictures(comparison, stills)]
    data = {"shapes": shapes_json(drawing)} if len(drawing.shapes) else {}
    thinned = drawing.n_triangles_full > len(drawing.triangles)
    note = (
        f" {count(drawing.n_triangles_full)} triangles are thinned out to {count(len(drawing.triangles))}."
        if thinned
        else ""
    )
    lead = f"Elastic free modes of the full model in the band, coloured by displacement; thin lines: undeformed.{note}"
    script = (files("cms.assessment.report") / "data" / "viewer.js").read_text(encoding="utf-8")
    return Section("shapes-section", "Mode shapes", (Markup(viewer, script, data), Gallery(pictures)), lead)


def columns_section(comparison: Comparison) -> Section:
    """Return the section about the columns of the mode sets."""
    rows: list[Sequence[Cell]] = []
    for k, result in enumerate(comparison.sets):
        point = result.detail
        name = Cell(result.name, "name", line=swatch(k))
        if point is None:
            why = Cell(result.words, note=sentence_case(result.sentence))
            rows.append([name, why, *[Cell("\u2013", "n blank")] * 6])
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
        rows.append(cells)
    headings = ["set", "columns", "columns>", "dropped>", "coordinates>", "residual bound>", "condition>", "time>"]
    lead = (
        "Columns of every set at its shown number of modes. Coordinates are the independent elastic shapes that remain "
        "without redundant columns and rigid-body motion. The time includes the computation of the set with the most "
        "modes and the assessment of all numbers of modes."
    )
    return Section("columns", "Columns, rank and conditioning", (TextTable(headings, rows),), lead, "Columns")


def method_section(comparison: Comparison) -> Section:
    """Return the section about the meaning and the source of the numbers."""
    terms = [(COLUMNS[name], name) for name in DECIDING] + [(DOUBTS[name], name) for name in DOUBTS]
    meanings = []
    for title, name in terms:
        limit = LIMITS[name]
        words = f"{sentence_case(limit.title)} "
        words += f"Limit: {share(limit.tolerance)}. If missed: {limit.action}." if limit.tolerance else (
            "Without limit."
        )  # fmt: skip
        meanings.append((sentence_case(title)[:-1], words))
    source = "taken from an earlier comparison" if comparison.full.was_cached else "solved for this comparison"
    facts = {
        "reference": f"full model, {source}; digest {comparison.full.digest[:16]}",
        "units": comparison.units.name,
        "time": ", ".join(f"{stage} {seconds(value)}" for stage, value in comparison.seconds.items()),
        **comparison.provenance,
    }
    rows = [[Cell(key, "name"), Cell(value)] for key, value in facts.items()]
    lead = (
        "A set is good enough if the first six numbers keep their limits; the others are information. Every set is "
        "computed once, with the most modes, from one factorisation; the sets with fewer modes are its subspaces."
    )
    blocks = (Terms(meanings), Heading("Provenance: model, versions, times"), TextTable(["", ""], rows))
    return Section("method", "What the numbers mean", blocks, lead, "Method")


# sections of a comparison with the evidence for its verdicts: convergence, frequencies, shapes, response, motion ------


#: descriptions of the charts of the records
SEEN = {
    "frequency-error": "Largest error of the elastic free-free frequencies in the band. Reduced frequencies are bounds "
    "from above, so the lines can only fall. A set with fewer modes than the band has no point.",
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
    "residual-bound": "Error bound from residuals, without the modes of the full model: a true frequency lies within "
    "it. The true error is usually close to its square.",
    "effective-mass": "Largest share, in x, y or z, of the effective mass with fixed interfaces that the set leaves "
    "out. It does not matter for a set whose static response to rigid-body accelerations is exact.",
}


def convergence_section(comparison: Comparison) -> Section:
    """Return the section with error against number of modes, one chart per record."""
    figures: list[Block] = []
    for name in (*judged(comparison), "residual-bound", "effective-mass"):
        chart = convergence_chart(comparison, name)
        title = {**COLUMNS, "residual-bound": "residual bound", "effective-mass": "missing effective mass"}[name]
        if not chart.items:
            figures.append(Paragraph(f"{sentence_case(title)} No set has this number."))
            continue
        caption = f"{SEEN[name]} {crossings(comparison.sets, name)}"
        figures.append(Figure(f"chart-{name}", chart, caption, sentence_case(title)[:-1]))
    switch = (
        '<div class="switch screen-only" role="group" aria-label="Horizontal axis">'
        '<button data-column="0" aria-pressed="true">by vibration modes</button>'
        '<button data-column="1" aria-pressed="false">by coordinates</button></div>'
    )
    lead = (
        "Each line is one set; the dashed line is the limit. Values below the axis are drawn at its lower end. Lines "
        "that coincide belong to sets with the same span. The axis of coordinates compares sets at equal size of the "
        "reduced body, because sets have different numbers of static columns."
    )
    row = Markup(f'<div class="row">{switch}{legend(comparison)}</div>')
    return Section("convergence", "Error against number of modes", (row, Gallery(figures)), lead, "Convergence")


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
        "the number of modes beside its name: the error, and below it the frequency [Hz]."
    )
    return Section("frequencies", "Free-free frequencies", (TextTable(headings, rows),), lead, "Frequencies")


def error_kind(error: float) -> str:
    """Return the verdict for one frequency error by the limit of the record."""
    limit = LIMITS["frequency-error"]
    if math.isnan(error) or (limit.failing is not None and abs(error) > limit.failing):
        return "fail"
    return "pass" if limit.tolerance is None or abs(error) <= limit.tolerance else "warn"


def mac_section(comparison: Comparison) -> Section:
    """Return the section with MAC matrices of every set at its shown point."""
    figures = []
    for k, result in enumerate(comparison.sets):
        point = result.detail
        if point is None or not point.record("mac").data["mac"].shape[1]:
            continue
        chart = mac_chart(result, point, comparison.full.frequencies_hz)
        caption = sentence_case(point.record("mac").reason)
        figures.append(Figure(f"mac-{k}", chart, caption, f"{result.name}, {modes_words(point.n_modes)}"))
    lead = (
        "Down: the modes of the full model; across: those of the reduced body. Dark is 1, the same shape; white is 0. "
        "A dark diagonal means that shapes and order agree; dark cells beside it mean that modes have another order."
    )
    return Section("mac", "Mode shapes: MAC", (Gallery(figures, 3) if figures else nothing_to_show(),), lead, "MAC")


def response_section(comparison: Comparison) -> Section:
    """Return the section with the frequency response: overlay and error."""
    full = comparison.full
    if not any(result.detail for result in comparison.sets):
        return Section("response", "Frequency response", (nothing_to_show(),), short="Response")
    words = ", ".join(
        f"{result.name} {share(result.detail.record('frequency-response').value)}"
        for result in comparison.sets
        if result.detail is not None
    )
    overlay = Figure(
        "response-chart",
        response_chart(comparison),
        f"{sentence_case(full.response_words)} The thick grey line is the full model; a set that is good enough covers "
        "it, peaks and valleys alike.",
        "Receptance from the first interface to the last",
    )
    error = Figure(
        "response-error",
        response_error_chart(comparison),
        f"Error of the whole receptance matrix of all interfaces at each frequency. Over the band: {words}. Narrow "
        "peaks stand where a resonance is shifted.",
        "Error at each frequency",
    )
    lead = (
        f"The free body is driven at its interfaces with {100 * full.damping:.3g} % damping in every mode, full and "
        f"reduced "
        f"alike; the full model's own response is known to {share(full.response_error)}."
    )
    return Section("response", "Frequency response at the interfaces", (overlay, error), lead, "Response")


def motion_section(comparison: Comparison) -> Section:
    """Return the section with the deformation error over time."""
    if not any(result.detail for result in comparison.sets):
        return Section("motion", "Deformation error", (nothing_to_show(),), short="Motion")
    rows = []
    for k, result in enumerate(comparison.sets):
        if result.detail is not None:
            error = result.detail.record("deformation-error").data["error"]
            cells = [Cell(f"{result.name}, {result.detail.n_modes}", "name", line=swatch(k))]
            rows.append(cells + [Cell(share(float(max(error[norm]))), "n") for norm in ("K", "M", "nodal")])
    norms = TextTable(["largest \u03b5 over time", "energy (K)>", "mass (M)>", "nodes>"], rows)
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
    drawn = Figure("motion", deformation_chart(comparison), caption)
    return Section("motion-section", "Deformation error in a motion", (drawn, norms), lead, "Motion")


def mass_section(comparison: Comparison) -> Section:
    """Return the section with the effective mass by direction."""
    if not any(result.detail for result in comparison.sets):
        return Section("mass", "Effective mass", (nothing_to_show(),))
    full = comparison.full
    held = 100 * float(full.held_mass[0]) / float(full.mass[0]) if full.mass[0] > 0 else 0.0
    caption = (
        f"100 % is what all fixed-interface modes of the full model carry ({held:.0f} % of the mass along x; the rest "
        "sits at the interfaces and moves with them). A low bar says that accelerations in this direction deform the "
        "body in ways the set leaves out; it decides nothing by itself."
    )
    drawn = Figure("effective-mass", effective_mass_chart(comparison), caption)
    return Section("mass", "Effective mass with the interfaces held", (drawn,), "", "Effective mass")
