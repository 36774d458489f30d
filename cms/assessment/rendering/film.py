"""Frames to files: PNG pictures, GIF and MP4 films."""

from collections.abc import Iterable, Iterator
from contextlib import closing
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

Image = NDArray[np.uint8]  #: pixels, (height, width, 3)

PICTURE_SUFFIXES = (".png",)
FILM_SUFFIXES = (".gif", ".mp4")
#: ordered dither, added before rounding to a colour: it replaces bands of colour by a fine pattern that does not change
#: between frames
DITHER = np.array([[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]]) - 7.5
PALETTE_FRAMES = 60  #: number of GIF frames in memory, from which the common palette is chosen


def require_suffix(path: Path, suffixes: tuple[str, ...]) -> None:
    """Raise `SceneError` unless the path ends in one of the suffixes."""
    if path.suffix.lower() not in suffixes:
        raise SceneError(f"{path}: expected a file name that ends in {' or '.join(suffixes)}")


def average_of_blocks(image: Image, n: int) -> Image:
    """Return an image, (n height, n width, >= 3) uint8, averaged over blocks of n by n pixels, which smooths edges."""
    height, width = (size // n for size in image.shape[:2])
    blocks = image[..., :3].astype(np.uint16).reshape(height, n, width, n, 3)
    return np.asarray(blocks.sum(axis=(1, 3)) // n**2, dtype=np.uint8)


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
    """Write a GIF with one palette for all frames, so that parts at rest do not flicker."""
    from PIL import Image as PilImage

    source = iter(frames)
    start = list(islice(source, PALETTE_FRAMES))
    colors = palette_of(np.stack(start[:: max(len(start) // 12, 1)]))
    table = nearest_colors(colors)

    def indexed(frame: Image) -> Any:
        height, width = frame.shape[:2]
        noise = np.tile(DITHER, (height // 4 + 1, width // 4 + 1))[:height, :width, None]
        moved = np.where((frame == frame[0, 0]).all(axis=2, keepdims=True), frame, np.clip(frame + noise, 0, 255))
        cell = moved.astype(np.uint8) >> 2
        image = PilImage.fromarray(table[cell[..., 0], cell[..., 1], cell[..., 2]])
        image.putpalette(colors.tobytes())
        return image

    images = (indexed(frame) for frame in chain(start, source))
    duration = max(round(100 / fps), 2) * 10  # [ms]; viewers slow down frames shorter than 20 ms
    first = next(images)
    first.save(path, "GIF", save_all=True, append_images=images, duration=duration, loop=0, optimize=False)


def palette_of(frames: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return colours, (<= 256, 3), for frames, (n, height, width, 3): the exact background, and up to 255 others.

    The background covers most pixels. It would otherwise take most of the colours, none of them exact.
    """
    from PIL import Image as PilImage

    pixels = frames[:, ::3, ::3].reshape(-1, 3)
    background = frames[0, 0, 0]
    others = pixels[np.abs(pixels.astype(int) - background).max(axis=1) > 3]
    sample = PilImage.fromarray(np.ascontiguousarray(others[None] if len(others) else pixels[None, :1]))
    chosen = sample.quantize(255, method=PilImage.Quantize.MEDIANCUT).getpalette() or []
    return np.concatenate([background[None], np.array(chosen, dtype=np.uint8).reshape(-1, 3)[:255]])


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
    try:
        import imageio_ffmpeg

        imageio_ffmpeg.get_ffmpeg_exe()
    except (ImportError, RuntimeError, OSError) as error:
        raise RenderError(f"{path}: no ffmpeg to write MP4 with ({error}); write a .gif instead") from error
    source: Iterator[Image] = iter(frames)
    first = next(source)
    height, width = (n - n % 2 for n in first.shape[:2])
    writer = imageio_ffmpeg.write_frames(
        str(path), (width, height), fps=fps, codec="libx264", quality=8, pix_fmt_out="yuv420p", macro_block_size=2,
        ffmpeg_log_level="error", output_params=["-movflags", "+faststart"],
    )  # fmt: skip
    with closing(writer):
        writer.send(None)
        for frame in chain([first], source):
            writer.send(np.ascontiguousarray(frame[:height, :width]))
