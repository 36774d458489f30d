"""Kernels as plain Python, without a compiler: a reference for compiled kernels, and a debugger of kernels.

The names are those of kernels/compiler/lean.py, where their purpose is described. Nothing is compiled, and a step takes
about a thousand times as long. An index outside an array raises `IndexError`, which names the array, and the kernel and
line in its traceback; compiled kernels would use other memory. Breakpoints and `print` work in kernels.
"""

import ctypes
from collections.abc import Iterator
from functools import lru_cache
from math import prod
from types import SimpleNamespace
from typing import Any

import numpy as np

from floatframe.engine.kernels.compiler.plain import array_type, array_value  # of functions that tests compile
from floatframe.engine.kernels.records import WORD, Declared

__all__ = [
    "Bounded",
    "array_type",
    "array_value",
    "entry",
    "inner",
    "loops",
    "matrix_loops",
    "record_at",
    "small",
    "view",
]


def inner(function):
    """Return the function itself, with the attribute by which generated code finds its source."""
    function.py_func = function
    return function


small = loops = matrix_loops = view = inner


class InterpretedEntry:
    """An entry that Python runs, with the parts of the interface of a numba function that the package uses."""

    def __init__(self, function) -> None:
        self.py_func = function
        self.stats = SimpleNamespace(cache_misses={})

    def compile(self, signature) -> None:
        """Do nothing."""

    def __call__(self, *tables):
        with np.errstate(all="ignore"):  # as compiled code: infinite numbers and NaN
            return self.py_func(*tables)


def entry(function, *, cache=True):
    """Return the function that Python calls."""
    return InterpretedEntry(function)


class Bounded(np.ndarray):
    """An array whose indices may not count from the end and whose slices may not exceed it, as in compiled kernels."""

    name = ""  #: of the field of a record

    def __array_finalize__(self, whole) -> None:
        self.name = getattr(whole, "name", "")

    def __getitem__(self, index):
        try:
            self.check(index)
            return np.ndarray.__getitem__(self, index)
        except IndexError as error:
            raise IndexError(f"{self.name}: {error}") from None

    def __setitem__(self, index, value):
        try:
            self.check(index)
            np.ndarray.__setitem__(self, index, value)
        except IndexError as error:
            raise IndexError(f"{self.name}: {error}") from None

    def check(self, index) -> None:
        """Raise `IndexError` for an index that numpy would accept, but kernels do not allow."""
        for axis, part in enumerate(index if type(index) is tuple else (index,)):
            if type(part) is slice:
                first, end = part.start or 0, self.shape[axis] if part.stop is None else part.stop
                if not 0 <= first <= end <= self.shape[axis]:
                    raise IndexError(
                        f"slice {first}:{end} is out of bounds for axis {axis} with size {self.shape[axis]}"
                    )
            elif part < 0:
                raise IndexError(f"index {part} is out of bounds for axis {axis} with size {self.shape[axis]}")


class RecordView:
    """A record of arrays as kernels see it: arrays and records are attributes, single numbers are read and written."""

    def __init__(self, name: str) -> None:
        self.__dict__.update(name=name, numbers={})

    def __getattr__(self, field: str) -> Any:
        try:
            return self.numbers[field][()]
        except KeyError:
            raise AttributeError(f"the record {self.name} has no field {field!r}") from None

    def __setattr__(self, field: str, value: float) -> None:
        self.numbers[field][()] = value


def record_at(declaration, table) -> RecordView:
    """Return the view of a record whose addresses and shapes are in a table."""
    return view_of(type(declaration), tuple(table.tolist()))  # type: ignore[arg-type]


@lru_cache(maxsize=64)
def view_of(kind: type[Any], words: tuple[int, ...]) -> RecordView:
    """Return the view of a record of this kind for the words of its table."""
    return next_view(kind(), iter(words))


def next_view(declaration, words: Iterator[int]) -> RecordView:
    """Return the view of a record for the next words of a table."""
    view = RecordView(type(declaration).__name__)
    for field, declared in zip(declaration._fields, declaration, strict=True):
        if not isinstance(declared, Declared):
            view.__dict__[field] = next_view(declared, words)
            continue
        address, shape = next(words), tuple(next(words) for _ in declared.shape)
        array = array_at(address, shape, declared.dtype)
        array.name = f"{view.name}.{field}"
        (view.__dict__ if shape else view.numbers)[field] = array
    return view


def array_at(address: int, shape: tuple[int, ...], dtype: type) -> Bounded:
    """Return the array at an address, whose memory another owns."""
    n_bytes = WORD * prod(shape)
    memory: Any = (ctypes.c_char * n_bytes).from_address(address) if n_bytes else bytearray()
    return Bounded(shape, dtype, memory)
