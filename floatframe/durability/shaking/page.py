"""A shake result as a document: first the main results, then each test with its curves."""

import math

import numpy as np

from fe_models.foundation.documents.document import (
    Answer,
    Block,
    Cell,
    Document,
    Figure,
    Gallery,
    Heading,
    Paragraph,
    Section,
    Terms,
    TextTable,
)
from floatframe.durability.shaking.loads.notching import NotchedRun
from floatframe.durability.shaking.loads.random_vibration import RandomRun
from floatframe.durability.shaking.loads.shock import TimeRun
from floatframe.durability.shaking.loads.sine import SineRun
from floatframe.durability.shaking.page_charts import (
    density_chart,
    history_chart,
    mass_chart,
    notch_chart,
    sine_chart,
    spectra_chart,
)
from floatframe.durability.shaking.record import (
    conversions,
    in_tables,
    level_scale,
    reported_rows,
    run_title,
    worst_nodes,
)
from floatframe.durability.shaking.shake import ShakeResult

__all__ = ["shake_document"]

KINDS = ("acceleration", "displacement", "force", "moment", "stress", "von Mises")  #: kinds of outputs with charts
MOST_MODES = 40  #: largest number of modes in the table of effective masses


def shake_document(result: ShakeResult) -> Document:
    """Return the report of a shake computation, which `fe_models.files.write_document` writes.

    Parameters
    ----------
    result
        What `shake` returned.
    """
    title = result.job.title or f"{result.model.name} on its base"
    sections = [summary_section(result), mass_section(result)]
    sections += [sine_section(result, run, k) for k, run in enumerate(result.sine)]
    sections += [random_section(result, run, k) for k, run in enumerate(result.random)]
    sections += [time_section(result, run, k) for k, run in enumerate(result.time)]
    sections.append(method_section(result))
    facts, answer = head(result)
    footer = "Written by floatframe shake. The JSON and CSV files beside this page contain the same numbers."
    return Document(title, facts, answer, sections, result.model.name, "base shaking", footer=footer)


def number(value: float | None, digits: int = 4) -> str:
    """Return a number for a table."""
    return "" if value is None or not math.isfinite(value) else f"{value:.{digits}g}"


def head(result: ShakeResult) -> tuple[str, Answer]:
    """Return the summary data, and the result in one sentence."""
    model, masses = result.model, result.masses
    held = "; ".join(f"{base.name} ({', '.join(base.holds) or 'ground'})" for base in model.bases)
    facts = (
        f"mass {model.mass[0, 0]:.5g} {model.units.mass_symbol}; base {held}; {len(model.omega)} modes from "
        f"{masses.frequencies[0]:.4g} to {masses.frequencies[-1]:.4g} Hz with the base held; damping "
        f"{result.job.damping.description}; "
        f"uncertainty {result.job.uncertainty.description}"
    )
    figures = [(f"{masses.frequencies[0]:.4g} Hz", "first mode on the base")]
    for name in ("x", "y", "z"):
        k = next(j for j, full in enumerate(masses.directions) if full.endswith(f":{name}"))
        main = int(np.argmax(masses.share[:, k]))
        figures.append(
            (
                f"{masses.frequencies[main]:.4g} Hz",
                f"main mode along {name}, {100 * masses.share[main, k]:.0f} % of the mass",
            )
        )
    depth = max((notch.depth for run in result.notched.values() for notch in run.notches), default=None)
    if depth is not None:
        figures.append((f"{depth:.1f} dB", "deepest notch"))
    return facts, Answer(sentence(result), figures=figures)


def sentence(result: ShakeResult) -> str:
    """Return a sentence about the tests and their notches."""
    counts = []
    for name, runs in (("sine", result.sine), ("random", result.random), ("shock or transient", result.time)):
        if runs:
            counts.append(f"{len(runs)} {name} run{'s' if len(runs) > 1 else ''}")
    said = f"{', '.join(counts)} of {result.model.name}."
    reasons = {notch.reason for run in result.notched.values() for notch in run.notches}
    if reasons:
        said += f" Inputs are notched for: {', '.join(sorted(reasons))}."
    elif result.notched:
        said += " No limit is reached, so that no input is notched."
    if result.notes:
        said += f" {len(result.notes)} note{'s' if len(result.notes) > 1 else ''} below."
    return said


def summary_section(result: ShakeResult) -> Section:
    """Return the section with the largest output of each kind in every run, and the notes."""
    rows = []
    for run, peaks, uncertain, what in every_run(result):
        best: dict[str, int] = {}
        for k in reported_rows(run.outputs, peaks):
            kind = run.outputs[k].kind
            if kind not in best or peaks[k] > peaks[best[kind]]:
                best[kind] = k
        for n, (kind, k) in enumerate(best.items()):
            if kind not in KINDS or (kind == "stress" and "von Mises" in best):
                continue
            factor, unit = in_tables(result.model, run.outputs[k])
            rows.append(
                [
                    Cell(f"{run_title(kind_of(run), run.test)}, {run.direction}" if n == 0 else "", "name"),
                    Cell(run.outputs[k].name, note=run.outputs[k].place),
                    Cell(number(factor * peaks[k]), "n"),
                    Cell(number(factor * uncertain[k]), "n"),
                    Cell(unit.replace(" ", "\u00a0")),
                    Cell(what),
                ]
            )
    notes = [Paragraph(note, "notice") for note in result.notes]
    return Section(
        "summary",
        "What is largest",
        (TextTable(["run", "output", "value>", "with uncertainty>", "unit", "what it is"], rows), *notes),
        "The largest output of each kind in every run, before notching.",
        "Summary",
    )


def kind_of(run: SineRun | RandomRun | TimeRun) -> str:
    """Return the kind of the test of a run."""
    return run.kind if isinstance(run, TimeRun) else "sine" if isinstance(run, SineRun) else "random"


def every_run(result: ShakeResult):
    """Yield each run with its values, its values with uncertainty, and their description."""
    for sine in result.sine:
        yield sine, sine.peaks, sine.uncertain.max(axis=0), "amplitude"
    for random in result.random:
        yield random, random.rms, random.uncertain, "rms"
    for run in result.time:
        yield run, run.peaks, run.uncertain, "largest"


def mass_section(result: ShakeResult) -> Section:
    """Return the section with the effective masses and their cumulative sums."""
    masses = result.masses
    names = [name.partition(":")[2] if len(result.model.bases) == 1 else name for name in masses.directions]
    rows = []
    for k in range(min(len(masses.frequencies), MOST_MODES)):
        cells = [
            Cell(str(k + 1), "n"),
            Cell(f"{masses.frequencies[k]:.5g}", "n"),
            Cell(f"{100 * masses.damping[k]:.3g} %", "n"),
        ]
        for share, total in zip(masses.share[k], masses.cumulative[k], strict=True):
            cells.append(
                Cell(
                    f"{100 * share:.2f}" if share > 5e-5 else "\u2013",
                    "n" + (" pass" if share > 0.1 else ""),
                    note=f"\u03a3 {100 * total:.1f}",
                )
            )
        rows.append(cells)
    totals = [Cell(""), Cell("total", "name"), Cell("")] + [Cell(number(float(v)), "n") for v in masses.total]
    rows.append(totals)
    more = len(masses.frequencies) - MOST_MODES
    after = [Paragraph(f"{more} more modes are in the JSON file.")] if more > 0 else []
    chart = Figure(
        "masses",
        mass_chart(masses),
        "Effective mass of all modes up to a frequency, relative to the mass of the rigid structure. The rest moves "
        "rigidly with the base or vibrates above the last mode.",
        "Cumulative effective mass",
    )
    unit = f"{result.model.units.mass_symbol}, {result.model.units.mass_symbol} {result.model.units.length_symbol}²"
    return Section(
        "masses-section",
        "Modes with the base held",
        (chart, TextTable(["mode>", "Hz>", "damping>", *(f"{name} [%]>" for name in names)], rows), *after),
        "Effective mass and inertia of each mode as a share of the total, and the cumulative sum; totals in "
        f"{unit}, about the point of the base.",
        "Effective masses",
    )


def kind_charts(result: ShakeResult, run, peaks, key: str, chart) -> Gallery:
    """Return one figure for each kind of output that a run has."""
    figures = []
    for kind in KINDS:
        if not any(run.outputs[k].kind == kind for k in reported_rows(run.outputs, peaks)):
            continue
        if kind == "stress" and any(o.kind == "von Mises" for o in run.outputs):
            continue
        name, words = f"{key}-{kind.replace(' ', '-')}", "The largest outputs of this kind; all are in the table."
        figures.append(Figure(name, chart(result.model, run, kind), words, kind[:1].upper() + kind[1:]))
    return Gallery(figures)


def sine_section(result: ShakeResult, run: SineRun, number_: int) -> Section:
    """Return the section of a sine run."""
    key = f"sine-{number_}"
    drawn = kind_charts(result, run, run.peaks, key, sine_chart)
    notched = result.notched.get(("sine", run.test, run.direction))
    static, swept = run.static.max(axis=0), run.swept_peaks
    headings = ["output", "amplitude>", "at Hz>", "amplification>", "quasi-static>", "with uncertainty>"]
    headings += ["swept>"] * (swept is not None) + ["notched>"] * (notched is not None) + ["unit"]
    rows = []
    for k in reported_rows(run.outputs, run.peaks):
        s, unit = in_tables(result.model, run.outputs[k])
        at = int(run.sizes[:, k].argmax())
        still = run.static[at, k]
        cells = [
            Cell(run.outputs[k].name, note=run.outputs[k].place),
            Cell(number(s * run.peaks[k]), "n"),
            Cell(number(run.peak_frequencies[k], 5), "n"),
            Cell(number(run.peaks[k] / still, 3) if still > 1e-6 * run.peaks[k] else "", "n"),
            Cell(number(s * static[k]), "n"),
            Cell(number(s * run.uncertain[:, k].max()), "n"),
        ]
        if swept is not None:
            cells.append(Cell(number(s * swept[k]), "n", note=f"{100 * swept[k] / run.peaks[k]:.1f} %"))
        if notched is not None:
            cells.append(Cell(number(s * notched.sizes[:, k].max()), "n"))
        rows.append([*cells, Cell(unit.replace(" ", "\u00a0"))])
    words = f"Sine {run.frequencies[0]:g} to {run.frequencies[-1]:g} Hz"
    words += (
        ""
        if run.rate is None
        else f", swept at {run.rate:g} octaves per minute (dotted, column \u201cswept\u201d: with the transient of "
        "the sweep)"
    )
    return Section(
        key,
        f"{run_title('Sine', run.test)}, {run.direction}",
        (*notch_part(result, "sine", notched, key), drawn, TextTable(headings, rows)),
        f"{words}. Amplitudes, 0 to peak.",
        f"{run_title('Sine', run.test)} {run.direction.partition(':')[2]}",
    )


def notch_part(result: ShakeResult, kind: str, notched: NotchedRun | None, key: str) -> list[Block]:
    """Return the notches of a run: a chart, and a table with the cause of each."""
    if notched is None:
        return []
    if not notched.notches:
        return [Paragraph("No limit is reached: the input is not notched.")]
    drawn = notch_chart(result.model, kind, notched)
    rows = [
        [
            Cell(f"{n.first:.5g} to {n.last:.5g}", "name"),
            Cell(f"{n.deepest:.5g}", "n"),
            Cell(f"{n.depth:.2f}", "n warn"),
            Cell(n.reason, note=n.output),
            Cell(number(n.limit), "n"),
            Cell(number(n.unnotched), "n"),
        ]
        for n in notched.notches
    ]
    squared = ", squared per Hz" if kind == "random" else ""
    blocks: list[Block] = [
        Figure(f"{key}-notch", drawn, "Input as specified and as notched.", "Notched input"),
        TextTable(["Hz", "deepest at>", "depth [dB]>", "reason", "limit>", "without the notch>"], rows),
        Paragraph(f"limit and value in units of the model{squared}", "why"),
    ]
    if notched.input_rms is not None:
        blocks.append(Paragraph(f"The notched input has {notched.input_rms / result.model.gravity:.4g} g rms."))
    return blocks


def random_section(result: ShakeResult, run: RandomRun, number_: int) -> Section:
    """Return the section of a random run."""
    key = f"random-{number_}"
    drawn = kind_charts(result, run, run.rms, key, density_chart)
    notched = result.notched.get(("random", run.test, run.direction))
    headings = ["output", "rms>", "3 sigma>", "crossings [1/s]>"] + ["largest expected>"] * (run.expected is not None)
    headings += ["rms with uncertainty>"] + ["rms notched>"] * (notched is not None) + ["unit"]
    rows = []
    for k in reported_rows(run.outputs, run.rms):
        s, unit = in_tables(result.model, run.outputs[k])
        is_von_mises = run.outputs[k].kind == "von Mises"
        place = run.von_mises.get(run.outputs[k].group) if is_von_mises else None
        note = run.outputs[k].place + (
            f"; not exceeded 99.73 % of the time: {place.quantile:.4g} = {place.factor:.3g} rms" if place else ""
        )
        cells = [
            Cell(run.outputs[k].name, note=note),
            Cell(number(s * run.rms[k]), "n"),
            Cell(number(3 * s * run.rms[k]), "n"),
            Cell("" if is_von_mises else number(run.crossings[k]), "n"),
        ]
        if run.expected is not None:
            cells.append(Cell("" if is_von_mises else number(s * run.expected[k]), "n"))
        cells.append(Cell(number(s * run.uncertain[k]), "n"))
        if notched is not None and notched.rms is not None:
            cells.append(Cell(number(s * notched.rms[k]), "n"))
        rows.append([*cells, Cell(unit.replace(" ", "\u00a0"))])
    given = ", ".join(
        f"{name} {value * level_scale(result.model, name):.4g}{' g' if ':r' not in name else ''} rms"
        for name, value in zip(run.inputs, run.input_rms, strict=True)
    )
    parts = [
        *notch_part(result, "random", notched, key),
        drawn,
        TextTable(headings, rows),
        *miles_part(result, run),
        *worst_part(result, run),
    ]
    return Section(
        key,
        f"{run_title('Random', run.test)}, {run.direction}",
        parts,
        f"Input {given}. Integrals over {len(run.band.frequencies)} frequencies; two nested rules differ by "
        f"{run.error.max():.1e} of an rms at most.",
        f"{run_title('Random', run.test)} {run.direction.partition(':')[2]}",
    )


def miles_part(result: ShakeResult, run: RandomRun) -> list[Block]:
    """Return a table of Miles' estimates for the main modes and the computed mean acceleration."""
    main = sorted([m for m in run.miles if m.share > 0.01], key=lambda m: -m.share)[:5]
    if not main:
        return []
    direction = run.direction.partition(":")[2]
    k = [o.name for o in run.outputs].index(f"mean acceleration {direction}")
    rms = run.rms[k] / result.model.gravity
    rows = [
        [
            Cell(str(m.mode), "n"),
            Cell(f"{m.frequency:.5g}", "n"),
            Cell(f"{100 * m.share:.1f}", "n"),
            Cell(number(m.Q), "n"),
            Cell(number(m.density), "n"),
            Cell(number(m.grms), "n"),
            Cell(f"{m.grms / rms:.3f}", "n"),
        ]
        for m in main
    ]
    headings = ["mode>", "Hz>", "share of mass [%]>", "Q>", "input [g²/Hz]>", "Miles [g rms]>"]
    words = (
        f"Computed mean acceleration (net base force divided by mass): {rms:.4g} g rms. Miles' estimate assumes one "
        "mode with the whole mass and the same density at all frequencies."
    )
    return [
        Heading("Miles' equation"),
        TextTable([*headings, "relative to the computed mean acceleration>"], rows),
        Paragraph(words, "why"),
    ]


def worst_part(result: ShakeResult, run: RandomRun) -> list[Block]:
    """Return the nodes with the largest von Mises stress."""
    worst = worst_nodes(result.model, run)
    if not worst:
        return []
    unit = result.model.units.stress_symbol
    rows = [[Cell(name, "name"), Cell(number(value), "n"), Cell(number(3 * value), "n")] for name, value in worst[:10]]
    return [
        Heading(f"Largest von Mises stress of all {len(result.model.field_labels)} kept nodes"),
        TextTable(["node", f"rms [{unit}]>", f"3 rms [{unit}]>"], rows),
    ]


def time_section(result: ShakeResult, run: TimeRun, number_: int) -> Section:
    """Return the section of a shock or transient."""
    key = f"time-{number_}"
    drawn = kind_charts(result, run, run.peaks, key, history_chart)
    blocks: list[Block] = [drawn]
    if run.spectra:
        words = "Largest response of single masses to the accelerations, during and after them."
        blocks.append(Figure(f"{key}-spectra", spectra_chart(result.model, run), words, "Shock response spectra"))
    rows = []
    for k in reported_rows(run.outputs, run.peaks):
        s, unit = in_tables(result.model, run.outputs[k])
        rows.append(
            [
                Cell(run.outputs[k].name, note=run.outputs[k].place),
                Cell(number(s * run.peaks[k]), "n"),
                Cell(number(1e3 * run.peak_times[k]), "n"),
                Cell(number(s * run.uncertain[k]), "n"),
                Cell(unit.replace(" ", "\u00a0")),
            ]
        )
    length, second = result.model.units.length_symbol, result.model.units.time_symbol
    left = "; ".join(
        f"{name}: at the end the base has {v:.4g} {length}/{second} and {d:.4g} {length}"
        for name, v, d in zip(run.inputs, run.velocity_left, run.displacement_left, strict=True)
        if math.isfinite(v)
    )
    made = ""
    if run.synthesis is not None:
        off = run.synthesis.decibels
        made = f" The spectrum reached deviates from its target by {off.min():+.2f} to {off.max():+.2f} dB."
    return Section(
        key,
        f"{run_title(run.kind.capitalize(), run.test)}, {run.direction}",
        (*blocks, TextTable(["output", "largest>", "at ms>", "with uncertainty>", "unit"], rows)),
        f"{run.words[:1].upper()}{run.words[1:]}. {left}.{made}",
        f"{run_title(run.kind.capitalize(), run.test)} {run.direction.partition(':')[2]}",
    )


def method_section(result: ShakeResult) -> Section:
    """Return the section with conventions, conversions and definitions."""
    terms = [
        ("units", "; ".join(conversions(result.model))),
        ("base", "follows its acceleration exactly: its interfaces are eliminated, and no mass is added"),
        ("forces", "of the base on the structure, moments about the point of the base"),
        ("mean acceleration", "net force of the base / mass: quasi-static load factor of the centre of mass"),
        ("displacement", "relative to the base"),
        (
            "von Mises",
            "sine: the largest value over a cycle; random: rms = sqrt tr(A Sigma), exact for Gaussian stress. The "
            "von Mises stress is not Gaussian and never negative, so that 3 rms is not its 99.73 % value; the table "
            "also has this value (between 1.9 and 3 rms)",
        ),
        (
            "uncertainty",
            result.job.uncertainty.description
            + ": largest transfer function within the share of the frequency, times the factor",
        ),
        (
            "notches",
            "the smaller of the level and the allowed input at each frequency; the reason is the limit that allows the "
            "smallest input",
        ),
    ]
    lead = "Formulas and conventions are in docs/shake.md."
    return Section("method", "Definitions", (Terms(terms),), lead, "Method")
