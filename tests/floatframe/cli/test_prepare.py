import os
import subprocess
import sys

import pytest

from floatframe.cli import prepare
from floatframe.cli.compile_kernels import PARTS
from tests.root import ROOT

SAYS = """
import json, sys, time
part = sys.argv[1]
began = time.time()
time.sleep(0.3)
if part == "broken": raise SystemExit("no compiler")
print("words of a library")
told = {"compiled": part == "motion", "from_package": part != "relative"}
print(json.dumps(told | {"seconds": time.time() - began, "at": began}))
"""


@pytest.fixture(autouse=True)
def workers(monkeypatch):
    monkeypatch.setattr(prepare, "RUN", SAYS)


def test_a_part_that_needs_another_begins_when_that_is_done():
    done = prepare.prepare_parts(("relative", "motion", "reduction"), 3)
    assert list(done) == ["relative", "motion", "reduction"]
    assert done["motion"]["compiled"]
    assert not done["reduction"]["compiled"]
    assert done["relative"]["at"] >= done["motion"]["at"] + done["motion"]["seconds"]
    assert done["reduction"]["at"] < done["motion"]["at"] + done["motion"]["seconds"]  # beside it


def test_each_part_is_announced_and_says_what_happened_to_it():
    told = []
    parts = ("relative", "motion", "reduction", "broken")
    prepare.prepare_parts(parts, 1, tell=lambda part, words: told.append((part, words)))
    assert [part for part, _ in told][::2] == ["motion", "relative", "reduction", "broken"]
    assert [part for part, _ in told][1::2] == ["motion", "relative", "reduction", "broken"]
    assert [words for _, words in told][:3] == [f"begins: {PARTS['motion'][0]}", "compiled in 0 s",
                                                f"begins: {PARTS['relative'][0]}"]  # fmt: skip
    assert [words for _, words in told][3::2] == ["was ready", "came with the package", "failed"]


def test_a_part_that_fails_says_why_and_leaves_the_others():
    done = prepare.prepare_parts(("broken", "motion"), 1)
    assert done["broken"] == {"failed": "no compiler"}
    assert done["motion"]["compiled"]


def test_later_parts_are_parts():
    assert {*prepare.LATER, *prepare.LATER.values()} <= set(PARTS)


#: prints the functions of which a larger factor, in memory and on disk, needs more code than `prepare` compiles
FACTORS = """
import numpy as np
from numba.core.dispatcher import Dispatcher
from cms.linear_algebra.solvers.factorization import lower_triangle
from cms.linear_algebra.sparse_cholesky import front_kernels, kernels
from cms.linear_algebra.sparse_cholesky.factor import CholeskyFactor
from floatframe.cli.compile_kernels import PARTS
from tests.cms.linear_algebra.sparse_cholesky.examples import grid

def compiled():
    named = {**vars(kernels), **vars(front_kernels)}.items()
    return {(name, kind) for name, each in named if isinstance(each, Dispatcher) for kind in each.signatures}

PARTS["cholesky"][1]()
before = compiled()
for on_disk in (False, True):
    factor = CholeskyFactor(lower_triangle(grid(15, dofs=3)), on_disk=on_disk)
    for columns in (1, 2, 40):
        factor.solve(np.ones((3 * 15**3, columns)))
    factor.close()
print(len(before), sorted(name for name, _ in compiled() - before))
"""


def test_a_large_factor_needs_no_more_code_than_prepare_compiles():
    known = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", FACTORS], env=known, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    n_functions, _, more = done.stdout.strip().partition(" ")
    assert int(n_functions) > 5
    assert more == "[]"
