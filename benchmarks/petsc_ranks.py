"""A large connecting rod on several ranks: time, memory and work of each (docs/cluster_mpi.md).

    mpirun -n 2 python -m benchmarks.petsc_ranks 0.5          # million dofs, the meshes of benchmarks.large_solid
    mpirun -n 2 python -m benchmarks.petsc_ranks 0.5 factor   # factorisation and one solve of 60 columns alone
    mpirun -n 2 python -m benchmarks.petsc_ranks 1.0 disk     # the factor in files

From the mesh file to the closed modal file, 50 modes, without geometric stiffness, as large_solid. Prints a line for
every stage, its time and the peak of resident memory of each rank in it, and one for every rank: the peak of all
stages, what MUMPS took, entries of the factor and floating-point operations there.
"""

import os
import resource
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from benchmarks.large_solid import N_MODES, OUT, mesh_file, solid
from benchmarks.records import print_record, record_in

MPIRUN = ["mpirun", "--oversubscribe", "--bind-to", "none"]
SETTINGS = {
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
}


def forget_peak_here(ranks):
    """Let the peak of resident memory of this rank begin anew (Linux)."""
    Path("/proc/self/clear_refs").write_text("5")


def peak_here(ranks):
    """Return the peak of resident memory [GB] of this rank since it began anew, and its processor time [s]."""
    status = Path("/proc/self/status").read_text()
    used = resource.getrusage(resource.RUSAGE_SELF)
    return int(status.partition("VmHWM:")[2].split()[0]) / 1e6, used.ru_utime + used.ru_stime


class Stages:
    """What the stages of a run took on every rank."""

    def __init__(self, ranks):
        self.ranks, self.rows = ranks, []

    @contextmanager
    def __call__(self, name):
        """Measure what is done within."""
        self.ranks.everywhere(forget_peak_here)
        start = time.perf_counter()
        yield
        seconds = time.perf_counter() - start
        self.rows.append((name, seconds, [peak for peak, _ in self.ranks.everywhere(peak_here)]))

    def peaks(self):
        """Return the peak of every rank over all stages [GB]."""
        return np.max([peaks for _, _, peaks in self.rows], axis=0)


def factored(body, solver, stage):
    """The factor of K_II, after a solve of 60 columns."""
    from cms.linear_algebra.solvers.factorization import factorize
    from fe_models.foundation.sparse.submatrix import nearby_order, principal_block

    with stage("factor"):
        K_ii = principal_block(body.K, nearby_order(body.K, body.dofs, body.i))
        factorization = factorize(K_ii, solver=solver)
    with stage("solve"):
        factorization.solve(np.random.default_rng(0).standard_normal((K_ii.shape[0], 60)))
    return factorization.factor


def whole(body, solver, stage):
    """The mode set, reduction and file."""
    import cms

    with cms.modes.Families(body, solver=solver) as families:
        with stage("factor"):
            factor = families.fixed.factorization.factor
        with stage("constraint modes"):
            _ = families.Psi_C
        with stage("vibration modes"):
            families.fixed_modes(N_MODES)
        with stage("mode set"):
            modes = cms.craig_bampton(families, n_modes=N_MODES)
    with stage("reduce"):
        reduced = cms.reduce(body, modes, frame=cms.NodalFrame("big_end"), geometric=False)
    with stage("write"):
        cms.write(reduced, OUT / "ranks.h5")
    return factor


def measured(million, what, solver, ranks):
    """Return the stages, the factor and the number of dofs."""
    stage = Stages(ranks)
    made, body = solid(mesh_file(million), ranks), None
    for name in ("read", "report", "assemble", "couple"):
        with stage(name):
            _, body = next(made)
    made.close()
    factor = what(body, solver, stage)
    return stage, factor, body.n_dof


def figures(short):
    """Return what the watch keeps: of two ranks beside one."""
    from cms.linear_algebra.solvers.petsc.libraries import missing_petsc

    if missing := missing_petsc():
        raise RuntimeError(missing)
    million = "0.1" if short else "0.5"
    found = {}
    for n in (1, 2):
        command = [*MPIRUN, "-n", str(n), sys.executable, "-m", "benchmarks.petsc_ranks", million]
        done = subprocess.run(command, env=os.environ | SETTINGS, capture_output=True, text=True, check=True)
        found[n] = record_in(done.stdout)
    one, two = found[1], found[2]
    return {
        f"largest peak of two ranks over the peak of one, {million} M dofs": max(two["GB"]) / one["GB"][0],
        f"peaks of two ranks, largest over smallest, {million} M dofs": max(two["GB"]) / min(two["GB"]),
        f"time of two ranks over that of one, {million} M dofs": two["s"] / one["s"],
    }


def main():
    from fe_models.foundation.ranks.mpi import all_ranks

    ranks = all_ranks()
    if ranks.rank:
        ranks.serve()
        return
    million = sys.argv[1] if sys.argv[1:] else "0.5"
    what, solver = factored if "factor" in sys.argv else whole, "petsc-disk" if "disk" in sys.argv else "petsc"
    begun = ranks.everywhere(peak_here)
    stages, factor, n_dof = measured(million, what, solver, ranks)
    ended = ranks.everywhere(peak_here)
    print(f"{n_dof} dofs, {factor.description}")
    for name, seconds, peaks in stages.rows:
        print(f"  {name}: {seconds:.1f} s, peaks {', '.join(f'{peak:.2f}' for peak in peaks)} GB")
    for rank, (peak, record) in enumerate(zip(stages.peaks(), factor.records, strict=True)):
        print(
            f"  rank {rank}: peak {peak:.2f} GB, MUMPS {record['MB'] / 1e3:.2f} GB, "
            f"{record['entries'] / 1e6:.0f}e6 entries, {record['flops'] / 1e9:.0f}e9 operations, "
            f"{ended[rank][1] - begun[rank][1]:.0f} s of processor",
        )
    record = {"GB": list(stages.peaks()), "s": sum(seconds for _, seconds, _ in stages.rows)}
    print_record(record)
    ranks.end()


if __name__ == "__main__":
    main()
