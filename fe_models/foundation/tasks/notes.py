"""Warnings of a task, which its row reports."""

import logging
import threading
from collections.abc import Iterator
from contextlib import contextmanager

__all__ = ["recorded_notes"]


class RecordingHandler(logging.Handler):
    """Logging handler that collects the warnings of one thread, but passes reports of progress on at once."""

    def __init__(self, others: list[logging.Handler]) -> None:
        super().__init__(logging.WARNING)
        self.thread, self.others = threading.get_ident(), others
        self.notes: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Store one warning, or pass it on."""
        if getattr(record, "is_progress", False):
            for each in self.others or filter(None, [logging.lastResort]):  # processes of workers have none
                each.handle(record)
        elif record.thread == self.thread and not record.name.startswith("distributed"):
            self.notes.append(record.getMessage())


@contextmanager
def recorded_notes() -> Iterator[list[str]]:
    """Collect warnings for the row, which reports them with the name of the job, instead of printing them."""
    root = logging.getLogger()
    before = root.handlers
    kept = RecordingHandler(before)
    root.handlers = [kept]
    try:
        yield kept.notes
    finally:
        root.handlers = before
