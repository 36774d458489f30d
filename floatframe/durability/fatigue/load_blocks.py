"""Load blocks: a history of the modal coordinates of a body, and its number of repeats."""

import math
from dataclasses import dataclass, field

import numpy as np

from fe_models.foundation.arrays import Array, frozen
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields, frozen_copies
from floatframe.errors import FatigueError, ModelError
from floatframe.results.trajectory import Trajectory

__all__ = ["GAP", "LoadBlock", "block_of_results"]

GAP = 10.0  #: ratio to the median time step above which a step is a gap


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class LoadBlock:
    """A history of modal coordinates with its number of `repeats` in a load programme.

    Parameters
    ----------
    name
        Name of the block.
    q
        Modal coordinates, (n_t, n_q).
    t
        Times, (n_t,) [s]; empty if unknown.
    repeats
        How often the history is repeated.
    scale
        Factor on the loads.
    has_gaps
        Whether time steps that are much longer than the others are intended.
    """

    name: str
    q: Array
    t: Array = field(default_factory=lambda: np.zeros(0))
    repeats: float = 1.0
    scale: float = 1.0
    has_gaps: bool = False

    def __post_init__(self) -> None:
        where = f"load block {self.name!r}"
        object.__setattr__(self, "q", frozen(self.q))
        object.__setattr__(self, "t", frozen(self.t))
        if self.q.ndim != 2 or len(self.q) < 2:
            raise FatigueError(f"{where}: q: expected (n_t, n_q) at two times or more, got {self.q.shape}")
        if not (math.isfinite(self.repeats) and self.repeats > 0):
            raise FatigueError(f"{where}: repeats: expected a number above 0, got {self.repeats:g}")
        if not (math.isfinite(self.scale) and self.scale != 0):
            raise FatigueError(f"{where}: scale: expected a number other than 0, got {self.scale:g}")
        bad = ~np.asarray(np.isfinite(self.q).all(axis=1))
        if bad.any():
            i = int(np.argmax(bad))
            at = f", t = {self.t[i]:.6g}" if len(self.t) == len(self.q) else ""
            raise FatigueError(
                f"{where}: {int(bad.sum())} of {len(bad)} rows contain NaN or infinity, first row {i}{at}: a gap in "
                "the history; cut it with times = [from, to], or fill the gap first"
            )
        if self.t.size:
            self.check_times(where)

    def check_times(self, where: str) -> None:
        """Raise `FatigueError` unless times match the rows, increase, and have no gap."""
        if self.t.shape != (len(self.q),):
            raise FatigueError(f"{where}: t: expected {len(self.q)} times, one per row, got {self.t.shape}")
        steps = np.diff(self.t)
        if not np.isfinite(self.t).all() or not (steps > 0).all():
            i = int(np.argmin(np.where(np.isfinite(steps), steps, -np.inf)))
            raise FatigueError(
                f"{where}: t: expected times that rise, got {self.t[i]:.9g} and then {self.t[i + 1]:.9g} at row {i + 1}"
            )
        i = int(np.argmax(steps))
        if steps[i] > GAP * np.median(steps) and not self.has_gaps:
            raise FatigueError(
                f"{where}: t: a gap from {self.t[i]:.6g} to {self.t[i + 1]:.6g}, {steps[i] / np.median(steps):.3g} "
                "times the usual step; cycles in it are unknown: cut it with times = [from, to], or set gaps = true "
                "if it is intended"
            )

    @property
    def duration(self) -> float:
        """Duration of one pass [s]; NaN if unknown."""
        return float(self.t[-1] - self.t[0]) if self.t.size else math.nan


def block_of_results(
    trajectory: Trajectory,
    body_name: str,
    *,
    name: str = "",
    repeats: float = 1.0,
    scale: float = 1.0,
    times: tuple[float, float] | None = None,
    has_gaps: bool = False,
) -> LoadBlock:
    """Return the load block of a body in a computed motion.

    Parameters
    ----------
    trajectory
        The motion.
    body_name
        Name of a flexible body in it.
    name
        Name of the block in reports.
    repeats
        How often the block occurs in one pass through the programme.
    scale
        Factor on the loads, and thus on all modal coordinates.
    times
        Part of the motion, from and to [s]; None: all of it.
    has_gaps
        Whether time steps that are much longer than the others are intended; otherwise they are refused.

    Raises
    ------
    ResultsError, FatigueError
        If there is no such body, it is rigid, the run did not reach its end and no `times` are given, or the part
        contains fewer than two output times.
    """
    name = name or body_name
    motion = trajectory.body(body_name)
    if motion.q.shape[1] == 0:
        raise FatigueError(f"load block {name!r}: body {body_name!r} is rigid in these results: it has no stress")
    chosen = np.ones(len(motion.t), bool)
    if times is not None:
        chosen = (motion.t >= times[0]) & (motion.t <= times[1])
        if chosen.sum() < 2:
            raise FatigueError(
                f"load block {name!r}: times = [{times[0]:g}, {times[1]:g}]: expected at least two output times in "
                f"this range; the results cover {motion.t[0]:g} to {motion.t[-1]:g}"
            )
    elif not trajectory.is_complete:
        raise FatigueError(
            f"load block {name!r}: this run did not reach its end; continue it with floatframe resume, or select a "
            f"part with times = [{motion.t[0]:g}, {motion.t[-1]:g}]"
        )
    return LoadBlock(name, motion.q[chosen], motion.t[chosen], repeats, scale, has_gaps)
