"""Kernels as the compilers compile them and as Python runs them: the same numbers, and indices that are checked."""

import os
import subprocess
import sys

import numpy as np
import pytest

from floatframe.engine.kernels.compiler.choice import VARIABLE
from floatframe.engine.kernels.compiler.interpreted import record_at
from floatframe.engine.kernels.memory import Memory
from floatframe.engine.kernels.records import zeros
from tests.floatframe.engine.kernels.compiler.computed import CELLS, N_SYSTEMS, computed_systems
from tests.floatframe.engine.structure_preserving.compared import ALL
from tests.floatframe.engine.structure_preserving.parts import METHODS
from tests.root import ROOT

ROUNDING = 1e-13  #: of the largest number of an array
EVERY_CHANGE = (1, 5, 7, 13, 16, 19, 22)  #: systems of which every change takes the steps, in 20 s of a processor


def interpreted(arguments):
    """Run Python with interpreted kernels; return the finished process."""
    known = {**os.environ, "PYTHONPATH": str(ROOT), VARIABLE: "interpreted"}
    return subprocess.run(
        [sys.executable, *arguments], cwd=ROOT, env=known, capture_output=True, text=True, check=False
    )


def assert_same_numbers(tmp_path, systems):
    """Compare the results of this process with those of another, whose kernels run as Python."""
    path = tmp_path / "results.npz"
    module = "tests.floatframe.engine.kernels.compiler.computed"
    done = interpreted(["-m", module, str(path), *map(str, systems)])
    assert done.returncode == 0, done.stderr[-2000:]
    expected, found = np.load(path), computed_systems(systems)
    assert list(found) == list(expected)
    for name, array in found.items():
        scale = np.abs(expected[name]).max(initial=0.0)
        np.testing.assert_allclose(array, expected[name], rtol=0, atol=ROUNDING * scale, err_msg=name)


def test_compiled_kernels_give_the_numbers_of_python(tmp_path):
    assert_same_numbers(tmp_path, EVERY_CHANGE)


@pytest.mark.long
@pytest.mark.parametrize("first", range(0, N_SYSTEMS, 10))
def test_compiled_kernels_give_the_numbers_of_python_for_100_systems(tmp_path, first):
    assert_same_numbers(tmp_path, range(first, first + 10))


def test_the_systems_have_every_part_and_every_scheme():
    taken = [cell for k in range(N_SYSTEMS) for cell in CELLS[k::N_SYSTEMS]]
    assert sorted(taken) == sorted(CELLS)
    assert {scheme for scheme, _ in taken} == set(METHODS)
    assert {part for _, part in taken} == set(ALL)


#: a marker of a body that does not exist
SPOILT = """
import numpy as np
from floatframe import Marker, PointForce, RigidBody, System
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.kernels.entry import evaluate_and_linearize
from floatframe.engine.kernels.work import new_work
push = PointForce("push", Marker("top"), (1.0, 0, 0))
model = compiled_system(System([RigidBody("top", 1.0, np.eye(3))], forces=[push])).model
markers = model.markers._replace(body=model.markers.body + 7)
evaluate_and_linearize(model._replace(markers=markers), new_work(model), 1.0, 0.0, 0.0)
"""


def test_an_index_outside_an_array_is_reported_with_array_and_kernel():
    done = interpreted(["-c", SPOILT])
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == "IndexError: Iterate.R: index 7 is out of bounds for axis 0 with size 1"
    assert "in marker_motion" in done.stderr


SIZES = {"n_b": 3, "n_q": 0, "n_u": 18, "n_w": 0, "n_remembered": 0, "angles": 0}


@pytest.mark.parametrize(("index", "words"), [
    (3, "index 3 is out of bounds for axis 0 with size 3"), ((0, 3), "index 3 is out of bounds for axis 1 with size 3"),
    (-1, "index -1 is out of bounds for axis 0 with size 3"), (slice(2, 4), "slice 2:4 is out of bounds for axis 0"),
])  # fmt: skip
def test_indices_are_checked_as_kernels_need_it(index, words):
    """numpy counts negative indices from the end, and shortens slices."""
    memory = zeros(Memory(), SIZES)
    positions = record_at(Memory(), memory.table).r
    with pytest.raises(IndexError, match=f"Memory.r: {words}"):
        positions[index]
    with pytest.raises(IndexError, match=f"Memory.r: {words}"):
        positions[index] = 1.0
    positions[2, 2] = 5.0
    assert memory.r[2, 2] == 5.0
