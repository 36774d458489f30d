"""Sections of a comparison with the evidence for its verdicts: convergence, frequencies, shapes, response, motion."""

import math

from cms.assessment.compare.comparison import Comparison
from cms.assessment.compare.verdicts import DECIDING, crossings, modes_words
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
from cms.assessment.report.html import Cell, Section, figure, table, text
from cms.assessment.report.parts import COLUMNS, legend, nothing_to_show, sentence_case, swatch
from cms.assessment.report.words import hertz, share, signed_percent

__all__ = [
    "convergence_section",
    "frequency_section",
    "mac_section",
    "mass_section",
    "motion_section",
    "response_section",
]

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
    "interfaces are held.",
}


def convergence_section(comparison: Comparison) -> Section:
    """Return the section with error against number of modes, one chart per record."""
    charts: dict[str, Chart] = {}
    figures = []
    for name in (*DECIDING, "residual-bound", "effective-mass"):
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
        "afterwards "
        "the free vibration."
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
