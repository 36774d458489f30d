"""Tall arrays on disk: memory maps of unnamed files, which the system removes when the process ends.

They behave like other NumPy arrays. Pages of a map that were touched count as memory of the process until they are
released (`release`). Computations therefore go through slices of rows (`row_slices`) and release each slice. Large
results computed from an array on disk also go to disk (`zeros_like`), so callers need not pass the location on.
"""

import mmap
import os
import tempfile
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fe_models.foundation.errors import StorageError

__all__ = ["is_on_disk", "on_disk", "release", "row_slices", "zeros_like"]

Array = NDArray[np.float64]

SLICE_BYTES = 32e6  #: size of a slice of rows that is processed at a time [bytes]
LARGE = 64e6  #: size above which a result computed from an array on disk is also stored on disk [bytes]


def on_disk(shape: tuple[int, ...]) -> Array:
    """Return an array of zeros in a file in the folder for temporary files, in C order.

    Parameters
    ----------
    shape
        Shape of the array.

    Raises
    ------
    StorageError
        If the folder has too little space. The space is reserved immediately, so that a computation cannot fail later.
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
    """Return the memory map of an array, or of the array of which it is a view; None for an array in memory."""
    while isinstance(X, np.ndarray):
        X = X.base
    return X if isinstance(X, mmap.mmap) else None


def is_on_disk(X: Any) -> bool:
    """Return whether an array is stored on disk."""
    return mapped(X) is not None


def release(X: Array) -> None:
    """Release the memory of an array on disk; its values stay on disk."""
    found = mapped(X)
    if found is not None and hasattr(mmap, "MADV_DONTNEED"):
        found.madvise(mmap.MADV_DONTNEED)


def zeros_like(X: Any, shape: tuple[int, ...]) -> Array:
    """Return zeros for a result computed from X: on disk if X is on disk and the result is large; C order."""
    is_large = 8 * int(np.prod(shape)) >= LARGE
    return on_disk(shape) if is_large and is_on_disk(X) else np.zeros(shape)


def row_slices(rows: slice | int, *arrays: Array, height: int | None = None) -> Iterator[slice]:
    """Yield slices of rows and release the memory after each; without an array on disk, slices of the given height.

    Parameters
    ----------
    rows
        The rows as a slice, or the number of rows.
    arrays
        Arrays with at least so many rows.
    height
        Number of rows of a slice if no array is on disk; None: a single slice.
    """
    whole = rows if isinstance(rows, slice) else slice(0, rows)
    stored = [X for X in arrays if is_on_disk(X)]
    if stored:
        height = max(16, int(SLICE_BYTES / max(max(X[:1].nbytes for X in stored), 1)))
    if height is None:
        yield whole
        return
    for first in range(whole.start, whole.stop, height):
        yield slice(first, min(first + height, whole.stop))
        for X in stored:
            release(X)
