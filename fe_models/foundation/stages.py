"""Stages of a long computation: progress and duration of each, and the announcement of a compilation."""

import html
import logging
import sys
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
    """Log a warning when numba begins to compile inside the block; code that it loads from its cache does not count.

    A notebook also shows a progress bar, with the number of compiled functions.
    """
    from numba.core.event import Event, Listener, install_listener

    class Announcement(Listener):
        began = 0.0
        n_compiled = 0
        bar: Any = None

        def on_start(self, event: Event) -> None:
            if not self.began:
                self.began = time.perf_counter()
                log.warning(
                    "compiling %s, once on this machine, %s; the command `floatframe prepare` does it in advance",
                    code, duration, extra={"is_progress": True},
                )  # fmt: skip
                self.bar = notebook_bar(f"compiling {code}, {duration}")

        def on_end(self, event: Event) -> None:
            self.n_compiled += 1
            if self.bar is not None:
                self.bar(f"compiling {code}, {duration}: {self.n_compiled} functions", False)

        def finish(self) -> None:
            if self.bar is not None:
                self.bar(f"compiled {code} in {time.perf_counter() - self.began:.0f} s", True)

    announcement = Announcement()
    with install_listener("numba:compile", announcement):
        yield
    announcement.finish()


def notebook_bar(words: str) -> Callable[[str, bool], None] | None:
    """Show a progress bar in a notebook; return its update by text and whether it is at its end, None elsewhere."""
    shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    if not hasattr(shell, "kernel"):
        return None
    from IPython.display import HTML, display

    def page_of(text: str, is_at_end: bool) -> Any:
        return HTML(f"<progress{' value=1' if is_at_end else ''}></progress> {html.escape(text)}")

    handle = display(page_of(words, False), display_id=True)
    return lambda text, is_at_end: handle.update(page_of(text, is_at_end))
