"""oneMKL's cluster sparse solver beside MUMPS: one factor of K_II and 60 columns on the same ranks.

    mpirun -n 2 python -m benchmarks.cluster_pardiso 0.25     # million dofs, the meshes of benchmarks.large_solid

The connecting rod of large_solid, both with one thread a rank (OMP_NUM_THREADS=1). The matrix and the columns lie on
rank 0 when the clock starts, the solutions when it ends. MKL is loaded from its wheel with Open MPI's BLACS: mkl_rt
takes Intel MPI alone. Prints times, the ratio, what each solver took on every rank, and by how much they differ.
"""

import ctypes
import sys
import time
from pathlib import Path

import numpy as np

from benchmarks.large_solid import mesh_file, solid
from benchmarks.petsc_ranks import forget_peak_here, peak_here

N_COLUMNS = 60
LIBRARIES = ("core", "sequential", "intel_lp64", "blacs_openmpi_lp64")
ANALYSE, FACTORISE, SOLVE, FREE = 11, 22, 33, -1  #: phases
DEFINITE = 2  #: mtype: real, symmetric, positive definite
SETTINGS = {0: 1, 1: 2, 7: 0, 34: 1, 39: 0}  #: iparm: own values, METIS, no refinement, numbers from 0, all on rank 0


def library():
    """Return MKL with its cluster solver on Open MPI, sequential; the parts need the names of each other."""
    from cms.linear_algebra.solvers.pardiso import installed_mkl

    folder = Path(installed_mkl()).parent
    parts = [next(folder.glob(f"libmkl_{name}.so*")) for name in LIBRARIES]
    # lazily: each names functions of the next
    return [ctypes.CDLL(str(part), mode=ctypes.RTLD_GLOBAL | 1) for part in parts][2]


def cluster_here(ranks):
    """Factorise and solve on this rank; return times of the two, and the kilobytes that the solver tells."""
    from mpi4py import MPI

    solver = library().cluster_sparse_solver_
    n, indptr, indices, data, b = ranks.store.pop("system") if ranks.rank == 0 else (0, *map(np.zeros, (1,) * 4))
    n = ranks.comm.bcast(n)
    x = np.zeros_like(b, order="F") if ranks.rank == 0 else np.zeros(1)
    pt, iparm = np.zeros(64, np.int64), np.zeros(64, np.int32)
    for k, value in SETTINGS.items():
        iparm[k] = value
    comm = ctypes.c_int(MPI.COMM_WORLD.py2f())
    integers = [ctypes.c_int(value) for value in (1, 1, DEFINITE)]

    def call(phase):
        error = ctypes.c_int(0)
        arrays = (a.ctypes.data_as(ctypes.c_void_p) for a in (data, indptr, indices))
        perm = ctypes.c_int(0)
        solver(
            pt.ctypes.data_as(ctypes.c_void_p), *map(ctypes.byref, integers), ctypes.byref(ctypes.c_int(phase)),
            ctypes.byref(ctypes.c_int(n)), *arrays, ctypes.byref(perm), ctypes.byref(ctypes.c_int(N_COLUMNS)),
            iparm.ctypes.data_as(ctypes.c_void_p), ctypes.byref(ctypes.c_int(0)),
            b.ctypes.data_as(ctypes.c_void_p), x.ctypes.data_as(ctypes.c_void_p), ctypes.byref(comm),
            ctypes.byref(error),
        )  # fmt: skip
        if error.value:
            raise RuntimeError(f"cluster_sparse_solver: error {error.value} in phase {phase}")

    ranks.comm.Barrier()
    times = [time.perf_counter()]
    for phases in ((ANALYSE, FACTORISE), (SOLVE,)):
        for phase in phases:
            call(phase)
        times.append(time.perf_counter())
    call(FREE)
    return np.diff(times), x if ranks.rank == 0 else None


def main():
    from cms.linear_algebra.solvers.factorization import lower_triangle
    from cms.linear_algebra.solvers.petsc.factor import PetscFactor
    from fe_models.foundation.ranks.mpi import MpiRanks
    from fe_models.foundation.sparse.submatrix import nearby_order, principal_block

    ranks = MpiRanks()
    if ranks.rank:
        ranks.serve()
        return
    *_, (_, body) = solid(mesh_file(sys.argv[1] if sys.argv[1:] else "0.25"))
    lower = lower_triangle(principal_block(body.K, nearby_order(body.K, body.dofs, body.i)))
    del body
    b = np.asfortranarray(np.random.default_rng(0).standard_normal((lower.shape[0], N_COLUMNS)))
    indptr, indices = (np.asarray(x, np.int32) for x in (lower.indptr, lower.indices))
    ranks.store["system"] = lower.shape[0], indptr, indices, lower.data, b
    ranks.everywhere(forget_peak_here)
    times, x = ranks.everywhere(cluster_here)[0]
    peaks = {"cluster": [peak for peak, _ in ranks.everywhere(peak_here)]}
    ranks.everywhere(forget_peak_here)
    start = time.perf_counter()
    factor = PetscFactor(lower, definite=True)
    factored = time.perf_counter()
    y = factor.solve(b)
    other = np.diff([start, factored, time.perf_counter()])
    peaks["MUMPS"] = [peak for peak, _ in ranks.everywhere(peak_here)]
    for name, (factoring, solving) in (("cluster", times), ("MUMPS", other)):
        told = ", ".join(f"{peak:.2f}" for peak in peaks[name])
        print(f"{name}: factor {factoring:.1f} s, {N_COLUMNS} columns {solving:.1f} s, peaks {told} GB")
    print(
        f"{len(b)} dofs, {ranks.size} ranks: cluster / MUMPS {times.sum() / other.sum():.2f}; "
        f"largest difference {np.abs(x - y).max() / np.abs(y).max():.1e}",
        flush=True,
    )
    factor.close()
    ranks.end()


if __name__ == "__main__":
    main()
