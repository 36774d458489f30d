"""Figures of the errors of mode sets relative to the full model: over the number of coordinates and over time."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from floatframe.design.laboratory.body_study import SetError
from floatframe.design.laboratory.figures import COLORS, MARKERS
from floatframe.errors import ResultsError

__all__ = ["error_figure"]

FLOOR = 1e-6  #: smallest error in figures; smaller errors are drawn at this value


def error_figure(results: Sequence[SetError], *, n_shown: int) -> Any:
    """Return a figure (Matplotlib) of one loading: largest errors over modal coordinates, and epsilon_K over time.

    Parameters
    ----------
    results
        Results of `body_study` for one loading.
    n_shown
        Number of vibration modes of the histories on the right; for a set without this case, the nearest number.

    Raises
    ------
    ResultsError
        If no case has errors.
    """
    from matplotlib.figure import Figure

    there = [r for r in results if r.errors is not None]
    if not there:
        raise ResultsError("error figure: no case gave a motion" + (f": {results[0].failure}" if results else ""))
    figure = Figure(figsize=(11.0, 4.2), layout="constrained")
    axes = figure.subplots(1, 3, width_ratios=(1.0, 1.0, 1.6))
    for k, name in enumerate(dict.fromkeys(r.mode_set for r in there)):
        rows = sorted((r for r in there if r.mode_set == name), key=lambda r: r.n_q)
        style = {"color": COLORS[k % len(COLORS)], "linewidth": 1.3}
        for part, each in enumerate(axes[:2]):
            error = np.maximum([r.largest[part] for r in rows], FLOOR)
            each.plot([r.n_q for r in rows], error, marker=MARKERS[k % len(MARKERS)], markersize=4.5,
                      label=name if part == 0 else None, **style)  # fmt: skip
        shown = min(rows, key=lambda r: abs(r.n_modes - n_shown)).errors
        assert shown is not None
        axes[2].plot(shown.t, np.maximum(shown.energy, FLOOR), **style)
    axes[0].set(xlabel="modal coordinates", ylabel="largest $\\epsilon_M$ (displacement)", yscale="log")
    axes[1].set(xlabel="modal coordinates", ylabel="largest $\\epsilon_K$ (strain energy)", yscale="log")
    low = max(FLOOR, 1e-4)
    axes[2].set(xlabel="time [s]", ylabel=f"$\\epsilon_K(t)$ with {n_shown} modes", yscale="log", ylim=(low, 2.0))
    for each in axes:
        each.grid(color="#e3e7eb", which="major", linewidth=0.6)
        for side in ("top", "right"):
            each.spines[side].set_visible(False)
    figure.legend(loc="outside lower center", ncols=4, frameon=False, fontsize=9)
    return figure
