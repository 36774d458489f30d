"""Plots of parameter studies: a panel for each output over the first parameter, with curves for the other ones."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.design.studies.study import StudyTable
from floatframe.errors import ResultsError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["MOST_CURVES", "OutputCurves", "curves_of", "plot_study", "plot_study_output", "value_label"]

MOST_CURVES = 9  #: largest number of curves listed in the legend; further curves share one colour


def plot_study(table: StudyTable) -> "Figure":
    """Return a figure with a panel for each output.

    Raises
    ------
    ResultsError
        If no point gave a result.
    """
    from matplotlib.figure import Figure

    if table.n_failed == len(table.rows):
        raise ResultsError(f"plot: no point of the study gave a result; the first one: {table.rows[0].error}")
    outputs = table.study.outputs
    n_columns = 1 if len(outputs) == 1 else 2
    n_rows = (len(outputs) + n_columns - 1) // n_columns
    figure = Figure(figsize=(6.5 * n_columns, 3.8 * n_rows + 0.3), layout="constrained")
    axes = figure.subplots(n_rows, n_columns, squeeze=False).ravel()
    for output, ax in zip(outputs, axes, strict=False):
        plot_study_output(table, output.name, ax)
    for ax in axes[len(outputs) :]:
        ax.remove()
    return figure


@dataclass(frozen=True, eq=False)
class OutputCurves:
    """An output over the first parameter, one curve per combination of the others."""

    x_label: str
    y_label: str
    choices: tuple[str, ...]  #: values of the first parameter if they are no numbers; x is their index
    is_log: bool  #: whether x needs a logarithmic axis
    curves: tuple[tuple[str, Array, Array], ...]  #: label, x, and values of each curve; NaN where a point failed
    failed: Array  #: x of failed points


def curves_of(table: StudyTable, name: str) -> OutputCurves:
    """Return the curves of an output."""
    study, values = table.study, table.column(name)
    k = [output.name for output in study.outputs].index(name)
    first = study.parameters[0]
    is_number = all(isinstance(value, int | float) and not isinstance(value, bool) for value in first.values)
    places = {repr(value): float(value) if is_number else float(i) for i, value in enumerate(first.values)}
    x = np.array([places[repr(row.values[0])] for row in table.rows])
    others = [row.values[1:] if study.is_grid else () for row in table.rows]
    curves = []
    for key in dict.fromkeys(map(repr, others)):
        rows = np.array([repr(other) == key for other in others])
        other = next(other for other in others if repr(other) == key)
        words = ", ".join(f"{p.name} = {value_label(v)}" for p, v in zip(study.parameters[1:], other, strict=False))
        curves.append((words, x[rows], values[rows]))
    take = f", {study.outputs[k].take}" if study.analysis not in ("modes", "static") else ""
    return OutputCurves(
        f"{first.name} ({first.path})" if first.name != first.path else first.path,
        f"{name}{take} [{table.units[k]}]",
        () if is_number else tuple(map(value_label, first.values)),
        is_number and len(x) > 1 and bool((x > 0).all()) and x.max() >= 50 * x.min(),
        tuple(curves),
        x[[bool(row.error) for row in table.rows]],
    )


def plot_study_output(table: StudyTable, name: str, ax: "Axes") -> "Axes":
    """Plot an output over the first parameter, one curve per combination of the others; ticks below: failures."""
    drawn = curves_of(table, name)
    is_few = len(drawn.curves) <= MOST_CURVES
    for i, (words, x, y) in enumerate(drawn.curves):
        label = words if words and is_few else None
        ax.plot(x, y, "o-", markersize=4, linewidth=1.4, color=f"C{i}" if is_few else "C0", label=label)
    if len(drawn.failed):
        ax.plot(drawn.failed, np.full(len(drawn.failed), 0.015), "x", color="#b22222",
                transform=ax.get_xaxis_transform(), clip_on=False, label="no result")  # fmt: skip
    if drawn.is_log:
        ax.set_xscale("log")
    if drawn.choices:
        ax.set_xticks(range(len(drawn.choices)), drawn.choices)
    ax.set_xlabel(drawn.x_label)
    ax.set_ylabel(drawn.y_label)
    ax.grid(alpha=0.3)
    if ax.get_legend_handles_labels()[0]:
        ax.legend(fontsize="small")
    return ax


def value_label(value: object) -> str:
    """Return a value of a parameter in a short form."""
    return f"{value:g}" if isinstance(value, int | float) and not isinstance(value, bool) else str(value)
