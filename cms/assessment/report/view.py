"""Pictures and films of the modes of a body on its real surface."""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from cms.assessment.rendering import Drawing, Scene, SceneError, Surface, Triad, render_animation, render_picture
from cms.assessment.rendering.drawing import OnFrame
from cms.body.reduced_body import ReducedBody, ReducedInterface
from cms.errors import BodyError
from fe_models.foundation.arrays import Array

__all__ = ["animate_mode", "mode_scene", "view_mode"]

DEFAULT_SCALE = 0.09  #: largest displacement in the picture divided by the diagonal of the body
FRAMES, FPS = 36, 24.0  #: frames per film of one period, and frames per second; the film lasts 1.5 s


def view_mode(body: ReducedBody, mode: int, path: str | Path, *, scale: float | None = None) -> Drawing:
    """Draw a mode into a PNG file: deformed surface coloured by displacement, undeformed surface, interfaces.

    Parameters
    ----------
    body
        A reduced body with a surface.
    mode
        Number of the mode, 1 to n_q, as `cms info` lists them.
    path
        The PNG file.
    scale
        Largest displacement drawn, relative to the diagonal of the body; None: 0.09.

    Raises
    ------
    BodyError
        If there is no such mode, or the body has no surface to draw.
    """
    return render_picture(mode_scene(body, mode, np.ones(1), scale=scale), path)


def animate_mode(
    body: ReducedBody, mode: int, path: str | Path, *, scale: float | None = None, on_frame: OnFrame | None = None
) -> Drawing:
    """Draw one period of a mode into a film (.gif or .mp4) that repeats without a jump.

    `on_frame` receives the number of drawn frames and of all frames; other parameters are those of `view_mode`.
    """
    phase = 2 * np.pi * np.arange(FRAMES) / FRAMES
    scene = mode_scene(body, mode, np.sin(phase), scale=scale, size=(960, 640))
    return render_animation(scene, path, fps=FPS, on_frame=on_frame)


def mode_scene(
    body: ReducedBody, mode: int, amplitudes: Array, *, scale: float | None = None, size: tuple[int, int] = (1280, 800)
) -> Scene:
    """Return the scene of a mode with one frame for each amplitude between -1 and 1, (n_frames,)."""
    where = f"mode {mode} of body {body.name!r}"
    scale = DEFAULT_SCALE if scale is None else scale
    if not 1 <= mode <= body.n_q:
        raise BodyError(f"{where}: expected a mode between 1 and {body.n_q}")
    if len(body.surface) == 0:
        raise BodyError(f"{where}: the body has no surface to draw; reduce it from a mesh")
    if not (np.isfinite(scale) and 0 < scale <= 10):
        raise SceneError(f"{where}: scale: expected a share of the body's diagonal, 0 < scale <= 10, got {scale}")
    shape = body.Phi[:, :, mode - 1]
    magnitude = np.linalg.norm(shape, axis=1)
    on_surface = np.unique(body.surface)
    largest = magnitude[on_surface].max()
    diagonal = float(np.linalg.norm(np.ptp(body.nodes[on_surface], axis=0)))
    factor = scale * diagonal / largest if largest > 0 else 0.0
    moved = body.nodes + (amplitudes[:, None, None] * factor) * shape
    share = np.abs(amplitudes)[:, None] * magnitude / (largest or 1.0)
    direction, up = view_axes(body.nodes[on_surface])
    frequency = body.frequencies[mode - 1] / body.units.time
    return Scene(
        surfaces=(
            Surface(body.surface, moved, scalars=share, name=body.name),
            Surface(body.surface, body.nodes, color="#8a99a8", opacity=0.1, name="undeformed"),
        ),
        triads=tuple(moved_triad(i, mode, factor * amplitudes, 0.05 * diagonal) for i in body.interfaces),
        title=f"{body.name}: mode {mode}, {frequency_words(frequency)}",
        captions=(
            body.labels[mode - 1],
            f"frame B: {body.frame.kind}{f' at {body.frame.at}' if body.frame.at else ''}; "
            f"largest displacement drawn at {100 * scale:.3g} % of the body's diagonal",
        ),
        scalar_title="displacement / largest",
        scalar_range=(0.0, 1.0),
        direction=direction,
        up=up,
        size=size,
    )


def moved_triad(interface: ReducedInterface, mode: int, amplitudes: Array, length: float) -> Triad:
    """Return the axes of an interface, moved and rotated by the mode, at each amplitude [units of q]."""
    motion = amplitudes[:, None] * interface.Psi[:, mode - 1]
    turned = Rotation.from_rotvec(motion[:, 3:]).as_matrix() @ interface.triad
    return Triad(interface.position + motion[:, :3], turned, length, interface.name)


def view_axes(nodes: Array) -> tuple[Array, Array]:
    """Return view direction and up direction, (3,) each, such that the two longest box sides are visible."""
    shortest, middle, longest = np.argsort(np.ptp(nodes, axis=0), kind="stable")
    axes = np.eye(3)
    towards = axes[shortest] * (1.0 if (longest, middle) in ((0, 1), (1, 2), (2, 0)) else -1.0)
    return -(towards + 0.5 * axes[middle] - 0.36 * axes[longest]), axes[middle]


def frequency_words(frequency: float) -> str:
    """Return a frequency [Hz] with its unit; a massless shape has no frequency."""
    return f"{frequency:.5g} Hz" if np.isfinite(frequency) else "static"
