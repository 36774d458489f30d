"""The watch over benchmarks: what counts as worse, what a page tells, numbers that texts quote from kept results."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks import watch
from benchmarks.aims import Aim
from benchmarks.watch import Change, Results


def results(**figures: float) -> Results:
    """Return results of one benchmark."""
    return Results("abc", "2026-01-01", watch.this_machine(), 0.1, {"recursive": dict(figures)}, {"recursive": 1.0})


@pytest.mark.parametrize(
    ("name", "now", "last", "is_regression"),
    [
        ("ours over theirs", 1.2, 1.0, True),
        ("ours over theirs", 1.1, 1.0, False),
        ("ours over theirs", 0.5, 1.0, False),
        ("against theirs, speedup", 0.8, 1.0, True),
        ("against theirs, speedup", 2.0, 1.0, False),
        ("memory, saving", 1.0, 1.2, True),
        ("a step [µs]", 9.0, 1.0, False),  # of the machine, not judged
        ("ours over theirs", 9.0, None, False),
    ],
)
def test_a_ratio_that_grew_by_more_than_15_percent_is_a_regression(name, now, last, is_regression):
    assert Change("m", name, now, last).is_regression is is_regression


def test_results_come_back_as_written(tmp_path):
    made = results(**{"a over b": 1.25})
    made.write(tmp_path / "results.json")
    assert Results.read(tmp_path / "results.json") == made
    assert Results.read(tmp_path / "none.json") is None
    assert [path.name for path in tmp_path.iterdir()] == ["results.json"]


def test_the_page_tells_both_runs_and_names_what_became_worse():
    now, last = results(**{"a over b": 1.5, "a step [µs]": 12.0}), results(**{"a over b": 1.0})
    now.failed["shells"] = "no module named x"
    rows = watch.page(now, last).splitlines()
    assert "| a over b | 1.5 | 1 | +50 % **regression** |" in rows
    assert "| a step [µs] | 12 | – |  |" in rows
    assert "- `shells`: no module named x" in rows


def test_the_page_tells_which_aims_are_missed_and_why(monkeypatch):
    aims = tuple(Aim("recursive", name, 2.0, "slow") for name in ("a over b", "c, speedup", "d", "e, speedup"))
    monkeypatch.setattr(watch, "AIMS", aims)
    rows = watch.page(results(**{"a over b": 1.5, "c, speedup": 1.5, "e, speedup": 2.5}), None).splitlines()
    told = {row.split(" (")[0].strip("| "): row.rsplit("| ", 1)[1] for row in rows if "`recursive`)" in row}
    assert told == {
        "a over b": "reached |", "c, speedup": "**missed**: slow |", "d": "not measured |", "e, speedup": "reached |",
    }  # fmt: skip


def test_quoted_figures_are_renewed_with_their_decimals(tmp_path, monkeypatch):
    text = tmp_path / "page.md"
    text.write_text("ratio 3.1<!-- recursive: a over b -->x, step 7<!--recursive: c--> ms, 2<!-- recursive: gone -->")
    monkeypatch.setattr(watch, "texts", lambda: [text])
    assert watch.quote(results(**{"a over b": 2.46, "c": 12.4})) == [text]
    assert text.read_text() == (
        "ratio 2.5<!-- recursive: a over b -->x, step 12<!--recursive: c--> ms, 2<!-- recursive: gone -->"
    )


def test_texts_quote_what_was_kept():
    kept = Results.read(watch.RESULTS)
    quoted = [(path, match) for path in watch.texts() for match in watch.QUOTED.finditer(path.read_text())]
    assert kept is not None
    assert quoted
    for path, match in quoted:
        value = kept.figures[match["module"]][match["name"]]
        assert match["number"] == watch.as_quoted(value, match["number"]), f"{path.name}: {match[0]}"


def test_a_benchmark_that_fails_says_why(monkeypatch, tmp_path):
    with pytest.raises(RuntimeError, match=r"No module named .benchmarks\.none."):
        watch.measured("none", short=True, limit=60.0)


def test_operations_of_a_step_are_counted_and_grow_with_the_modes():
    """Beside what a step of more modes must do at least: products of its matrices of modes."""
    from benchmarks import work_of_a_step

    told = subprocess.run(
        [sys.executable, "-m", "benchmarks.work_of_a_step", work_of_a_step.COUNTED, "[[1, 2], [1, 6]]"],
        cwd=Path(__file__).parents[1],
        env=os.environ | {"NUMBA_DISABLE_JIT": "1", "FLOATFRAME_COMPILER": "plain"},
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    few, many = (case[0] for case in json.loads(told.stdout))
    assert few > 1000
    assert many - few > 2 * (6**2 - 2**2) * 3


def test_names_are_those_of_benchmarks_that_take_part():
    names = watch.modules()
    assert "recursive" in names
    assert "watch" not in names
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks", "nothing"], cwd=Path(__file__).parents[1], capture_output=True, text=True
    )
    assert done.returncode == 2
    assert "no benchmark nothing; known: " in done.stderr
