"""Charts of a shake result."""

from collections.abc import Sequence

import numpy as np

from cms.assessment.report.palette import style_of
from fe_models.foundation.arrays import Array
from fe_models.foundation.documents.charts import INK, Axis, Chart, Line, thinned
from floatframe.durability.shaking.loads.notching import NotchedRun
from floatframe.durability.shaking.loads.random_vibration import RandomRun
from floatframe.durability.shaking.loads.shock import TimeRun
from floatframe.durability.shaking.loads.sine import SineRun
from floatframe.durability.shaking.record import in_tables, level_scale, reported_rows
from floatframe.durability.shaking.shake import EffectiveMasses
from floatframe.durability.shaking.structure.model import Output, ShakenModel

__all__ = ["density_chart", "history_chart", "mass_chart", "notch_chart", "sine_chart", "spectra_chart"]

MOST_LINES = 8  #: largest number of lines in a chart; the largest outputs are drawn


def over_frequency(x: str, y: str, lines: Sequence[Line], height: int = 400) -> Chart:
    """Return a chart over frequency with two logarithmic axes."""
    return Chart(Axis(x, is_log=True), (Axis(y, is_log=True),), tuple(map(thinned, lines)), height)


def largest(outputs: Sequence[Output], sizes: Array, kind: str) -> list[int]:
    """Return the outputs of a kind with the largest values, at most MOST_LINES, in their original order."""
    keep = [k for k in reported_rows(tuple(outputs), sizes) if outputs[k].kind == kind]
    return sorted(sorted(keep, key=lambda k: -sizes[k])[:MOST_LINES])


def sine_chart(model: ShakenModel, run: SineRun, kind: str) -> Chart:
    """Amplitudes of one kind of output over frequency; dotted during the sweep."""
    lines = []
    unit = ""
    if kind == "acceleration":
        level = run.level * level_scale(model, run.direction)
        lines.append(Line(run.frequencies, level, "input", INK, width=3, opacity=0.5))
    for n, k in enumerate(largest(run.outputs, run.peaks, kind)):
        factor, unit = in_tables(model, run.outputs[k])
        color = style_of(n).color
        lines.append(Line(run.frequencies, factor * run.sizes[:, k], run.outputs[k].name, color))
        if run.swept is not None:
            order = np.argsort(run.swept_frequencies)
            x, y = run.swept_frequencies[order], factor * run.swept[order, k]
            lines.append(Line(x, y, f"{run.outputs[k].name}, swept", color, "dot", 1.2))
    return over_frequency("frequency [Hz]", f"amplitude [{unit}]", lines)


def density_chart(model: ShakenModel, run: RandomRun, kind: str) -> Chart:
    """Power spectral densities of one kind of output."""
    lines, unit = [], ""
    if kind == "acceleration":
        for k, name in enumerate(run.inputs):
            y = run.level[:, k] * level_scale(model, name) ** 2
            lines.append(Line(run.band.frequencies, y, f"input {name}", INK, width=3, opacity=0.5))
    for n, k in enumerate(largest(run.outputs, run.rms, kind)):
        factor, unit = in_tables(model, run.outputs[k])
        name = f"{run.outputs[k].name}, {factor * run.rms[k]:.3g} {unit} rms"
        lines.append(Line(run.band.frequencies, factor**2 * run.density[:, k], name, style_of(n).color))
    words = f"density [({unit})²/Hz]" if " " in unit or "/" in unit else f"density [{unit}²/Hz]"
    return over_frequency("frequency [Hz]", words, lines)


def history_chart(model: ShakenModel, run: TimeRun, kind: str) -> Chart:
    """Time histories of one kind of output."""
    lines, unit = [], ""
    if kind == "acceleration":
        for k, name in enumerate(run.inputs):
            if run.displacement_left[k] == run.displacement_left[k]:
                y = run.input_values[k] * level_scale(model, name)
                lines.append(Line(1e3 * run.t, y, f"input {name}", INK, width=2.5, opacity=0.5))
    for n, k in enumerate(largest(run.outputs, run.peaks, kind)):
        factor, unit = in_tables(model, run.outputs[k])
        lines.append(Line(1e3 * run.t, factor * run.values[k], run.outputs[k].name, style_of(n).color, width=1.3))
    return Chart(Axis("time [ms]"), (Axis(f"{kind} [{unit}]"),), tuple(map(thinned, lines)), 380)


def spectra_chart(model: ShakenModel, run: TimeRun) -> Chart:
    """Shock response spectra of inputs and accelerations, and the target of a synthesis."""
    lines = []
    if run.synthesis is not None:
        lines.append(Line(run.synthesis.frequencies, run.synthesis.target, "target", INK, "dash"))
    names = sorted(run.spectra, key=lambda name: -max(v.max() for v in run.spectra[name].values()))[:MOST_LINES]
    for n, name in enumerate(names):
        for m, (Q, values) in enumerate(run.spectra[name].items()):
            dash, color = ("solid", "dot", "dash")[m % 3], style_of(n).color
            lines.append(Line(run.spectra_frequencies, values / model.gravity, f"{name}, Q {Q:g}", color, dash))
    unit = {"acceleration": "g", "displacement": "g s²", "pseudo-velocity": "g s"}[run.spectra_kind]
    return over_frequency("natural frequency [Hz]", f"largest {run.spectra_kind} [{unit}]", lines)


def notch_chart(model: ShakenModel, kind: str, run: NotchedRun) -> Chart:
    """The input as specified and as notched."""
    power = 1 if kind == "sine" else 2
    lines = [
        Line(run.frequencies, run.level / model.gravity**power, "as specified", INK, "dash"),
        Line(run.frequencies, run.notched / model.gravity**power, "notched", style_of(1).color),
    ]
    return over_frequency("frequency [Hz]", "input [g]" if kind == "sine" else "input [g²/Hz]", lines, 340)


def mass_chart(masses: EffectiveMasses) -> Chart:
    """Cumulative effective mass over frequency, the directions of the first base."""
    lines = []
    for k, name in enumerate(masses.directions[:6]):
        x = np.concatenate([[masses.frequencies[0] * 0.5], masses.frequencies, [masses.frequencies[-1] * 1.2]])
        y = 100 * np.concatenate([[0.0], masses.cumulative[:, k], masses.cumulative[-1:, k]])
        style = style_of(k)
        lines.append(Line(x, y, name.partition(":")[2], style.color, style.dash, is_step=True))
    upwards = Axis("effective mass, cumulative [%]", range=(0.0, 105.0))
    return Chart(Axis("frequency [Hz]", is_log=True), (upwards,), tuple(lines), 340)
