"""Code of inner functions on disk: the key of a function changes with everything that decides about its code."""

import math
import os
import time

import pytest
from numba import float64, int64
from numba.core import types
from numba.core.bytecode import FunctionIdentity

from floatframe.engine.kernels.compiler import lean, stored
from floatframe.engine.kernels.compiler.lean import InnerLibrary, entry, inner, loops
from floatframe.engine.kernels.compiler.stored import code_key, delete_old
from floatframe.engine.kernels.joints.row_formulas import by_code

SOURCE = """
def called(x):
    return x * FACTOR + 0.5

called = inner(called)

def caller(x):
    return called(max(x, 1.0)) - 1.0

caller = inner(caller)

def other(x):
    return x

other = inner(other)

def run(x):
    return caller(x) + other(x)

run = entry(run, cache=False)
"""


@pytest.fixture
def written(tmp_path, monkeypatch):
    """The names and keys of the functions whose code was written, in an empty folder."""
    found = []
    write = InnerLibrary.store

    def store(self, key, result):
        found.append((self.name, key))
        write(self, key, result)

    monkeypatch.setattr(stored, "FOLDER", tmp_path)
    monkeypatch.setattr(InnerLibrary, "store", store)
    monkeypatch.setattr(InnerLibrary, "known", {})
    return found


def names_of(written):
    return sorted(name for name, _ in written)


def made(source=SOURCE, **values):
    """The names of a source; as in a new process, no library is known."""
    InnerLibrary.known.clear()
    names = {"__name__": "tests.made", "inner": inner, "entry": entry, "math": math, "FACTOR": 2.0} | values
    exec(source, names)
    return names


def key_of(source, *arguments, options="", **values):
    return code_key(made(source, **values)["caller"].py_func, arguments or (float64,), options)


def test_unchanged_functions_are_read_from_disk_and_give_the_same(written):
    assert made()["run"](3.0) == 3.0 * 2.0 + 0.5 - 1.0 + 3.0
    assert names_of(written) == ["called", "caller", "other"]
    written.clear()
    assert made()["run"](3.0) == 3.0 * 2.0 + 0.5 - 1.0 + 3.0
    assert written == []


def test_an_edited_function_and_its_callers_alone_are_compiled(written):
    made()["run"](3.0)
    written.clear()
    assert made(SOURCE.replace("0.5", "0.75"))["run"](3.0) == 3.0 * 2.0 + 0.75 - 1.0 + 3.0
    assert names_of(written) == ["called", "caller"]


def test_a_table_of_functions_is_read_from_disk(written):
    # without a module it was stored under one symbol and looked for under another
    source = SOURCE.replace("caller(x) + other(x)", "chosen(1, x)").replace(
        "def run", "chosen = by_code('chosen', {0: other, 1: caller}, 'x')\n\ndef run"
    )
    for names in (["called", "caller", "chosen", "other"], []):
        written.clear()
        assert made(source, by_code=by_code)["run"](3.0) == 3.0 * 2.0 + 0.5 - 1.0
        assert names_of(written) == names


def test_functions_of_one_name_with_other_values_are_kept_apart(written):
    for factor in (2.0, 3.0, 2.0):
        assert made(FACTOR=factor)["run"](4.0) == 4.0 * factor + 0.5 - 1.0 + 4.0
    assert len(written) == 3 + 2


def with_symbol_of_name(function, key):
    """Return the identity of a function whose symbol depends only on its name and types."""
    known = FunctionIdentity.from_function(function)
    known.unique_id, known.unique_name = 1, known.func_qualname
    return known


def test_functions_with_one_symbol_are_refused_and_not_merged(monkeypatch):
    """The linker would keep one of them, so that twice its value is returned."""
    monkeypatch.setattr(lean, "identity", with_symbol_of_name)
    monkeypatch.setattr(lean, "code_key", lambda *arguments: None)
    double, triple = (made(FACTOR=factor)["called"] for factor in (2.0, 3.0))
    with pytest.raises(RuntimeError, match="two inner functions named called have one symbol"):
        entry(lambda x: double(x) + triple(x), cache=False)(1.0)
    assert entry(lambda x: double(x) + double(x), cache=False)(1.0) == 5.0


def test_code_that_lost_a_called_function_or_is_damaged_is_compiled_again(written, tmp_path):
    made()["run"](3.0)
    path = tmp_path / dict(written)["called"]
    for damage in ("unlink", "truncate"):
        written.clear()
        path.unlink() if damage == "unlink" else path.write_bytes(path.read_bytes()[:40])
        assert made()["run"](3.0) == 3.0 * 2.0 + 0.5 - 1.0 + 3.0
        assert names_of(written) == ["called", "caller"]


PARTS = """
def deep(x):
    return x + OFFSET

deep = inner(deep)

def called(x):
    return deep(x)

called = inner(called)

def caller(x, y=1.0):
    return called(x) * FACTOR

caller = inner(caller)
"""


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("* FACTOR", "/ FACTOR"), ("x + OFFSET", "x - OFFSET"), ("y=1.0", "y=2.0"), ("called(x) *", "deep(x) *"),
        ("deep = inner(deep)", "deep = loops(deep)"), ("called(x) *", "-called(x) *"),
    ],
)  # fmt: skip
def test_a_change_of_a_function_or_of_one_that_it_calls_changes_the_key(old, new):
    assert old in PARTS
    values = {"OFFSET": 1.0, "loops": loops}
    assert key_of(PARTS, **values) == key_of(PARTS, **values)
    assert key_of(PARTS.replace(old, new), **values) != key_of(PARTS, **values)


def test_values_types_and_options_change_the_key():
    plain = key_of(PARTS, OFFSET=1.0)
    others = [
        key_of(PARTS, OFFSET=1.5), key_of(PARTS, OFFSET=1), key_of(PARTS, OFFSET=True),
        key_of(PARTS, int64, OFFSET=1.0),
        key_of(PARTS, float64, int64, OFFSET=1.0), key_of(PARTS, OFFSET=1.0, options="optsize"),
        key_of(PARTS, types.UniTuple(float64, 2), OFFSET=1.0), key_of(PARTS, types.UniTuple(float64, 3), OFFSET=1.0),
    ]  # fmt: skip
    assert None not in others
    assert len({plain, *others}) == 1 + len(others)


def test_lines_that_move_and_comments_keep_the_key():
    assert key_of("\n\n# why\n" + PARTS, OFFSET=1.0) == key_of(PARTS, OFFSET=1.0)


def test_what_uses_a_value_of_unknown_kind_has_no_key_and_is_compiled(written):
    assert key_of(PARTS, OFFSET=object()) is None
    unknown = made(SOURCE.replace("FACTOR", "FACTORS[0]"), FACTORS=[2.0])
    assert code_key(unknown["called"].py_func, (float64,), "") is None
    assert code_key(unknown["caller"].py_func, (float64,), "") is None
    assert code_key(unknown["other"].py_func, (float64,), "") is not None


def test_files_that_were_not_read_for_long_are_deleted(written, tmp_path):
    made()["run"](3.0)
    old = next(tmp_path.iterdir())
    os.utime(old, (time.time() - 100.0,) * 2)
    delete_old(50.0)
    assert not old.exists()
    assert len(list(tmp_path.iterdir())) == 2
