"""An estimate as one HTML page that works offline, and as a record for JSON."""

from typing import Any

from cms.report.charts import base_layout, line
from cms.report.html import Cell, Section, figure, page, table, text
from floatframe.identification.base_parameters import base_parameters
from floatframe.identification.estimation import Estimate, Measured
from floatframe.identification.physical import RealParameters

__all__ = ["identification_html", "identification_record"]

SURE, DOUBTFUL = 0.05, 0.3  #: relative deviations up to which a parameter is well known, and from which it is not known
MEASURED, MODELLED, RESIDUAL = "#1b1f24", "#0072B2", "#CC79A7"


def identification_record(
    made: Estimate, real: RealParameters | None, check: Measured | None, notes: tuple[str, ...]
) -> dict[str, Any]:
    """Return an estimate as plain numbers and words."""
    form = made.base.form
    if made.base.source == "torques":
        others = {
            source: len(base_parameters(form, source=source, by="samples").kept) for source in ("reactions", "both")
        }
    else:
        others = {}
    return {
        "system": form.system.name,
        "source": made.base.source,
        "n_parameters": len(form.names),
        "n_base": len(made.values),
        "n_instants": len(made.residuals),
        "condition": made.condition,
        "parameters": [
            {"name": name, "value": value, "deviation": deviation, "relative": relative, "a_priori": prior}
            for name, value, deviation, relative, prior in zip(
                made.base.names,
                made.values.tolist(),
                made.deviations.tolist(),
                made.relative_deviations.tolist(),
                made.base.values(form.values).tolist(),
                strict=True,
            )
        ],
        "channels": [
            {"name": name, "noise": sigma, "whiteness": r, "misfit": fit}
            for name, sigma, r, fit in zip(
                made.channels,
                made.sigma.tolist(),
                made.whiteness.tolist(),
                made.misfit(made.measured).tolist(),
                strict=True,
            )
        ],
        "validation": None if check is None else dict(zip(made.channels, made.misfit(check).tolist(), strict=True)),
        "without_effect": list(made.base.without_effect),
        "told_by_other_sources": others,
        "real_bodies": None
        if real is None
        else {
            "excess": real.excess,
            "bodies": {body.name: real.phi[10 * i : 10 * i + 10].tolist() for i, body in enumerate(form.system.bodies)},
            "least": real.least.tolist(),
        },
        "warnings": list(made.warnings),
        "notes": list(notes),
    }


def identification_html(made: Estimate, record: dict[str, Any], check: Measured | None) -> str:
    """Return the page of an estimate whose record was made."""
    sections = [parameter_section(record), fit_section(made, record), unseen_section(record)]
    if record["real_bodies"] is not None:
        sections.append(real_section(record))
    if check is not None:
        sections.insert(2, validation_section(made, record, check))
    return page(
        f"{record['system']}: identification",
        f"{text(record['system'])}<small>identification</small>",
        header(record),
        sections,
        {},
        text("Written by floatframe identify."),
    )


def header(record: dict[str, Any]) -> str:
    """Return the title, the facts, and the answer."""
    known = sum(each["relative"] <= SURE for each in record["parameters"])
    unknown = sum(each["relative"] >= DOUBTFUL for each in record["parameters"])
    facts = (
        f"{record['n_base']} combinations of {record['n_parameters']} parameters, from {record['source']} at "
        f"{record['n_instants']} instants; condition number {record['condition']:.3g}; {'; '.join(record['notes'])}"
    )
    answer = (
        f"{known} of {record['n_base']} combinations are known within {SURE:.0%}, {unknown} not within {DOUBTFUL:.0%}."
    )
    warned = "".join(f"<p>{text(words)}</p>" for words in record["warnings"])
    return (
        f'<h1>What is {text(record["system"])} made of?</h1><p class="facts">{text(facts)}</p>'
        f'<section class="answer{" none" if record["warnings"] else ""}"><p>{text(answer)}</p>{warned}</section>'
    )


def parameter_section(record: dict[str, Any]) -> Section:
    """The combinations with their deviations, the surest first in each body."""
    rows = [
        (
            Cell(text(each["name"])),
            Cell(f"{each['value']:.5g}"),
            Cell(f"{each['deviation']:.2g}"),
            Cell(f"{each['relative']:.1%}" if each["relative"] < 10 else "&gt; 1000 %"),
            Cell(f"{each['a_priori']:.5g}"),
        )
        for each in record["parameters"]
    ]
    heads = ("combination", "value", "deviation", "relative", "in the system file")
    return Section(
        "parameters", "What the motion tells", "Parameters", table(heads, rows),
        "Values in the units of the system. A combination is all that can be told, its parts are not.",
    )  # fmt: skip


def fit_section(made: Estimate, record: dict[str, Any]) -> Section:
    """Measured, modelled, residual; noise of the channels."""
    rows = [
        (
            Cell(text(each["name"])),
            Cell(f"{each['noise']:.3g}"),
            Cell(f"{each['misfit']:.2%}"),
            Cell(f"{each['whiteness']:.2f}"),
        )
        for each in record["channels"]
    ]
    drawn = figure(
        "fit", "Measured (black), modelled (blue), and what is left (pink), of each channel.", height=160 * len(rows)
    )
    heads = ("channel", "noise", "misfit", "neighbours correlate")
    return Section(
        "fit", "How well it fits", "Fit", drawn + table(heads, rows),
        "Noise is the deviation of the residual. Where neighbours correlate it is no noise: something is missing.",
        {"fit": fit_chart(made)},
    )  # fmt: skip


def validation_section(made: Estimate, record: dict[str, Any], check: Measured) -> Section:
    """A motion that the estimate has not seen."""
    rows = [(Cell(text(name)), Cell(f"{misfit:.2%}")) for name, misfit in record["validation"].items()]
    drawn = figure("check", "Measured (black), predicted (blue), and what is left (pink).", height=160 * len(rows))
    return Section(
        "validation", "Another motion", "Validation", drawn + table(("channel", "misfit"), rows),
        "A motion that was not used for the estimate.", {"check": prediction_chart(made, check)},
    )  # fmt: skip


def unseen_section(record: dict[str, Any]) -> Section:
    """What no motion tells, and what would."""
    words = ", ".join(record["without_effect"]) or "none"
    others = record["told_by_other_sources"]
    more = "".join(
        f"<p>{text(f'Measuring {source} would tell {n} combinations instead of ' + str(record['n_base']))}.</p>"
        for source, n in others.items()
    )
    return Section(
        "unseen", "What no motion tells", "Unseen",
        f"<p>{text('Parameters without any effect on what was measured: ' + words)}.</p>{more}"
        "<p>Combinations that are badly known are told better by a motion made for them: "
        "<code>ff.exciting_motion</code> finds one within limits of position, rate, acceleration and torque.</p>", "",
    )  # fmt: skip


def real_section(record: dict[str, Any]) -> Section:
    """Real bodies that fit."""
    rows = [
        (
            Cell(text(name)),
            Cell(f"{phi[0]:.4g}"),
            *(Cell(f"{x / phi[0]:.4g}") for x in phi[1:4]),
            *(Cell(f"{phi[k]:.4g}") for k in (4, 7, 9)),
        )
        for name, phi in record["real_bodies"]["bodies"].items()
    ]
    heads = ("body", "mass", "c_x", "c_y", "c_z", "J_xx", "J_yy", "J_zz")
    return Section(
        "real", "Bodies that could be built", "Bodies", table(heads, rows),
        "Positive masses and inertias that fit the measurements (squared misfit "
        f"{record['real_bodies']['excess']:+.2%} over the best), "
        "near the system file where nothing was measured. J about the origin of the body.",
    )  # fmt: skip


def fit_chart(made: Estimate) -> dict[str, Any]:
    """Return the channels over time, below each other."""
    _, y = made.measured.rows(made.base.form)
    return stacked(made, made.measured, y, y - made.residuals)


def prediction_chart(made: Estimate, check: Measured) -> dict[str, Any]:
    """Return the channels of another motion."""
    _, y = check.rows(made.base.form)
    return stacked(made, check, y, made.predicted(check))


def stacked(made: Estimate, measured: Measured, y: Any, modelled: Any) -> dict[str, Any]:
    """Return a chart with a row for each channel."""
    traces, layout = [], base_layout("time [s]", "")
    t, n = measured.times, y.shape[1]
    for k, name in enumerate(made.channels):
        for values, label, color in (
            (y[:, k], "measured", MEASURED), (modelled[:, k], "modelled", MODELLED),
            (y[:, k] - modelled[:, k], "left", RESIDUAL),
        ):  # fmt: skip
            trace = line(t, values, label, color, width=1.3, hover="%{y:.4g}")
            trace |= {"yaxis": "y" if k == 0 else f"y{k + 1}", "showlegend": k == 0}
            traces.append(trace)
        axis = dict(base_layout("", "")["yaxis"])
        axis |= {"domain": [1 - (k + 0.9) / n, 1 - k / n], "title": {"text": name, "font": {"size": 10}}}
        layout["yaxis" if k == 0 else f"yaxis{k + 1}"] = axis
    layout["xaxis"] |= {"anchor": f"y{n}" if n > 1 else "y"}
    layout["height"] = 160 * n
    return {"data": traces, "layout": layout}
