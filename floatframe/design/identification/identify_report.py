"""An estimate as a report, and as a record for JSON."""

from dataclasses import replace
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.documents.charts import INK, Axis, Chart, LimitLine, Line, thinned
from fe_models.foundation.documents.document import Answer, Block, Cell, Document, Figure, Paragraph, Section, TextTable
from floatframe.design.identification.base_parameters import base_parameters
from floatframe.design.identification.estimation import Estimate, Measured
from floatframe.design.identification.excitation import ExcitingMotion
from floatframe.design.identification.next_motion import NextMotion
from floatframe.design.identification.physical import RealParameters
from floatframe.design.identification.regressors import LinearForm
from floatframe.engine.tree.topology import tree_of

__all__ = ["identification_document", "identification_record", "verdict_of"]

#: relative deviations up to which a parameter is well determined, and above which it is undetermined
SURE, DOUBTFUL = 0.05, 0.3
UNREAL = (
    "no real bodies, with positive masses and inertias, fit within the noise: check signs, units and positions of the "
    "joints in the system file, or effects that the model lacks"
)
OFF = 3.0  #: number of deviations above which a value differs significantly from the system file
NEARER = 0.7  #: ratio of deviations below which another motion is a significant improvement
MOST_NAMES = 8  #: largest number of combinations in a list
VERDICTS = {"well known": "pass", "roughly known": "", "not known": "fail", "zero within its deviation": "warn"}
COLORS = {
    "measured": INK, "modelled": "#0072B2", "predicted": "#0072B2", "residual": "#CC79A7", "position": "#0072B2",
}  # fmt: skip


def identification_record(
    made: Estimate, real: RealParameters | None, check: Measured | None, notes: tuple[str, ...],
    better: NextMotion | None = None,
) -> dict[str, Any]:  # fmt: skip
    """Return an estimate as plain numbers and texts."""
    form = made.base.form
    told = set(made.base.names)
    others = {}
    for source in ("reactions", "both") if made.base.source == "torques" else ():
        names = base_parameters(form, source=source, by="samples").names
        others[source] = {"n_base": len(names), "new": [name for name in names if name not in told]}
    prior = made.base.values(form.values)
    is_drive = made.base.kept >= form.n_inertial
    units = [unit_of(form, int(k)) for k in made.base.kept]
    after = [None] * len(prior) if better is None else better.deviations.tolist()
    return {
        "system": form.system.name,
        "source": made.base.source,
        "n_parameters": len(form.names),
        "n_base": len(made.values),
        "n_instants": len(made.residuals),
        "condition": made.condition,
        "parameters": [
            {
                "name": name,
                "value": value,
                "unit": unit,
                "deviation": deviation,
                "relative": relative,
                "verdict": verdict_of(value, deviation),
                "a_priori": None if drive else own,
                "off": None if drive else (value - own) / deviation,
                "deviation_of_next_motion": then,
            }
            for name, value, unit, deviation, relative, own, drive, then in zip(
                made.base.names,
                made.values.tolist(),
                units,
                made.deviations.tolist(),
                made.relative_deviations.tolist(),
                prior.tolist(),
                is_drive.tolist(),
                after,
                strict=True,
            )
        ],
        "next_motion": None
        if better is None
        else {
            "condition": better.condition,
            "period": better.motion.period,
            "coordinates": {
                name: row for name, row in zip(better.motion.names, better.motion.coefficients.tolist(), strict=True)
            },
        },
        "channels": [
            {"name": name, "unit": unit, "noise": sigma, "whiteness": r, "misfit": fit}
            for name, unit, sigma, r, fit in zip(
                channel_words(made),
                channel_units(made),
                made.sigma.tolist(),
                made.whiteness.tolist(),
                made.misfit(made.measured).tolist(),
                strict=True,
            )
        ],
        "validation": None
        if check is None
        else dict(zip(channel_words(made), made.misfit(check).tolist(), strict=True)),
        "without_effect": list(made.base.without_effect),
        "told_by_other_sources": others,
        "real_bodies": None
        if real is None
        else {
            "excess": real.excess,
            "bodies": {body.name: real.phi[10 * i : 10 * i + 10].tolist() for i, body in enumerate(form.system.bodies)},
            "least": real.least.tolist(),
        },
        "warnings": [*made.warnings, *([] if real is None or real.is_fit else [UNREAL])],
        "notes": list(notes),
    }


def unit_of(form: LinearForm, k: int) -> str:
    """Return the unit of a parameter, in the symbols of the system."""
    units = form.system.units
    mass, length, time, force = (getattr(units, f"{name}_symbol") for name in ("mass", "length", "time", "force"))
    if k < form.n_inertial:
        return (mass, *[f"{mass} {length}"] * 3, *[f"{mass} {length}²"] * 6)[k % 10]
    columns = tree_of(form.system).columns
    place, row = divmod(k - form.n_inertial, len(columns))
    is_length = columns[row].unit == "m"
    act = force if is_length else f"{force} {length}"
    return {
        "motor-inertia": mass if is_length else f"{mass} {length}²",
        "viscous": f"{force} {time}/{length}" if is_length else f"{act} {time}/rad",
        "coulomb": act,
        "offset": act,
    }[form.terms[place]]


def verdict_of(value: float, deviation: float) -> str:
    """Return a text that states how well a value is determined."""
    if deviation <= SURE * abs(value):
        return "well known"
    if deviation < DOUBTFUL * abs(value):
        return "roughly known"
    return "zero within its deviation" if abs(value) < 2 * deviation else "not known"


def channel_words(made: Estimate) -> list[str]:
    """Return the column names of the channels in files."""
    units = {column.name: column.unit for column in made.base.form.columns}
    return [
        name if name.startswith("base ") else f"{name} {'force' if units[name] == 'm' else 'torque'}"
        for name in made.channels
    ]


def channel_units(made: Estimate) -> list[str]:
    """Return the units of the channels."""
    units = made.base.form.system.units
    force, moment = units.force_symbol, f"{units.force_symbol} {units.length_symbol}"
    return [force if name.endswith("force") or name.startswith("base F") else moment for name in channel_words(made)]


def identification_document(made: Estimate, record: dict[str, Any], check: Measured | None) -> Document:
    """Return the report of an estimate from its record."""
    sections = [parameter_section(record), fit_section(made, record), residual_section(made)]
    if check is not None:
        sections.append(validation_section(made, record, check))
    sections.append(unseen_section(record))
    if record["next_motion"] is not None:
        sections.append(next_section(made, record))
    if record["real_bodies"] is not None:
        sections.append(real_section(made, record))
    facts, answer = head(record)
    title = f"{record['system']}: what the measurement tells"
    footer = "Written by floatframe identify."
    return Document(title, facts, answer, sections, record["system"], "identification", footer=footer)


def head(record: dict[str, Any]) -> tuple[str, Answer]:
    """Return the key figures and the conclusion."""
    n = {words: sum(each["verdict"] == words for each in record["parameters"]) for words in VERDICTS}
    facts = [
        f"{record['n_base']} combinations of {record['n_parameters']} parameters from {record['source']} at "
        f"{record['n_instants']} instants",
        f"condition number {record['condition']:.3g}",
        *record["notes"],
    ]
    answer = (
        f"{n['well known']} of {record['n_base']} combinations are known within {SURE:.0%}, "
        f"{n['roughly known']} within {DOUBTFUL:.0%}, {n['not known']} are not known; "
        f"{n['zero within its deviation']} cannot be distinguished from zero."
    )
    off = [each["name"] for each in record["parameters"] if each["off"] is not None and abs(each["off"]) > OFF]
    if off:
        answer += f" {len(off)} differ from the system file by more than {OFF:g} deviations."
    elif record["parameters"]:
        answer += f" None differs from the system file by more than {OFF:g} deviations."
    verdict = "fail" if record["warnings"] else "pass"
    return "; ".join(facts), Answer(answer, verdict, notes=record["warnings"])


def parameter_section(record: dict[str, Any]) -> Section:
    """Return the section with the combinations and their deviations."""
    rows = [
        (
            Cell(each["name"], "name"),
            Cell(number(each["value"], each["deviation"]), "n"),
            Cell(f"± {each['deviation']:.2g}", "n"),
            Cell(each["unit"]),
            Cell(each["verdict"], VERDICTS[each["verdict"]], note=share_words(each)),
            Cell("" if each["a_priori"] is None else number(each["a_priori"], each["deviation"]), "n"),
            Cell(
                "" if each["off"] is None else f"{each['off']:+.1f}",
                "n fail" if each["off"] is not None and abs(each["off"]) > OFF else "n",
            ),
        )
        for each in record["parameters"]
    ]
    heads = ("combination", "value>", "deviation>", "unit", "", "in the system file>", "off it, deviations>")
    return Section(
        "parameters", "What the motion tells", (TextTable(heads, rows),),
        "The motion determines each combination as a whole, not its parts. Deviations are standard deviations; errors "
                "rarely exceed three of them. The system file contains no drives.", "Parameters",
    )  # fmt: skip


def share_words(each: dict[str, Any]) -> str:
    """Return the relative deviation as text, if it is meaningful."""
    return "" if each["verdict"] == "zero within its deviation" else f"{each['relative']:.1%}"


def number(value: float, deviation: float) -> str:
    """Return a value with the digits that are significant for its deviation, two of them uncertain."""
    if not deviation > 0:
        return f"{value:.5g}"
    places = 1 - int(np.floor(np.log10(deviation)))
    return f"{value:.{places}f}" if 0 <= places <= 12 else f"{value:.5g}"


def fit_section(made: Estimate, record: dict[str, Any]) -> Section:
    """Return the section with measured and modelled channels, and the noise of the channels."""
    rows = [
        (
            Cell(each["name"], "name"),
            Cell(f"{each['noise']:.3g}", "n"),
            Cell(each["unit"]),
            Cell(f"{each['misfit']:.2%}", "n"),
            Cell(f"{each['whiteness']:+.2f}", "n"),
        )
        for each in record["channels"]
    ]
    drawn = Figure("fit-chart", fit_chart(made), "Measured and modelled (blue).")
    heads = ("channel", "noise>", "unit", "misfit>", "neighbours correlate>")
    return Section(
        "fit", "How well it fits", (drawn, TextTable(heads, rows)),
        "Noise is the standard deviation of the residual; misfit is its rms relative to the measurement.", "Fit",
    )  # fmt: skip


def residual_section(made: Estimate) -> Section:
    """Return the section with the residuals, at their own scale."""
    words = "Measured minus modelled values; grey: two standard deviations, which contain 95 % of the noise."
    drawn = Figure("residuals-chart", residual_chart(made), words)
    return Section(
        "residuals", "What is left", (drawn,),
        "Noise has no pattern. Waves, steps at reversals of a joint and drifts are effects that the model lacks: "
                "elasticity, friction of another kind, a wrong zero.", "Residuals",
    )  # fmt: skip


def validation_section(made: Estimate, record: dict[str, Any], check: Measured) -> Section:
    """Return the section on another motion that was not used in the estimate."""
    rows = [(Cell(name, "name"), Cell(f"{misfit:.2%}", "n")) for name, misfit in record["validation"].items()]
    drawn = Figure("check", prediction_chart(made, check), "Measured and predicted (blue).")
    return Section(
        "validation", "Another motion", (drawn, TextTable(("channel", "misfit>"), rows)),
        "A motion that was not used for the estimate.", "Validation",
    )  # fmt: skip


def unseen_section(record: dict[str, Any]) -> Section:
    """Return the section on combinations that no motion determines, and on further measurements."""
    words = ", ".join(record["without_effect"]) or "none"
    rows = [
        (
            Cell({"reactions": "reactions at the base", "both": "torques and reactions"}[source], "name"),
            Cell(str(each["n_base"]), "n"),
            Cell("; ".join(each["new"][:MOST_NAMES]) + ("; ..." if len(each["new"]) > MOST_NAMES else "")),
        )
        for source, each in record["told_by_other_sources"].items()
    ]
    heads = ("measured instead", "combinations>", "among them, in other combinations than here")
    blocks: list[Block] = [Paragraph(f"Parameters without any effect on what was measured: {words}.")]
    if rows:
        blocks += [Paragraph("Other sensors determine other combinations:"), TextTable(heads, rows)]
    return Section("unseen", "What no motion tells", blocks, "", "Unseen")


def next_section(made: Estimate, record: dict[str, Any]) -> Section:
    """Return the section on a more informative motion and its expected accuracy."""
    each_helped = [
        each
        for each in record["parameters"]
        if each["deviation_of_next_motion"] < NEARER * each["deviation"] and each["verdict"] != "well known"
    ]
    rows = [
        (
            Cell(each["name"], "name"),
            Cell(f"± {each['deviation']:.2g}", "n"),
            Cell(f"± {each['deviation_of_next_motion']:.2g}", "n"),
            Cell(each["unit"]),
            Cell(verdict_of(each["value"], each["deviation_of_next_motion"])),
        )
        for each in each_helped
    ]
    heads = ("combination", "deviation now>", "with this motion>", "unit", "then")
    nothing = (
        "This motion would determine no doubtful combination much better: measure longer, with less noise, or "
        "with larger accelerations."
    )
    blocks: list[Block] = [TextTable(heads, rows) if rows else Paragraph(nothing)]
    worse = sum(each["deviation_of_next_motion"] > each["deviation"] / NEARER for each in record["parameters"])
    if worse:
        told = f"It determines {worse} of the combinations less well than this one did: measure both."
        blocks.append(Paragraph(told))
    n = record["next_motion"]
    chart = next_chart(n, [column.unit for column in made.base.form.columns])
    blocks.append(Figure("next-chart", chart, "Positions of the coordinates over one period."))
    return Section(
        "next", "Which motion would help", blocks,
        f"A Fourier series of {n['period']:.3g} {made.base.form.system.units.time_symbol} within the positions, rates "
        f"and accelerations of this measurement, chosen for its condition number ({n['condition']:.3g} against "
        f"{record['condition']:.3g}), with as many rows and the same noise. Write it with --motion FILE.csv.",
        "Next motion",
    )  # fmt: skip


def real_section(made: Estimate, record: dict[str, Any]) -> Section:
    """Return the section on physically consistent bodies that fit the measurements."""
    rows = []
    for name, phi in record["real_bodies"]["bodies"].items():
        size = max(abs(x / phi[0]) for x in phi[1:4]) or 1.0
        largest = max(abs(x) for x in phi[4:])
        rows.append(
            (
                Cell(name, "name"),
                Cell(f"{phi[0]:.4g}", "n"),
                *(Cell(plain_number(x / phi[0], size), "n") for x in phi[1:4]),
                *(Cell(plain_number(phi[k], largest), "n") for k in (4, 7, 9, 5, 6, 8)),
            )
        )
    form = made.base.form
    mass, first, second = (unit_of(form, k) for k in (0, 1, 4))
    length = first.removeprefix(f"{mass} ")
    heads = (
        "body", f"mass [{mass}]>", *(f"c_{a} [{length}]>" for a in "xyz"),
        *(f"J_{ab}>" for ab in ("xx", "yy", "zz", "xy", "xz", "yz")),
    )  # fmt: skip
    return Section(
        "real", "Bodies that could be built", (TextTable(heads, rows),),
        "Positive masses and inertias that fit the measurements (squared misfit "
                f"{record['real_bodies']['excess']:+.2%} over the best). Values that are not measured are close to the "
                        f"system file. J: elements of the tensor about the origin of the body [{second}].", "Bodies",
    )  # fmt: skip


def plain_number(value: float, size: float) -> str:
    """Return a number; rounding errors relative to a size become zero."""
    return "0" if abs(value) < 1e-9 * size else f"{value:.4g}"


def fit_chart(made: Estimate) -> Chart:
    """Return a chart of the channels over time, one panel below the other."""
    _, y = made.measured.rows(made.base.form)
    return stacked(made, made.measured.times, {"measured": y, "modelled": y - made.residuals})


def residual_chart(made: Estimate) -> Chart:
    """Return a chart of the residuals over time, with the band of the noise."""
    chart = stacked(made, made.measured.times, {"residual": made.residuals})
    bands = tuple(LimitLine(2 * sigma, low=-2 * sigma, panel=k) for k, sigma in enumerate(made.sigma.tolist()))
    return replace(chart, limits=bands)


def prediction_chart(made: Estimate, check: Measured) -> Chart:
    """Return a chart of the channels of another motion."""
    _, y = check.rows(made.base.form)
    return stacked(made, check.times, {"measured": y, "predicted": made.predicted(check)})


def next_chart(motion: dict[str, Any], units: list[str]) -> Chart:
    """Return a chart of the positions in a motion over its period."""
    rows = np.array(list(motion["coordinates"].values()))
    t = np.linspace(0, motion["period"], 201)
    made = ExcitingMotion(tuple(motion["coordinates"]), motion["period"], rows, motion["condition"])
    names = [f"{name}\n[{unit}]" for name, unit in zip(motion["coordinates"], units, strict=True)]
    return panels(t, {"position": made.at(t)[0]}, names, height=100)


def stacked(made: Estimate, t: Array, curves: dict[str, Array]) -> Chart:
    """Return a chart with a panel for each channel."""
    names = [f"{name}\n[{unit}]" for name, unit in zip(channel_words(made), channel_units(made), strict=True)]
    return panels(t, curves, names)


def panels(t: Array, curves: dict[str, Array], names: list[str], height: int = 160) -> Chart:
    """Return a chart with one panel for each name; curves: (n_t, n) arrays by their meaning."""
    lines = [
        thinned(Line(t, values[:, k], label, COLORS[label], width=1.3, panel=k))
        for k in range(len(names))
        for label, values in curves.items()
    ]
    axes = tuple(Axis(name) for name in names)
    return Chart(Axis("time [s]"), axes, tuple(lines), height * len(names) + 60, has_legend=len(curves) > 1)
