"""Plots of a computed motion; each function draws into given axes, or into a new figure."""

from typing import TYPE_CHECKING

import numpy as np

from floatframe.results.energy_balance import balance_defect, energy_scale
from floatframe.results.sensor_plots import labelled
from floatframe.results.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = [
    "plot_drift",
    "plot_energies",
    "plot_energy_balance",
]

SHOWN = 1e-6  #: smallest drift on the axis, relative to the largest drift
MOST_CURVES = 8  #: largest number of curves in a plot; if there are more, those with the largest values are drawn


def plot_energies(trajectory: Trajectory, ax: "Axes | None" = None) -> "Axes":
    """Plot kinetic, strain, gravity and spring energy, work and dissipation, unless zero, and the total energy."""
    ax, e = axes_for(trajectory, ax), trajectory.energies
    parts = {"kinetic": e.kinetic, "strain": e.strain, "gravity": e.gravity, "springs": e.springs,
             "work of forces": e.work, "dissipated": e.dissipated}  # fmt: skip
    for name, values in parts.items():
        if np.any(values):
            ax.plot(trajectory.t, values, label=name)
    ax.plot(trajectory.t, e.total, "k--", linewidth=1, label="total")
    units = trajectory.units
    return labelled(ax, f"energy [{units.force_symbol} {units.length_symbol}]")


def plot_energy_balance(trajectory: Trajectory, ax: "Axes | None" = None) -> "Axes":
    """Plot the error of the energy balance, divided by the largest energy in motion."""
    ax = axes_for(trajectory, ax)
    defect = balance_defect(trajectory) / (energy_scale(trajectory) or 1.0)
    ax.plot(trajectory.t, defect, "k", label="total - work + dissipated")
    return labelled(ax, "error of the energy balance / largest energy")


def plot_drift(trajectory: Trajectory, ax: "Axes | None" = None) -> "Axes":
    """Plot the constraint error of each joint, as distance and angle, on a logarithmic axis.

    The largest ones are drawn. Errors that stay below `SHOWN` times the largest one are rounding errors.
    """
    ax, length = axes_for(trajectory, ax), trajectory.units.length_symbol
    sizes = {}
    for name in trajectory.head.joints:
        drift = trajectory.drift(name)
        sizes[f"{name} distance [{length}]"] = np.abs(drift.distance)
        sizes[f"{name} angle [rad]"] = np.abs(drift.angle)
    peaks = {name: float(np.nanmax(size, initial=0.0)) for name, size in sizes.items()}
    most = max(peaks.values(), default=0.0)
    ranked = sorted(peaks, key=lambda name: -peaks[name])[:MOST_CURVES]
    kept = [name for name, peak in peaks.items() if name in ranked and peak > SHOWN * most]
    for name in kept:
        ax.semilogy(trajectory.t, np.where(sizes[name] > 0, sizes[name], np.nan), linewidth=0.8, label=name)
    if kept:
        decades = -np.log10(SHOWN)
        ax.set_ylim(SHOWN * most, most * 10 ** (0.14 * decades * (1 + (len(kept) + 1) // 2)))  # room for the legend
    note_omitted(ax, len(kept), len(peaks))
    ax.set_ylabel(f"drift of joints [{length}, rad]")
    if kept:
        ax.legend(fontsize="small", ncols=2, loc="upper left")
    return ax


def note_omitted(ax: "Axes", n_shown: int, n_all: int) -> None:
    """Write above a plot that it shows only the largest curves."""
    if n_shown < n_all:
        ax.set_title(f"the largest {n_shown} of {n_all}", loc="right", fontsize="small", alpha=0.6)


def axes_for(trajectory: Trajectory, ax: "Axes | None") -> "Axes":
    """Return the given axes, or those of a new figure, with time along x."""
    if ax is None:
        from matplotlib.figure import Figure

        ax = Figure(layout="constrained").add_subplot()
    ax.set_xlabel(f"time [{trajectory.units.time_symbol}]")
    ax.grid(alpha=0.3)
    return ax
