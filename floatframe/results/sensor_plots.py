"""Plots of measurements over time: panels of one unit and at most a dozen curves, pages of at most eight panels."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from floatframe.errors import ResultsError
from floatframe.results.sensors.measurement import Measurement

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = [
    "figure_of",
    "free_legends",
    "groups_of",
    "labelled",
    "pages_of",
    "panels_of",
    "plot_bars",
    "plot_columns",
    "plot_measurement",
    "sensor_pages",
]

ROUNDING = 1e-9  #: magnitude, relative to the largest column of a unit, below which a curve is a rounding error
MOST_CURVES = 12  #: largest number of curves in a panel; further columns go into additional panels
N_COLORS = 10  #: number of colours, after which they repeat with dashed lines
LONG_LEGEND = 6  #: number of entries above which a legend has two columns
MOST_BARS = 40  #: largest number of bars of a unit
MOST_PANELS = 8  #: largest number of panels on a page
LEGEND_GAP = 0.03  #: gap between curves and a legend above them, as a share of the height of a panel
LIKELY = 1.1  #: ratio of the sizes of panels before and after the layout of a page, at most
MOST_LEGEND = 0.5  #: largest share of the height of a panel that is kept free for a legend


def panels_of(measurement: Measurement) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Return pairs of a unit and the names of the columns with this unit."""
    quantities = measurement.quantities
    units = dict.fromkeys(measurement.units[name] for name in quantities)
    return tuple((unit, tuple(name for name in quantities if measurement.units[name] == unit)) for unit in units)


def groups_of(measurement: Measurement) -> tuple[tuple[str, ...], ...]:
    """Return the columns of each panel: at most a dozen of one unit, without columns that stay zero beside others.

    If all columns of a unit stay zero, the last one is shown.
    """
    groups = []
    for _, columns in panels_of(measurement):
        size = {name: float(np.abs(measurement.columns[name]).max(initial=0.0)) for name in columns}
        shown = [name for name in columns if size[name] > ROUNDING * max(size.values())] or [columns[-1]]
        n = -(-len(shown) // MOST_CURVES)
        groups += [tuple(map(str, part)) for part in np.array_split(shown, n)]
    return tuple(groups)


def plot_measurement(
    measurement: Measurement, ax: "Axes | None" = None, *, columns: Sequence[str] = (), time_symbol: str = "s"
) -> "Axes":
    """Plot columns of one unit over time, as grouped by `groups_of`; by default the first group."""
    if ax is None:
        from matplotlib.figure import Figure

        ax = Figure(figsize=(7, 4), layout="constrained").add_subplot()
    columns = columns or groups_of(measurement)[0]
    unit = measurement.units[columns[0]]
    for k, name in enumerate(columns):
        is_sum = name.split()[-1] in ("size", "total", "von")
        line: dict[str, Any] = {"linewidth": 1.0, "color": "k"} if is_sum else {"linewidth": 1.5}
        style = "-" if k < N_COLORS else "--"
        if is_sum and len(columns) > 1:  # where one component is all, gaps show its curve below
            line["dashes"] = (4, 5)
        ax.plot(measurement.t, measurement.columns[name], style, label=name, **line)
    ax.set_xlabel(f"time [{time_symbol}]")
    ax.set_title("\n".join([measurement.sensor, *measurement.places]), fontsize="medium")
    ax.grid(alpha=0.3)
    if dict(panels_of(measurement))[unit] == tuple(columns) and len(columns) == 1:
        ax.set_ylabel(f"{columns[0]} [{unit}]")
        return ax
    return labelled(ax, f"{measurement.sensor} [{unit}]")


def plot_columns(measurements: Sequence[Measurement], ax: "Axes", *, time_symbol: str = "s") -> "Axes":
    """Plot all columns of measurements into one pair of axes, labelled with sensor and column.

    Raises
    ------
    ResultsError
        If there is nothing to plot, or the columns have several units.
    """
    units: dict[str, list[str]] = {}
    for each in measurements:
        for columns in groups_of(each):
            units.setdefault(each.units[columns[0]], []).extend(each.channel(name) for name in columns)
            if len(units) == 1:
                for name in columns:
                    style = "-" if len(ax.lines) < N_COLORS else "--"
                    ax.plot(each.t, each.columns[name], style, linewidth=1.5, label=each.channel(name))
    if len(units) != 1:
        words = "; ".join(f"{', '.join(names)} [{unit}]" for unit, names in units.items())
        raise ResultsError(
            f"plot: expected columns of one unit for the given axes, got {words or 'nothing'}; name columns, such as "
            '"tip x", or omit the axes'
        )
    ((unit, names),) = units.items()
    ax.set_xlabel(f"time [{time_symbol}]")
    ax.grid(alpha=0.3)
    return labelled(ax, f"{names[0]} [{unit}]" if len(names) == 1 else f"[{unit}]")


def sensor_pages(measurements: Sequence[Measurement], *, title: str = "", time_symbol: str = "s") -> list["Figure"]:
    """Return pages with panels for every sensor, each with the columns of one unit, at most a dozen.

    Raises
    ------
    ResultsError
        If there is nothing to plot.
    """
    panels = [
        partial(plot_measurement, measurement, columns=columns, time_symbol=time_symbol)
        for measurement in measurements
        for columns in groups_of(measurement)
    ]
    if not panels:
        raise ResultsError("plot: no sensor to plot; name a joint coordinate, or add tables [sensors.NAME]")
    return pages_of(panels, title=title)


def plot_bars(measurements: Sequence[Measurement], *, title: str = "") -> "Figure":
    """Return a figure with the last values of all columns as bars, a panel for each unit.

    Columns that are zero are left out, unless all of their unit are zero; so are the smallest beyond `MOST_BARS`.

    Raises
    ------
    ResultsError
        If there is nothing to plot.
    """
    from matplotlib.figure import Figure

    bars: dict[str, dict[str, float]] = {}
    for each in measurements:
        for name, values in each.quantities.items():
            label = each.sensor if len(each.quantities) == 1 else each.channel(name)
            bars.setdefault(each.units[name], {})[label] = float(values[-1])
    if not bars:
        raise ResultsError("plot: no sensor to plot; name a joint coordinate, or add tables [sensors.NAME]")
    shown = {unit: largest_bars(values) for unit, values in bars.items()}
    heights = [0.28 * len(values) + 1.0 for values in shown.values()]
    figure = Figure(figsize=(7, sum(heights) + 0.4), layout="constrained")
    figure.suptitle(title)
    axes = figure.subplots(len(shown), 1, squeeze=False, height_ratios=heights).ravel()
    for ax, (unit, drawn) in zip(axes, shown.items(), strict=True):
        patches = ax.barh(list(drawn), list(drawn.values()), color="C0")
        ax.bar_label(patches, [f"{value:.4g}" for value in drawn.values()], padding=3, fontsize="small")
        ax.margins(x=0.15)
        ax.invert_yaxis()
        ax.axvline(0.0, color="k", linewidth=0.8)
        left_out = len(bars[unit]) - len(drawn)
        ax.set_xlabel(f"[{unit}]" + (f", {left_out} smaller left out" if left_out else ""))
        ax.grid(axis="x", alpha=0.3)
    return figure


def largest_bars(values: Mapping[str, float]) -> dict[str, float]:
    """Return the largest values, in their order, without rounding errors; the first one if all are zero."""
    size = max(map(abs, values.values()))
    ranked = sorted(values, key=lambda name: -abs(values[name]))[:MOST_BARS]
    kept = [name for name in values if name in ranked and abs(values[name]) > ROUNDING * size]
    return {name: values[name] for name in kept or list(values)[:1]}


def pages_of(panels: "Sequence[Callable[[Axes], Axes]]", *, title: str = "") -> list["Figure"]:
    """Return figures of at most eight panels each, in two columns; each panel is a function that draws into its axes.

    The titles of several pages end in "page 1 of 3".
    """
    from matplotlib.figure import Figure

    pages = [panels[first : first + MOST_PANELS] for first in range(0, len(panels), MOST_PANELS)]
    figures = []
    for number, page in enumerate(pages, start=1):
        n_columns = 1 if len(panels) == 1 else 2
        n_rows = (len(page) + n_columns - 1) // n_columns
        figure = Figure(figsize=(6.5 * n_columns, 3.4 * n_rows + 0.6))
        words = [title, f"page {number} of {len(pages)}" if len(pages) > 1 else ""]
        if any(words):
            figure.suptitle(", ".join(word for word in words if word))
        figure.subplots_adjust(**likely_places(figure, n_rows, n_columns))
        axes = figure.subplots(n_rows, n_columns, squeeze=False).ravel()
        for panel, ax in zip(page, axes, strict=False):
            panel(ax)
        for ax in axes[len(page) :]:
            ax.remove()
        free_legends(figure)
        figure.set_layout_engine("constrained")
        figures.append(figure)
    return figures


def likely_places(figure: "Figure", n_rows: int, n_columns: int) -> dict[str, float]:
    """Return the places of panels that leave as much room for labels as the layout will, within a tenth.

    The layout itself takes as long as the drawing of a page.
    """
    width, height = figure.get_size_inches()
    left, right, below, above, title = 0.75, 0.1, 0.45, 0.2, 0.35  # [in]
    across = (width - n_columns * (left + right)) / n_columns
    high = (height - title - n_rows * (below + above)) / n_rows
    return {
        "left": left / width, "right": 1 - right / width, "wspace": (left + right) / across,
        "bottom": below / height, "top": 1 - (above + title) / height, "hspace": (below + above) / high,
    }  # fmt: skip


def free_legends(figure: "Figure") -> None:
    """Make room above the curves for those legends that cover a curve, on linear axes."""
    for ax in figure.axes:
        legend = ax.get_legend()
        if legend is None or ax.get_yscale() != "linear":
            continue
        bottom, top = ax.get_ylim()  # this scales the axes to their curves, which the next lines need
        box = legend.get_window_extent().expanded(LIKELY, LIKELY)
        if any(box.count_contains(line.get_transform().transform(line.get_xydata())) for line in ax.get_lines()):
            share = min(box.height / ax.get_window_extent().height + LEGEND_GAP, MOST_LEGEND)
            ax.set_ylim(bottom, bottom + (top - bottom) / (1 - share))
            legend.set_loc("upper right")


def figure_of(ax: "Axes") -> "Figure":
    """Return the figure of axes; `ResultsError` if the axes have been removed from their figure."""
    figure = ax.get_figure(root=True)
    if figure is None:
        raise ResultsError("plot: the given axes belong to no figure")
    return figure


def labelled(ax: "Axes", label: str) -> "Axes":
    """Set the label of the y axis and add a legend."""
    ax.set_ylabel(label)
    if handles := ax.get_legend_handles_labels()[0]:
        ax.legend(fontsize="small", ncols=1 if len(handles) <= LONG_LEGEND else 2)
    return ax
