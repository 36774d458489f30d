"""Charts of a shake result as plotly figures in plain types."""

from collections.abc import Sequence

import numpy as np

from cms.assessment.report.charts import Chart, base_layout, line
from cms.assessment.report.palette import style_of
from fe_models.foundation.arrays import Array
from floatframe.durability.shaking.loads.notching import NotchedRun
from floatframe.durability.shaking.loads.random_vibration import RandomRun
from floatframe.durability.shaking.loads.shock import TimeRun
from floatframe.durability.shaking.loads.sine import SineRun
from floatframe.durability.shaking.record import in_tables, level_scale, reported_rows
from floatframe.durability.shaking.shake import EffectiveMasses
from floatframe.durability.shaking.structure.model import Output, ShakenModel

__all__ = ["density_chart", "history_chart", "mass_chart", "notch_chart", "sine_chart", "spectra_chart"]

MOST_LINES = 8  #: largest number of lines in a chart; the largest outputs are drawn
MOST_POINTS = 1500  #: largest number of points of a line
BLACK = "#1b1f24"


def thinned(x: Array, y: Array) -> tuple[Array, Array]:
    """Return a line with fewer points that keeps its largest and smallest values."""
    if len(x) <= MOST_POINTS:
        return x, y
    parts = np.array_split(np.arange(len(x)), MOST_POINTS // 2)
    keep = np.unique(np.concatenate([[part[y[part].argmin()], part[y[part].argmax()]] for part in parts]))
    return x[keep], y[keep]


def log_log(x: str, y: str) -> Chart:
    """Return the layout of a chart over frequency."""
    layout = base_layout(x, y)
    layout["xaxis"] |= {"type": "log", "exponentformat": "none"}
    layout["yaxis"] |= {"type": "log", "exponentformat": "power"}
    layout["height"] = 400
    return layout


def largest(outputs: Sequence[Output], sizes: Array, kind: str) -> list[int]:
    """Return the outputs of a kind with the largest values, at most MOST_LINES, in their original order."""
    keep = [k for k in reported_rows(tuple(outputs), sizes) if outputs[k].kind == kind]
    return sorted(sorted(keep, key=lambda k: -sizes[k])[:MOST_LINES])


def sine_chart(model: ShakenModel, run: SineRun, kind: str) -> Chart:
    """Amplitudes of one kind of output over frequency; dotted during the sweep."""
    traces = []
    unit = ""
    if kind == "acceleration":
        traces.append(
            line(
                run.frequencies,
                run.level * level_scale(model, run.direction),
                "input",
                BLACK,
                width=3,
                opacity=0.5,
                hover="%{y:.4g}",
            )
        )
    for n, k in enumerate(largest(run.outputs, run.peaks, kind)):
        factor, unit = in_tables(model, run.outputs[k])
        color = style_of(n).color
        x, y = thinned(run.frequencies, factor * run.sizes[:, k])
        traces.append(line(x, y, run.outputs[k].name, color, hover="%{y:.4g}"))
        if run.swept is not None:
            order = np.argsort(run.swept_frequencies)
            x, y = thinned(run.swept_frequencies[order], factor * run.swept[order, k])
            traces.append(line(x, y, f"{run.outputs[k].name}, swept", color, dash="dot", width=1.2, hover="%{y:.4g}"))
    return {"data": traces, "layout": log_log("frequency [Hz]", f"amplitude [{unit}]")}


def density_chart(model: ShakenModel, run: RandomRun, kind: str) -> Chart:
    """Power spectral densities of one kind of output."""
    traces, unit = [], ""
    if kind == "acceleration":
        for k, name in enumerate(run.inputs):
            y = run.level[:, k] * level_scale(model, name) ** 2
            traces.append(line(run.band.frequencies, y, f"input {name}", BLACK, width=3, opacity=0.5, hover="%{y:.4g}"))
    for n, k in enumerate(largest(run.outputs, run.rms, kind)):
        factor, unit = in_tables(model, run.outputs[k])
        x, y = thinned(run.band.frequencies, factor**2 * run.density[:, k])
        name = f"{run.outputs[k].name}, {factor * run.rms[k]:.3g} {unit} rms"
        traces.append(line(x, y, name, style_of(n).color, hover="%{y:.4g}"))
    return {
        "data": traces,
        "layout": log_log(
            "frequency [Hz]", f"density [({unit})²/Hz]" if " " in unit or "/" in unit else f"density [{unit}²/Hz]"
        ),
    }


def history_chart(model: ShakenModel, run: TimeRun, kind: str) -> Chart:
    """Time histories of one kind of output."""
    traces, unit = [], ""
    if kind == "acceleration":
        for k, name in enumerate(run.inputs):
            if run.displacement_left[k] == run.displacement_left[k]:
                x, y = thinned(1e3 * run.t, run.input_values[k] * level_scale(model, name))
                traces.append(line(x, y, f"input {name}", BLACK, width=2.5, opacity=0.5, hover="%{y:.4g}"))
    for n, k in enumerate(largest(run.outputs, run.peaks, kind)):
        factor, unit = in_tables(model, run.outputs[k])
        x, y = thinned(1e3 * run.t, factor * run.values[k])
        traces.append(line(x, y, run.outputs[k].name, style_of(n).color, width=1.3, hover="%{y:.4g}"))
    layout = base_layout("time [ms]", f"{kind} [{unit}]")
    layout["height"] = 380
    return {"data": traces, "layout": layout}


def spectra_chart(model: ShakenModel, run: TimeRun) -> Chart:
    """Shock response spectra of inputs and accelerations, and the target of a synthesis."""
    traces = []
    if run.synthesis is not None:
        traces.append(
            line(run.synthesis.frequencies, run.synthesis.target, "target", BLACK, dash="dash", hover="%{y:.4g}")
        )
    names = sorted(run.spectra, key=lambda name: -max(v.max() for v in run.spectra[name].values()))[:MOST_LINES]
    for n, name in enumerate(names):
        for m, (Q, values) in enumerate(run.spectra[name].items()):
            dash = ("solid", "dot", "dash")[m % 3]
            traces.append(
                line(
                    run.spectra_frequencies,
                    values / model.gravity,
                    f"{name}, Q {Q:g}",
                    style_of(n).color,
                    dash=dash,
                    hover="%{y:.4g}",
                )
            )
    unit = {"acceleration": "g", "displacement": "g s²", "pseudo-velocity": "g s"}[run.spectra_kind]
    return {"data": traces, "layout": log_log("natural frequency [Hz]", f"largest {run.spectra_kind} [{unit}]")}


def notch_chart(model: ShakenModel, kind: str, run: NotchedRun) -> Chart:
    """The input as specified and as notched."""
    power = 1 if kind == "sine" else 2
    x, y = thinned(run.frequencies, run.notched / model.gravity**power)
    traces = [
        line(run.frequencies, run.level / model.gravity**power, "as specified", BLACK, dash="dash", hover="%{y:.4g}"),
        line(x, y, "notched", style_of(1).color, hover="%{y:.4g}"),
    ]
    layout = log_log("frequency [Hz]", "input [g]" if kind == "sine" else "input [g²/Hz]")
    layout["height"] = 340
    return {"data": traces, "layout": layout}


def mass_chart(masses: EffectiveMasses) -> Chart:
    """Cumulative effective mass over frequency, the directions of the first base."""
    traces = []
    for k, name in enumerate(masses.directions[:6]):
        x = np.concatenate([[masses.frequencies[0] * 0.5], masses.frequencies, [masses.frequencies[-1] * 1.2]])
        y = 100 * np.concatenate([[0.0], masses.cumulative[:, k], masses.cumulative[-1:, k]])
        trace = line(x, y, name.partition(":")[2], style_of(k).color, dash=style_of(k).dash, hover="%{y:.2f} %")
        trace["line"]["shape"] = "hv"
        traces.append(trace)
    layout = base_layout("frequency [Hz]", "effective mass, cumulative [%]")
    layout["xaxis"] |= {"type": "log", "exponentformat": "none"}
    layout["yaxis"] |= {"range": [0, 105]}
    layout["height"] = 340
    return {"data": traces, "layout": layout}
