"""Stages of a long computation: progress of each stage, and its duration in seconds."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

__all__ = ["Stages"]


@dataclass(eq=False)
class Stages:
    """The stages of a job: a progress bar for the current stage, and durations of finished stages [s]."""

    show: Any = None  #: display of `rich.progress.Progress`; None: no progress bar
    seconds: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def __call__(self, name: str) -> Iterator[Callable[[float], None]]:
        """Run a stage; yields a function that receives the finished fraction, 0 to 1."""
        begin = time.perf_counter()
        task = self.show.add_task(name, total=None) if self.show is not None else None

        def advance(fraction: float) -> None:
            if self.show is not None:
                self.show.update(task, total=1.0, completed=fraction)

        try:
            yield advance
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - begin
        if self.show is not None:
            self.show.update(task, total=1.0, completed=1.0)
