"""Plots of results of the analyses."""

from typing import TYPE_CHECKING

import numpy as np

from floatframe.analyses.linear.parameter_study import Locus

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["campbell_figure", "plot_campbell"]


ROUNDING = 1e-12  #: rounding error of a response, relative to the largest amplitude with the same unit


def plot_campbell(locus: Locus, ax: "Axes | None" = None, *, time_unit: float = 1.0) -> "Axes":
    """Plot frequencies over rotation speed, with lines for the first three multiples of the speed.

    Parameters
    ----------
    locus
        Result of `campbell`.
    ax
        Axes to draw in; default: a new figure.
    time_unit
        Unit of time of the system [s].
    """
    ax = _axes() if ax is None else ax
    ax.plot(locus.values, locus.frequencies / time_unit, color="#1f4e79", linewidth=1.6)
    largest = float(np.nanmax(locus.frequencies)) / time_unit
    for order in (1, 2, 3):
        line = order * locus.values / (2 * np.pi) / time_unit
        ax.plot(locus.values, line, color="0.6", linewidth=0.9, linestyle="--", zorder=0)
        inside = np.flatnonzero(line <= 1.04 * largest)
        if len(inside):
            k = inside[-1]
            ax.annotate(
                f"{order}P", (locus.values[k], line[k]), xytext=(-14, -3), textcoords="offset points", color="0.4",
                fontsize=9, va="top", ha="center", bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8},
            )  # fmt: skip
    ax.set_ylim(0, 1.05 * largest if largest > 0 else 1)
    ax.set_xlim(locus.values.min(), max(locus.values.max(), locus.values.min() + 1e-12))
    ax.set_xlabel(locus.parameter)
    ax.set_ylabel("frequency in the rotating frame [Hz]")
    ax.grid(alpha=0.3)
    return ax


def campbell_figure(locus: Locus, *, time_unit: float = 1.0) -> "Figure":
    """Return the Campbell diagram with steady output values below it, one panel for each unit.

    An output is not drawn but listed if it is zero at all speeds, compared with the largest output of the same unit.

    Parameters
    ----------
    locus
        Result of `campbell`.
    time_unit
        Unit of time of the system [s].
    """
    from matplotlib.figure import Figure

    size = {unit: 0.0 for unit in locus.output_units}
    for unit, values in zip(locus.output_units, locus.steady.T, strict=True):
        size[unit] = max(size[unit], float(np.abs(values).max(initial=0.0)))
    units = [unit for unit in size if size[unit] > 0]
    rows = 1 + len(units)
    figure = Figure(figsize=(7, 4.5 + 2.4 * len(units)), layout="constrained")
    axes = figure.subplots(rows, 1, sharex=True, squeeze=False, height_ratios=[2.0] + [1.0] * len(units)).ravel()
    plot_campbell(locus, axes[0], time_unit=time_unit)
    still = []
    for k, (name, unit) in enumerate(zip(locus.outputs, locus.output_units, strict=True)):
        values = locus.steady[:, k]
        if float(np.abs(values).max(initial=0.0)) <= ROUNDING * size[unit]:
            still.append(name)
            continue
        axes[1 + units.index(unit)].plot(locus.values, values, color=f"C{k % 10}", linewidth=1.4, label=name)
    for unit, ax in zip(units, axes[1:], strict=True):
        ax.set_ylabel(f"[{unit}]")
        ax.legend(fontsize="small")
        ax.grid(alpha=0.3)
    if units:
        axes[0].set_xlabel("")
        axes[-1].set_xlabel(locus.parameter)
    if still:
        figure.suptitle(f"zero: {', '.join(still)}", fontsize="small", color="0.4")
    return figure


def _axes() -> "Axes":
    from matplotlib.figure import Figure

    return Figure(figsize=(7, 4.5), layout="constrained").subplots()
