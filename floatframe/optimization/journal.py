"""The journal of an optimisation: every evaluation is a line as soon as it is known, for a second call to go on with.

The first line holds the digest of all that the numbers depend on; a line that was cut off by an interruption counts as
not written.
"""

import hashlib
import json
import os
from pathlib import Path

from floatframe.errors import ResultsError
from floatframe.optimization.design import Design
from floatframe.optimization.evaluation import Evaluation

__all__ = ["Journal", "design_digest", "open_journal"]

KIND = "floatframe optimize journal 1"


class Journal:
    """A file to which evaluations are appended, and what it held when it was opened."""

    def __init__(self, path: Path, known: dict[tuple[float, ...], Evaluation]) -> None:
        self.path = path
        self.known = known

    def append(self, evaluation: Evaluation) -> None:
        """Write an evaluation and see that it is on the disk; not one that another try may give."""
        if not evaluation.is_lasting:
            return
        record = {"values": evaluation.values, "numbers": evaluation.numbers, "error": evaluation.error}
        with open(self.path, "a", encoding="utf-8") as file:
            file.write(json.dumps(record) + "\n")
            file.flush()
            os.fsync(file.fileno())
        self.known[evaluation.values] = evaluation


def open_journal(path: Path, design: Design, files: tuple[str, ...]) -> Journal:
    """Return the journal at a path, new or with what it holds.

    Raises
    ------
    ResultsError
        If the file is no journal, or one of another system or other numbers; it is left as it is.
    """
    digest = design_digest(design, files)
    whole = path.read_bytes() if path.is_file() else b""
    lines = whole.split(b"\n")
    if len(lines) < 2:  # no first line that is complete
        if whole and not whole.startswith(b'{"kind"'):
            raise ResultsError(f"{path}: expected a journal of floatframe optimize, got another file; name another")
        path.write_text(json.dumps({"kind": KIND, "digest": digest}) + "\n", encoding="utf-8")
        return Journal(path, {})
    try:
        head = json.loads(lines[0])
        is_journal = head["kind"] == KIND
    except (ValueError, TypeError, KeyError):
        is_journal = False
    if not is_journal:
        raise ResultsError(f"{path}: expected a journal of floatframe optimize, got another file; name another")
    if head.get("digest") != digest:
        raise ResultsError(
            f"{path}: this journal is of another system, other parameters or other numbers than {design.source} asks "
            "for now; delete it to begin anew, or name another with --journal"
        )
    known: dict[tuple[float, ...], Evaluation] = {}
    for line in lines[1:]:
        try:
            record = json.loads(line)
            values = tuple(float(v) for v in record["values"])
            numbers = tuple(tuple(float(v) for v in part) for part in record["numbers"])
            error = str(record["error"])
        except (ValueError, TypeError, KeyError):
            continue
        expected = tuple(1 if q.times is None else len(q.times) for q in design.quantities)
        if len(values) == len(design.parameters) and (error or tuple(map(len, numbers)) == expected):
            known[values] = Evaluation(values, numbers, error)
    if not whole.endswith(b"\n"):  # the next line begins anew
        with open(path, "ab") as file:
            file.write(b"\n")
    return Journal(path, known)


def design_digest(design: Design, files: tuple[str, ...]) -> str:
    """Return the SHA-256 of what the numbers depend on: files of the system, key paths, quantities."""
    asked = [
        (q.analysis, q.output.of, q.output.take, q.band, q.at, None if q.times is None else q.times.tolist())
        for q in design.quantities
    ]
    text = repr(([(p.paths, p.factors) for p in design.parameters], asked))
    digest = hashlib.sha256(text.encode())
    for name in files:
        data = Path(name).read_bytes()
        digest.update(str(len(data)).encode() + b" " + data)
    return digest.hexdigest()
