"""Stages of a long computation: progress and duration of each, and the announcement of a compilation."""

import logging
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

__all__ = ["Stages", "announced_compilation"]


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


@contextmanager
def announced_compilation(log: logging.Logger, code: str, duration: str) -> Iterator[None]:
    """Log a warning when numba begins to compile inside the block; code that it loads from its cache does not count."""
    from numba.core.event import Event, Listener, install_listener

    class Announcement(Listener):
        is_made = False

        def on_start(self, event: Event) -> None:
            if not self.is_made:
                self.is_made = True
                log.warning(
                    "compiling %s, once on this machine, %s; the command `floatframe prepare` does it in advance",
                    code, duration,
                )  # fmt: skip

        def on_end(self, event: Event) -> None:
            pass

    with install_listener("numba:compile", Announcement()):
        yield
