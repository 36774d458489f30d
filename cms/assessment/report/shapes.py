"""Mode shapes for the report: data for the interactive viewer, and still pictures for printing."""

import base64
import json
import logging
import tempfile
from pathlib import Path

import numpy as np

from cms.assessment.compare.comparison import Comparison, Drawing
from cms.assessment.rendering import Lines, RenderError, Scene, Surface, render_picture
from cms.assessment.rendering.shape import colormap
from cms.assessment.report.view import view_axes
from fe_models.foundation.arrays import Array

__all__ = ["shapes_json", "still_pictures"]

log = logging.getLogger(__name__)

SCALE = 0.09  #: largest displacement in a still picture divided by the diagonal of the body
SIZE = (900, 560)  #: width and height of a still picture [px]


def shapes_json(drawing: Drawing) -> str:
    """Return the viewer data in base64: positions as 32-bit numbers, shapes as 16-bit fractions of their largest."""
    direction, up = view_axes(drawing.nodes)
    return json.dumps(
        {
            "nodes": encoded(drawing.nodes.astype("<f4")),
            "triangles": encoded(drawing.triangles.astype("<u4")),
            "lines": encoded(drawing.lines.astype("<u4")),
            "shapes": [encoded(np.rint(32767 * shape).astype("<i2")) for shape in drawing.shapes],
            "colors": encoded(np.rint(255 * colormap()).astype("u1")),
            "box": [drawing.nodes.min(axis=0).tolist(), drawing.nodes.max(axis=0).tolist()],
            "direction": direction.tolist(),
            "up": up.tolist(),
        }
    )


def encoded(values: np.ndarray) -> str:
    """Return the bytes of an array in base64."""
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode()


def still_pictures(comparison: Comparison, modes: int) -> list[tuple[str, bytes]]:
    """Return the first modes as pictures, (title, PNG); fewer if some cannot be drawn."""
    pictures: list[tuple[str, bytes]] = []
    with tempfile.TemporaryDirectory(prefix="report-") as folder:
        for k in range(min(modes, len(comparison.drawing.shapes))):
            title = f"mode {k + 1}, {comparison.full.frequencies_hz[k]:.5g} Hz"
            path = Path(folder) / f"mode{k + 1}.png"
            try:
                render_picture(mode_scene(comparison.drawing, k, f"{comparison.name}: free {title}"), path)
            except RenderError as error:
                log.warning("the report goes without still pictures: %s", error)
                return pictures
            pictures.append((title, path.read_bytes()))
    return pictures


def mode_scene(drawing: Drawing, k: int, title: str) -> Scene:
    """Return the scene of a free mode: deformed body coloured by displacement, in front of the undeformed body."""
    shape = drawing.shapes[k]
    diagonal = float(np.linalg.norm(np.ptp(drawing.nodes, axis=0)))
    moved = drawing.nodes + SCALE * diagonal * shape
    direction, up = view_axes(drawing.nodes)
    size: Array = np.linalg.norm(shape, axis=1)
    surfaces = (
        Surface(drawing.triangles, moved, scalars=size),
        Surface(drawing.triangles, drawing.nodes, color="#8a99a8", opacity=0.1),
    )
    lines = (
        Lines(drawing.lines, drawing.nodes, color="#b8c4d0", width=1.5),
        Lines(drawing.lines, moved, color="#0072B2", width=4.0),
    )
    return Scene(
        surfaces=surfaces if len(drawing.triangles) else (),
        lines=() if len(drawing.triangles) else lines,
        title=title,
        scalar_title="displacement / largest" if len(drawing.triangles) else "",
        scalar_range=(0.0, 1.0) if len(drawing.triangles) else None,
        direction=direction,
        up=up,
        size=SIZE,
    )
