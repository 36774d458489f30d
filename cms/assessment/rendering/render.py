"""Drawing of scenes to files by VTK in a separate process or, if that fails, by matplotlib, with a note."""

import logging
import os
import queue
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cms
from cms.assessment.rendering.drawing import OnFrame, draw_animation, draw_picture
from cms.assessment.rendering.errors import RenderError, SceneError
from cms.assessment.rendering.film import FILM_SUFFIXES, PICTURE_SUFFIXES, require_suffix
from cms.assessment.rendering.scene import Scene
from cms.assessment.rendering.scene_file import write_scene
from fe_models.foundation.paths import is_stream
from fe_models.foundation.presentation import presented

__all__ = ["Drawing", "render_animation", "render_picture"]

log = logging.getLogger(__name__)

# -P: files in the user's folder must not shadow modules
WORKER = (sys.executable, "-P", "-m", "cms.assessment.rendering.worker")
SILENCE = 120.0  #: time without a new frame after which the worker is considered dead [s]


@presented
@dataclass(frozen=True)
class Drawing:
    """Picture or film in a file, and the library that drew it."""

    path: Path
    backend: str  #: "vtk" or "matplotlib"
    note: str = ""  #: reason why VTK was not used; empty if it was used


def render_picture(scene: Scene, path: str | Path) -> Drawing:
    """Draw the first frame of a scene into a PNG file.

    Raises
    ------
    SceneError
        If the path does not end in .png.
    RenderError
        If the file cannot be written.
    """
    target = Path(path)
    require_suffix(target, PICTURE_SUFFIXES)

    def fallback(out: Path) -> None:
        from cms.assessment.rendering.matplotlib_view import matplotlib_view

        draw_picture(scene, out, matplotlib_view)

    return drawn(scene, target, (), fallback, nothing)


def render_animation(scene: Scene, path: str | Path, *, fps: float = 25.0, on_frame: OnFrame | None = None) -> Drawing:
    """Draw all frames of a scene into a film file.

    Parameters
    ----------
    path
        Name of the file; ends in .gif or .mp4.
    fps
        Frames per second; a GIF uses the nearest possible rate (whole hundredths of a second per frame).
    on_frame
        Callback that receives the number of drawn frames and of all frames, for a progress bar.

    Raises
    ------
    SceneError
        If the path has another suffix, or fps is not between 1 and 120.
    RenderError
        If the file cannot be written.
    """
    target, tell = Path(path), on_frame or nothing
    require_suffix(target, FILM_SUFFIXES)
    if not 1 <= fps <= 120:
        raise SceneError(f"render_animation: fps: expected 1 to 120 frames a second, got {fps}")

    def fallback(out: Path) -> None:
        from cms.assessment.rendering.matplotlib_view import matplotlib_view

        draw_animation(scene, out, matplotlib_view, fps=fps, on_frame=tell)

    return drawn(scene, target, (repr(float(fps)),), fallback, tell)


def drawn(
    scene: Scene, target: Path, options: tuple[str, ...], fallback: Callable[[Path], None], tell: OnFrame
) -> Drawing:
    """Draw to a temporary file next to the target, and rename it, so that the target is always complete."""
    if is_stream(target):
        raise RenderError(f"{target}: this is a device or a pipe; expected the name of a file")
    try:
        with tempfile.TemporaryDirectory(prefix=".drawing-", dir=target.parent) as folder:
            out = Path(folder) / target.name
            reason = run_worker(scene, Path(folder) / "scene.npz", out, options, tell)
            if reason:
                log.warning("%s: VTK could not draw it (%s); drawn with matplotlib instead", target, reason)
                fallback(out)
            os.replace(out, target)
    except OSError as error:
        raise RenderError(
            f"{target}: cannot be written ({error.strerror or error}); check the folder and its space"
        ) from error
    note = f"drawn with matplotlib, since VTK could not ({reason})" if reason else ""
    return Drawing(target, "matplotlib" if reason else "vtk", note)


def run_worker(scene: Scene, scene_path: Path, out: Path, options: tuple[str, ...], tell: OnFrame) -> str:
    """Draw in a separate process; return "" on success, or the reason for the failure."""
    write_scene(scene, scene_path)
    search = os.pathsep.join([str(Path(cms.__file__).parents[1]), *filter(None, [os.environ.get("PYTHONPATH")])])
    with (scene_path.parent / "errors.txt").open("w+b") as errors:
        try:
            worker = subprocess.Popen(
                [*WORKER, str(scene_path), str(out), *options], stdout=subprocess.PIPE, stderr=errors,
                stdin=subprocess.DEVNULL, env=os.environ | {"PYTHONPATH": search}, text=True,
            )  # fmt: skip
        except OSError as error:
            return f"its process could not start: {error}"
        try:
            is_silent = follow(worker, tell)
        finally:
            worker.kill()  # no effect if the worker has ended; an interrupted caller leaves no process behind
            code = worker.wait()
            if worker.stdout is not None:
                worker.stdout.close()
        errors.seek(0)
        said = errors.read().decode(errors="replace")
    if is_silent:
        return f"no frame within {SILENCE:g} s"
    if code == 0 and out.is_file():
        return ""
    log.debug("the drawing process said:\n%s", said)
    return ending(code, said)


def follow(worker: subprocess.Popen[str], tell: OnFrame) -> bool:
    """Report the worker's progress until it ends; return True if it stopped responding."""
    lines: queue.Queue[str] = queue.Queue()

    def listen() -> None:
        assert worker.stdout is not None  # the pipe was opened with the process
        for line in worker.stdout:
            lines.put(line)
        lines.put("")

    threading.Thread(target=listen, daemon=True).start()
    while True:
        try:
            line = lines.get(timeout=SILENCE)
        except queue.Empty:
            return True
        if not line:
            break
        words = line.split()
        if len(words) == 2 and all(word.isdigit() for word in words):
            tell(int(words[0]), int(words[1]))
    try:
        worker.wait(timeout=SILENCE)
    except subprocess.TimeoutExpired:
        return True
    return False


def ending(code: int, said: str) -> str:
    """Describe how a process ended: by a signal, or with its last line of output."""
    if code < 0:
        name = signal.Signals(-code).name if -code in signal.Signals._value2member_map_ else str(-code)
        return f"its process died of {name}, most likely there is no OpenGL here"
    lines = [line.strip() for line in said.splitlines() if line.strip()]
    return lines[-1][:200] if lines else f"its process ended with code {code}"


def nothing(done: int, all_: int) -> None:
    """Ignore progress."""
