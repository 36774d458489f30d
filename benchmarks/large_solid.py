"""A large connecting rod from the mesh file to the closed modal file, against the bare solver.

    python -m benchmarks.large_solid              # about 0.5 million dofs
    python -m benchmarks.large_solid 0.5 1.0      # and 1 million

tet10, two rigid interfaces (RBE2), 50 fixed-interface modes. "line": everything from reading the mesh file to the
closed modal file. "bare": one PARDISO factorisation of K_II and one solve of 60 columns without iterative refinement,
nothing else counted. Each is a process of its own, so the peaks of memory are their own; the ratio is line / bare.
Processor seconds of all threads stand beside those of the clock, in programs and in the system: on virtual machines
that get their memory page by page from a host the first touch of a gigabyte can take seconds, and both pay for it.
Meshes are made by gmsh once and kept in benchmarks/out.
"""

import resource
import sys
import time
from pathlib import Path

import numpy as np

from benchmarks.records import print_record, record_of
from benchmarks.rods import OUT, rod_file

#: million dofs -> element size [mm]
SIZES = {"0.03": 4.8, "0.06": 3.76, "0.1": 3.0, "0.25": 2.05, "0.5": 1.62, "1.0": 1.24}
N_MODES = 50


def mesh_file(million):
    return rod_file(million, SIZES[million])


def solid(path, ranks=None):
    import cms
    import fe_models

    mesh = fe_models.read_mesh(path)
    steel = fe_models.Material("steel", E=210e3, nu=0.3, rho=7.85e-9)
    yield "read", mesh
    fe_models.report_mesh(mesh, steel, units="mm-t-s").raise_for_errors()
    yield "report", None
    ends = [
        fe_models.rigid_interface(mesh, name, fe_models.selections.FaceGroup(name)) for name in ("big_end", "small_end")
    ]
    units = cms.unit_system("mm-t-s")
    body = fe_models.solid_body(mesh, steel, name="rod", units=units, interfaces=ends, ranks=ranks)
    yield "assemble", None
    body = cms.couple(body)
    yield "couple", body


def processor():
    """Return processor seconds of this process so far: of programs, and of the system for them."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return np.array([used.ru_utime, used.ru_stime])


def line(path):
    """The whole line, with the time of each stage."""
    import cms

    times, clock, body = {}, time.perf_counter(), None
    start, used = clock, processor()

    def stamp(stage):
        nonlocal clock
        times[stage] = time.perf_counter() - clock
        clock = time.perf_counter()

    for stage, result in solid(path):
        stamp(stage)
        body = result
    modes = cms.craig_bampton(body, n_modes=N_MODES)
    stamp("mode set")
    reduced = cms.reduce(body, modes, frame=cms.NodalFrame("big_end"), geometric=False)
    stamp("reduce")
    cms.write(reduced, OUT / "line.h5")
    stamp("write")
    seconds = time.perf_counter() - start
    return {"s": seconds, "processor": list(processor() - used), "stages": times, "n_dof": body.n_dof}


def bare(path):
    """One factorisation of K_II, one solve of 60 columns."""
    from cms.linear_algebra.solvers.factorization import lower_triangle
    from cms.linear_algebra.solvers.pardiso import PardisoFactor
    from fe_models.foundation.sparse.submatrix import principal_block

    *_, (_, body) = solid(path)
    lower = lower_triangle(principal_block(body.K, body.i))
    columns = np.asfortranarray(np.random.default_rng(0).standard_normal((lower.shape[0], 60)))
    start, used = time.perf_counter(), processor()
    factor = PardisoFactor(lower, definite=True)
    factored = time.perf_counter()
    factor.solve(columns)
    solved = time.perf_counter()
    stages = {"factor": factored - start, "solve": solved - factored}
    return {"s": solved - start, "processor": list(processor() - used), "stages": stages}


def measured(million):
    """Return the record of the line and those of the bare solver before and after it: the machine drifts."""
    path = mesh_file(million)
    record = {}
    for what in ("bare", "line", "bare"):
        record.setdefault(what, []).append(record_of("large_solid", what, path))
    return record["line"][0], record["bare"]


def figures(short):
    """Return what the watch keeps."""
    million = "0.1" if short else "0.5"
    whole, bares = measured(million)
    bare_s = np.mean([b["s"] for b in bares])
    return {
        f"mesh file to modal file over the bare solver, {million} M dofs": whole["s"] / bare_s,
        f"mesh file to modal file, {million} M dofs [s]": whole["s"],
        f"peak of memory, {million} M dofs [GB]": whole["GB"],
    }


def main():
    for million in [a for a in sys.argv[1:] if a in SIZES] or ["0.5"]:
        whole, bares = measured(million)
        seconds = [b["s"] for b in bares]
        work, own = sum(whole["processor"]), np.mean([sum(b["processor"]) for b in bares])
        print(
            f"{whole['n_dof']} dofs: line {whole['s']:.1f} s, peak {whole['GB']:.1f} GB; bare "
            f"{' and '.join(f'{s:.1f}' for s in seconds)} s, peak {bares[0]['GB']:.1f} GB; "
            f"ratio {whole['s'] / np.mean(seconds):.2f}"
        )
        of_line, *of_bares = (f"{sum(r['processor']):.0f} ({r['processor'][1]:.0f})" for r in (whole, *bares))
        print(f"  processor (of it system): line {of_line} s, bare {' and '.join(of_bares)} s, ratio {work / own:.2f}")
        print("  line:", ", ".join(f"{stage} {s:.1f}" for stage, s in whole["stages"].items()))
        print("  bare:", ", ".join(f"{stage} {s:.1f}" for stage, s in bares[-1]["stages"].items()), flush=True)


if __name__ == "__main__":
    if sys.argv[1:] and sys.argv[1] in ("line", "bare"):
        record = {"line": line, "bare": bare}[sys.argv[1]](Path(sys.argv[2]))
        record["GB"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
        print_record(record)
    else:
        main()
