"""How Python hands arrays to the kernels."""

import subprocess
import sys

import numpy as np
import pytest

from floatframe.kernels.entry import no_memory, prepare, run
from floatframe.kernels.model import Memory, Model, Rows, Work, new_rows, new_work
from floatframe.kernels.structure import Structure, table_of
from tests.floatframe.test_tangent import system_with_everything

MODEL = system_with_everything().compiled.model


@pytest.mark.parametrize(
    ("kind", "data"),
    [(Model, MODEL), (Work, new_work(MODEL)), (Memory, no_memory()), (Rows, new_rows(MODEL, 3))],
    ids=["Model", "Work", "Memory", "Rows"],
)
def test_arrays_are_what_the_kernels_take_them_for(kind, data):
    """Number, dimensions and order of every array; its address and shape where the kernels look for them."""
    fields, table = Structure(kind).fields, table_of(data)
    for name, array in data._asdict().items():
        block, place = fields[name]
        assert array.flags.c_contiguous, name
        assert array.dtype == (np.int64 if str(block.dtype) == "int64" else np.float64), name
        assert array.ndim == block.ndim, name
        assert table[place] == array.ctypes.data, name
        assert tuple(table[place + 1 : place + 1 + array.ndim]) == array.shape, name


def test_there_is_one_compilation_for_all_systems():
    prepare()
    assert not prepare()
    assert len(run.signatures) == 1


def test_kernels_come_from_the_cache_in_the_next_process():
    prepare()
    code = "from floatframe.kernels.entry import prepare; print(prepare())"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"
