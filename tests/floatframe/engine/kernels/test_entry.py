"""The kernels of motions are compiled once, for all systems and processes."""

import os
import subprocess
import sys
from types import SimpleNamespace

import pytest
from numba.core.event import trigger_event

from floatframe.engine.kernels import entry
from floatframe.engine.kernels.compiler.choice import is_lean
from floatframe.engine.kernels.entry import absolute_kernels, prepare


def test_there_is_one_compilation_for_all_systems():
    prepare()
    assert not prepare()
    assert len(absolute_kernels.compiled.signatures) == 1


def test_kernels_come_from_the_cache_in_the_next_process():
    prepare()
    code = "from floatframe.engine.kernels.entry import prepare; print(prepare())"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"


@pytest.mark.long
@pytest.mark.skipif(not is_lean, reason="plain numba takes several times as long")
def test_a_first_compilation_takes_less_than_20_s_of_processor_time(tmp_path):
    code = "import time; from floatframe.engine.kernels.entry import prepare; assert prepare()\n"
    code += "print(time.process_time())"
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    run = [sys.executable, "-c", code]
    done = subprocess.run(run, capture_output=True, text=True, check=True, env=environment)
    assert float(done.stdout) < 20.0


class Compilation:
    """Stands for a function of numba that is compiled, or loaded from the cache."""

    def __init__(self, is_stored):
        self.is_stored, self.stats = is_stored, SimpleNamespace(cache_misses={})

    def compile(self, signature):
        self.stats.cache_misses[signature] = 0 if self.is_stored else 1
        for _ in range(0 if self.is_stored else 2):  # it and a function inside
            with trigger_event("numba:compile"):
                pass

    def __call__(self, *tables):
        return (0, 0, 0, -1, 0.0)


@pytest.mark.parametrize("is_stored", [False, True])
def test_a_notebook_shows_a_bar_while_code_is_compiled(is_stored, monkeypatch):
    """Three functions are compiled: the first shows the bar, each updates it, and the end fills it."""
    shown = []
    handle = SimpleNamespace(update=shown.append)
    display = SimpleNamespace(HTML=str, display=lambda page, display_id: shown.append(page) or handle)
    shell = SimpleNamespace(get_ipython=lambda: SimpleNamespace(kernel=object()), display=display)
    monkeypatch.setitem(sys.modules, "IPython", shell)
    monkeypatch.setitem(sys.modules, "IPython.display", display)
    run = entry.CompiledEntry(Compilation(is_stored), 0)
    run(what=0)
    run(what=0)
    if is_stored:
        assert shown == []
        return
    assert len(shown) == 4
    assert shown[2].startswith("<progress></progress> compiling the code of motions")
    assert shown[2].endswith("2 functions")
    assert shown[3].startswith("<progress value=1></progress> compiled the code of motions")


@pytest.mark.parametrize("is_stored", [False, True])
def test_python_too_is_told_once_that_code_is_being_compiled(is_stored, caplog):
    run = entry.CompiledEntry(Compilation(is_stored), 0)
    run(what=0)
    run(what=0)
    told = [record.levelname for record in caplog.records if "compiling the code of motions" in record.message]
    assert told == ([] if is_stored else ["WARNING"])
