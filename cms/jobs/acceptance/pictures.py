"""Pictures of an acceptance: the body with its interfaces, and sums of effective mass."""

import io

import numpy as np

from cms.assessment.quality.of_body.effective_mass import DIRECTIONS, EffectiveMass
from cms.assessment.rendering import Scene, Surface, Triad, render_picture
from cms.assessment.report.png import png_of
from cms.assessment.report.view import view_axes
from cms.body.reduced_body import ReducedBody

__all__ = ["body_picture", "mass_picture"]

SIZE = (1280, 640)  #: of the picture of a body [px]
COLORS = ("#0072B2", "#D55E00", "#009E73", "#56B4E9", "#E69F00", "#CC79A7")
DPI = 160


def body_picture(body: ReducedBody) -> bytes | None:
    """Draw the undeformed body with the axes of its interfaces (PNG); None where it has no surface."""
    if len(body.surface) == 0:
        return None
    on_surface = body.nodes[np.unique(body.surface)]
    diagonal = float(np.linalg.norm(np.ptp(on_surface, axis=0)))
    direction, up = view_axes(on_surface)
    scene = Scene(
        surfaces=(Surface(body.surface, body.nodes, color="#9fb3c8", name=body.name),),
        triads=tuple(
            Triad(interface.position[None], np.asarray(interface.triad)[None], 0.06 * diagonal, interface.name)
            for interface in body.interfaces
        ),
        title="",
        direction=direction,
        up=up,
        size=SIZE,
    )
    return png_of(lambda path: render_picture(scene, path), "the acceptance")


def mass_picture(found: EffectiveMass) -> bytes:
    """Draw the sum of effective mass over frequency, one line a direction (PNG)."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.6, 2.7), dpi=DPI, layout="constrained")
    axes = figure.add_subplot()
    frequencies, sums = np.asarray(found.frequencies), 100 * found.cumulative
    last = float(frequencies[-1]) * 1.05 if len(frequencies) else 1.0
    for k, name in enumerate(DIRECTIONS):
        if found.total[k] > 0:
            x, y = np.concatenate([[0.0], frequencies, [last]]), np.concatenate([[0.0], sums[:, k], sums[-1:, k]])
            style = "-" if k < 3 else "--"
            axes.step(x, y, where="post", color=COLORS[k], label=name, linewidth=1.5, linestyle=style)
    axes.set(xlabel="frequency with the interface held [Hz]", ylabel="sum of effective mass [%]", xlim=(0, last))
    axes.set_ylim(0, 105)
    axes.grid(color="#e3e7eb")
    axes.legend(ncols=6, frameon=False, fontsize=8, loc="lower right")
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    target = io.BytesIO()
    figure.savefig(target, format="png")
    return target.getvalue()
