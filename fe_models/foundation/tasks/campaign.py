"""A campaign: one task at many values, computed by workers; failures are rows, and a later call continues.

A line for every row is appended to a journal as soon as the row is known. The first line contains the kind of the
journal and the digest of all inputs that affect the results. A line truncated by an interruption is ignored.
"""

import hashlib
import json
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

from fe_models.foundation.errors import ReportedError
from fe_models.foundation.paths import file_digest
from fe_models.foundation.tasks.installation import source_mark
from fe_models.foundation.tasks.task_map import ProcessError, Progress
from fe_models.foundation.tasks.workers import Workers, tasks_of

__all__ = ["Campaign", "CampaignTask", "TaskJournal", "campaign_digest", "open_task_journal"]

Value = TypeVar("Value")
Row = TypeVar("Row")
Given = TypeVar("Given", contravariant=True)
Made = TypeVar("Made")


class CampaignTask(Protocol[Given, Made]):
    """Computation of a row at a value, and its form in a journal; the task is sent to workers."""

    def __call__(self, value: Given, /) -> Made:
        """Return the row of a value."""

    def failed(self, value: Given, words: str, is_lasting: bool, /) -> Made:
        """Return the row of a value whose computation failed; `is_lasting`: another attempt would also fail."""

    def key(self, value: Given, /) -> Any:
        """Return the identification of a value in plain types, with digests of files that it names."""

    def record(self, row: Made, /) -> dict[str, Any] | None:
        """Return the content of a row besides its value in plain types; None: the next call computes it again."""

    def row(self, value: Given, record: dict[str, Any], /) -> Made:
        """Return the row of a record; KeyError, TypeError or ValueError: the record is not used."""


class Campaign(Generic[Value, Row]):
    """The rows of a task.

    Parameters
    ----------
    task
        Task that computes a row.
    journal
        Journal that stores the rows; None: nothing is written.
    """

    def __init__(self, task: CampaignTask[Value, Row], journal: "TaskJournal | None" = None) -> None:
        self.task, self.journal = task, journal
        self.records = {} if journal is None else {json.dumps(each.get("key")): each for each in journal.records}
        self.n_known = 0  #: number of rows read from the journal

    def known(self, value: Value) -> Row | None:
        """Return the row of a value from the journal."""
        record = self.records.get(json.dumps(self.task.key(value), default=str)) if self.records else None
        try:
            return None if record is None else self.task.row(value, record)
        except (KeyError, TypeError, ValueError):
            return None

    def rows(
        self, values: Sequence[Value], workers: Workers, *, threads: int | None = 1, progress: Progress | None = None,
        files: Sequence[str] = (),
    ) -> list[Row]:  # fmt: skip
        """Return the rows of all values; rows that are not in the journal are computed.

        Parameters
        ----------
        values
            Values of all rows.
        workers, threads
            As in `tasks_of`.
        progress
            Callback that receives the number of known rows and of all rows.
        files
            As in `TaskMap.map`.
        """
        rows = {k: row for k, value in enumerate(values) if (row := self.known(value)) is not None}
        self.n_known += len(rows)
        missing = [k for k in range(len(values)) if k not in rows]

        def keep(i: int, row: Row) -> None:
            rows[missing[i]] = row
            self.append(values[missing[i]], row)
            if progress is not None:
                progress(len(rows), len(values))

        if missing:
            with tasks_of(workers, len(missing), threads=threads) as tasks:
                tasks.map(self.task, [values[k] for k in missing], failed=self.failed, done=keep, files=files)
        return [rows[k] for k in range(len(values))]

    def failed(self, value: Value, error: Exception) -> Row:
        """Return the row of a failure, with the text of its error."""
        words = str(error) if isinstance(error, ReportedError) else f"{type(error).__name__}: {error}"
        is_lasting = isinstance(error, ReportedError) and not isinstance(error, ProcessError)
        return self.task.failed(value, " ".join(words.split()) or type(error).__name__, is_lasting)

    def append(self, value: Value, row: Row) -> None:
        """Write a row to the journal, if there is one and the row should be stored."""
        record = None if self.journal is None else self.task.record(row)
        if record is not None and self.journal is not None:
            self.journal.append({"key": self.task.key(value), **record})


def campaign_digest(asked: Any, files: Iterable[str]) -> str:
    """Return the SHA-256 of everything that determines results: program, request, and content of files."""
    digest = hashlib.sha256(repr((source_mark(), asked)).encode())
    for name in files:
        digest.update(file_digest(name).encode())
    return digest.hexdigest()


class TaskJournal:
    """A file to which records are appended, and the records that it contained when it was opened."""

    def __init__(self, path: Path, records: list[dict[str, Any]]) -> None:
        self.path = path
        self.records = records

    def append(self, record: dict[str, Any]) -> None:
        """Write a record and flush it to disk."""
        with open(self.path, "a", encoding="utf-8") as file:
            file.write(json.dumps(record, default=str) + "\n")
            file.flush()
            os.fsync(file.fileno())


def open_task_journal(path: Path, kind: str, digest: str, source: str, error: type[ReportedError]) -> TaskJournal:
    """Open the journal at a path, a new one or an existing one with its records.

    Parameters
    ----------
    path
        Path of the file, which is created if missing.
    kind
        Name of the command, such as "floatframe sweep", and version of its record format.
    digest
        Digest of all inputs that affect the results.
    source
        File that requests the work, for messages.
    error
        Class of the error to raise.

    Raises
    ------
    error
        If the file is not such a journal, or belongs to other work; it is left unchanged.
    """
    command = kind.rpartition(" journal ")[0]
    whole = path.read_bytes() if path.is_file() else b""
    lines = whole.split(b"\n")
    if len(lines) < 2:  # there is no complete first line
        if whole and not whole.startswith(b'{"kind"'):
            raise error(f"{path}: expected a journal of {command}, got another file; name another")
        path.write_text(json.dumps({"kind": kind, "digest": digest}) + "\n", encoding="utf-8")
        return TaskJournal(path, [])
    try:
        head = json.loads(lines[0])
        is_journal = head["kind"] == kind
    except (ValueError, TypeError, KeyError):
        is_journal = False
    if not is_journal:
        raise error(f"{path}: expected a journal of {command}, got another file; name another")
    if head.get("digest") != digest:
        raise error(
            f"{path}: this journal is of another system, other parameters or other numbers than {source} asks for now, "
            "or of another version of the program; delete it to begin anew, or name another with --journal"
        )
    records = []
    for line in lines[1:]:
        try:
            record = json.loads(line)
        except ValueError:
            continue
        if isinstance(record, dict):
            records.append(record)
    if not whole.endswith(b"\n"):  # the last line was cut off: start a new line
        with open(path, "ab") as file:
            file.write(b"\n")
    return TaskJournal(path, records)
