"""Plots of the analyses; they read results and compute nothing."""

from typing import TYPE_CHECKING

import numpy as np

from floatframe.analyses.frequency_response import FrequencyResponse
from floatframe.analyses.parameter_study import Locus

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["plot_campbell", "plot_frequency_response", "plot_root_locus"]


def plot_campbell(locus: Locus, ax: "Axes | None" = None, *, time_unit: float = 1.0) -> "Axes":
    """Plot frequencies over the speed, with the lines of once, twice and three times per revolution.

    Parameters
    ----------
    locus
        As `campbell` returns it.
    ax
        Where to draw; a new figure by default.
    time_unit
        Seconds in the unit of time of the system.
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
            ax.annotate(f"{order}P", (locus.values[k], line[k]), color="0.45", fontsize=9, va="bottom", ha="right")
    ax.set_ylim(0, 1.05 * largest if largest > 0 else 1)
    ax.set_xlim(locus.values.min(), max(locus.values.max(), locus.values.min() + 1e-12))
    ax.set_xlabel(locus.parameter)
    ax.set_ylabel("frequency in the turning system [Hz]")
    ax.grid(alpha=0.3)
    return ax


def plot_root_locus(locus: Locus, ax: "Axes | None" = None) -> "Axes":
    """Plot eigenvalues in the complex plane, coloured by the parameter."""
    ax = _axes() if ax is None else ax
    for column in locus.eigenvalues.T:
        ax.plot(column.real, column.imag, color="0.75", linewidth=1, zorder=1)
        points = ax.scatter(column.real, column.imag, c=locus.values, s=18, cmap="viridis", zorder=2)
    ax.figure.colorbar(points, ax=ax, label=locus.parameter)
    ax.axvline(0, color="0.3", linewidth=0.8)
    ax.set_xlabel("real part [1/s]")
    ax.set_ylabel("imaginary part [1/s]")
    ax.grid(alpha=0.3)
    return ax


def plot_frequency_response(response: FrequencyResponse, *, time_unit: float = 1.0) -> "Figure":
    """Return a Bode plot: amplitudes, a panel for each unit, and phases below; a curve for each output and input.

    Parameters
    ----------
    response
        As `frequency_response` returns it.
    time_unit
        Seconds in the unit of time of the system.
    """
    from matplotlib.figure import Figure

    pairs = [(o, i) for o in range(len(response.outputs)) for i in range(len(response.inputs))]
    units = list(dict.fromkeys(response.units[o][i] for o, i in pairs))
    figure = Figure(figsize=(8, 2.8 * len(units) + 2.6), layout="constrained")
    axes = figure.subplots(len(units) + 1, 1, sharex=True, squeeze=False).ravel()
    hertz = response.frequencies / time_unit
    amplitudes, phases = response.amplitudes, response.phases
    for k, (o, i) in enumerate(pairs):
        color = f"C{k % 10}"
        label = f"{response.outputs[o]} / {response.inputs[i]}"
        size = amplitudes[:, o, i]
        if not size.any():
            label += " (none)"
        axes[units.index(response.units[o][i])].loglog(
            hertz, np.where(size > 0, size, np.nan), color=color, linewidth=1.4, label=label
        )
        axes[-1].semilogx(hertz, (phases[:, o, i] + 180) % 360 - 180, color=color, linewidth=1.1)
    for unit, ax in zip(units, axes, strict=False):
        ax.set_ylabel(f"amplitude [{unit}]")
        ax.legend(fontsize="small")
        ax.grid(which="major", alpha=0.4)
        ax.grid(which="minor", alpha=0.15)
    axes[-1].set_ylabel("phase [degrees]")
    axes[-1].set_ylim(-190, 190)
    axes[-1].set_yticks([-180, -90, 0, 90, 180])
    axes[-1].grid(which="major", alpha=0.4)
    axes[-1].set_xlabel("frequency [Hz]")
    axes[-1].set_xlim(hertz[0], hertz[-1])
    return figure


def _axes() -> "Axes":
    from matplotlib.figure import Figure

    return Figure(figsize=(7, 4.5), layout="constrained").subplots()
