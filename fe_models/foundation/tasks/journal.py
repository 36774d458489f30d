"""A journal of tasks: every result is a line as soon as it is known, for a second call to go on with.

The first line holds the kind of the journal and the digest of all that the results depend on; a line that was cut off
by an interruption counts as not written.
"""

import json
import os
from pathlib import Path
from typing import Any

from fe_models.foundation.errors import ReportedError

__all__ = ["TaskJournal", "open_task_journal"]


class TaskJournal:
    """A file to which records are appended, and those that it held when it was opened."""

    def __init__(self, path: Path, records: list[dict[str, Any]]) -> None:
        self.path = path
        self.records = records

    def append(self, record: dict[str, Any]) -> None:
        """Write a record and see that it is on the disk."""
        with open(self.path, "a", encoding="utf-8") as file:
            file.write(json.dumps(record) + "\n")
            file.flush()
            os.fsync(file.fileno())


def open_task_journal(path: Path, kind: str, digest: str, source: str, error: type[ReportedError]) -> TaskJournal:
    """Return the journal at a path, new or with what it holds.

    Parameters
    ----------
    path
        Of the file, which is made where it is missing.
    kind
        Name of the command, "floatframe sweep", and number of the format of its records.
    digest
        Of all that the results depend on.
    source
        File that asks for the work now, for messages.
    error
        Kind of the error that is raised.

    Raises
    ------
    error
        If the file is no such journal, or one of other work; it is left as it is.
    """
    command = kind.rpartition(" journal ")[0]
    whole = path.read_bytes() if path.is_file() else b""
    lines = whole.split(b"\n")
    if len(lines) < 2:  # no first line that is complete
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
    if not whole.endswith(b"\n"):  # the next line begins anew
        with open(path, "ab") as file:
            file.write(b"\n")
    return TaskJournal(path, records)
