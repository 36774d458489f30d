"""Plots of spectra: lines, bands, maps over orders or frequencies, transfer functions with coherence."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fe_models.foundation.documents.plot_axes import log_frequencies
from floatframe.errors import ResultsError
from floatframe.files.signals.octaves import nominal_frequency
from floatframe.files.signals.orders import SpectralMap
from floatframe.files.signals.spectra import Spectrum
from floatframe.files.signals.transfer import TransferEstimate

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["plot_spectra", "plot_spectral_map", "plot_spectrum", "plot_transfer"]

RANGE = 1e-6  #: lower end of a logarithmic axis, relative to the largest value
MOST_TICKS = 12  #: largest number of labelled bands


def axes_of(ax: "Axes | None") -> "Axes":
    """Return the given axes, or those of a new figure."""
    if ax is not None:
        return ax
    from matplotlib.figure import Figure

    return Figure(figsize=(7, 4), layout="constrained").add_subplot()


def plot_spectrum(spectrum: Spectrum, ax: "Axes | None" = None) -> "Axes":
    """Plot a density or amplitudes over frequency, or levels of bands as bars."""
    ax = axes_of(ax)
    if spectrum.edges is None:
        inside = spectrum.frequencies > 0
        ax.plot(spectrum.frequencies[inside], spectrum.values[inside], linewidth=1.0)
        if spectrum.kind == "power spectral density":
            log_frequencies(ax)
            log_from(ax, float(spectrum.values[inside].max(initial=0.0)))
        else:
            ax.set_ylim(bottom=0)
        ax.set_xlabel("frequency [Hz]")
    else:
        place = np.arange(len(spectrum.frequencies))
        ax.bar(place, spectrum.values, width=0.9)
        shown = place[:: max(1, len(place) // MOST_TICKS)]
        ax.set_xticks(shown, [f"{nominal_frequency(f):g}" for f in spectrum.frequencies[shown]])
        ax.set_xlabel("band [Hz]")
    ax.set_ylabel(f"{spectrum.kind} [{spectrum.unit or '-'}]")
    ax.set_title(spectrum.name, fontsize="medium")
    ax.grid(alpha=0.3)
    return ax


def log_from(ax: "Axes", largest: float) -> None:
    """Make the axis of values logarithmic over six powers of ten."""
    if largest > 0:
        ax.set_yscale("log")
        ax.set_ylim(bottom=RANGE * largest)


def plot_spectral_map(spectra: SpectralMap, ax: "Axes | None" = None) -> "Axes":
    """Plot amplitudes as colours over orders or frequencies, and over speed if it is known and monotonic."""
    ax = axes_of(ax)
    speeds = spectra.speeds
    change = np.zeros(0) if speeds is None else np.diff(speeds)
    one_way = len(change) > 0 and bool((change > 0).all() or (change < 0).all())
    over = speeds * 30 / np.pi if speeds is not None and one_way else spectra.times
    mesh = ax.pcolormesh(spectra.lines, over, spectra.amplitudes, shading="nearest", cmap="viridis")
    ax.figure.colorbar(mesh, ax=ax, label=f"amplitude ({'rms' if spectra.is_rms else 'peak'}) [{spectra.unit or '-'}]")
    ax.set_xlabel("order" if spectra.kind == "order" else "frequency [Hz]")
    ax.set_ylabel("speed [1/min]" if one_way else "time [s]")
    ax.set_title(spectra.name, fontsize="medium")
    return ax


def plot_transfer(transfer: TransferEstimate, ax: "Axes | None" = None) -> "Axes":
    """Plot the magnitudes of H1 and H2, and the coherence on its own axis."""
    ax = axes_of(ax)
    inside = transfer.frequencies > 0
    f = transfer.frequencies[inside]
    for name, H in (("H1", transfer.H1), ("H2", transfer.H2)):
        ax.plot(f, np.abs(H[inside]), label=name, linewidth=1.0)
    log_from(ax, float(np.nanmax(np.abs(transfer.H1[inside]), initial=0.0)))
    ax.set_xlabel("frequency [Hz]")
    ax.set_ylabel(f"size [{transfer.unit or '-'}]")
    ax.set_title(f"{transfer.output} / {transfer.input}", fontsize="medium")
    ax.legend(loc="upper left")
    ax.grid(alpha=0.3)
    right = ax.twinx()
    right.plot(f, transfer.coherence[inside], color="0.6", linewidth=0.8)
    right.set_ylim(0, 1.02)
    right.set_ylabel("coherence")
    return ax


def plot_spectra(spectra: Sequence[Spectrum | SpectralMap | TransferEstimate], *, title: str = "") -> "Figure":
    """Return a figure with a panel for every spectrum.

    Raises
    ------
    ResultsError
        If there is no spectrum.
    """
    from matplotlib.figure import Figure

    if not spectra:
        raise ResultsError("plot: no spectrum to plot; name a sensor")
    n_columns = 1 if len(spectra) == 1 else 2
    n_rows = (len(spectra) + n_columns - 1) // n_columns
    figure = Figure(figsize=(6.5 * n_columns, 3.6 * n_rows + 0.6), layout="constrained")
    if title:
        figure.suptitle(title)
    axes = figure.subplots(n_rows, n_columns, squeeze=False).ravel()
    for spectrum, ax in zip(spectra, axes, strict=False):
        if isinstance(spectrum, SpectralMap):
            plot_spectral_map(spectrum, ax)
        elif isinstance(spectrum, TransferEstimate):
            plot_transfer(spectrum, ax)
        else:
            plot_spectrum(spectrum, ax)
    for ax in axes[len(spectra) :]:
        ax.remove()
    return figure
