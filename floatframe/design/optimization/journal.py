"""The journal of an optimisation: every evaluation is a line, for a second call to go on with."""

import hashlib
from pathlib import Path

from fe_models.foundation.tasks.installation import source_mark
from fe_models.foundation.tasks.journal import TaskJournal, open_task_journal
from floatframe.design.optimization.design import Design
from floatframe.design.optimization.evaluation import Evaluation
from floatframe.errors import ResultsError

__all__ = ["Journal", "design_digest", "open_journal"]

KIND = "floatframe optimize journal 1"


class Journal:
    """A file to which evaluations are appended, and what it held when it was opened."""

    def __init__(self, journal: TaskJournal, known: dict[tuple[float, ...], Evaluation]) -> None:
        self.journal = journal
        self.known = known

    def append(self, evaluation: Evaluation) -> None:
        """Write an evaluation; not one that another try may give."""
        if not evaluation.is_lasting:
            return
        self.journal.append({"values": evaluation.values, "numbers": evaluation.numbers, "error": evaluation.error})
        self.known[evaluation.values] = evaluation


def open_journal(path: Path, design: Design, files: tuple[str, ...]) -> Journal:
    """Return the journal at a path, new or with what it holds.

    Raises
    ------
    ResultsError
        If the file is no journal, or one of another system, other numbers or another version of the program; it is left
        as it is.
    """
    journal = open_task_journal(path, KIND, design_digest(design, files), design.source, ResultsError)
    expected = tuple(1 if q.times is None else len(q.times) for q in design.quantities)
    known: dict[tuple[float, ...], Evaluation] = {}
    for record in journal.records:
        try:
            values = tuple(float(v) for v in record["values"])
            numbers = tuple(tuple(float(v) for v in part) for part in record["numbers"])
            error = str(record["error"])
        except (ValueError, TypeError, KeyError):
            continue
        if len(values) == len(design.parameters) and (error or tuple(map(len, numbers)) == expected):
            known[values] = Evaluation(values, numbers, error)
    return Journal(journal, known)


def design_digest(design: Design, files: tuple[str, ...]) -> str:
    """Return the SHA-256 of what the numbers depend on: this program, files of the system, key paths, quantities."""
    asked = [
        (q.analysis, q.output.of, q.output.take, q.band, q.at, None if q.times is None else q.times.tolist())
        for q in design.quantities
    ]
    text = repr((source_mark(), [(p.paths, p.factors) for p in design.parameters], asked))
    digest = hashlib.sha256(text.encode())
    for name in files:
        data = Path(name).read_bytes()
        digest.update(str(len(data)).encode() + b" " + data)
    return digest.hexdigest()
