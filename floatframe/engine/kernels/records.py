"""Records of arrays; the shape, unit and number type of each array are declared once, in its record.

A record is a named tuple of arrays and of other records. A record created without values contains their declarations.
So `Work()` declares all working arrays, and everything else follows from it:

    zeros(Work(), sizes)         the arrays, all zero
    filled(Springs(), ...)       arrays made of lists
    of_items(Springs(), items)   arrays made of items with one entry for each array
    measured(Model(), model)     the sizes of given arrays, which must agree with their declarations
    leaves(model)                the arrays in order, in which kernels find them (compiler/structure.py)

Records that Python passes to kernels are `tabled`: `model.table` contains addresses and shapes of all arrays.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import prod
from typing import Any, NamedTuple, TypeVar

import numpy as np

from fe_models.foundation.arrays import Array, IntArray

__all__ = [
    "Declared",
    "Size",
    "filled",
    "flat",
    "integer",
    "leaves",
    "measured",
    "of_items",
    "real",
    "stacked",
    "tabled",
    "zeros",
]

Record = TypeVar("Record", bound=NamedTuple)

WORD = 8  #: size of a number of any type in bytes
LINE = 8  #: size of a cache line in numbers; every array begins at a cache line


class Tabled:
    """Data that belong to a record in addition to its arrays, and are freed with it."""

    @cached_property
    def table(self) -> IntArray:
        """Address and shape of each array in the order of the record, as kernels read them.

        It is made once, because this takes as long as a step.
        """
        words: list[int] = []
        for _, array in leaves(self):
            words.append(array.__array_interface__["data"][0])
            words += array.shape
        return np.array(words, np.int64)

    @cached_property
    def sizes(self) -> dict[str, int]:
        """The sizes of the arrays by name, see `measured`."""
        return measured(type(self)(), self)  # type: ignore[type-var]

    def __reduce__(self) -> tuple[Any, ...]:  # a copy has its own arrays, and therefore its own table
        return type(self), tuple(self)  # type: ignore[arg-type]


def tabled(record: type[Record]) -> type[Record]:
    """Return the class of a record with `Tabled`."""
    names = {name: getattr(record, name) for name in ("__doc__", "__module__", "__qualname__")}
    return type(record.__name__, (Tabled, record), names)


@dataclass(frozen=True)
class Size:
    """A symbolic array size: a named number of items, or factor * number + more."""

    name: str
    factor: int = 1
    more: int = 0

    def __rmul__(self, factor: int) -> "Size":
        return Size(self.name, factor * self.factor, factor * self.more)

    def __add__(self, more: int) -> "Size":
        return Size(self.name, self.factor, self.more + more)

    def of(self, sizes: Mapping[str, int]) -> int:
        """Return the number for given sizes."""
        return self.factor * sizes[self.name] + self.more

    def __str__(self) -> str:
        product = self.name if self.factor == 1 else f"{self.factor} {self.name}"
        return f"{product} + {self.more}" if self.more else product


@dataclass(frozen=True)
class Declared:
    """Declaration of an array in a record."""

    dtype: type
    shape: tuple[Size | int, ...]  #: shape of the array, () for a single number
    unit: str  #: unit of the numbers, "" if they have none


def real(*shape: Size | int, unit: str = "") -> Any:
    """Declare an array of real numbers."""
    return Declared(np.float64, shape, unit)


def integer(*shape: Size | int) -> Any:
    """Declare an array of integers."""
    return Declared(np.int64, shape, "")


def stacked(declaration: Record, size: Size) -> Record:
    """Declare consecutive records of arrays: each array gets one more dimension, its first."""
    arrays: Any = (Declared(each.dtype, (size, *each.shape), each.unit) for each in declaration)
    return type(declaration)(*arrays)


@dataclass(frozen=True, eq=False)
class Layout:
    """Positions of the arrays of a record in one block of memory."""

    arrays: tuple[tuple[tuple[int, ...], np.dtype[Any], int], ...]  #: shape, number type and first byte of each array
    n_words: int
    table: IntArray  #: table of the record for a block at address 0
    addresses: IntArray  #: indices of the addresses in the table


@lru_cache(maxsize=256)
def layout_of(kind: type[Any], sizes: tuple[tuple[str, int], ...]) -> Layout:
    """Return the layout of a record in which each array begins at a cache line."""
    known = dict(sizes)
    arrays: list[tuple[tuple[int, ...], np.dtype[Any], int]] = []
    table: list[int] = []
    addresses: list[int] = []
    n_words = 0
    for each in declarations(kind()):
        shape = tuple(size.of(known) if isinstance(size, Size) else size for size in each.shape)
        arrays.append((shape, np.dtype(each.dtype), WORD * n_words))
        addresses.append(len(table))
        table += [WORD * n_words, *shape]
        n_words += -(-prod(shape) // LINE) * LINE
    return Layout(tuple(arrays), n_words, np.array(table, np.int64), np.array(addresses, np.int64))


def zeros(declaration: Record, sizes: Mapping[str, int]) -> Record:
    """Return a record of zero arrays in one block of memory, whose table follows from the address of the block."""
    layout = layout_of(type(declaration), tuple(sizes.items()))
    block = np.zeros(layout.n_words + LINE)
    address = block.__array_interface__["data"][0]
    shift = -address % (WORD * LINE)  # bytes up to the first cache line
    arrays = [np.ndarray(shape, dtype, block, shift + first) for shape, dtype, first in layout.arrays]
    is_flat = len(arrays) == len(declaration)
    made = type(declaration)._make(arrays) if is_flat else grouped(declaration, iter(arrays))
    if isinstance(made, Tabled):
        made.table = layout.table.copy()
        made.table[layout.addresses] += address + shift
    return made


def declarations(declaration: Any) -> Iterator[Declared]:
    """Return the declarations of the arrays of a record and of the records in it, as `leaves` does."""
    for each in declaration:
        if isinstance(each, Declared):
            yield each
        else:
            yield from declarations(each)


def grouped(declaration: Record, arrays: Iterator[Array]) -> Record:
    """Return a record with as many of the arrays as it declares."""
    made: list[Any] = [next(arrays) if isinstance(each, Declared) else grouped(each, arrays) for each in declaration]
    return type(declaration)(*made)


def filled(declaration: Record, **values: Any) -> Record:
    """Return a record with arrays made from lists of entries, and numbers made from single values.

    Records inside the record are passed unchanged.
    """
    made: dict[str, Any] = {}
    for name, declared in zip(declaration._fields, declaration, strict=True):
        if not isinstance(declared, Declared):
            made[name] = values.pop(name)
            continue
        array: Array = np.array(values.pop(name), declared.dtype, order="C")
        made[name] = array.reshape(-1, *declared.shape[1:]) if declared.shape else array
    if values:
        raise TypeError(f"{type(declaration).__name__} has no arrays {', '.join(values)}")
    return declaration._replace(**made)


def of_items(declaration: Record, items: Sequence[Mapping[str, Any]], **whole: Any) -> Record:
    """Return a record with one array entry for each item; some arrays may be given completely."""
    names = [name for name in declaration._fields if name not in whole]
    return filled(declaration, **{name: [item[name] for item in items] for name in names}, **whole)


def leaves(record: Any, within: str = "") -> Iterator[tuple[str, Any]]:
    """Return name and array (or declaration) of all fields of a record and of the records in it."""
    for name, each in zip(record._fields, record, strict=True):
        if isinstance(each, tuple):
            yield from leaves(each, f"{within}{name}.")
        else:
            yield f"{within}{name}", each


def measured(declaration: Record, record: Record) -> dict[str, int]:
    """Return the sizes of the arrays of a record by name.

    Raises
    ------
    ValueError
        If an array does not agree with its declaration, or with the sizes of earlier arrays.
    """
    sizes: dict[str, int] = {}
    where = type(declaration).__name__
    declared = dict(leaves(declaration))
    for name, array in leaves(record):
        each = declared[name]
        if not isinstance(array, np.ndarray) or array.dtype != each.dtype or array.ndim != len(each.shape):
            raise ValueError(f"{where}.{name}: expected {each}, got {described(array)}")
        if not array.flags.c_contiguous:
            raise ValueError(f"{where}.{name}: expected an array in C order")
        for n, size in zip(array.shape, each.shape, strict=True):
            if isinstance(size, Size):
                known = sizes.setdefault(size.name, (n - size.more) // size.factor)
                size = size.factor * known + size.more
            if n != size:
                raise ValueError(
                    f"{where}.{name}: expected shape ({', '.join(map(str, each.shape))}), got {array.shape}"
                )
    return sizes


def described(value: Any) -> str:
    """Return the description of an array, for messages."""
    return f"{value.dtype} of shape {value.shape}" if isinstance(value, np.ndarray) else repr(value)


def flat(arrays: list[Array]) -> Array:
    """Return arrays joined into one vector."""
    return np.concatenate([*(np.ascontiguousarray(each, dtype=float).ravel() for each in arrays), np.zeros(0)])
