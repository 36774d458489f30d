"""Plots of parameter studies: a panel for each output over the first parameter, with curves for the other ones."""

from typing import TYPE_CHECKING

import numpy as np

from floatframe.design.studies.study import StudyTable
from floatframe.errors import ResultsError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["plot_study", "plot_study_output"]

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


def plot_study_output(table: StudyTable, name: str, ax: "Axes") -> "Axes":
    """Plot an output over the first parameter, one curve per combination of the others; ticks below: failures."""
    study, values = table.study, table.column(name)
    k = [output.name for output in study.outputs].index(name)
    first = study.parameters[0]
    is_number = all(isinstance(value, int | float) and not isinstance(value, bool) for value in first.values)
    places = {repr(value): float(value) if is_number else float(i) for i, value in enumerate(first.values)}
    x = np.array([places[repr(row.values[0])] for row in table.rows])
    others = [row.values[1:] if study.is_grid else () for row in table.rows]
    curves = list(dict.fromkeys(repr(other) for other in others))
    for i, curve in enumerate(curves):
        rows = np.array([repr(other) == curve for other in others])
        other = next(o for o in others if repr(o) == curve)
        told = ", ".join(f"{p.name} = {value_label(v)}" for p, v in zip(study.parameters[1:], other, strict=False))
        color = f"C{i}" if len(curves) <= MOST_CURVES else "C0"
        label = told if told and len(curves) <= MOST_CURVES else None
        ax.plot(x[rows], values[rows], "o-", markersize=4, linewidth=1.4, color=color, label=label)
    failed = np.array([bool(row.error) for row in table.rows])
    if failed.any():
        ax.plot(x[failed], np.full(failed.sum(), 0.015), "x", color="#b22222", transform=ax.get_xaxis_transform(),
                clip_on=False, label="no result")  # fmt: skip
    if is_number:
        steps = np.diff(np.log(np.abs(x[np.abs(x) > 0]))) if (x > 0).all() else np.zeros(0)
        span = x.max() / x.min() if (x > 0).all() and x.min() > 0 else 1.0
        if span >= 50 and len(steps):
            ax.set_xscale("log")
    else:
        ax.set_xticks(range(len(first.values)), [value_label(value) for value in first.values])
    unit = table.units[k]
    take = study.outputs[k].take
    ax.set_xlabel(f"{first.name} ({first.path})" if first.name != first.path else first.path)
    ax.set_ylabel(f"{name}, {take} [{unit}]" if study.analysis not in ("modes", "static") else f"{name} [{unit}]")
    ax.grid(alpha=0.3)
    if ax.get_legend_handles_labels()[0]:
        ax.legend(fontsize="small")
    return ax


def value_label(value: object) -> str:
    """Return a value of a parameter in a short form."""
    return f"{value:g}" if isinstance(value, int | float) and not isinstance(value, bool) else str(value)
