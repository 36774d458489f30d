"""Charts of a comparison as plotly figures in plain types: {"data": […], "layout": {…}}."""

import math
from typing import Any

import numpy as np

from cms.assessment.compare.comparison import Comparison, Point, SetResult
from cms.assessment.quality.limits import LIMITS
from cms.assessment.quality.record import plain
from cms.assessment.report.formatting import share
from cms.assessment.report.palette import FULL_MODEL, style_of
from fe_models.foundation.arrays import Array

__all__ = [
    "CONVERGENCE_HEIGHT",
    "MAC_HEIGHT",
    "convergence_chart",
    "deformation_chart",
    "effective_mass_chart",
    "mac_chart",
    "response_chart",
    "response_error_chart",
]

FLOOR = 1e-10  #: smallest error drawn over time or frequency; smaller values are rounding
DECADES = 4  #: decades below its limit that the chart of a record shows; smaller values are drawn at its lower end
DIRECTIONS = ("x", "y", "z", "about x", "about y", "about z")
INK, GRID = "#3d4650", "#e3e7eb"

MAC_HEIGHT, CONVERGENCE_HEIGHT = 270, 290  #: height of a chart and of its frame [px]

Chart = dict[str, Any]


def convergence_chart(comparison: Comparison, name: str) -> Chart:
    """Return the value of one record against the number of modes (or coordinates), one line per set, with its limit."""
    tolerance = LIMITS[name].tolerance
    floor = 10.0 ** math.floor(math.log10(tolerance or 1.0) - DECADES)
    traces: list[Chart] = []
    for k, result in enumerate(comparison.sets):
        known = [(p, p.record(name).value) for p in result.points if math.isfinite(p.record(name).value)]
        if not known:
            continue
        style = style_of(k)
        traces.append(
            {
                "type": "scatter", "mode": "lines+markers", "name": result.name,
                "x": [p.n_modes for p, _ in known], "y": [max(value, floor) for _, value in known],
                "customdata": [[p.n_modes, p.n_q, value] for p, value in known],
                "hovertemplate": f"{result.name}<br>%{{customdata[0]}} modes, %{{customdata[1]}} coordinates"
                                 "<br>%{customdata[2]:.3g}<extra></extra>",
                "line": {"color": style.color, "width": 2, "dash": style.dash},
                "marker": {"symbol": style.symbol, "size": 7, "color": style.color},
            }
        )  # fmt: skip
    layout = base_layout("vibration modes", "error [-]")
    layout |= {"height": CONVERGENCE_HEIGHT, "showlegend": False}
    layout["yaxis"] |= log_axis([y for trace in traces for y in trace["y"]] + ([tolerance] if tolerance else []))
    layout["xaxis"]["rangemode"] = "tozero"
    if tolerance:
        layout |= limit_line(tolerance)
    return {"data": traces, "layout": layout}


def response_chart(comparison: Comparison) -> Chart:
    """Return the magnitude of the drawn response entry: full model, and every set at its shown point."""
    full, units = comparison.full, comparison.units
    traces = [
        line(full.response_hz, full.response, "full model", FULL_MODEL, width=4, opacity=0.35, hover="%{y:.3g}"),
        *[
            line(full.response_hz, point.record("frequency-response").data["drawn"], legend(result, point),
                 style_of(k).color, dash=style_of(k).dash, hover="%{y:.3g}")
            for k, result, point in detailed_sets(comparison)
        ],
    ]  # fmt: skip
    layout = base_layout("frequency [Hz]", f"displacement / force [{units.length_symbol}/{units.force_symbol}]")
    layout["yaxis"] |= {"type": "log", "exponentformat": "power", "dtick": 1}
    layout["xaxis"] |= {"exponentformat": "none"}
    layout["height"] = 430
    return {"data": traces, "layout": layout}


def response_error_chart(comparison: Comparison) -> Chart:
    """Return the relative error of the complete response matrix of the interfaces at every frequency."""
    traces = [
        line(comparison.full.response_hz, np.maximum(point.record("frequency-response").data["error"], FLOOR),
             legend(result, point), style_of(k).color, dash=style_of(k).dash, hover="%{y:.2g}")
        for k, result, point in detailed_sets(comparison)
    ]  # fmt: skip
    layout = base_layout("frequency [Hz]", "relative error [-]")
    layout["xaxis"] |= {"exponentformat": "none"}
    layout["yaxis"] |= log_axis([y for trace in traces for y in trace["y"]])
    return {"data": traces, "layout": layout}


def deformation_chart(comparison: Comparison, norm: str = "K") -> Chart:
    """Return the deformation error over time of every set at its shown point, and the exciting force."""
    full = comparison.full
    force: Chart = {
        "type": "scatter", "mode": "lines", "name": "force / peak", "x": plain(full.t * 1e3), "y": plain(full.force),
        "yaxis": "y2", "line": {"color": "#9aa5b1", "width": 1}, "fill": "tozeroy",
        "fillcolor": "rgba(154,165,177,.18)", "hovertemplate": "%{y:.2f}",
    }  # fmt: skip
    traces = [
        line(full.t * 1e3, np.maximum(point.record("deformation-error").data["error"][norm], FLOOR),
             legend(result, point), style_of(k).color, dash=style_of(k).dash, hover="%{y:.2g}")
        for k, result, point in detailed_sets(comparison)
    ]  # fmt: skip
    tolerance = LIMITS["deformation-error"].tolerance
    layout = base_layout("time [ms]", "deformation error \u03b5(t) [-]")
    largest = [max(trace["y"]) for trace in traces] + [tolerance or 1.0]
    layout["yaxis"] |= log_axis([min(largest) / 100, max(largest)])
    if full.force is not None:
        traces.insert(0, force)
    layout["yaxis2"] = {
        "overlaying": "y", "side": "right", "range": [0, 4], "showgrid": False, "showticklabels": False,
        "zeroline": False, "fixedrange": True,
    }  # fmt: skip
    layout["height"] = 400
    if tolerance:
        layout |= limit_line(tolerance)
    return {"data": traces, "layout": layout}


def effective_mass_chart(comparison: Comparison) -> Chart:
    """Return the share of effective mass in every set with its interfaces held, by direction."""
    traces = []
    for k, result, point in detailed_sets(comparison):
        remainder = np.asarray(point.record("effective-mass").data["remainder"], dtype=float)
        traces.append(
            {
                "type": "bar", "name": legend(result, point), "x": list(DIRECTIONS), "y": plain(100 * (1 - remainder)),
                "marker": {"color": style_of(k).color, "pattern": {"shape": PATTERNS[k % len(PATTERNS)], "size": 5,
                                                                    "fgcolor": "white", "fillmode": "overlay"}},
                "hovertemplate": f"{result.name}<br>%{{x}}: %{{y:.1f}} %<extra></extra>",
            }
        )  # fmt: skip
    layout = base_layout("direction", "effective mass carried [%]")
    layout |= {"barmode": "group", "bargap": 0.25, "height": 360}
    layout["yaxis"] |= {"range": [0, 105]}
    layout["xaxis"] |= {"showgrid": False}
    return {"data": traces, "layout": layout}


PATTERNS = ("", "/", "\\", "x", ".", "-", "|", "+")


def mac_chart(result: SetResult, point: Point, frequencies_hz: Array) -> Chart:
    """Return the MAC of the free modes of the full model (down) and those of a set (across)."""
    mac = np.asarray(point.record("mac").data["mac"])
    n, k = mac.shape
    k = min(k, n + 2)
    trace: Chart = {
        "type": "heatmap", "z": plain(mac[:, :k]), "x": list(range(1, k + 1)), "y": list(range(1, n + 1)),
        "zmin": 0, "zmax": 1, "colorscale": [[0, "#f7fafc"], [0.5, "#6ea3cf"], [1, "#08306b"]], "showscale": False,
        "xgap": 1, "ygap": 1,
        "customdata": [[f"{f:.5g}" for _ in range(k)] for f in frequencies_hz[:n]],
        "hovertemplate": "full model %{y} (%{customdata} Hz)<br>set %{x}<br>MAC %{z:.4f}<extra></extra>",
    }  # fmt: skip
    layout = base_layout("mode of the set", "mode of the full model")
    layout["xaxis"] |= {"tick0": 1, "dtick": dtick(k), "showgrid": False, "constrain": "domain"}
    layout["yaxis"] |= {
        "autorange": "reversed", "tick0": 1, "dtick": dtick(n), "showgrid": False, "scaleanchor": "x",
        "constrain": "domain",
    }  # fmt: skip
    layout |= {"height": MAC_HEIGHT, "showlegend": False, "margin": {"l": 50, "r": 10, "t": 8, "b": 44}}
    return {"data": [trace], "layout": layout}


def dtick(n: int) -> int:
    """Return the step of the tick labels on an axis of n modes."""
    return 1 if n <= 10 else 2 if n <= 20 else 5


# Parts ----------------------------------------------------------------------------------------------------------------


def detailed_sets(comparison: Comparison) -> list[tuple[int, SetResult, Point]]:
    """Return the sets with a shown point, with their index (which gives the style)."""
    return [(k, result, result.detail) for k, result in enumerate(comparison.sets) if result.detail is not None]


def legend(result: SetResult, point: Point) -> str:
    """Return the name of a set and its number of modes."""
    return f"{result.name}, {point.n_modes}"


def line(
    x: Array, y: Array, name: str, color: str, *, dash: str = "solid", width: float = 2, opacity: float = 1.0,
    hover: str,
) -> Chart:  # fmt: skip
    """Return a line."""
    return {
        "type": "scatter", "mode": "lines", "name": name, "x": plain(np.asarray(x)), "y": plain(np.asarray(y)),
        "line": {"color": color, "width": width, "dash": dash}, "opacity": opacity, "hovertemplate": hover,
    }  # fmt: skip


def base_layout(x: str, y: str) -> Chart:
    """Return the layout that all charts share."""
    axis = {
        "gridcolor": GRID, "linecolor": "#9aa5b1", "ticks": "outside", "tickcolor": "#9aa5b1", "zeroline": False,
        "automargin": True, "showline": True, "tickfont": {"size": 11.5},
    }  # fmt: skip
    return {
        "height": 330, "margin": {"l": 62, "r": 14, "t": 12, "b": 48},
        "paper_bgcolor": "white", "plot_bgcolor": "white",
        "font": {"family": "Inter, 'Segoe UI', system-ui, -apple-system, 'Helvetica Neue', Arial, sans-serif",
                 "size": 12.5, "color": INK},
        "xaxis": {**axis, "title": {"text": x, "standoff": 8}},
        "yaxis": {**axis, "title": {"text": y, "standoff": 8}},
        "legend": {"orientation": "h", "y": 1.02, "yanchor": "bottom", "x": 0, "font": {"size": 12}},
        "hoverlabel": {"bgcolor": "white", "bordercolor": "#9aa5b1", "font": {"color": INK}},
        "hovermode": "closest",
    }  # fmt: skip


def log_axis(values: list[float]) -> Chart:
    """Return a logarithmic axis of errors over whole decades that contain the values."""
    positive = [value for value in values if value and value > 0]
    low = math.floor(math.log10(min(positive, default=1e-3)) + 1e-9)
    high = math.ceil(math.log10(max(positive, default=1.0)) - 1e-9)
    high = max(high, low + 1)
    return {
        "type": "log", "range": [low - 0.15, high + 0.1], "exponentformat": "power",
        "dtick": 1 if high - low <= 7 else 2,
    }  # fmt: skip


def limit_line(tolerance: float) -> Chart:
    """Return the line of a limit and its label."""
    return {
        "shapes": [
            {"type": "line", "xref": "paper", "x0": 0, "x1": 1, "y0": tolerance, "y1": tolerance,
             "line": {"color": "#5b6770", "width": 1.5, "dash": "dash"}, "layer": "below"}
        ],
        "annotations": [
            {"xref": "paper", "x": 1, "xanchor": "right", "y": math.log10(tolerance), "yanchor": "bottom",
             "text": f"limit {share(tolerance)}", "showarrow": False,
             "bgcolor": "rgba(255,255,255,.75)", "borderpad": 1, "font": {"size": 11, "color": "#5b6770"}}
        ],
    }  # fmt: skip
