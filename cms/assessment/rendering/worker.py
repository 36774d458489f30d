"""The drawing process with VTK: `python -m cms.assessment.rendering.worker scene.npz out.png [fps]`.

It is a separate process, because VTK ends its process if there is no OpenGL. It prints one line per frame, which tells
`cms.assessment.rendering.render` that it is alive.
"""

import sys
from pathlib import Path

from cms.assessment.rendering.drawing import draw_animation, draw_picture
from cms.assessment.rendering.scene_file import read_scene
from cms.assessment.rendering.vtk_view import vtk_view

__all__ = ["main"]


def main(scene_path: str, out: str, fps: str = "") -> None:
    """Draw the scene in a file into another file: a film if fps is given, otherwise a picture."""
    leave_no_core_file()
    scene = read_scene(Path(scene_path))
    if fps:
        draw_animation(scene, Path(out), vtk_view, fps=float(fps), on_frame=report)
    else:
        draw_picture(scene, Path(out), vtk_view)


def leave_no_core_file() -> None:
    """Disable core files if the system has them: VTK may crash, and its memory is useless to the user."""
    try:
        import resource
    except ImportError:
        return
    resource.setrlimit(resource.RLIMIT_CORE, (0, resource.getrlimit(resource.RLIMIT_CORE)[1]))


def report(done: int, all_: int) -> None:
    """Report progress to the parent process."""
    sys.stdout.write(f"{done} {all_}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main(*sys.argv[1:])
