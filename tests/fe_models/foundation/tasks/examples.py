"""Systems, bodies and helpers that several tests share: processes."""

import os
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

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


def row(value, error):
    return value, f"{error}"


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
