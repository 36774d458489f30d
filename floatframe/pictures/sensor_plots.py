"""Plots of sensor measurements, with one panel for each sensor and unit."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from floatframe.errors import ResultsError
from floatframe.pictures.plots import labelled
from floatframe.results.sensors.measurement import Measurement

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["panels_of", "plot_measurement", "plot_sensors"]

ROUNDING = 1e-9  #: relative to the largest column of a unit; smaller curves would coincide with zero


def panels_of(measurement: Measurement) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Return the columns of each panel, as a unit and the names of the columns with this unit."""
    quantities = measurement.quantities
    units = dict.fromkeys(measurement.units[name] for name in quantities)
    return tuple((unit, tuple(name for name in quantities if measurement.units[name] == unit)) for unit in units)


def plot_measurement(
    measurement: Measurement, ax: "Axes | None" = None, *, unit: str | None = None, time_symbol: str = "s"
) -> "Axes":
    """Plot the columns of one unit (default: the first unit) over time."""
    if ax is None:
        from matplotlib.figure import Figure

        ax = Figure(figsize=(7, 4), layout="constrained").add_subplot()
    panels = dict(panels_of(measurement))
    unit = next(iter(panels)) if unit is None else unit
    columns = panels[unit]
    size = {name: float(np.abs(measurement.columns[name]).max(initial=0.0)) for name in columns}
    # components that stay zero would crowd the legend; if all do, the last one is shown
    shown = [name for name in columns if size[name] > ROUNDING * max(size.values())] or [columns[-1]]
    for name in columns if len(columns) == 1 else shown:
        is_sum = name.split()[-1] in ("size", "total", "von")
        line = {"linewidth": 1.0, "color": "k"} if is_sum else {"linewidth": 1.5}
        ax.plot(measurement.t, measurement.columns[name], label=name, **line)
    ax.set_xlabel(f"time [{time_symbol}]")
    ax.set_title("\n".join([measurement.sensor, *measurement.places]), fontsize="medium")
    ax.grid(alpha=0.3)
    if len(columns) == 1:
        ax.set_ylabel(f"{columns[0]} [{unit}]")
        return ax
    return labelled(ax, f"{measurement.sensor} [{unit}]")


def plot_sensors(measurements: Sequence[Measurement], *, title: str = "", time_symbol: str = "s") -> "Figure":
    """Return a figure with a panel for every sensor and every unit of its columns.

    Raises
    ------
    ResultsError
        If there is nothing to plot.
    """
    from matplotlib.figure import Figure

    panels = [(measurement, unit) for measurement in measurements for unit, _ in panels_of(measurement)]
    if not panels:
        raise ResultsError("plot: no sensor to plot; name a joint coordinate, or add tables [sensors.NAME]")
    n_columns = 1 if len(panels) == 1 else 2
    n_rows = (len(panels) + n_columns - 1) // n_columns
    figure = Figure(figsize=(6.5 * n_columns, 3.4 * n_rows + 0.6), layout="constrained")
    if title:
        figure.suptitle(title)
    axes = figure.subplots(n_rows, n_columns, squeeze=False).ravel()
    for (measurement, unit), ax in zip(panels, axes, strict=False):
        plot_measurement(measurement, ax, unit=unit, time_symbol=time_symbol)
    for ax in axes[len(panels) :]:
        ax.remove()
    return figure
