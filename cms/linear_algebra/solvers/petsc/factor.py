"""MUMPS through PETSc: the matrix, its factor and the solution columns are distributed over all ranks.

(1) rank 0 sends every rank its rows of the upper triangle, with equally many entries
(2) all ranks factorise together; METIS on rank 0 chooses the order
(3) rows of the columns go to all ranks, many right-hand sides are solved at once, and rows go back
"""

from itertools import count
from typing import Any

import numpy as np
import scipy.sparse as sp

from cms.errors import FactorizationError, FactorRoomError
from cms.linear_algebra.solvers.petsc.libraries import petsc
from fe_models.foundation.arrays import Array
from fe_models.foundation.ranks.mpi import all_ranks
from fe_models.foundation.ranks.ranks import Ranks
from fe_models.foundation.ranks.rows import Rows, collected, even_rows, own_rows, spread
from fe_models.foundation.ranks.spread_matrix import OwnRows, SpreadBlock
from fe_models.foundation.ranks.trim import give_back

__all__ = ["PetscFactor"]

CHUNK = 64  #: number of columns per solve; the workspace of MUMPS grows with it
ROOM = (20, 60, 200)  #: workspace beyond the estimate in percent (ICNTL(14)); the values are tried one after the other
METIS = 5  #: code of METIS for ICNTL(7)
#: values of INFOG(1) for a lack of workspace, which the next value of ROOM may cure
TOO_SMALL = (-8, -9, -11, -14, -15, -17, -20)
NOT_FACTORIZED = {
    -5: "not enough memory for the analysis",
    -7: "not enough memory for the analysis",
    -10: "a pivot is zero",
    -13: "not enough memory for the factor",
    -19: "not enough memory for the factor",
    -40: "a pivot is zero or negative",
    -90: "the factor could not be stored",
}
NO_ROOM = (-5, -7, -13, -19, -90)
numbers = count()


class PetscFactor:
    """Cholesky or L D Lᵀ factor of a symmetric matrix, distributed over all ranks, until `close` is called."""

    def __init__(
        self,
        lower: sp.csc_array | SpreadBlock,
        *,
        definite: bool,
        on_disk: bool = False,
        keeps_matrix: bool = False,
    ) -> None:
        """Factorise a matrix from its lower triangle, (n, n), with all diagonal entries stored and row indices sorted.

        The entries are sent to the ranks, and `lower` is empty afterwards, so that rank 0 does not store them twice.
        For a distributed matrix each rank uses its own rows.

        on_disk: the factor is stored in files of each rank, in the folder named by MUMPS_OOC_TMPDIR (/tmp).
        keeps_matrix: the matrix is kept together with its factor, for a search by SLEPc.
        """
        self.is_open = True
        self.ranks = all_ranks()
        self.key = f"factor {next(numbers)}"
        if isinstance(lower, SpreadBlock):
            self.rows = lower.rows
            n_entries = lower.keep(self.key, upper=True)
        else:
            self.rows = even_rows(lower.indptr, self.ranks.size)
            n_entries = lower.nnz
            self.ranks.store[self.key] = (lower.indptr, lower.indices, lower.data)
            lower.indptr, lower.indices, lower.data = emptied(self.rows.n)
        self.n = self.rows.n
        found = self.ranks.everywhere(factorize_here, self.key, self.rows, definite, on_disk, keeps_matrix)
        self.record, self.records = found[0], found
        error = self.record["INFOG(1)"]
        n_negative = self.record["negative"]
        if error < 0 or (definite and n_negative):
            self.close()
            words = NOT_FACTORIZED.get(error, f"error {error}") if error < 0 else f"{n_negative} pivots are negative"
            kind = FactorRoomError if error in NO_ROOM else FactorizationError
            raise kind(f"MUMPS: {words}; n = {self.n}, {n_entries} entries")
        self.n_negative, self.n_perturbed = n_negative, self.record["null"]
        self.n_positive = self.n - n_negative - self.n_perturbed
        #: memory of MUMPS on every rank in MB, and entries of the factor there
        self.memory = [each["MB"] for each in found]
        self.entries = [each["entries"] for each in found]
        self.n_factor_entries = sum(self.entries)
        form = "L Lᵀ" if definite else "L D Lᵀ"
        form += ", factor on disk" if on_disk else ""
        of = "1 rank" if self.ranks.size == 1 else f"{self.ranks.size} ranks"
        version = ".".join(str(k) for k in petsc().Sys.getVersion())
        self.description = f"MUMPS (PETSc {version}; {form}; no refinement; {of})"

    def solve(self, b: Array) -> Array:
        """Return A⁻¹ b for b, (n, k), in any memory order; the result is in Fortran order."""
        x = np.empty(b.shape, order="F")
        for first in range(0, b.shape[1], CHUNK):
            columns = slice(first, min(first + CHUNK, b.shape[1]))
            self.ranks.store["columns"] = b[:, columns]
            x[:, columns] = self.ranks.everywhere(solve_here, self.key, self.rows)[0]
        return x

    def close(self) -> None:
        """Free the factor on all ranks."""
        if self.is_open:
            self.is_open = False
            self.ranks.everywhere(free_here, self.key)


def emptied(n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return indptr, indices and data of an empty matrix with n columns."""
    return np.zeros(n + 1, np.int32), np.zeros(0, np.int32), np.zeros(0)


def communicator(ranks: Ranks) -> Any:
    """Return PETSc's communicator for these ranks."""
    PETSc = petsc()
    return PETSc.COMM_SELF if ranks.size == 1 else PETSc.COMM_WORLD


def factorize_here(
    ranks: Ranks, key: str, rows: Rows, definite: bool, on_disk: bool, keeps_matrix: bool
) -> dict[str, Any]:
    """Steps (1) and (2) on each rank: distribute and factorise; return the report of MUMPS."""
    PETSc = petsc()
    comm = communicator(ranks)
    indptr, indices, data = rows_here(ranks, key, rows)
    n_own = rows.count(ranks.rank)
    A = PETSc.Mat().createSBAIJ(((n_own, rows.n), (n_own, rows.n)), 1, csr=(indptr, indices, data), comm=comm)
    del indptr, indices, data
    A.assemble()
    A.setOption(PETSc.Mat.Option.SYMMETRIC, True)
    give_back()
    if definite:
        A.setOption(PETSc.Mat.Option.SPD, True)
    for room in ROOM:
        ksp = PETSc.KSP().create(comm)
        ksp.setOperators(A)
        ksp.setType(PETSc.KSP.Type.PREONLY)
        pc = ksp.getPC()
        pc.setType(PETSc.PC.Type.CHOLESKY)
        pc.setFactorSolverType("mumps")
        pc.setFactorSetUpSolverType()
        F = pc.getFactorMatrix()
        F.setMumpsIcntl(7, METIS)
        F.setMumpsIcntl(14, room)
        F.setMumpsIcntl(22, int(on_disk))
        if not definite:
            F.setMumpsIcntl(13, 1)  # count the signs of all pivots, including those of the last front
            F.setMumpsIcntl(24, 1)  # also count pivots that are zero to rounding
        try:
            ksp.setUp()
        except PETSc.Error:  # raised on all ranks; INFOG has the reason
            pass
        error = F.getMumpsInfog(1)
        if error not in TOO_SMALL:
            break
        ksp.destroy()
    if not keeps_matrix and error >= 0:  # the factor no longer needs the matrix
        for each in (pc, ksp, A):  # pc as well, because Python would leave it in the garbage of PETSc
            each.destroy()
    ranks.store[key] = (F, ksp, A) if keeps_matrix else (F,)
    give_back()
    return {
        "INFOG(1)": error,
        "negative": F.getMumpsInfog(12) if error >= 0 else 0,
        "null": 0 if definite or error < 0 else F.getMumpsInfog(28),
        "entries": entries(F.getMumpsInfo(27)) if error >= 0 else 0,
        "MB": F.getMumpsInfo(22) if error >= 0 else 0,
        "flops": F.getMumpsRinfo(3) if error >= 0 else 0.0,
    }


def rows_here(ranks: Ranks, key: str, rows: Rows) -> tuple[np.ndarray, np.ndarray, Array]:
    """Return the rows that this rank already has, or receives from rank 0."""
    given = ranks.store.pop(key, None)
    return (given.indptr, given.indices, given.data) if isinstance(given, OwnRows) else spread(ranks, rows, given)


def entries(value: int) -> int:
    """Return a count reported by MUMPS, where negative values are in millions."""
    return -value * 10**6 if value < 0 else value


def solve_here(ranks: Ranks, key: str, rows: Rows) -> Array | None:
    """Step (3) on each rank: solve, and return the solutions on rank 0."""
    own = own_rows(ranks, rows, ranks.store.pop("columns", None))
    x = collected(ranks, rows, solved_rows(ranks, key, rows, own))
    give_back()
    return x


def solved_rows(ranks: Ranks, key: str, rows: Rows, own: Array) -> Array:
    """Return the rows of the solutions on this rank, given its rows of the right-hand sides, (n_own, k)."""
    PETSc = petsc()
    comm = communicator(ranks)
    F = ranks.store[key][0]
    n_own, k = own.shape
    size = ((n_own, rows.n), (PETSc.DECIDE, k))
    B = PETSc.Mat().createDense(size, array=np.asfortranarray(own), comm=comm)
    X = PETSc.Mat().createDense(size, comm=comm)
    X.setUp()
    for each in (B, X):
        each.assemble()
    F.matSolve(B, X)
    x = np.array(X.getDenseArray(), order="F")
    B.destroy()
    X.destroy()
    return x


def free_here(ranks: Ranks, key: str) -> None:
    """Free the factor on this rank."""
    for each in ranks.store.pop(key, ()) if isinstance(ranks.store.get(key), tuple) else ():
        each.destroy()
    ranks.store.pop(key, None)
    give_back()
