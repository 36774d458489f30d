"""PARDISO of the Intel Math Kernel Library, called directly for symmetric matrices.

`pypardiso` finds and loads the library. Its own solver class copies and hashes the matrix and keeps the default of two
steps of iterative refinement. This makes a block solve 4-7 times slower than the plain substitution used here.

References
----------
.. [1] oneMKL Developer Reference, "pardiso" and "pardiso iparm Parameter".
"""

import ctypes
import os
import sys
from functools import cache
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from cms.errors import FactorizationError, FactorRoomError
from fe_models.foundation.arrays import Array

__all__ = ["PardisoFactor", "missing_pardiso", "mkl_runtime"]

POSITIVE_DEFINITE, INDEFINITE = 2, -2  # mtype: real symmetric
ANALYSE_AND_FACTORIZE, SOLVE, RELEASE = 12, 33, -1  # phase
CHUNK = 64  #: number of right-hand sides per call; larger blocks are not faster, and the workspace grows with them
#: pivots below 1e-13 of the matrix norm are set to this bound and counted; PARDISO then refines
PIVOT_PERTURBATION = 13
#: largest backward error of a stable factorisation, far above rounding (1e-15), far below instability (1e-3 and more)
STABLE = 1e-9

NOT_FACTORIZED = {
    -2: "not enough memory for the factor",
    -3: "the reordering failed",
    -4: "a pivot is zero or negative",
    -7: "a diagonal entry is zero",
    -8: "the matrix is too large for 32-bit indices",
    -10: "the factor could not be stored",
}
NO_ROOM = (-2, -10)
#: whether the user requested bitwise reproducible results in the environment before the program started
BITWISE = bool(os.environ.get("MKL_CBWR"))


@cache
def mkl_runtime() -> ctypes.CDLL | None:
    """Return the loaded MKL library; None if it is not available (other processors, macOS, not installed)."""
    # its threads release the processor immediately, because NumPy and our own threads need it between two solves
    os.environ.setdefault("KMP_BLOCKTIME", "0")
    path = installed_mkl()
    if path is not None:  # found in its package; pypardiso would search all of sys.prefix, which takes a second or more
        os.environ.setdefault("PYPARDISO_MKL_RT", path)
    try:
        from pypardiso import PyPardisoSolver

        return PyPardisoSolver().libmkl
    except (ImportError, OSError, AttributeError):
        return None


def missing_pardiso() -> str:
    """Describe which parts of PARDISO are missing; "" if it can be used."""
    return "" if mkl_runtime() is not None else "needs MKL, which is not installed; pip install pypardiso (x86-64 only)"


def installed_mkl() -> str | None:
    """Return the path of the runtime library in the installed package `mkl`; None if there is none."""
    try:
        files = distribution("mkl").files or []
    except PackageNotFoundError:
        return None
    paths = [Path(str(file.locate())) for file in files if "mkl_rt" in file.name and not file.name.endswith(".lib")]
    return next((str(path) for path in paths if path.is_file()), None)


class PardisoFactor:
    """Cholesky or L D Lᵀ factor of a symmetric matrix in PARDISO's own memory, until `close` is called.

    Results are bitwise reproducible if MKL_CBWR was set in the environment before the program started. Otherwise two
    runs on one machine with equal threads differ by rounding.
    """

    def __init__(self, lower: sp.csc_array, *, definite: bool) -> None:
        """Factorise a matrix from its lower triangle, (n, n), all diagonal entries stored, row indices sorted."""
        library = mkl_runtime()
        if library is None:
            raise FactorizationError(f"PARDISO {missing_pardiso()}")
        self._pardiso = library["pardiso"]  # our own handle, because pypardiso's handle has its argument types attached
        self._pardiso.restype = None
        self._n_threads = int(library.mkl_get_max_threads())
        self.n = lower.shape[0]
        # the compressed columns of the lower triangle are the compressed rows of the upper triangle that PARDISO
        # expects
        self._a = np.ascontiguousarray(lower.data, dtype=np.float64)
        self._ia = np.ascontiguousarray(lower.indptr, dtype=np.int32)
        self._ja = np.ascontiguousarray(lower.indices, dtype=np.int32)
        self._pt = np.zeros(64, np.int64)
        self._mtype = POSITIVE_DEFINITE if definite else INDEFINITE
        self._factorize(definite=definite, matching=not definite)
        if not definite and not (first := self._backward_error()) < STABLE:
            # matching chooses pairs of pivots by the size of their entries; remaining entries may grow without bound
            self.close()
            self._factorize(definite=False, matching=False)
            if not self._backward_error() < first:
                self.close()
                self._factorize(definite=False, matching=True)
        self.n_negative = 0 if definite else int(self._iparm[22])
        self.n_positive = self.n if definite else int(self._iparm[21])
        self.n_perturbed = 0 if definite else int(self._iparm[13])
        text = ctypes.create_string_buffer(200)
        library.mkl_get_version_string(text, 200)
        words = text.value.decode(errors="replace").split()
        version = next((word.split("-")[0] for word in words if word[0].isdigit()), "unknown")
        matched = ", scaling and matching" if self._iparm[12] else ""
        kind = "L Lᵀ" if definite else f"L D Lᵀ, Bunch-Kaufman pivots{matched}"
        bitwise = ", bitwise repeatable" if BITWISE else ""
        self.description = f"PARDISO (MKL {version}; {kind}; no refinement; {self._n_threads} threads{bitwise})"

    def _factorize(self, *, definite: bool, matching: bool) -> None:
        """Compute the factor; raise `FactorizationError` if PARDISO fails."""
        self._pt = np.zeros(64, np.int64)
        self._iparm = np.zeros(64, np.int32)  # entries that are not set below: see [1]_
        self._iparm[0] = 1  # use the values given here instead of defaults
        self._iparm[1] = 2 if BITWISE else 3  # nested dissection, serial or parallel
        self._iparm[9] = PIVOT_PERTURBATION
        self._iparm[17] = -1  # request the number of entries of the factor
        self._iparm[34] = 1  # 0-based
        if matching:
            self._iparm[10] = self._iparm[12] = 1  # scaling and matching, for multipliers with a zero diagonal
        if not definite:
            self._iparm[20] = 1  # Bunch-Kaufman pivots
        if BITWISE:
            self._iparm[33] = self._n_threads
        self.is_open = True
        error = self._call(ANALYSE_AND_FACTORIZE)
        if error:
            where = int(self._iparm[29])
            self.close()
            at = f" (equation {where} of {self.n})" if error == -4 and where > 0 else ""
            raise (FactorRoomError if error in NO_ROOM else FactorizationError)(
                f"PARDISO: {NOT_FACTORIZED.get(error, f'error {error}')}{at}; n = {self.n}, {len(self._a)} entries"
            )

    def _backward_error(self) -> float:
        """Return max |A x - b| / (|A| |x| + |b|) over the rows, from two solves with a random column.

        It is as small as rounding for any condition number of A, unless pivots grow.
        """
        b = self.solve(np.random.default_rng(0).standard_normal((self.n, 1)))
        b /= np.linalg.norm(b)
        x = self.solve(b)
        if not np.isfinite(x).all():
            return np.inf
        upper = sp.csr_array((self._a, self._ja, self._ia), shape=(self.n, self.n))
        size = sp.csr_array((np.abs(self._a), self._ja, self._ia), shape=(self.n, self.n))
        Ax, size_x = (A @ v + A.T @ v - A.diagonal()[:, None] * v for A, v in ((upper, x), (size, np.abs(x))))
        return float((np.abs(Ax - b) / (size_x + np.abs(b))).max())

    @property
    def n_factor_entries(self) -> int:
        """Number of stored entries of the factor."""
        return int(np.uint32(self._iparm[17])) if self._iparm[17] < 0 else int(self._iparm[17])

    def solve(self, b: Array) -> Array:
        """Return A⁻¹ b for b, (n, k), in any memory order; the result is in Fortran order."""
        x = np.empty(b.shape, order="F")
        for first in range(0, b.shape[1], CHUNK):
            columns = slice(first, min(first + CHUNK, b.shape[1]))
            error = self._call(SOLVE, np.asfortranarray(b[:, columns]), x[:, columns])
            if error:
                raise FactorizationError(f"PARDISO: the solution of {b.shape[1]} columns failed (error {error})")
        return x

    def close(self) -> None:
        """Free the factor; the caller rejects further solves."""
        if self.is_open:
            self.is_open = False
            self._call(RELEASE)

    def __del__(self) -> None:
        if getattr(self, "is_open", False) and not sys.is_finalizing():  # the end of the process frees it too
            self.close()

    def _call(self, phase: int, b: Array | None = None, x: Array | None = None) -> int:
        error = ctypes.c_int32(0)
        given = (
            self._pt,
            1,  # maxfct
            1,  # mnum
            self._mtype,
            phase,
            self.n,
            self._a,
            self._ia,
            self._ja,
            None,  # perm
            1 if b is None else b.shape[1],
            self._iparm,
            0,  # msglvl
            b,
            x,
        )
        pointers = [
            ctypes.byref(ctypes.c_int32(value))
            if isinstance(value, int)
            else None
            if value is None
            else value.ctypes.data_as(ctypes.c_void_p)
            for value in given
        ]
        self._pardiso(*pointers, ctypes.byref(error))
        return error.value
