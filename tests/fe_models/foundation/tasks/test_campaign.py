"""Campaigns: rows of a task from workers and from a journal, failures as rows."""

import json
from dataclasses import dataclass
from typing import Any

import pytest

from fe_models.foundation.errors import ArgumentError, BodyError
from fe_models.foundation.tasks.campaign import Campaign, campaign_digest, open_task_journal
from fe_models.foundation.tasks.task_map import ProcessError
from fe_models.foundation.tasks.workers import ThisProcess


@dataclass(frozen=True)
class Row:
    value: Any
    root: float | None
    error: str = ""
    is_lasting: bool = True


@dataclass
class Roots:
    """Square roots; a negative number has none, a text ends the process, None is a fault."""

    calls: list[Any]

    def __call__(self, value: Any) -> Row:
        self.calls.append(value)
        if value is None:
            raise ZeroDivisionError
        if isinstance(value, str):
            raise ProcessError("its process ended")
        if value < 0:
            raise BodyError("no root of\na negative number")
        return Row(value, value**0.5)

    def failed(self, value: Any, words: str, is_lasting: bool) -> Row:
        return Row(value, None, words, is_lasting)

    def key(self, value: Any) -> Any:
        return ["of", value]

    def record(self, row: Row) -> dict[str, Any] | None:
        return {"root": row.root, "error": row.error} if row.is_lasting else None

    def row(self, value: Any, record: dict[str, Any]) -> Row:
        return Row(value, None if record["error"] else float(record["root"]), record["error"])


def journal(path, digest="a"):
    return open_task_journal(path, "cms test journal 1", digest, "this test", ArgumentError)


VALUES = [4.0, -1.0, 1 / 3, "killed", None, 4.0]


def test_failures_are_rows_and_finished_rows_are_not_computed_again(tmp_path):
    path, told = tmp_path / "a.journal", []
    first = Campaign(Roots([]), journal(path))
    rows = first.rows(VALUES, ThisProcess(), progress=lambda done, all_: told.append((done, all_)))
    assert [row.root for row in rows] == [2.0, None, (1 / 3) ** 0.5, None, None, 2.0]
    assert [row.error for row in rows] == ["", "no root of a negative number", "", "its process ended",
                                           "ZeroDivisionError:", ""]  # fmt: skip
    assert told[-1] == (6, 6)
    again = Campaign(Roots([]), journal(path))
    assert again.rows(VALUES, ThisProcess()) == rows
    assert again.task.calls == ["killed", None]  # the others are known, the failure that lasts among them
    assert again.n_known == 4
    assert again.known(7.0) is None


def test_a_record_that_is_none_is_left_out(tmp_path):
    path = tmp_path / "a.journal"
    Campaign(Roots([]), journal(path)).rows([4.0, 9.0, 16.0], 1)
    head, one, two, three = path.read_text().splitlines()
    spoilt = json.dumps(json.loads(two) | {"root": "x"})
    path.write_text("\n".join([head, one, spoilt, '{"key": 5}', "[]", three[:20]]))
    again = Campaign(Roots([]), journal(path))
    assert [row.root for row in again.rows([4.0, 9.0, 16.0], ThisProcess())] == [2.0, 3.0, 4.0]
    assert again.task.calls == [9.0, 16.0]


def test_a_journal_of_other_work_is_refused(tmp_path):
    file = tmp_path / "mesh.inp"
    file.write_text("a")
    digest = campaign_digest(("x", 1), [str(file)])
    assert digest == campaign_digest(("x", 1), [str(file)])
    assert digest != campaign_digest(("x", 2), [str(file)])
    path = tmp_path / "a.journal"
    journal(path, digest)
    file.write_text("b")
    with pytest.raises(ArgumentError, match="this journal is of another system"):
        journal(path, campaign_digest(("x", 1), [str(file)]))
