"""A large connecting rod on several ranks: time, memory and work of each (docs/cluster_mpi.md).

    mpirun -n 2 python -m benchmarks.petsc_ranks 0.5          # million dofs, the meshes of benchmarks.large_solid
    mpirun -n 2 python -m benchmarks.petsc_ranks 0.5 factor   # factorisation and one solve of 60 columns alone
    mpirun -n 2 python -m benchmarks.petsc_ranks 1.0 disk     # the factor in files

Prints a line for all, and a row for every rank: peak of resident memory, what MUMPS took, entries of the factor and
floating-point operations there. "line": from the mesh file to the closed modal file, 50 modes, without geometric
stiffness, as large_solid.
"""

import resource
import sys
import time

import numpy as np

from benchmarks.large_solid import N_MODES, OUT, mesh_file, solid


def peak_here(ranks):
    """Return processor time and the peak of resident memory [GB] of this rank."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1e6


def factored(body, solver):
    """The factor of K_II, after a solve of 60 columns."""
    from cms.solvers.factorization import factorize
    from fe_models.body.submatrix import principal_block

    K_ii = principal_block(body.K, body.i)
    start = time.perf_counter()
    factorization = factorize(K_ii, solver=solver)
    between = time.perf_counter()
    factorization.solve(np.random.default_rng(0).standard_normal((K_ii.shape[0], 60)))
    return factorization.factor, {"factor": between - start, "solve": time.perf_counter() - between}


def whole(body, solver):
    """The mode set, reduction and file."""
    import cms

    times, start = {}, time.perf_counter()
    with cms.Families(body, solver=solver) as families:
        modes = cms.craig_bampton(families, n_modes=N_MODES)
        factor = families.fixed.factorization.factor
    times["mode set"], start = time.perf_counter() - start, time.perf_counter()
    reduced = cms.reduce(body, modes, frame=cms.NodalFrame("big_end"), geometric=False)
    times["reduce"], start = time.perf_counter() - start, time.perf_counter()
    cms.write(reduced, OUT / "ranks.h5")
    times["write"] = time.perf_counter() - start
    return factor, times


def main():
    from fe_models.foundation.ranks.mpi import all_ranks

    ranks = all_ranks()
    if ranks.rank:
        ranks.serve()
        return
    million, only_factor = sys.argv[1] if sys.argv[1:] else "0.5", "factor" in sys.argv
    body = None
    for _, result in solid(mesh_file(million)):
        body = result
    before = ranks.everywhere(peak_here)
    factor, times = (factored if only_factor else whole)(body, "petsc-disk" if "disk" in sys.argv else "petsc")
    after = ranks.everywhere(peak_here)
    print(f"{body.n_dof} dofs, {factor.description}: " + ", ".join(f"{name} {s:.1f} s" for name, s in times.items()))
    for rank, (here, record, start) in enumerate(zip(after, factor.records, before, strict=True)):
        print(
            f"  rank {rank}: peak {here[1]:.2f} GB ({start[1]:.2f} before), MUMPS {record['MB'] / 1e3:.2f} GB, "
            f"{record['entries'] / 1e6:.0f}e6 entries, {record['flops'] / 1e9:.0f}e9 operations, "
            f"{here[0] - start[0]:.0f} s of processor",
            flush=True,
        )
    ranks.end()


if __name__ == "__main__":
    main()
