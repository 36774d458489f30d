"""Figures of a laboratory study for publications: error over coordinates, error over cost."""

from typing import TYPE_CHECKING

import numpy as np

from floatframe.design.laboratory.laboratory import LaboratoryResult
from floatframe.errors import ResultsError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["FLOOR", "convergence_figure"]

COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000", "#999999")
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")
FLOOR = 1e-9  #: smallest error in figures; smaller errors are drawn at this value


def convergence_figure(result: LaboratoryResult) -> "Figure":
    """Return a figure: on the left error over modal coordinates, on the right error over processor time.

    Each description is one line over its number of modes. Cases without a motion are only in the table.

    Raises
    ------
    ResultsError
        If no case gave a motion.
    """
    from matplotlib.figure import Figure

    families = dict.fromkeys(r.case.family for r in result.cases if not r.failure)
    if not families:
        raise ResultsError(f"study: no case gave a motion; the first one: {result.cases[0].failure}")
    figure = Figure(figsize=(9.2, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    for k, family in enumerate(families):
        rows = sorted((r for r in result.cases if r.case.family == family and not r.failure), key=lambda r: r.n_q)
        error = np.maximum([r.error for r in rows], FLOOR)
        style = {"color": COLORS[k % 8], "marker": MARKERS[k // 8 % 8 if len(families) > 8 else k], "markersize": 4.5,
                 "linewidth": 1.4, "linestyle": "-" if rows[0].case.stiffening else "--"}  # fmt: skip
        left.plot([r.n_q for r in rows], error, label=rows[0].case.description, **style)
        right.plot([r.seconds for r in rows], error, **style)
    left.set(xlabel="modal coordinates", ylabel="largest error / range of the reference", yscale="log")
    right.set(xlabel="processor time of the run [s]", xlim=(0, None))
    for axes in (left, right):
        if result.settled is not None:  # below this level, the error of the reference itself dominates
            axes.axhline(max(result.settled, FLOOR), color="#666666", linewidth=0.8, linestyle=":")
        axes.grid(color="#e3e7eb", which="both", linewidth=0.6)
        for side in ("top", "right"):
            axes.spines[side].set_visible(False)
    figure.legend(loc="outside lower center", ncols=min(3, len(families)), frameon=False, fontsize=8)
    figure.suptitle(f"{result.name}, against {result.reference}", fontsize=10)
    return figure
