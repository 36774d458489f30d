"""The journal of a study: every completed point is a line, so that a later call can continue."""

import hashlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from fe_models.foundation.digest import file_digest
from fe_models.foundation.tasks.installation import source_mark
from fe_models.foundation.tasks.journal import TaskJournal, open_task_journal
from floatframe.design.studies.study_file import Study
from floatframe.design.studies.study_row import StudyRow
from floatframe.errors import ResultsError

__all__ = ["StudyJournal", "open_study_journal"]

KIND = "floatframe sweep journal 1"


class StudyJournal:
    """A file to which rows are appended, with the rows that it contained when opened."""

    def __init__(self, journal: TaskJournal, study: Study) -> None:
        self.journal = journal
        self.folder = Path(study.system).parent
        n = len(study.outputs)
        self.known: dict[str, dict[str, Any]] = {}
        for record in journal.records:
            try:
                if len(record["outputs"]) == len(record["units"]) == n and all(
                    isinstance(value, float) for value in record["outputs"]
                ):
                    self.known[str(record["point"])] = record
            except (KeyError, TypeError):
                continue

    def row(self, point: tuple[Any, ...]) -> StudyRow | None:
        """Return the row of a point, if it is known."""
        record = self.known.get(self.key(point))
        if record is None:
            return None
        return StudyRow(point, tuple(record["outputs"]), tuple(record["units"]), str(record.get("error", "")))

    def append(self, row: StudyRow) -> None:
        """Write a row, unless a repeated attempt could give another result."""
        if row.is_lasting:
            outputs = [float(value) for value in row.outputs]
            key = self.key(row.values)
            self.journal.append({"point": key, "outputs": outputs, "units": row.units, "error": row.error})

    def key(self, point: tuple[Any, ...]) -> str:
        """Return the key of a point as text: its values, and digests of the files that they name."""
        digests = [file_digest(self.folder / text) for text in texts(point)]
        return json.dumps([point, [digest for digest in digests if digest]], default=str)


def texts(value: Any) -> Iterator[str]:
    """Yield all texts in a value of a file that can be names of files."""
    if isinstance(value, str):
        if 0 < len(value) < 1000 and "\0" not in value:
            yield value
    elif isinstance(value, dict):
        for each in value.values():
            yield from texts(each)
    elif isinstance(value, list | tuple):
        for each in value:
            yield from texts(each)


def open_study_journal(path: Path, study: Study, files: tuple[str, ...]) -> StudyJournal:
    """Return the journal at a path, either new or with its existing rows.

    Raises
    ------
    ResultsError
        If the file is not a journal, or belongs to another system, other outputs or another version of the program; it
        is left unchanged.
    """
    digest = study_digest(study, files)
    return StudyJournal(open_task_journal(path, KIND, digest, f"the study of {study.system}", ResultsError), study)


def study_digest(study: Study, files: tuple[str, ...]) -> str:
    """Return the SHA-256 of everything the results depend on: program, files of the system, key paths, outputs."""
    asked = [(output.of, output.take) for output in study.outputs]
    text = repr((source_mark(), study.analysis, [parameter.path for parameter in study.parameters], asked))
    digest = hashlib.sha256(text.encode())
    for name in files:
        digest.update(file_digest(name).encode())
    return digest.hexdigest()
