"""Pictures of an optimisation: the objective, and the parameters within their bounds, over the evaluations."""

from typing import TYPE_CHECKING

import numpy as np

from floatframe.design.optimization.optimize import PERMITTED, OptimizationResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["plot_history", "plot_objective", "plot_parameters"]


def plot_history(result: OptimizationResult) -> "Figure":
    """Return a figure with the objective above and the parameters below."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.5, 6.5), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True)
    plot_objective(result, upper)
    plot_parameters(result, lower)
    upper.set_xlabel("")
    return figure


def plot_objective(result: OptimizationResult, ax: "Axes") -> "Axes":
    """Draw F of all evaluations and its minimum so far; hollow: limits are violated, cross at the bottom: failed."""
    rows = result.history
    number = np.arange(1, len(rows) + 1)
    F = np.array([row.objective for row in rows])
    is_failed = np.array([bool(row.evaluation.error) for row in rows])
    is_kept = np.array([row.violation <= PERMITTED for row in rows])
    best = np.minimum.accumulate(np.where(is_kept, F, np.inf))
    ax.plot(number[is_kept], F[is_kept], ".", color="C0", markersize=5, label="evaluation")
    broken = ~is_kept & ~is_failed
    if broken.any():
        ax.plot(number[broken], F[broken], "o", color="C1", markersize=4, fillstyle="none", label="breaks a limit")
    if is_failed.any():
        ax.plot(number[is_failed], np.full(is_failed.sum(), 0.02), "x", color="#b22222", clip_on=False,
                transform=ax.get_xaxis_transform(), label="no result")  # fmt: skip
    seen = np.isfinite(best)
    ax.step(number[seen], best[seen], where="post", color="black", linewidth=1.2, label="best so far")
    if np.nanmin(F) > 0 and np.nanmax(F) > 50 * np.nanmin(F):
        ax.set_yscale("log")
    ax.set_ylabel("objective F")
    ax.set_xlabel("evaluation")
    ax.grid(alpha=0.3)
    ax.legend(fontsize="small")
    return ax


def plot_parameters(result: OptimizationResult, ax: "Axes") -> "Axes":
    """Draw the parameters, scaled from 0 (lower bound) to 1 (upper bound), without the points of differences."""
    rows = [(i + 1, row) for i, row in enumerate(result.history) if not row.is_difference]
    number = [i for i, _ in rows]
    is_swarm = result.design.method == "differential-evolution"
    for k, p in enumerate(result.design.parameters):
        z = [(row.evaluation.values[k] - p.lower) / (p.upper - p.lower) for _, row in rows]
        label = f"{p.name} ({p.lower:g} to {p.upper:g})"
        ax.plot(number, z, "." if is_swarm else ".-", markersize=4, linewidth=1.0, label=label)
    ax.set_ylim(-0.05, 1.05)
    ax.set_ylabel("between the bounds")
    ax.set_xlabel("evaluation")
    ax.grid(alpha=0.3)
    ax.legend(fontsize="small")
    return ax
