"""Report of a correlation as a document."""

from typing import Any

import numpy as np

from cms.assessment.correlation.correlate import MOVING, Correlation
from cms.assessment.correlation.update import Update
from cms.assessment.quality.limits import LIMITS, Limit
from cms.assessment.quality.record import worst
from cms.assessment.report.formatting import hertz, signed_percent
from cms.assessment.report.parts import records_table
from cms.jobs.studies.correlation_file import CorrelationResult
from fe_models.foundation.documents.charts import Axis, Chart, Matrix
from fe_models.foundation.documents.document import (
    Answer,
    Cell,
    Document,
    Figure,
    Gallery,
    Paragraph,
    Section,
    TextTable,
)

__all__ = ["correlation_document"]

DETERMINED = Limit("share of a parameter that the test does not determine", 0.1, 0.5, "")
MOST_POINTS = 20


def correlation_document(result: CorrelationResult) -> Document:
    """Return the document."""
    last = result.last
    verdicts = Section("verdicts", "Verdicts", (records_table(last.records),))
    sections = [
        verdicts, pairs_section(result), mac_section(result), orthogonality_section(last), points_section(last),
    ]  # fmt: skip
    if result.update is not None:
        sections.insert(2, update_section(result.update))
    if result.damping:
        sections.append(damping_section(result))
    footer = "Written by cms correlate. The same numbers stand in the JSON file where one was asked for."
    name = last.model.name
    return Document(
        f"Test and model of {name}", facts(last), answer(result), sections, name, "test and model", footer=footer
    )


def facts(c: Correlation) -> str:
    """Return a description of the compared data."""
    away = c.points.distances[np.isfinite(c.points.distances)]
    placed = f", at most {away.max():.3g} from their nodes" if len(away) else ", placed by number"
    return (
        f"{c.measured.source}: {c.measured.n_modes} modes at {len(c.points.points)} points{placed}; the model has "
        f"{len(c.model.frequencies)} elastic modes, {'free' if c.model.is_free else 'held'}"
    )


def answer(result: CorrelationResult) -> Answer:
    """Return the main result in a sentence, with its numbers."""
    first = result.correlation
    last = result.last
    words = "No measured mode has a partner in the model."
    if last.pairs:
        macs = [pair.mac for pair in last.pairs]
        error = float(np.abs(last.errors).max())
        words = (
            f"{len(last.pairs)} of {last.measured.n_modes} measured modes have a partner; largest frequency error "
            f"{100 * error:.2g} %, least MAC {min(macs):.3f}."
        )
        if result.update is not None and first.pairs:
            words += f" Before the update the largest error was {100 * float(np.abs(first.errors).max()):.2g} %."
            if not result.update.is_converged:
                words += " The update did not converge."
    return Answer(words, worst(last.records))


def graded(value: float, limit: Limit, words: str) -> Cell:
    """Return a number in the colour of the verdict about it."""
    return Cell(words, f"n {limit.verdict(value)}")


def pairs_section(result: CorrelationResult) -> Section:
    """Return the section about pairs of modes."""
    c = result.last
    first = result.correlation
    before = {pair.measured: error for pair, error in zip(first.pairs, first.errors, strict=True)}
    by_mode = {pair.measured: (pair, error) for pair, error in zip(c.pairs, c.errors, strict=True)}
    rows = []
    for k in range(c.measured.n_modes):
        cells = [Cell(str(k + 1), "n"), Cell(hertz(c.measured.frequencies[k]), "n"),
                 Cell(f"{100 * c.measured.damping[k]:.3g}" if c.measured.damping.size else "\u2013", "n")]  # fmt: skip
        if k in by_mode:
            pair, error = by_mode[k]
            cells += [
                Cell(str(pair.computed + 1), "n", "by hand" if pair.by_hand else ""),
                Cell(hertz(c.model.frequencies[pair.computed]), "n"),
                graded(abs(error), LIMITS["test-frequency"], signed_percent(float(error))),
                graded(1 - pair.mac, LIMITS["test-mac"], f"{pair.mac:.3f}"),
            ]
        else:
            nearest = int(np.argmax(c.mac[k]))
            note = f"most similar: {nearest + 1}, {hertz(c.model.frequencies[nearest])} Hz, MAC {c.mac[k, nearest]:.2f}"
            cells += [Cell("none", "n fail", note), *[Cell("\u2013", "n blank")] * 3]
        if result.update is not None:
            cells.append(Cell(signed_percent(float(before[k])) if k in before else "\u2013", "n"))
        rows.append(cells)
    headings = ["measured>", "Hz>", "damping %>", "computed>", "Hz>", "error>", "MAC>"]
    headings += ["error before>"] if result.update is not None else []
    lead = "Pairs by the greatest sum of MAC; errors are those of the model, coloured by the limits of the verdicts."
    return Section("pairs", "Pairs of modes", (TextTable(headings, rows),), lead, "Pairs")


def heat(values: Any, across: str, down: str) -> Chart:
    """Return a matrix with entries from 0 to 1 as a heat map."""
    return Chart(Axis(across), (Axis(down),), (Matrix(np.asarray(values), down, across),), has_legend=False)


def mac_section(result: CorrelationResult) -> Section:
    """Return the section about the MAC before and after the update, and the MAC of the test with itself."""
    shown = {"mac": ("test and model", result.correlation.mac, "computed mode")}
    if result.update is not None:
        shown["mac-after"] = ("test and updated model", result.update.after.mac, "computed mode")
    shown["auto-mac"] = ("test with itself", result.correlation.auto_mac, "measured mode")
    figures = [
        Figure(key, heat(values, across, "measured mode"), title) for key, (title, values, across) in shown.items()
    ]
    lead = (
        "Dark is 1, the same shape. Dark off the diagonal of the test with itself: shapes that its points do not tell "
        "apart; add points before you trust a pair."
    )
    return Section("mac-section", "MAC", (Gallery(figures),), lead)


def orthogonality_section(c: Correlation) -> Section:
    """Return the section about orthogonality of the measured shapes in the mass of the model."""
    if c.orthogonality is None or c.cross_orthogonality is None:
        return Section("orthogonality", "Orthogonality", (Paragraph(f"Not known: {c.why_not}.", "notice"),))
    own = np.abs(c.orthogonality)
    off = own - np.diag(np.diag(own))
    k, j = np.unravel_index(int(np.argmax(off)), off.shape) if off.size > 1 else (0, 0)
    words = "measured, of the pairs"
    lead = (
        f"By the mass of the model at the measured rows. Largest coupling of two measured shapes {off[k, j]:.3f}, "
        f"modes {c.pairs[k].measured + 1} and {c.pairs[j].measured + 1}."
    )
    partners = heat(np.abs(c.cross_orthogonality), "computed, of the pairs", words)
    figures = [
        Figure("own", heat(own, words, words), "measured shapes with each other"),
        Figure("cross", partners, "measured shapes with their partners"),
    ]
    return Section("orthogonality", "Orthogonality", (Gallery(figures),), lead)


def points_section(c: Correlation) -> Section:
    """Return the section about the points with the poorest agreement."""
    rows = [[Cell(str(point), "n"), Cell(node, "n"), graded(1 - value, LIMITS["test-mac"], f"{value:.3f}")]
            for point, node, value in c.point_comac()[:MOST_POINTS]]  # fmt: skip
    if not rows:
        return Section("points", "Points", (Paragraph("No modes are paired.", "notice"),))
    lead = (
        "COMAC of each point over all pairs, the least of its directions, worst first: a sensor that is rotated, "
        "exchanged or wrongly scaled, or a place where the model is wrong. Directions are left out whose motion in "
        f"test and model is below {100 * MOVING:g} % of the largest."
    )
    return Section("points", "Points", (TextTable(["point>", "node>", "COMAC>"], rows),), lead)


def update_section(update: Update) -> Section:
    """Return the section about the parameters and their uncertainty."""
    rows = []
    for p, value, spread, told in zip(update.parameters, update.values, update.spread, update.determined, strict=True):
        low, high = p.start * (1 + p.least), p.start * (1 + p.most)
        at_end = np.isclose(value, [low, high], rtol=1e-9, atol=0.0).any()
        cells = [Cell(p.name, "name", f"{p.path}{'; at its bound' if at_end else ''}"), Cell(f"{p.start:.6g}", "n"),
                 Cell(f"{value:.6g}", "n"), Cell(signed_percent(float(value / p.start - 1)), "n"),
                 Cell(f"\u00b1 {100 * spread:.2g} %", "n"), Cell(f"\u00b1 {100 * p.spread:.2g} %", "n"),
                 graded(1 - float(told), DETERMINED, f"{100 * told:.0f} %")]  # fmt: skip
        rows.append(cells)
    headings = ["parameter", "start>", "updated>", "change>", "spread after>", "before>", "from the test>"]
    n = len(update.parameters)
    pairs = [f"{update.parameters[i].name} and {update.parameters[j].name} ({update.correlation[i, j]:+.2f})"
             for i in range(n) for j in range(i) if abs(update.correlation[i, j]) > 0.9]  # fmt: skip
    lead = (
        f"Least squares over the frequencies of the pairs, measured to {100 * update.frequency_spread:g} %; spreads "
        "are standard deviations, shares of the start. A parameter about which the test has no information keeps its "
        "value, which is then meaningless."
    )
    if pairs:
        lead += f" The test hardly tells apart: {'; '.join(pairs)}."
    return Section("update", "Updated parameters", (TextTable(headings, rows),), lead, "Update")


def damping_section(result: CorrelationResult) -> Section:
    """Return the section about fits of the measured damping."""
    rows = []
    for fit in result.damping:
        names = ("ratio",) if fit.kind == "ratio" else ("alpha [1/s]", "beta [s]")
        words = ", ".join(f"{n} {v:.4g} \u00b1 {s:.2g}" for n, v, s in zip(names, fit.values, fit.spread, strict=True))
        rows.append([Cell(fit.kind, "name"), Cell(words, note=fit.table().replace("\n", "; ")),
                     Cell(f"{100 * fit.misfit:.2g} %", "n")])  # fmt: skip
    lead = "Least squares over the measured ratios; the misfit is their root mean square distance, of critical damping."
    return Section("damping", "Damping", (TextTable(["law", "constants", "misfit>"], rows),), lead)
