"""Multifrontal Cholesky factorisation, in memory or with the factor on disk."""

import logging
import os
import tempfile
import threading
from pathlib import Path
from typing import Protocol

import numpy as np
import scipy.sparse as sp

from cms.errors import FactorizationError, FactorRoomError
from cms.linear_algebra.sparse_cholesky.analysis import Fronts, analyse, inverse
from cms.linear_algebra.sparse_cholesky.blocks import blocks_of, for_each
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.ranks.trim import give_back
from fe_models.foundation.stages import announced_compilation
from fe_models.foundation.threads import n_threads, one_blas_thread

__all__ = ["CholeskyFactor", "Panels", "PanelsInFile", "PanelsInMemory"]

log = logging.getLogger(__name__)


# storage of the columns of a factor for the solves: in memory, or in a file that vanishes with the process ------------


class Panels(Protocol):
    """Storage of the factor by block (`cms.linear_algebra.sparse_cholesky.blocks`); each block is written once."""

    def put(self, k: int, numbers: Array) -> None:
        """Store the numbers of block k."""

    def of(self, k: int) -> Array:
        """Return the numbers of block k."""

    def close(self) -> None:
        """Free the storage."""


class PanelsInMemory:
    """Storage of the factor in arrays."""

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
    """Storage of the factor in an unnamed file, which the system removes whenever the process ends."""

    def __init__(self, ends: IntArray, folder: Path | None = None) -> None:
        """Open the file in a folder, by default in the folder for temporary files.

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
                f"the factor needs {needed / 1e9:.3g} GB of disk, {where} has "
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


# factor ---------------------------------------------------------------------------------------------------------------


#: number of right-hand sides that pass through the factor together; each factor entry read serves all of them
WIDTHS = (8, 16)


class CholeskyFactor:
    """Cholesky factor P A Pᵀ = L Lᵀ of a positive definite matrix, until `close` is called.

    For each front, children first, with w own columns and u rows below them:

    (1) F = [[F11, .], [F21, F22]]: entries of A in its columns, plus the update matrices of its children
    (2) F11 = L11 L11ᵀ;  L21 = F21 L11⁻ᵀ;  update matrix: F22 - L21 L21ᵀ
    (3) [L11; L21] is stored in the panels, through which every solve passes once forward and once backward
    """

    def __init__(
        self, lower: sp.csc_array, *, definite: bool = True, on_disk: bool = False, folder: Path | None = None,
        fronts: Fronts | None = None,
    ) -> None:  # fmt: skip
        """Factorise a matrix from its lower triangle, (n, n), with all diagonal entries stored and row indices sorted.

        Parameters
        ----------
        on_disk
            Whether to store the factor in a file in `folder` (default: the folder for temporary files) instead of
            memory.
        fronts
            Result of an earlier analysis; None: the analysis is made here.
        """
        self.is_open = False
        if not definite:
            raise FactorizationError("cholesky: expected a positive definite matrix; take superlu for others")
        self.n = lower.shape[0]
        with announced_compilation(log, "the code of the Cholesky factorisation", "about 20 s"):
            self._make(lower, fronts, on_disk, folder)

    def _make(self, lower: sp.csc_array, fronts: Fronts | None, on_disk: bool, folder: Path | None) -> None:
        try:
            self._fronts = analyse(lower) if fronts is None else fronts
        except MemoryError as error:
            raise FactorRoomError(f"cholesky: not enough memory for the analysis; n = {self.n}") from error
        self.n_factor_entries = self._fronts.n_entries
        self.n_negative = self.n_perturbed = 0
        self.n_positive = self.n
        self._blocks = blocks_of(self._fronts)
        self._panels: Panels = PanelsInFile(self._blocks.stored, folder) if on_disk else PanelsInMemory()
        self.is_open = True
        try:
            self._factorise(lower, on_disk)
        except MemoryError as error:
            self.close()
            raise FactorRoomError(
                f"cholesky: not enough memory; n = {self.n}, {self.n_factor_entries} entries of the factor"
            ) from error
        except BaseException:
            self.close()
            raise
        where = "factor on disk" if on_disk else "factor in memory"
        self.description = f"Cholesky by {len(self._fronts.above)} fronts (own; nested dissection; {where})"

    def _factorise(self, lower: sp.csc_array, on_disk: bool) -> None:
        from cms.linear_algebra.sparse_cholesky import front_kernels, kernels

        rank = inverse(self._fronts.order)
        entries = front_kernels.Entries(*kernels.permuted(lower.indptr, lower.indices, lower.data, rank))
        tree, blocks = self._blocks.tree, self._blocks
        left_size = self._fronts.below.astype(np.int64) ** 2
        left: dict[int, Array] = {}  # update matrices of each block that wait for the parent block
        local = threading.local()

        def factorise(k: int) -> None:
            if not hasattr(local, "rows"):
                local.rows, local.words = np.empty(self.n, np.int32), front_kernels.words()
            lo, hi = int(blocks.first[k]), int(blocks.first[k + 1])
            n_front, n_stack, n_left = blocks.room(k, left_size)
            F, stack = np.empty(n_front), np.empty(n_stack)
            panels = np.empty(int(tree.stored[hi] - tree.stored[lo]))
            if blocks.below[k]:
                front_kernels.begin_front(tree, entries, lo, F, stack, local.rows)  # (1)
                for child in blocks.below[k]:
                    of_child = int(blocks.first[child]), int(blocks.first[child + 1])
                    front_kernels.take_updates(tree, *of_child, left.pop(child), lo, F, stack)
                failed = front_kernels.finish_front(tree, lo, F, stack, panels, local.words)  # (2)
                failed += tree.first[lo] if failed else 0
            else:
                failed = front_kernels.factorise_fronts(
                    tree, entries, lo, hi, F, stack, local.rows, panels, local.words
                )
            if failed:
                row = int(self._fronts.order[failed - 1])
                raise FactorizationError(f"cholesky: a pivot is zero or negative (row {row} of {self.n})")
            del F
            stack.resize(n_left, refcheck=False)  # in place, because a copy would touch new memory
            left[k] = stack
            self._panels.put(k, panels)  # (3)

        with one_blas_thread():
            for_each(blocks, factorise, n_threads(), blocks.turns(on_disk=on_disk))
        give_back()

    def solve(self, b: Array) -> Array:
        """Return A⁻¹ b for b, (n, k), in any memory order; up to 16 columns come in C order, others in F order."""
        if b.shape[1] <= WIDTHS[-1]:
            return self._substituted(b)
        x = np.empty(b.shape, order="F")
        for start in range(0, b.shape[1], WIDTHS[-1]):
            some = slice(start, start + WIDTHS[-1])
            x[:, some] = self._substituted(b[:, some])
        return x

    def _substituted(self, b: Array) -> Array:
        """Return the solutions for b, (n, k), in C order; k is at most 16."""
        from cms.linear_algebra.sparse_cholesky import solve_kernels
        from cms.linear_algebra.sparse_cholesky.tiles import LANES, ROWS

        b, x = np.ascontiguousarray(b), np.empty(b.shape)
        width = next(each for each in WIDTHS if each >= b.shape[1])
        tree, blocks, order = self._blocks.tree, self._blocks, self._fronts.order
        parts = (0.0,) * (width // LANES)
        Y = np.empty((self.n, width))
        left_size = width * ROWS * -(-self._fronts.below // ROWS)
        left: dict[int, Array] = {}
        most = int(self._fronts.width.max(initial=0)) + ROWS

        def eliminate(k: int) -> None:  # solves L y = b
            lo, hi = int(blocks.first[k]), int(blocks.first[k + 1])
            _, n_stack, _ = blocks.room(k, left_size)
            own, stack = np.empty(most * width), np.empty(n_stack)
            if blocks.below[k]:
                solve_kernels.begin_rows(tree, lo, parts, order, b, own, stack)
                for child in blocks.below[k]:
                    of_child = int(blocks.first[child]), int(blocks.first[child + 1])
                    solve_kernels.take_rows_of(tree, *of_child, left.pop(child), lo, parts, own, stack)
                solve_kernels.finish_rows(tree, lo, parts, self._panels.of(k), own, stack, Y)
            else:
                solve_kernels.eliminate_fronts(tree, lo, hi, parts, order, b, self._panels.of(k), own, stack, Y)
            left[k] = stack

        def substitute(k: int) -> None:  # solves Lᵀ x = y
            lo, hi = int(blocks.first[k]), int(blocks.first[k + 1])
            own, eight = np.empty(most * width), np.empty(ROWS * width)
            solve_kernels.substitute_back(tree, lo, hi, parts, order, self._panels.of(k), own, eight, Y, x)

        for_each(blocks, eliminate, n_threads(), blocks.by_distance)
        for_each(blocks, substitute, n_threads(), blocks.by_height, downwards=True)
        return x

    def close(self) -> None:
        """Free the factor; further calls do nothing."""
        if self.is_open:
            self.is_open = False
            self._panels.close()
