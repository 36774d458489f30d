"""Frames to files: PNG pictures, GIF and MP4 films."""

import logging
import subprocess
import tempfile
from collections.abc import Iterable, Sequence
from contextlib import suppress
from itertools import chain, islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cms.assessment.rendering.errors import RenderError, SceneError

__all__ = [
    "FILM_SUFFIXES",
    "PICTURE_SUFFIXES",
    "Image",
    "average_of_blocks",
    "require_suffix",
    "write_film",
    "write_picture",
]

log = logging.getLogger(__name__)

Image = NDArray[np.uint8]  #: pixels, (height, width, 3)

PICTURE_SUFFIXES = (".png",)
FILM_SUFFIXES = (".gif", ".mp4")
#: ordered dither, added before rounding to a colour: it replaces bands of colour by a fine pattern that does not change
#: between frames
DITHER = np.array([[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]]) - 7.5
CRF = 18  #: quality of H.264; smaller is better and larger
RATE = 2_000_000  #: highest rate of an H.264 film after its first second [bit/s]: ten seconds take less than 3 MB
PALETTE_FRAMES = 60  #: number of GIF frames in memory, from which the common palette is chosen


def require_suffix(path: Path, suffixes: tuple[str, ...]) -> None:
    """Raise `SceneError` unless the path ends in one of the suffixes."""
    if path.suffix.lower() not in suffixes:
        raise SceneError(f"{path}: expected a file name that ends in {' or '.join(suffixes)}")


def average_of_blocks(image: Image, n: int) -> Image:
    """Return an image averaged over blocks of n by n pixels, which smooths edges, without its opacity.

    The given one is (n height, n width, 4) uint8, the other (height, width, 3).
    """
    from PIL import Image as PilImage

    height, width = image.shape[:2]
    whole = PilImage.frombuffer("RGBX", (width, height), np.ascontiguousarray(image), "raw", "RGBX", 0, 1)
    return np.asarray(whole.reduce(n).convert("RGB"))


def write_picture(image: Image, path: Path) -> None:
    """Write a picture, (height, width, 3) uint8, as PNG."""
    from PIL import Image as PilImage

    PilImage.fromarray(image).save(path, format="PNG", optimize=True)


def write_film(frames: Iterable[Image], path: Path, *, fps: float) -> None:
    """Write frames, each (height, width, 3) uint8, as a film in the format of the suffix.

    A GIF repeats forever. Its frames last whole hundredths of a second, so its frame rate is the nearest possible one.
    """
    if path.suffix.lower() == ".gif":
        write_gif(frames, path, fps)
    else:
        write_mp4(frames, path, fps)


def write_gif(frames: Iterable[Image], path: Path, fps: float) -> None:
    """Write a GIF with one palette for all frames, so that parts at rest do not flicker, by ffmpeg or else Pillow.

    Files of ffmpeg are a quarter as large, since pixels that do not change are not repeated.
    """
    source = iter(frames)
    start = list(islice(source, PALETTE_FRAMES))
    colors = palette_of(np.stack(start[:: max(len(start) // 12, 1)]))
    hundredths = max(round(100 / fps), 2)  # viewers slow down frames shorter than 20 ms
    if ffmpeg_path(path):
        write_gif_by_ffmpeg(chain(start, source), path, 100 / hundredths, colors)
    else:
        write_gif_by_pillow(chain(start, source), path, 10 * hundredths, colors)


def write_gif_by_ffmpeg(frames: Iterable[Image], path: Path, fps: float, colors: NDArray[np.uint8]) -> None:
    """Write a GIF in these colours, (<= 255, 3)."""
    from PIL import Image as PilImage

    palette = np.zeros((256, 4), dtype=np.uint8)  # the last colour is transparent: a pixel that does not change
    palette[:-1] = np.append(colors[0], 255)
    palette[: len(colors), :3] = colors
    with tempfile.TemporaryDirectory(prefix="palette-") as folder:
        file = Path(folder) / "palette.png"
        PilImage.fromarray(palette.reshape(16, 16, 4)).save(file)
        options = ("-i", str(file), "-lavfi", "paletteuse=dither=bayer:bayer_scale=5:diff_mode=rectangle")
        run_ffmpeg(frames, path, fps, (*options, "-loop", "0"))


def write_gif_by_pillow(frames: Iterable[Image], path: Path, duration: int, colors: NDArray[np.uint8]) -> None:
    """Write a GIF in these colours, (<= 255, 3), with frames that last `duration` ms."""
    from PIL import Image as PilImage

    table = nearest_colors(colors)

    def indexed(frame: Image) -> Any:
        height, width = frame.shape[:2]
        noise = np.tile(DITHER, (height // 4 + 1, width // 4 + 1))[:height, :width, None]
        moved = np.where((frame == frame[0, 0]).all(axis=2, keepdims=True), frame, np.clip(frame + noise, 0, 255))
        cell = moved.astype(np.uint8) >> 2
        image = PilImage.fromarray(table[cell[..., 0], cell[..., 1], cell[..., 2]])
        image.putpalette(colors.tobytes())
        return image

    images = (indexed(frame) for frame in frames)
    first = next(images)
    first.save(path, "GIF", save_all=True, append_images=images, duration=duration, loop=0, optimize=False)


def palette_of(frames: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return colours, (<= 255, 3), for frames, (n, height, width, 3): the exact background, and up to 254 others.

    The background covers most pixels. It would otherwise take most of the colours, none of them exact.
    """
    from PIL import Image as PilImage

    pixels = frames[:, ::3, ::3].reshape(-1, 3)
    background = frames[0, 0, 0]
    others = pixels[np.abs(pixels.astype(int) - background).max(axis=1) > 3]
    sample = PilImage.fromarray(np.ascontiguousarray(others[None] if len(others) else pixels[None, :1]))
    chosen = sample.quantize(254, method=PilImage.Quantize.MEDIANCUT).getpalette() or []
    return np.concatenate([background[None], np.array(chosen, dtype=np.uint8).reshape(-1, 3)[:254]])


def nearest_colors(colors: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the index of the closest colour for each cell of the colour cube with 64 levels, (64, 64, 64)."""
    from scipy.spatial import KDTree

    levels = np.arange(64) * 4 + 1.5
    cells = np.stack(np.meshgrid(levels, levels, levels, indexing="ij"), axis=-1)
    table = np.asarray(KDTree(colors).query(cells.reshape(-1, 3))[1], dtype=np.uint8).reshape(64, 64, 64)
    table[tuple(colors[0] >> 2)] = 0
    return table


def write_mp4(frames: Iterable[Image], path: Path, fps: float) -> None:
    """Write an H.264 film in a form that common players and browsers can show (4:2:0, even size)."""
    if not ffmpeg_path(path):
        raise RenderError(f"{path}: no ffmpeg to write MP4 with; write a .gif instead")
    source = iter(frames)
    first = next(source)
    height, width = (n - n % 2 for n in first.shape[:2])
    options = (
        "-vcodec", "libx264", "-preset", "veryfast", "-crf", str(CRF), "-maxrate", str(RATE), "-bufsize", str(RATE),
        "-pix_fmt", "yuv420p", "-movflags", "+faststart",
    )  # fmt: skip
    run_ffmpeg((frame[:height, :width] for frame in chain([first], source)), path, fps, options)


def ffmpeg_path(path: Path) -> str:
    """Return the path of ffmpeg; "" if there is none for this film."""
    try:
        import imageio_ffmpeg

        return str(imageio_ffmpeg.get_ffmpeg_exe())
    except (ImportError, RuntimeError, OSError) as error:
        log.debug("%s: no ffmpeg: %s", path, error)
        return ""


def run_ffmpeg(frames: Iterable[Image], path: Path, fps: float, options: Sequence[str]) -> None:
    """Send frames to ffmpeg, which writes the film while the next frames are drawn.

    Raises
    ------
    RenderError
        If ffmpeg cannot write the file.
    """
    source = iter(frames)
    first = next(source)
    height, width = first.shape[:2]
    given = ("-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", repr(float(fps)), "-i", "-")
    with tempfile.TemporaryFile() as errors:
        command = [ffmpeg_path(path), "-y", "-loglevel", "error", *given, *options, str(path)]
        with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=errors) as process:
            assert process.stdin is not None  # the pipe was opened with the process
            with suppress(BrokenPipeError), process.stdin:
                for frame in chain([first], source):
                    process.stdin.write(np.ascontiguousarray(frame).data)
        if process.returncode:
            errors.seek(0)
            said = errors.read().decode(errors="replace").strip().splitlines() or ["no message"]
            raise RenderError(f"{path}: ffmpeg could not write the film: {said[-1][:200]}")
