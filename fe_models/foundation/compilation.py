"""Announcement of a compilation, so that nobody waits without knowing for what; imports numba."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager

from numba.core.event import Event, Listener, install_listener

__all__ = ["announced_compilation"]


@contextmanager
def announced_compilation(log: logging.Logger, message: str) -> Iterator[None]:
    """Log a warning when numba begins to compile inside the block; code that it loads from its cache does not count."""
    with install_listener("numba:compile", _Announcement(log, message)):
        yield


class _Announcement(Listener):
    def __init__(self, log: logging.Logger, message: str) -> None:
        self.log, self.message = log, message
        self.is_made = False

    def on_start(self, event: Event) -> None:
        if not self.is_made:
            self.is_made = True
            self.log.warning(
                "%s is being compiled, once on this machine; the command `floatframe prepare` does it in advance",
                self.message,
            )

    def on_end(self, event: Event) -> None:
        pass
