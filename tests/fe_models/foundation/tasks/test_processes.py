"""Work in processes beside: one bad value never takes the others along, and no process outlives the one that asks."""

import os
import signal
import time

import pytest

from fe_models.foundation.tasks.task_map import ProcessError
from fe_models.foundation.tasks.workers import tasks_of
from tests.fe_models.foundation.tasks.examples import answer, require_workers_to_end, row

BAD = {
    "killed": "killed by SIGKILL; the system may have run out of memory",
    "segfault": "killed by SIGSEGV",
    "exit": "SystemExit: 3",
    "hard exit": "exit code 4",
    "raise": "a bad one",
    "unpicklable error": "UnpicklableError: unsendable",
    "unpicklable result": "lambda",
    "memory": "",
}


@pytest.mark.parametrize("n", [2, pytest.param(3, marks=pytest.mark.long)])
def test_one_bad_value_never_loses_the_others(n):
    values, seen = [1, "killed", 2, *BAD, 3, "segfault", 4, 5], []
    with tasks_of(n) as tasks:
        found = tasks.map(answer, values, failed=row, progress=lambda *told: seen.append(told))
    for value, got in zip(values, found, strict=True):
        if isinstance(value, int):
            assert got == value * value
        else:
            assert got[0] == value
            assert BAD[value] in got[1]
    assert seen[-1] == (len(values), len(values))


def test_without_a_place_for_failures_the_first_error_in_order_is_raised():
    with tasks_of(2) as tasks:
        with pytest.raises(KeyError, match="a bad one"):
            tasks.map(answer, [1, "raise", 2, "killed"])
        with pytest.raises(ProcessError, match="SIGKILL"):
            tasks.map(answer, ["killed"] * 3)


def test_a_function_that_cannot_be_sent_is_refused_before_any_work():
    with tasks_of(2) as tasks, pytest.raises(ProcessError, match="top level of a module"):
        tasks.map(lambda value: value, [1, 2])


def note_and_sleep(folder, value):
    (folder / f"{os.getpid()}.pid").write_text("")
    time.sleep(100)


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="processes are looked up in /proc")
@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP", "SIGKILL", "SIGINT"])
def test_workers_end_with_the_process_that_started_them(tmp_path, name):
    require_workers_to_end(tmp_path, 2, lambda process: process.send_signal(signal.Signals[name]))
