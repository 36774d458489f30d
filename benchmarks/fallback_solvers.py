"""Solvers for processors without MKL beside PARDISO: one thread, processor time, one process each.

python -m benchmarks.fallback_solvers          # 160 818 interior dofs of the tet10 connecting rod
python -m benchmarks.fallback_solvers small    # 33 882
python -m benchmarks.fallback_solvers blocks 0.5 cholesky   # all processors, 16 blocks of 16 columns: as block Lanczos
"""

import os
import resource
import sys
import time
from pathlib import Path

from benchmarks.records import print_record, record_of
from benchmarks.rods import rod_file

SIZES = {"small": 5.0, "large": 2.5}  #: element size [mm]
NAMES = ("pardiso", "cholesky", "cholesky on disk", "superlu", "superlu, minimum degree")


def mesh_file(size):
    return rod_file(f"fallback_{size}", SIZES[size])


def one(name, path):
    """Analysis and factorisation, a solve of 60 columns, their processor times; peak above what was held before."""
    import numpy as np
    import scipy.sparse as sp

    from benchmarks.large_solid import solid
    from cms.linear_algebra.solvers import superlu
    from cms.linear_algebra.solvers.factorization import lower_triangle
    from cms.linear_algebra.solvers.registry import SOLVERS
    from cms.linear_algebra.sparse_cholesky.factor import CholeskyFactor
    from fe_models.foundation.sparse.submatrix import principal_block

    *_, (_, body) = solid(Path(path))
    lower = lower_triangle(principal_block(body.K, body.i))
    b = np.random.default_rng(0).standard_normal((lower.shape[0], 60))
    line = sp.diags_array([-1.0, 2.1, -1.0], offsets=[-1, 0, 1], shape=(16, 16))
    tiny = lower_triangle(sp.csc_array(sp.kronsum(sp.kronsum(line, line), line)))
    make = SOLVERS[name.split()[0].rstrip(",")].factor
    if name.endswith("degree"):
        superlu.SMALL = 10**9
    if name.endswith("disk"):
        make = lambda lower, *, definite: CholeskyFactor(lower, on_disk=True)  # noqa: E731
    first = make(tiny, definite=True)  # compiled loops are loaded, those for few columns and for many
    for columns in (2, 16):
        first.solve(b[: tiny.shape[0], :columns])
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    start = time.process_time()
    factor = make(lower, definite=True)
    made = time.process_time()
    x = factor.solve(b)
    solved = time.process_time()
    A = lower + sp.tril(lower, k=-1).T
    return {
        "n": lower.shape[0], "factor": made - start, "solve": solved - made, "entries": factor.n_factor_entries / 1e6,
        "GB": (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1e6,
        "residual": float(abs(A @ x - b).max()),
    }  # fmt: skip


def blocks(million, name):
    """Print the time of a factor of the rod of `large_solid` and of 16 blocks of 16 columns, and the peak."""
    import numpy as np
    import scipy.sparse as sp

    from benchmarks import large_solid
    from cms.linear_algebra.solvers.factorization import lower_triangle
    from cms.linear_algebra.solvers.registry import SOLVERS
    from fe_models.foundation.sparse.submatrix import principal_block

    *_, (_, body) = large_solid.solid(large_solid.mesh_file(million))
    lower = lower_triangle(principal_block(body.K, body.i))
    make = SOLVERS[name].factor
    line = sp.diags_array([-1.0, 2.1, -1.0], offsets=[-1, 0, 1], shape=(16, 16))
    tiny = lower_triangle(sp.csc_array(sp.kronsum(sp.kronsum(line, line), line)))
    make(tiny, definite=True).solve(np.ones((4096, 16)))  # compiled loops are loaded
    b = np.asfortranarray(np.random.default_rng(0).standard_normal((lower.shape[0], 16)))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    times, used = [time.perf_counter()], [time.process_time()]
    factor = make(lower, definite=True)
    times.append(time.perf_counter())
    used.append(time.process_time())
    for _ in range(16):
        factor.solve(b)
    times.append(time.perf_counter())
    used.append(time.process_time())
    more = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1e6
    made, solved = np.diff(times)
    made_by, solved_by = np.diff(used)
    print(
        f"{name}: n {lower.shape[0]}: factor {made:.2f} s, 16 blocks of 16 columns {solved:.2f} s, together "
        f"{made + solved:.2f} s; processor time {made_by:.2f} and {solved_by:.2f} s; "
        f"{factor.n_factor_entries / 1e6:.0f} million entries, peak {more:.2f} GB more"
    )


def measured(name, path):
    environment = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    return record_of("fallback_solvers", "one", name, path, env=environment)


def figures(short):
    """Return the time of `cholesky` by that of PARDISO: factorisation and 60 columns."""
    path = mesh_file("small" if short else "large")
    ours, bare = (measured(name, path) for name in ("cholesky", "pardiso"))
    return {
        f"cholesky over PARDISO, {ours['n'] // 1000}k dofs, factorisation and 60 columns": (
            (ours["factor"] + ours["solve"]) / (bare["factor"] + bare["solve"])
        )
    }


def main():
    size = "small" if "small" in sys.argv else "large"
    path = mesh_file(size)
    for name in NAMES if size == "small" else NAMES[:-1]:
        row = measured(name, path)
        print(
            f"{name:24} n {row['n']}: factor {row['factor']:6.2f} s, 60 columns {row['solve']:6.2f} s, "
            f"{row['entries']:6.1f} million entries, peak {row['GB']:5.2f} GB more, residual {row['residual']:.0e}",
            flush=True,
        )


if __name__ == "__main__":
    if sys.argv[1:2] == ["blocks"]:
        blocks(*sys.argv[2:])
    elif sys.argv[1:2] == ["one"]:
        from fe_models.foundation.threads import bounded_threads

        with bounded_threads(1):
            print_record(one(*sys.argv[2:]))
    else:
        main()
