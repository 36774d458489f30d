"""One job of a fleet: the request to a worker, its work, and its answer."""

import logging
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from fe_models.foundation.errors import ReportedError
from fe_models.foundation.tasks.task_map import ProcessError

__all__ = ["FleetJob", "FleetRow", "failed_row", "reduce_and_write_one"]


@dataclass(frozen=True)
class FleetJob:
    """A job and its modal file, both by full path, and a fingerprint of all files on which the job depends."""

    job: Path
    output: Path
    digest: str
    solver: str | None = None  #: overrides the solver of the job


@dataclass(frozen=True)
class FleetRow:
    """The result of one job."""

    job: FleetJob
    name: str = ""  #: name of the body
    n_modes: int = 0
    seconds: float = 0.0
    notes: tuple[str, ...] = ()  #: warnings during the job
    error: str = ""  #: reason why there is no file
    is_lasting: bool = True  #: whether another attempt would give the same error
    is_known: bool = False  #: whether the row comes from the journal


class Kept(logging.Handler):
    """Keeps the warnings of one thread."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.thread = threading.get_ident()
        self.notes: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Keep one warning."""
        if record.thread == self.thread and not record.name.startswith("distributed"):
            self.notes.append(record.getMessage())


@contextmanager
def notes_kept() -> Iterator[list[str]]:
    """Collect warnings for the row, which reports them with the name of the job; they are not printed meanwhile."""
    root, kept = logging.getLogger(), Kept()
    before, root.handlers = root.handlers, [kept]
    try:
        yield kept.notes
    finally:
        root.handlers = before


def reduce_and_write_one(job: FleetJob) -> FleetRow:
    """Run a job and write its modal file; called in a worker."""
    from cms.body.modal_file.file import write
    from cms.jobs.reduce_job import reduce_job

    began = time.perf_counter()
    with notes_kept() as notes:
        reduced = reduce_job(job.job, solver=job.solver)
        write(reduced, job.output)
    return FleetRow(job, reduced.name, reduced.n_q, time.perf_counter() - began, tuple(notes))


def failed_row(job: FleetJob, error: Exception) -> FleetRow:
    """Return the row of a failed job, with the text of its error."""
    words = str(error) if isinstance(error, ReportedError) else f"{type(error).__name__}: {error}"
    is_lasting = isinstance(error, ReportedError) and not isinstance(error, ProcessError)
    return FleetRow(job, error=" ".join(words.split()) or type(error).__name__, is_lasting=is_lasting)
