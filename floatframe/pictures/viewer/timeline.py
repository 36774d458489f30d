"""Which rows of a motion a page carries."""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from floatframe.results.trajectory import Trajectory

__all__ = ["MOST_ROWS", "Timeline", "evenly", "timeline"]

MOST_ROWS = 4000  #: of a page
FASTEST = 2.6  #: rad that a body may turn from row to row, so that it is seen to turn the right way


@dataclass(frozen=True, eq=False)
class Timeline:
    """The rows."""

    rows: IntArray  #: of the trajectory, (n,)
    largest_turn: float  #: of a body from row to row [rad]

    @property
    def turns_too_far(self) -> bool:
        """Whether a body would be seen to turn the wrong way."""
        return self.largest_turn > FASTEST


def timeline(trajectory: Trajectory, most: int) -> Timeline:
    """Return at most so many rows, evenly spaced in time, with the first and the last."""
    rows = evenly(trajectory.t, min(most, MOST_ROWS))
    steps = np.diff(trajectory.t[rows], prepend=trajectory.t[rows[0]])
    fastest = [np.linalg.norm(trajectory.body(name).omega_B[rows], axis=1) for name in trajectory.body_names]
    return Timeline(rows, float(max((float((speed * steps).max()) for speed in fastest), default=0.0)))


def evenly(t: Array, most: int) -> IntArray:
    """Return rows of ascending times, at most so many, evenly spaced in time, with the first and the last."""
    if len(t) <= most:
        return np.arange(len(t))
    wanted = np.linspace(t[0], t[-1], most)
    after = np.clip(np.searchsorted(t, wanted), 1, len(t) - 1)
    return np.unique(np.where(wanted - t[after - 1] <= t[after] - wanted, after - 1, after))
