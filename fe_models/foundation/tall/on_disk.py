"""Tall arrays on disk: mapped from a file without a name, which the system removes with the process.

They are NumPy arrays as others are. What was touched of a mapped array counts as memory of the process until it is
given back (`release`); so work goes by slices of rows (`row_slices`), after each of which it is. What is made of an
array on disk, and is large, goes there as well (`zeros_like`): nobody has to hand on where arrays lie. `in_memory`,
`copied` and `beside` also take columns whose rows lie on many ranks (`SpreadColumns`).
"""

import mmap
import os
import tempfile
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fe_models.foundation.errors import StorageError
from fe_models.foundation.ranks.spread_columns import SpreadColumns, spread_beside

__all__ = ["beside", "copied", "in_memory", "is_on_disk", "on_disk", "release", "row_slices", "zeros_like"]

Array = NDArray[np.float64]

SLICE_BYTES = 32e6  #: of rows that are worked on at once
LARGE = 64e6  #: bytes from which what is made of an array on disk goes there too


def on_disk(shape: tuple[int, ...]) -> Array:
    """Return an array of zeros in a file in the folder for temporary files, (shape), C order.

    Raises
    ------
    StorageError
        If the folder has too little room: that is reserved at once, so that the work does not stop in its midst.
    """
    size = 8 * int(np.prod(shape))
    if not size:
        return np.zeros(shape)
    folder = tempfile.gettempdir()
    try:
        with tempfile.TemporaryFile(dir=folder, buffering=0) as file:
            if hasattr(os, "posix_fallocate"):
                os.posix_fallocate(file.fileno(), 0, size)
            else:
                file.truncate(size)
            return np.ndarray(shape, np.float64, buffer=mmap.mmap(file.fileno(), size))
    except OSError as error:
        raise StorageError(
            f"columns of {size / 1e9:.3g} GB do not go to disk in {folder}: {error.strerror}; choose another folder by "
            "TMPDIR"
        ) from error


def mapped(X: Any) -> mmap.mmap | None:
    """Return the map that an array, or what it is a view of, lies in; None for one in memory."""
    while isinstance(X, np.ndarray):
        X = X.base
    return X if isinstance(X, mmap.mmap) else None


def is_on_disk(X: Array) -> bool:
    """Return whether an array lies on disk."""
    return mapped(X) is not None


def release(X: Array) -> None:
    """Give back the memory of an array on disk; its numbers stay."""
    found = mapped(X)
    if found is not None and hasattr(mmap, "MADV_DONTNEED"):
        found.madvise(mmap.MADV_DONTNEED)


def zeros_like(X: Array, shape: tuple[int, ...]) -> Array:
    """Return zeros for what is made of X: on disk where X is, and they are large; else in memory. C order."""
    is_large = 8 * int(np.prod(shape)) >= LARGE
    return on_disk(shape) if is_large and is_on_disk(X) else np.zeros(shape)


def row_slices(rows: slice | int, *arrays: Array) -> Iterator[slice]:
    """Yield slices of rows, all at once where no array is on disk; memory of those that are is given back after each.

    Parameters
    ----------
    rows
        The rows as a slice, or how many from the first.
    arrays
        All of as many rows or more.
    """
    whole = rows if isinstance(rows, slice) else slice(0, rows)
    stored = [X for X in arrays if is_on_disk(X)]
    if not stored:
        yield whole
        return
    height = max(16, int(SLICE_BYTES / max(max(X[:1].nbytes for X in stored), 1)))
    for first in range(whole.start, whole.stop, height):
        yield slice(first, min(first + height, whole.stop))
        for X in stored:
            release(X)


def copied(X: Any) -> Any:
    """Return a copy, on disk or on the ranks where X is."""
    return beside(X)


def beside(*arrays: Any) -> Any:
    """Return arrays of as many rows side by side, (n, k).

    On disk where one of them is and they are large; on all ranks where one of them is.
    """
    if found := [X for X in arrays if isinstance(X, SpreadColumns)]:
        return spread_beside(found[0].layout, *arrays)
    width = sum(X.shape[1] for X in arrays)
    stored = next((X for X in arrays if is_on_disk(X)), arrays[0])
    result = zeros_like(stored, (len(stored), width))
    for rows in row_slices(len(stored), *arrays, result):
        np.concatenate([X[rows] for X in arrays], axis=1, out=result[rows])
    return result


def in_memory(X: Any) -> Array:
    """Return an array itself, or, of one on disk or on many ranks, a copy in memory in C order."""
    if isinstance(X, SpreadColumns):
        return X.whole()
    if not is_on_disk(X):
        return X
    result = np.empty(X.shape)
    for rows in row_slices(len(X), X):
        result[rows] = X[rows]
    return result


def of_this_process(X: Any) -> Array:
    """Return an array itself, in memory or on disk, or, of columns on many ranks, a copy in memory."""
    return X.whole() if isinstance(X, SpreadColumns) else X
