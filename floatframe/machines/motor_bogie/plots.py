"""A start as one figure: electrical and mechanical frequencies over time, and the load where they cross."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.files.signals.orders import SpectralMap
from floatframe.machines.motor_bogie.figures import ModeOfBogie, SupplyLines

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["plot_lines", "plot_map", "plot_start"]

DECADES = 4.0  #: range of amplitudes that colours show, in decades


def plot_start(
    maps: Sequence[tuple[SpectralMap, Sequence[int]]],
    supply: tuple[Array, Array],
    modes: Sequence[ModeOfBogie],
    found: SupplyLines,
    predicted: SupplyLines,
) -> "Figure":
    """Return a figure with spectra over time, the supply lines and the modes, and loads over frequency.

    Parameters
    ----------
    maps
        Maps of a current, a torque and the force of a mount, from `frequency_map`, each with the multiples of the
        supply frequency to be drawn as lines.
    supply
        Times [s] and supply frequency [Hz], (n_t,) each.
    modes
        Modes of the bogie, drawn as horizontal lines.
    found, predicted
        Results of `supply_lines` and `predicted_lines`.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.3 * (len(maps) + 1)), layout="constrained")
    axes = figure.subplots(len(maps) + 1, 1)
    highest = 1.12 * min(found.load) * float(supply[1].max())
    for (spectrum, multiples), ax in zip(maps, axes, strict=False):
        plot_map(spectrum, supply, multiples, modes, ax, highest)
    plot_lines(found, predicted, modes, axes[-1])
    return figure


def plot_map(
    spectrum: SpectralMap,
    supply: tuple[Array, Array],
    multiples: Sequence[int],
    modes: Sequence[ModeOfBogie],
    ax: "Axes",
    highest: float,
) -> "Axes":
    """Draw amplitudes as colours over time and frequency, supply lines dashed, modes dotted (green: frame modes)."""
    t, f = supply
    shown = np.log10(np.maximum(spectrum.amplitudes, 1e-12)).T
    top = float(shown[1:].max())
    mesh = ax.pcolormesh(
        spectrum.times, spectrum.lines, shown, shading="nearest", cmap="magma", vmin=top - DECADES, vmax=top
    )
    ax.figure.colorbar(mesh, ax=ax, label=f"log10 of the amplitude [{spectrum.unit}]")
    for n in multiples:
        ax.plot(t, n * f, color="white", linewidth=0.8, linestyle="--", alpha=0.7)
        inside = np.flatnonzero((n * f > 0.82 * highest) & (n * f < 0.9 * highest))
        k = inside[0] if len(inside) else int(0.93 * len(t))
        ax.annotate(f"{n} f", (t[k], n * f[k]), color="white", fontsize="small", ha="right", va="bottom")
    for mode in modes:
        ax.axhline(
            mode.frequency,
            color="#7fd0ff" if mode.flexible < 0.3 else "#8dff8d",
            linewidth=0.6,
            alpha=0.8,
            linestyle=":",
        )
    ax.set_xlim(spectrum.times[0], spectrum.times[-1])
    ax.set_ylim(0, highest)
    ax.set_xlabel("time [s]")
    ax.set_ylabel("frequency [Hz]")
    ax.set_title(spectrum.name, fontsize="medium")
    return ax


def plot_lines(found: SupplyLines, predicted: SupplyLines, modes: Sequence[ModeOfBogie], ax: "Axes") -> "Axes":
    """Draw the amplitude of each line in a load over frequency, from the run and for constant speed."""
    for k, n in enumerate(found.load):
        color = f"C{k}"
        ax.semilogy(n * found.frequency, found.load[n], color=color, label=f"{n} f, of the start")
        ax.semilogy(n * predicted.frequency, predicted.load[n], color=color, linewidth=0.8, linestyle="--",
                    label=f"{n} f, running evenly")  # fmt: skip
    for mode in modes:
        ax.axvline(mode.frequency, color="C0" if mode.flexible < 0.3 else "C2", linewidth=0.5, alpha=0.5, linestyle=":")
    ax.set_xlim(0, 1.05 * min(found.load) * float(found.frequency.max()))
    ax.set_ylim(bottom=0.5)
    ax.set_xlabel("frequency of the line [Hz]")
    ax.set_ylabel("amplitude of the force [N]")
    ax.grid(alpha=0.3)
    ax.legend(fontsize="small")
    return ax
