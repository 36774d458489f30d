"""Plots of quality results; they draw existing data and compute nothing."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from cms.assessment.quality.of_reduction.deformation import DeformationError
from cms.assessment.quality.reference.port_model import FrequencyResponse
from fe_models.foundation.documents.plot_axes import log_frequencies

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["frf_figure", "plot_deformation_error", "plot_frf", "plot_phase"]

STYLES = ("-", "--", ":", "-.")
COLORS = ("#20303c", "#d1495b", "#00798c", "#edae49")


def plot_frf(
    curves: Mapping[str, FrequencyResponse],
    output: int,
    input: int,
    ax: "Axes | None" = None,
    *,
    is_inertance: bool = False,
) -> "Axes":
    """Plot the magnitude of one entry of frequency responses over frequency, both logarithmic.

    Parameters
    ----------
    curves
        Legend -> response.
    output, input
        Row and column of H.
    is_inertance
        Whether to plot acceleration instead of displacement.
    """
    ax = ax or new_axes()
    for k, (name, response) in enumerate(curves.items()):
        values = response.values(is_inertance=is_inertance)
        ax.loglog(response.frequencies, np.abs(values[:, output, input]), label=name, **style(k))
    first = next(iter(curves.values()))
    ax.set_ylabel(f"|{first.outputs[output]} / {first.inputs[input]}|")
    log_frequencies(ax)
    return finished(ax, "frequency [Hz]")


def plot_phase(
    curves: Mapping[str, FrequencyResponse],
    output: int,
    input: int,
    ax: "Axes | None" = None,
    *,
    is_inertance: bool = False,
) -> "Axes":
    """Plot the phase of one entry of frequency responses in degrees; parameters as in `plot_frf`."""
    ax = ax or new_axes()
    for k, (name, response) in enumerate(curves.items()):
        values = response.values(is_inertance=is_inertance)
        ax.semilogx(response.frequencies, np.degrees(np.angle(values[:, output, input])), label=name, **style(k))
    ax.set_yticks([-180, -90, 0, 90, 180])
    ax.set_ylabel("phase [deg]")
    log_frequencies(ax)
    return finished(ax, "frequency [Hz]")


def frf_figure(
    curves: Mapping[str, FrequencyResponse],
    entries: Sequence[tuple[int, int]],
    labels: Sequence[str],
    *,
    is_inertance: bool = False,
    title: str = "",
) -> "Figure":
    """Return a figure with magnitude above phase, one column for each entry (output, input) of the responses."""
    from matplotlib.figure import Figure

    n = len(entries)
    figure = Figure(figsize=(max(7.0, 4.6 * n), 5.6), layout="constrained")
    axes = figure.subplots(2, n, sharex=True, squeeze=False, height_ratios=(3, 1))
    for k, (output, input) in enumerate(entries):
        plot_frf(curves, output, input, axes[0, k], is_inertance=is_inertance).set_ylabel(labels[k])
        axes[0, k].set_xlabel("")
        plot_phase(curves, output, input, axes[1, k], is_inertance=is_inertance)
        legend = axes[1, k].get_legend()
        if legend is not None:
            legend.remove()
    figure.suptitle(title)
    return figure


def plot_deformation_error(errors: Mapping[str, DeformationError], norm: str = "K", ax: "Axes | None" = None) -> "Axes":
    """Plot the deformation error eps(t) of mode sets in one norm, logarithmic, and the size of the deformation.

    Parameters
    ----------
    errors
        Legend -> error.
    norm
        One of "M", "K", "nodal".
    """
    ax = ax or new_axes()
    first = next(iter(errors.values()))
    ax.semilogy(first.t, positive(first.size[norm]), color="0.8", linewidth=3, label="size of the deformation")
    for k, (name, error) in enumerate(errors.items()):
        ax.semilogy(error.t, positive(error.error[norm]), label=name, **style(k))
    ax.set_ylabel(f"deformation error, {norm} norm")
    return finished(ax, "time")


def positive(values: np.ndarray) -> np.ndarray:
    """Return the values with NaN for those that a logarithmic axis cannot show."""
    return np.where(values > 0, values, np.nan)


def style(k: int) -> dict[str, object]:
    """Return the line style of curve k; the first curve is wide, so that it remains visible below a second one."""
    return {"color": f"C{k}" if k >= len(COLORS) else COLORS[k], "linestyle": STYLES[min(k, 1)], "linewidth": 1.6}


def new_axes() -> "Axes":
    """Return the axes of a new figure."""
    from matplotlib.figure import Figure

    return Figure(layout="constrained").add_subplot()


def finished(ax: "Axes", x: str) -> "Axes":
    """Label the x axis, and add grid and legend."""
    ax.set_xlabel(x)
    ax.grid(alpha=0.3, which="both")
    if ax.get_legend_handles_labels()[0]:
        ax.legend(fontsize="small")
    return ax
