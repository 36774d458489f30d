"""Charts of a comparison."""

import math
from collections.abc import Callable, Sequence

import numpy as np

from cms.assessment.compare.comparison import Comparison, Point, SetResult
from cms.assessment.quality.limits import LIMITS
from cms.assessment.report.formatting import share
from cms.assessment.report.palette import FULL_MODEL, style_of
from fe_models.foundation.arrays import Array
from fe_models.foundation.documents.charts import Axis, Bars, Chart, LimitLine, Line, Matrix

__all__ = [
    "convergence_chart",
    "deformation_chart",
    "effective_mass_chart",
    "mac_chart",
    "response_chart",
    "response_error_chart",
]

FLOOR = 1e-10  #: smallest error in charts over time or frequency; smaller values are rounding
DECADES = 4  #: decades below the limit in the chart of a record; smaller values are drawn at the lower end
DIRECTIONS = ("x", "y", "z", "about x", "about y", "about z")


def convergence_chart(comparison: Comparison, name: str) -> Chart:
    """Return the chart of one record against the number of modes or coordinates: one line per set, and the limit."""
    tolerance = LIMITS[name].tolerance
    floor = 10.0 ** math.floor(math.log10(tolerance or 1.0) - DECADES)
    lines = []
    for k, result in enumerate(comparison.sets):
        known = [(p, p.record(name).value) for p in result.points if math.isfinite(p.record(name).value)]
        if not known:
            continue
        style = style_of(k)
        lines.append(
            Line(
                [p.n_modes for p, _ in known], [max(value, floor) for _, value in known], result.name, style.color,
                style.dash, symbol=style.symbol, other_x=[p.n_q for p, _ in known],
                notes=tuple(f"{p.n_modes} modes, {p.n_q} coordinates\n{value:.3g}" for p, value in known),
            )
        )  # fmt: skip
    upwards = log_axis("error [-]", [np.asarray(line.y) for line in lines], [tolerance] if tolerance else [])
    return Chart(
        Axis("vibration modes"), (upwards,), tuple(lines), 290, limits_of(tolerance), has_legend=False,
        other_label="generalised coordinates",
    )  # fmt: skip


def response_chart(comparison: Comparison) -> Chart:
    """Return the chart of one response entry: full model, and every set at its shown point."""
    full, units = comparison.full, comparison.units
    lines = [Line(full.response_hz, full.response, "full model", FULL_MODEL, width=4, opacity=0.35)]
    lines += curves(comparison, full.response_hz, lambda p: p.record("frequency-response").data["drawn"])
    label = f"displacement / force [{units.length_symbol}/{units.force_symbol}]"
    return Chart(Axis("frequency [Hz]"), (Axis(label, is_log=True),), tuple(lines), 430)


def response_error_chart(comparison: Comparison) -> Chart:
    """Return the chart of the relative error of the complete interface response over frequency."""
    lines = curves(
        comparison, comparison.full.response_hz,
        lambda p: np.maximum(p.record("frequency-response").data["error"], FLOOR),
    )  # fmt: skip
    upwards = log_axis("relative error [-]", [np.asarray(line.y) for line in lines])
    return Chart(Axis("frequency [Hz]"), (upwards,), tuple(lines))


def deformation_chart(comparison: Comparison) -> Chart:
    """Return the chart of the deformation error over time for every set at its shown point, with the force."""
    full = comparison.full
    t = full.t * 1e3
    lines = curves(comparison, t, lambda p: np.maximum(p.record("deformation-error").data["error"]["K"], FLOOR))
    tolerance = LIMITS["deformation-error"].tolerance
    largest = [float(np.max(line.y)) for line in lines] + [tolerance or 1.0]
    upwards = log_axis("deformation error \u03b5(t) [-]", [], [min(largest) / 100, max(largest)])
    hill = [] if full.force is None else [Line(t, full.force, "force / peak", "#9aa5b1", width=1, is_hill=True)]
    return Chart(Axis("time [ms]"), (upwards,), (*hill, *lines), 400, limits_of(tolerance))


def effective_mass_chart(comparison: Comparison) -> Chart:
    """Return the chart of the share of effective mass in every set with fixed interfaces, by direction."""
    bars = []
    for k, result, point in detailed_sets(comparison):
        remainder = np.asarray(point.record("effective-mass").data["remainder"], dtype=float)
        bars.append(Bars(100 * (1 - remainder), legend(result, point), style_of(k).color))
    upwards = Axis("effective mass carried [%]", range=(0.0, 105.0))
    return Chart(Axis("direction"), (upwards,), tuple(bars), 360, names=DIRECTIONS)


def mac_chart(result: SetResult, point: Point, frequencies_hz: Array) -> Chart:
    """Return the MAC matrix between free modes of the full model (rows) and those of a set (columns)."""
    mac = np.asarray(point.record("mac").data["mac"])
    n, k = mac.shape
    notes = tuple(f"{f:.5g} Hz" for f in frequencies_hz[:n])
    matrix = Matrix(mac[:, : min(k, n + 2)], "full model", result.name, notes)
    return Chart(Axis("mode of the set"), (Axis("mode of the full model"),), (matrix,), 270, has_legend=False)


# Parts ----------------------------------------------------------------------------------------------------------------


def detailed_sets(comparison: Comparison) -> list[tuple[int, SetResult, Point]]:
    """Return the sets with a shown point, with their index, which determines the line style."""
    return [(k, result, result.detail) for k, result in enumerate(comparison.sets) if result.detail is not None]


def curves(comparison: Comparison, x: Array, values: Callable[[Point], Array]) -> list[Line]:
    """Return one line for each set with a shown point."""
    return [
        Line(x, values(point), legend(result, point), style_of(k).color, style_of(k).dash)
        for k, result, point in detailed_sets(comparison)
    ]


def legend(result: SetResult, point: Point) -> str:
    """Return the legend of a set: its name and number of modes."""
    return f"{result.name}, {point.n_modes}"


def log_axis(label: str, arrays: Sequence[Array], more: Sequence[float] = ()) -> Axis:
    """Return a logarithmic error axis over whole decades that contain the values."""
    values = np.concatenate([*arrays, np.asarray(more, dtype=float)])
    positive = values[np.isfinite(values) & (values > 0)]
    low = math.floor(math.log10(positive.min(initial=math.inf) if len(positive) else 1e-3) + 1e-9)
    high = math.ceil(math.log10(positive.max(initial=0.0) if len(positive) else 1.0) - 1e-9)
    return Axis(label, is_log=True, range=(10 ** (low - 0.15), 10 ** (max(high, low + 1) + 0.1)))


def limits_of(tolerance: float | None) -> tuple[LimitLine, ...]:
    """Return the line for a limit, with its text."""
    return (LimitLine(tolerance, f"limit {share(tolerance)}"),) if tolerance else ()
