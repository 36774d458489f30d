"""How Python hands arrays to the kernels."""

import numpy as np
import pytest
from numba.core.errors import TypingError
from numba.extending import intrinsic
from numba.np.arrayobj import make_array

from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.kernels.compiler.compilation import (
    array_type,
    array_value,
    entry,
    inner,
    loops,
    matrix_loops,
    small,
)
from floatframe.engine.kernels.compiler.structure import Structure, n_words
from floatframe.engine.kernels.entry import NO_MEMORY
from floatframe.engine.kernels.memory import Memory, Rows, new_rows
from floatframe.engine.kernels.model import JointRows, Model
from floatframe.engine.kernels.records import leaves, measured
from floatframe.engine.kernels.work import Work, new_work
from tests.floatframe.engine.kernels.examples import system_with_everything

MODEL = compiled_system(system_with_everything()).model


def places(structure, first=0, within=""):
    """Return type and place in the table of every array of a structure by name."""
    found = {}
    for name, (kind, place) in structure.fields.items():
        if isinstance(kind, Structure):
            found |= places(kind, first + place, f"{within}{name}.")
        else:
            found[within + name] = kind, first + place
    return found


@pytest.mark.parametrize(
    ("declaration", "data"),
    [(Model(), MODEL), (Work(), new_work(MODEL)), (Memory(), NO_MEMORY), (Rows(), new_rows(MODEL, 3))],
    ids=["Model", "Work", "Memory", "Rows"],
)
def test_arrays_are_what_the_kernels_take_them_for(declaration, data):
    """Number, dimensions and order of every array; its address and shape where the kernels look for them."""
    found, table = places(Structure(declaration)), data.table
    arrays = dict(leaves(data))
    assert list(arrays) == list(found)
    assert len(table) == n_words(declaration)
    for name, array in arrays.items():
        kind, place = found[name]
        assert array.flags.c_contiguous, name
        assert array.dtype == (np.int64 if "int64" in str(kind) else np.float64), name
        assert array.ndim == getattr(kind, "ndim", 0), name
        assert table[place] == array.ctypes.data, name
        assert tuple(table[place + 1 : place + 1 + array.ndim]) == array.shape, name


def test_an_array_that_is_not_what_is_declared_is_named():
    rows = MODEL.rows
    wrong = [
        rows._replace(x=rows.x[:, :2].copy()),
        rows._replace(x=rows.x[1:].copy()),
        rows._replace(x=rows.x.astype(np.float32)),
        rows._replace(x=np.asfortranarray(rows.x)),
        rows._replace(x=JointRows().x),
    ]
    measured(Model(), MODEL)
    for each in wrong:
        with pytest.raises(ValueError, match=r"Model\.rows\.x: expected"):
            measured(Model(), MODEL._replace(rows=each))


@intrinsic
def as_block(_, array):
    """Return an array as kernels see it."""

    def generate(context, builder, signature, arguments):
        value = make_array(array)(context, builder, arguments[0])
        shape = [builder.extract_value(value.shape, k) for k in range(array.ndim)]
        return array_value(context, builder, signature.return_type, value.data, shape)

    return array_type(array.dtype, array.ndim)(array), generate


def test_an_error_in_a_kernel_names_the_line():
    @entry
    def broken(x):
        return x[0] + "text"

    with pytest.raises(TypingError, match=r"test_arrays.py.*, line \d+"):
        broken(np.zeros(1))


@pytest.mark.parametrize("decorator", [inner, small, loops, matrix_loops])
def test_kernels_calculate_as_python_does(decorator):
    """Loops, branches, parts, tuples, changes of variables: all that lowering and passes of kernels touch."""

    def plain(A, q):
        n, m = A.shape
        total, low, high = 0.0, A[0, 0], A[0, 0]
        for i in range(n):
            row = A[i]
            part = row[1:]
            x = row[0]
            if x < 0.0:
                x = -2.0 * x
            elif x == 0.0:
                x = 1.0
            c = (x, x * x, 3.0)
            for j in range(part.size):
                total += part[j] * c[j % 3]
                low, high = min(low, part[j]), max(high, part[j])
            k = 0
            while k < m and A[i, k] < 1.0:
                k += 1
            q[i] = k / m + 7 // (k + 1)
        flat = A.reshape(n * m)
        q[n] = flat[n * m - 1] ** 2 + (total if total > 0.0 else -total) + c[1]
        q[n + 1 :] = low - high
        return total, k

    lean = decorator(plain)

    @entry
    def compiled(A, q, B, p):
        total, k = lean(as_block(A), as_block(q))
        again, _ = lean(as_block(B), as_block(p))
        return total, k, again

    rng = np.random.default_rng(3)
    A, B = rng.normal(size=(4, 5)), rng.normal(size=(3, 4))
    q, p, q_, p_ = (np.zeros(8) for _ in range(4))
    total, k, again = compiled(A, q, B, p)
    total_, k_ = plain(A, q_)
    again_, _ = plain(B, p_)
    assert k == k_
    np.testing.assert_allclose([total, again, *q, *p], [total_, again_, *q_, *p_], rtol=1e-14, atol=0)
