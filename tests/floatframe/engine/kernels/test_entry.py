"""The kernels of motions are compiled once, for all systems and processes."""

import os
import subprocess
import sys

import pytest

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
