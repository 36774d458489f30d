"""Storage of the columns of a factor for the solves: in memory, or in a file that vanishes with the process."""

import os
import tempfile
import threading
from pathlib import Path
from typing import Protocol

import numpy as np

from cms.errors import FactorRoomError
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["Panels", "PanelsInFile", "PanelsInMemory"]


class Panels(Protocol):
    """The numbers of the factor by block (`cms.linear_algebra.sparse_cholesky.blocks`); each block is written once."""

    def put(self, k: int, numbers: Array) -> None:
        """Store the numbers of block k."""

    def of(self, k: int) -> Array:
        """Return the numbers of block k."""

    def close(self) -> None:
        """Free the storage."""


class PanelsInMemory:
    """Panels as arrays."""

    def __init__(self) -> None:
        self._numbers: dict[int, Array] = {}

    def put(self, k: int, numbers: Array) -> None:
        """Store the numbers of block k."""
        self._numbers[k] = numbers

    def of(self, k: int) -> Array:
        """Return the numbers of block k."""
        return self._numbers[k]

    def close(self) -> None:
        """Free the arrays."""
        self._numbers = {}


class PanelsInFile:
    """Panels in an unnamed file, which the system removes when the process ends, however it ends."""

    def __init__(self, ends: IntArray, folder: Path | None = None) -> None:
        """Open the file, by default in the folder for temporary files.

        Parameters
        ----------
        ends
            Start of the numbers of each block, and their end, (n_blocks + 1,).
        folder
            Folder of the file.

        Raises
        ------
        FactorRoomError
            If the folder does not exist, cannot be written, or has too little space.
        """
        self._ends = 8 * np.asarray(ends, dtype=np.int64)
        self._lock = threading.Lock()
        where = Path(folder or tempfile.gettempdir())
        needed = int(self._ends[-1])
        try:
            status = os.statvfs(where) if hasattr(os, "statvfs") else None
            self._file = tempfile.TemporaryFile(dir=where, buffering=0)
        except OSError as error:
            raise FactorRoomError(f"no file for the factor in {where}: {error.strerror}; choose a folder") from error
        if status is not None and status.f_bavail * status.f_frsize < needed:
            self._file.close()
            raise FactorRoomError(
                f"the factor takes {needed / 1e9:.3g} GB of disk, {where} has "
                f"{status.f_bavail * status.f_frsize / 1e9:.3g} GB; choose another folder by TMPDIR"
            )

    def put(self, k: int, numbers: Array) -> None:
        """Write the numbers of block k."""
        left = numbers.data.cast("B")
        try:
            with self._lock:
                self._file.seek(int(self._ends[k]))
                while len(left):
                    left = left[self._file.write(left) :]
        except OSError as error:
            raise FactorRoomError(f"the factor could not be written to disk: {error.strerror}") from error

    def of(self, k: int) -> Array:
        """Read the numbers of block k."""
        numbers = np.empty(int(self._ends[k + 1] - self._ends[k]) // 8)
        left = numbers.data.cast("B")
        with self._lock:
            self._file.seek(int(self._ends[k]))
            while len(left):
                got = self._file.readinto(left)
                if not got:
                    raise FactorRoomError("the factor on disk is shorter than what was written; is the disk full?")
                left = left[got:]
        return numbers

    def close(self) -> None:
        """Remove the file."""
        self._file.close()
