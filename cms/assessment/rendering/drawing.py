"""Drawing of a scene into a file with a given view function: each frame is drawn, then written."""

from collections.abc import Callable, Iterator
from pathlib import Path

from cms.assessment.rendering.annotations import compose, layout_of, paper_of
from cms.assessment.rendering.camera import Camera, fitted_camera
from cms.assessment.rendering.film import Image, write_film, write_picture
from cms.assessment.rendering.scene import Scene

__all__ = ["OnFrame", "ViewMaker", "draw_animation", "draw_picture"]

ViewMaker = Callable[[Scene, Camera], Callable[[int], Image]]
OnFrame = Callable[[int, int], None]  #: callback that receives the number of finished frames and of all frames


def draw_picture(scene: Scene, path: Path, view_maker: ViewMaker) -> None:
    """Draw the first frame into a PNG file."""
    write_picture(next(frames_of(scene, view_maker, lambda done, all_: None)), path)


def draw_animation(scene: Scene, path: Path, view_maker: ViewMaker, *, fps: float, on_frame: OnFrame) -> None:
    """Draw all frames into a film file."""
    write_film(frames_of(scene, view_maker, on_frame), path, fps=fps)


def frames_of(scene: Scene, view_maker: ViewMaker, on_frame: OnFrame) -> Iterator[Image]:
    """Yield the finished frames, (height, width, 3) uint8."""
    layout = layout_of(scene)
    camera = fitted_camera(scene, layout.view[2:])
    paper = paper_of(scene, layout)
    draw = view_maker(scene, camera)
    for frame in range(scene.n_frames):
        yield compose(scene, layout, camera, paper, draw(frame), frame)
        on_frame(frame + 1, scene.n_frames)
