"""A journal of tasks: every result is written as a line as soon as it is known, so that a later run can continue.

The first line holds the kind of the journal and the digest of all inputs that affect the results. A line that an
interruption cut off counts as not written.
"""

import json
import os
from pathlib import Path
from typing import Any

from fe_models.foundation.errors import ReportedError

__all__ = ["TaskJournal", "open_task_journal"]


class TaskJournal:
    """A file to which records are appended, and the records that it contained when it was opened."""

    def __init__(self, path: Path, records: list[dict[str, Any]]) -> None:
        self.path = path
        self.records = records

    def append(self, record: dict[str, Any]) -> None:
        """Write a record and flush it to disk."""
        with open(self.path, "a", encoding="utf-8") as file:
            file.write(json.dumps(record) + "\n")
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
