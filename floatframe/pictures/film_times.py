"""The selection of the rows of a motion that a film shows, and its speed."""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from floatframe.errors import ResultsError

__all__ = ["FilmTimes", "film_times", "round_below", "speed_words", "time_words"]

SHORT, LONG = 2.0, 12.0  #: range of film lengths in real time [s], outside which another speed is chosen
CHOSEN_LENGTH = 6.0  #: smallest length of a film with a chosen speed [s]
#: largest product of frames and nodes of a film, which limits the memory; longer films get fewer frames
MOST_COORDINATES = 2e7


@dataclass(frozen=True, eq=False)
class FilmTimes:
    """The output rows that a film shows, and its speed."""

    rows: IntArray  #: rows of the trajectory, one for each frame, (n_frames,)
    fps: float  #: frames per second [1/s]
    speed: float  #: seconds of motion per second of film


def film_times(t: Array, *, fps: float, speed: float | None, n_nodes: int = 0) -> FilmTimes:
    """Choose the rows that a film shows, equally spaced in time and without repetition.

    Parameters
    ----------
    t
        Output times, ascending, (n_t,) [s].
    fps
        Desired frames per second.
    speed
        Seconds of motion per second of film; None: chosen automatically.
    n_nodes
        Nodes of all bodies, which limit the number of frames.
    """
    if len(t) == 0:
        raise ResultsError("film: the trajectory has no rows")
    if not (np.isfinite(fps) and fps > 0):
        raise ResultsError(f"film: fps: expected a number above 0, got {fps}")
    if speed is not None and not (np.isfinite(speed) and speed > 0):
        raise ResultsError(f"film: speed: expected a number above 0, got {speed}")
    duration = float(t[-1] - t[0])
    if speed is None:
        speed = 1.0 if SHORT <= duration <= LONG or duration == 0 else round_below(duration / CHOSEN_LENGTH * 1.0001)
    length = duration / speed
    most = max(int(MOST_COORDINATES / max(n_nodes, 1)), 24)
    n_frames = min(max(round(length * fps), 1), len(t), most)
    wanted = t[0] + (np.arange(n_frames) + 0.5) / n_frames * duration if n_frames > 1 else t[:1]
    after = np.clip(np.searchsorted(t, wanted), 1, max(len(t) - 1, 1)) if len(t) > 1 else np.zeros(1, np.int64)
    rows = np.where(np.abs(t[after - 1] - wanted) <= np.abs(t[after] - wanted), after - 1, after)
    rows = np.unique(rows) if len(t) > 1 else np.zeros(1, np.int64)
    return FilmTimes(rows, min(max(len(rows) / length, 1.0), 120.0) if length > 0 else 1.0, speed)


def round_below(value: float) -> float:
    """Return the largest of 1, 2, 5 times a power of ten that does not exceed the value."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(m * power for m in (1, 2, 5) if m * power <= value * (1 + 1e-12)))


def speed_words(speed: float) -> str:
    """Return the speed of a film in words."""
    if speed == 1:
        return "in real time"
    return f"{1 / speed:.3g} times slower than real time" if speed < 1 else f"{speed:.3g} times faster than real time"


def time_words(t: Array) -> tuple[str, ...]:
    """Return times, (n,) [s], as text with enough decimals to be distinct."""
    step = float(np.diff(t).min()) if len(t) > 1 else 1.0
    decimals = int(np.clip(np.ceil(-np.log10(step) + 0.3), 0, 9)) if step > 0 else 3
    return tuple(f"t = {value:.{decimals}f} s" for value in t)
