"""Charts of documents in plain data: lines, bars and matrices over axes, one panel below the other.

A page draws them by `data/chart.js`, a PDF by matplotlib (`pdf.py`).
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fe_models.foundation.arrays import Array

__all__ = ["INK", "Axis", "Bars", "Chart", "LimitLine", "Line", "Matrix", "chart_record", "thinned"]

INK = "#1b1f24"  #: text colour, which is inverted on a dark page
DIGITS = 6  #: number of digits of a number in a page


@dataclass(frozen=True, eq=False)
class Line:
    """Line in a chart; non-finite points are gaps."""

    x: ArrayLike
    y: ArrayLike
    name: str = ""
    color: str = INK
    dash: str = "solid"  #: solid, dash, dot, dashdot, longdash or longdashdot
    width: float = 2.0
    opacity: float = 1.0
    symbol: str = ""  #: circle, square, diamond, triangle-up, triangle-down, cross, x or star; empty: no markers
    is_step: bool = False  #: whether the value is constant from each point to the next
    is_hill: bool = False  #: whether the line is a filled background, a quarter of the height, without an axis
    panel: int = 0
    other_x: ArrayLike | None = None  #: horizontal positions after the page is switched to another axis
    notes: tuple[str, ...] = ()  #: tooltip of each point; empty: x and y


@dataclass(frozen=True, eq=False)
class Bars:
    """A group of bars, one for each name of the chart."""

    values: ArrayLike
    name: str
    color: str


@dataclass(frozen=True, eq=False)
class Matrix:
    """Matrix of numbers from 0 (light) to 1 (dark) as cells; rows start at the top, both indices at 1."""

    values: Array
    row: str  #: meaning of a row
    column: str
    notes: tuple[str, ...] = ()  #: additional tooltip of each row


@dataclass(frozen=True)
class Axis:
    """Axis with its label; without a range it fits the data."""

    label: str = ""
    is_log: bool = False
    range: tuple[float, float] | None = None


@dataclass(frozen=True)
class LimitLine:
    """Horizontal line with a text, or a band from `low` to `value` of a panel."""

    value: float
    label: str = ""
    low: float | None = None
    panel: int = 0


@dataclass(frozen=True, eq=False)
class Chart:
    """A chart: its axes, and the items that are drawn over them.

    Parameters
    ----------
    x
        Horizontal axis.
    panels
        Vertical axes, from the top panel to the last.
    items
        Lines of all panels, or bars, or one matrix.
    height
        Height on a page [px].
    limits
        Limit lines and bands.
    names
        Names of the groups of bars.
    has_legend
        Whether a legend lists the names of the items.
    """

    x: Axis
    panels: tuple[Axis, ...]
    items: tuple[Line | Bars | Matrix, ...]
    height: int = 330
    limits: tuple[LimitLine, ...] = ()
    names: tuple[str, ...] = ()
    has_legend: bool = True
    other_label: str = ""  #: label of the horizontal axis after the page is switched


def thinned(line: Line, most: int = 1500) -> Line:
    """Return a line with at most this number of points, including the largest and smallest values."""
    x, y = np.asarray(line.x, dtype=float), np.asarray(line.y, dtype=float)
    if len(x) <= most:
        return line
    parts = [part[np.isfinite(y[part])] for part in np.array_split(np.arange(len(x)), most // 2)]
    ends = [[part[y[part].argmin()], part[y[part].argmax()]] for part in parts if len(part)]
    keep = np.unique(np.concatenate([np.zeros(0, dtype=int), *ends]).astype(int))
    return replace(line, x=x[keep], y=y[keep])


def chart_record(chart: Chart) -> dict[str, Any]:
    """Return a chart in plain types, for the script that draws it."""
    return {
        "x": axis_record(chart.x),
        "panels": [axis_record(axis) for axis in chart.panels],
        "height": chart.height,
        "names": list(chart.names),
        "has_legend": chart.has_legend,
        "other_label": chart.other_label,
        "limits": [vars(limit) for limit in chart.limits],
        "items": [item_record(item) for item in chart.items],
    }


def axis_record(axis: Axis) -> dict[str, Any]:
    """Return an axis in plain types."""
    return {"label": axis.label, "is_log": axis.is_log, "range": None if axis.range is None else list(axis.range)}


def item_record(item: Line | Bars | Matrix) -> dict[str, Any]:
    """Return a chart item in plain types."""
    if isinstance(item, Bars):
        return {"kind": "bars", "values": plain(item.values), "name": item.name, "color": item.color}
    if isinstance(item, Matrix):
        return {"kind": "matrix", **vars(item), "values": [plain(row) for row in np.asarray(item.values)]}
    record: dict[str, Any] = {"kind": "line", **vars(item), "x": plain(item.x), "y": plain(item.y)}
    record["other_x"] = None if item.other_x is None else plain(item.other_x)
    return record


def plain(values: ArrayLike) -> list[float | int | None]:
    """Return numbers with few digits; None for non-finite numbers."""
    return [shortest(float(value)) if math.isfinite(value) else None for value in np.asarray(values, dtype=float)]


def shortest(value: float) -> float | int:
    """Return a number with `DIGITS` digits, as an integer if it is one."""
    short = float(f"{value:.{DIGITS}g}")
    return int(short) if short.is_integer() and abs(short) < 1e15 else short
