"""Work in processes beside: one bad value never takes the others along, and no process outlives the one that asks."""

import os
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import pytest

from fe_models.foundation.tasks.task_map import ProcessError
from fe_models.foundation.tasks.workers import tasks_of
from tests.root import ROOT, heed_signals


class UnpicklableError(Exception):
    """Cannot be made again from its arguments."""

    def __init__(self, one, other):
        super().__init__(one + other)


def answer(value):
    """Square a number, or end in one of the bad ways."""
    if value == "killed":
        os.kill(os.getpid(), signal.SIGKILL)
    if value == "segfault":
        os.kill(os.getpid(), signal.SIGSEGV)
    if value == "exit":
        sys.exit(3)
    if value == "hard exit":
        os._exit(4)
    if value == "raise":
        raise KeyError("a bad one")
    if value == "unpicklable error":
        raise UnpicklableError("un", "sendable")
    if value == "unpicklable result":
        return lambda: None
    if value == "memory":
        raise MemoryError
    return value * value


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


def row(value, error):
    return value, f"{error}"


@pytest.mark.parametrize("n", [2, 3])
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


SLEEPS = """
    import sys
    from functools import partial
    from pathlib import Path
    from fe_models.foundation.tasks.workers import tasks_of
    from tests.fe_models.foundation.tasks.test_processes import note_and_sleep
    if __name__ == "__main__":
        with tasks_of({workers!r}) as tasks:
            tasks.map(partial(note_and_sleep, Path(sys.argv[1])), [1, 2, 3])
"""


def is_running(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False


def require_workers_to_end(folder, workers, end):
    """Run a script whose two workers sleep, end it while they do, and see that they end too."""
    script = folder / "script.py"
    script.write_text(textwrap.dedent(SLEEPS).format(workers=workers))
    with subprocess.Popen(
        [sys.executable, str(script), str(folder)], env=os.environ | {"PYTHONPATH": str(ROOT)},
        stderr=subprocess.PIPE, text=True, start_new_session=True, preexec_fn=heed_signals,
    ) as process:  # fmt: skip
        while len(list(folder.glob("*.pid"))) < 2 and process.poll() is None:
            time.sleep(0.05)
        pids = [int(path.stem) for path in folder.glob("*.pid")]
        assert len(pids) == 2
        end(process)
        process.wait()
        while any(map(is_running, pids)):  # else the test hangs, and is ended as one that does
            time.sleep(0.05)


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="processes are looked up in /proc")
@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP", "SIGKILL", "SIGINT"])
def test_workers_end_with_the_process_that_started_them(tmp_path, name):
    require_workers_to_end(tmp_path, 2, lambda process: process.send_signal(signal.Signals[name]))
