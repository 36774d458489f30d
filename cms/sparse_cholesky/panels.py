"""Where the columns of a factor wait for the solves: in memory, or in a file that vanishes with its process."""

import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Protocol

import numpy as np

from cms.errors import FactorRoomError
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["Panels", "PanelsInFile", "PanelsInMemory"]

Panel = tuple[Array, Array]  #: of a front: its diagonal block (w, w) and the rows below (u, w), in Fortran order


class Panels(Protocol):
    """Panels of all fronts, written once in their order."""

    def append(self, diagonal: Array, below: Array) -> None:
        """Keep the panel of the next front."""

    def each(self, *, backwards: bool = False) -> Iterator[tuple[int, Panel]]:
        """Go through the panels; one is to be used up before the next is asked for."""

    def close(self) -> None:
        """Give up what they take."""


class PanelsInMemory:
    """Panels as arrays."""

    def __init__(self) -> None:
        self._panels: list[Panel] = []

    def append(self, diagonal: Array, below: Array) -> None:
        """Keep the panel of the next front."""
        self._panels.append((diagonal, below))

    def each(self, *, backwards: bool = False) -> Iterator[tuple[int, Panel]]:
        """Go through the panels."""
        numbers = range(len(self._panels))
        for f in reversed(numbers) if backwards else numbers:
            yield f, self._panels[f]

    def close(self) -> None:
        """Free them."""
        self._panels = []


class PanelsInFile:
    """Panels in a file without a name, which the system removes with the process, however that ends."""

    def __init__(self, width: IntArray, below: IntArray, folder: Path | None = None) -> None:
        """Open the file for fronts of these sizes, (n_fronts,) each, in the folder for temporary files by default.

        Raises
        ------
        FactorRoomError
            If the folder does not exist, cannot be written, or has too little room.
        """
        self._shapes = [(int(w), int(u)) for w, u in zip(width, below, strict=True)]
        sizes = 8 * (np.asarray(width) * (np.asarray(width) + np.asarray(below)))
        self._ends = np.concatenate([[0], np.cumsum(sizes)])
        self._buffer = np.empty(int(sizes.max(initial=0)) // 8)
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

    def append(self, diagonal: Array, below: Array) -> None:
        """Write the panel of the next front."""
        try:
            for part in (diagonal, below):
                left = part.ravel(order="K").data.cast("B")
                while len(left):
                    left = left[self._file.write(left) :]
        except OSError as error:
            raise FactorRoomError(f"the factor could not be written to disk: {error.strerror}") from error

    def each(self, *, backwards: bool = False) -> Iterator[tuple[int, Panel]]:
        """Read the panels one by one into the same memory."""
        numbers = range(len(self._shapes))
        for f in reversed(numbers) if backwards else numbers:
            w, u = self._shapes[f]
            numbers_of = self._buffer[: w * (w + u)]
            self._file.seek(int(self._ends[f]))
            left = numbers_of.data.cast("B")
            while len(left):
                got = self._file.readinto(left)
                if not got:
                    raise FactorRoomError("the factor on disk is shorter than what was written; is the disk full?")
                left = left[got:]
            yield (
                f,
                (
                    numbers_of[: w * w].reshape((w, w), order="F"),
                    numbers_of[w * w :].reshape((u, w), order="F"),
                ),
            )

    def close(self) -> None:
        """Remove the file."""
        self._file.close()
        self._buffer = np.empty(0)
