"""Warnings of a task, which its row reports."""

import logging
import threading
from collections.abc import Iterator
from contextlib import contextmanager

__all__ = ["recorded_notes"]


class RecordingHandler(logging.Handler):
    """Logging handler that collects the warnings of one thread."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.thread = threading.get_ident()
        self.notes: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Store one warning."""
        if record.thread == self.thread and not record.name.startswith("distributed"):
            self.notes.append(record.getMessage())


@contextmanager
def recorded_notes() -> Iterator[list[str]]:
    """Collect warnings for the row, which reports them with the name of the job, instead of printing them."""
    root, kept = logging.getLogger(), RecordingHandler()
    before, root.handlers = root.handlers, [kept]
    try:
        yield kept.notes
    finally:
        root.handlers = before
