"""Text and scales around a view (title, captions, colour bar, labels, axes), independent of the drawing library."""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from cms.assessment.rendering.camera import Camera
from cms.assessment.rendering.film import Image
from cms.assessment.rendering.scene import Scene, frame_of
from cms.assessment.rendering.shape import colormap
from fe_models.foundation.arrays import Array

__all__ = ["Layout", "compose", "layout_of", "paper_of"]

INK, FAINT, AXIS_COLORS = "#1f2a33", "#5b6770", ("#c8403a", "#3a9a4b", "#2f6fc4")


@dataclass(frozen=True)
class Layout:
    """Positions of the elements of a picture, in pixels."""

    size: tuple[int, int]  #: width and height of the picture
    view: tuple[int, int, int, int]  #: left, top, width and height of the view
    unit: int  #: size of the small text, with which all other sizes scale


def layout_of(scene: Scene) -> Layout:
    """Return the layout of a scene: text at the top, colour bar on the right, and the view in the remaining area."""
    width, height = scene.size
    unit = max(round(min(width / 1280, height / 800) * 19 * scene.text_scale), 9)
    top = unit
    if scene.title:
        top += round(1.9 * unit)
    top += round(1.35 * unit) * len(scene.captions)
    right = 8 * unit if scene.has_scalars else unit
    bottom = round(2.2 * unit) if scene.frame_notes else unit
    return Layout((width, height), (unit, top, width - unit - right, height - top - bottom), unit)


def paper_of(scene: Scene, layout: Layout) -> Any:
    """Return what all frames have around the view, as an image of PIL: title, captions and colour bar."""
    from PIL import Image as PilImage
    from PIL import ImageDraw

    image = PilImage.new("RGB", layout.size, scene.background)
    draw = ImageDraw.Draw(image)
    u = layout.unit
    y = u * 0.8
    if scene.title:
        draw.text((1.4 * u, y), scene.title, INK, font=font(round(1.35 * u), is_bold=True))
        y += 1.9 * u
    for caption in scene.captions:
        draw.text((1.4 * u, y), caption, FAINT, font=font(u))
        y += 1.35 * u
    if scene.has_scalars:
        draw_color_bar(draw, scene, layout)
    return image


def compose(scene: Scene, layout: Layout, camera: Camera, paper: Any, view: Image, frame: int) -> Image:
    """Return the finished picture, (height, width, 3) uint8: the view on the paper, with annotations of the frame."""
    from PIL import Image as PilImage
    from PIL import ImageDraw

    image = paper.copy()
    left, top, width, height = layout.view
    image.paste(PilImage.fromarray(view), (left, top))
    draw = ImageDraw.Draw(image)
    u = layout.unit
    if scene.frame_notes:
        middle = (left + width / 2, layout.size[1] - 1.1 * u)
        draw.text(middle, scene.frame_notes[frame], INK, anchor="mm", font=font(u))
    if scene.has_scalars:
        draw_bar_title(draw, scene, layout)
    draw_triads(draw, scene, layout, camera, frame)
    corner = (left + 2.6 * u, top + height - 2.8 * u)
    draw_axes(draw, corner, camera.axes[:2] @ np.eye(3) * 2.1 * u, camera.axes[2], u, "xyz")
    return np.asarray(image)


def bar_of(layout: Layout) -> tuple[float, float, float]:
    """Return left, top and height of the colour bar, in pixels."""
    u, (width, height) = layout.unit, layout.size
    _, top, _, view_height = layout.view
    bar_height = min(0.62 * height, view_height - 5 * u)
    return width - 6.6 * u, top + (view_height - bar_height) / 2 + u, bar_height


def draw_bar_title(draw: Any, scene: Scene, layout: Layout) -> None:
    """Draw the title of the colour bar, which may reach into the view."""
    u = layout.unit
    _, y, _ = bar_of(layout)
    title = scene.scalar_title + (f" [{scene.scalar_unit}]" if scene.scalar_unit else "")
    draw.text((layout.size[0] - 1.2 * u, y - 1.7 * u), title, INK, anchor="rm", font=font(u))


def draw_color_bar(draw: Any, scene: Scene, layout: Layout) -> None:
    """Draw the colour bar with rounded numbers beside it."""
    u, (low, high) = layout.unit, scene.color_limits
    x, y, bar_height = bar_of(layout)
    colors = (colormap() * 255).round().astype(int)
    for row in range(round(bar_height)):
        color = tuple(colors[min(int(255.999 * (1 - row / bar_height)), 255)])
        draw.line([(x, y + row), (x + 1.1 * u, y + row)], fill=color)
    for value in round_ticks(low, high):
        at = y + bar_height * (1 - (value - low) / (high - low))
        draw.line([(x + 1.1 * u, at), (x + 1.45 * u, at)], fill=FAINT, width=max(u // 14, 1))
        draw.text((x + 1.8 * u, at), f"{value:.6g}".replace("-", "\N{MINUS SIGN}"), INK, anchor="lm", font=font(u))


def round_ticks(low: float, high: float) -> Array:
    """Return 4 to 8 tick values between low and high: multiples of 1, 2 or 5 times a power of ten."""
    span = high - low
    step = 10.0 ** np.floor(np.log10(span / 4))
    step *= max((m for m in (1, 2, 5) if span / (m * step) >= 4), default=1)
    ticks = np.arange(np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9) + 1) * step
    return np.where(np.abs(ticks) < 1e-9 * step, 0.0, ticks)


def draw_triads(draw: Any, scene: Scene, layout: Layout, camera: Camera, frame: int) -> None:
    """Draw the triads of a frame, then their labels; each label moves below labels that it would cover."""
    u, offset = layout.unit, np.array(layout.view[:2], dtype=float)
    words, pad = font(round(0.9 * u)), 0.25 * u
    labels: list[tuple[float, float, str]] = []
    for triad in scene.triads:
        position, axes = frame_of(triad.position, frame, 1), frame_of(triad.axes, frame, 2)
        origin = camera.project(position)[:2] + offset
        tips = camera.project(position + triad.size * axes.T)[:, :2] + offset - origin
        draw_axes(draw, tuple(origin), tips.T, camera.axes[2] @ axes, u, "")
        x, y = origin[0] + 0.7 * u, origin[1] + 0.55 * u
        is_there = any(name == triad.label and abs(x - x0) < u and abs(y - y0) < u for x0, y0, name in labels)
        if triad.label and not is_there:  # two bodies may have interfaces of one name at one joint
            labels.append((x, y, triad.label))
    boxes: list[tuple[float, float, float, float]] = []
    for x, y, label in labels:
        left, top, right, bottom = draw.textbbox((x, y), label, font=words)
        box = (left - pad, top - pad, right + pad, bottom + pad)
        down = drop_below(box, boxes)
        box = (box[0], box[1] + down, box[2], box[3] + down)
        draw.rounded_rectangle(box, radius=0.3 * u, fill="#ffffff", outline="#c5cdd4")
        draw.text((x, y + down), label, INK, font=words)
        boxes.append(box)


def drop_below(box: tuple[float, float, float, float], drawn: list[tuple[float, float, float, float]]) -> float:
    """Return how far down a box (left, top, right, bottom) [px] must move so that it covers no drawn box."""
    down = 0.0
    for left, top, right, bottom in sorted(drawn, key=lambda other: other[1]):
        beside = box[2] < left or right < box[0]
        if not beside and box[1] + down <= bottom and top <= box[3] + down:
            down = bottom - box[1] + 1.0
    return down


def draw_axes(draw: Any, origin: Any, arms: Array, depth: Array, u: int, names: str) -> None:
    """Draw three axes whose arms in the picture are the columns of `arms`, (2, 3) [px], the farthest axis first.

    The y components of the arms point down for triads; for the corner axes, which have names, they point up.
    """
    sign = -1.0 if names else 1.0
    for k in np.argsort(-np.asarray(depth)):
        tip = (origin[0] + arms[0, k], origin[1] + sign * arms[1, k])
        draw.line([tuple(origin), tip], fill=AXIS_COLORS[k], width=max(round(0.16 * u), 2))
        if names:
            length = np.hypot(arms[0, k], arms[1, k])
            reach = 1 + 0.55 * u / max(length, 0.35 * u)
            at = (origin[0] + reach * arms[0, k], origin[1] + sign * reach * arms[1, k])
            if length > 0.35 * u:
                draw.text(at, names[k], AXIS_COLORS[k], anchor="mm", font=font(round(0.85 * u)))
    r = 0.2 * u
    draw.ellipse((origin[0] - r, origin[1] - r, origin[0] + r, origin[1] + r), fill=INK)


@lru_cache(maxsize=16)
def font(size: int, *, is_bold: bool = False) -> Any:
    """Return matplotlib's own DejaVu Sans, so that pictures look the same on every machine."""
    from importlib.util import find_spec

    from PIL import ImageFont

    name = "DejaVuSans-Bold.ttf" if is_bold else "DejaVuSans.ttf"
    where = find_spec("matplotlib")  # not imported: that takes a third of a second
    assert where is not None  # the package requires it
    return ImageFont.truetype(str(Path(str(where.origin)).parent / "mpl-data" / "fonts" / "ttf" / name), size)
