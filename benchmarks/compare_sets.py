"""Six mode sets of one body that share a factorisation, against a single Craig-Bampton reduction.

    python -m benchmarks.compare_sets             # about 0.15 million dofs
    python -m benchmarks.compare_sets 3.5         # another element size [mm], coarser

tet10 connecting rod, two rigid interfaces (RBE2), 50 vibration modes in every set. "single": Craig-Bampton from the
coupled body to the reduced body, without stress modes, which a comparison does not read. "six": six sets and their
reduced bodies, all from one `Families`: one factorisation, three eigenproblems (fixed, free, loaded interfaces).
Reading, assembly and coupling are the same for both and not counted. Each is a process of its own; the single one runs
before and after, since machines drift. Seconds of the clock, and of the processors in brackets. Meshes are made by gmsh
once and kept in benchmarks/out.
"""

import resource
import sys
import time

import numpy as np

from benchmarks.records import print_record, record_of
from benchmarks.rods import rod_file

SIZE = 2.56  # element size [mm]
N_MODES = 50
SETS = ("craig-bampton", "craig-bampton-ir", "herting", "rubin", "craig-chang", "benfield-hruda")


def coupled_rod(size):
    import cms
    import fe_models

    mesh = fe_models.read_mesh(rod_file(f"{size}mm", size))
    steel = fe_models.Material("steel", E=210e3, nu=0.3, rho=7.85e-9)
    ends = [
        fe_models.rigid_interface(mesh, name, fe_models.selections.FaceGroup(name)) for name in ("big_end", "small_end")
    ]
    return cms.couple(fe_models.solid_body(mesh, steel, name="rod", units=cms.unit_system("mm-t-s"), interfaces=ends))


def run(names, size):
    import cms

    body = coupled_rod(size)
    loads = [
        cms.modes.point_load("big_end", mass=1e-3, inertia=0.5),
        cms.modes.point_load("small_end", mass=5e-4, stiffness=1e4),
    ]
    stages = {}
    start, cpu = time.perf_counter(), time.process_time()
    clock = start

    def stamp(stage):
        nonlocal clock
        stages[stage] = time.perf_counter() - clock
        clock = time.perf_counter()

    with cms.modes.Families(body) as families:
        _ = families.fixed
        stamp("factorise")
        for name in names:
            options = {"loads": loads} if name == "benfield-hruda" else {}
            modes = cms.MODE_SETS[name](families, n_modes=N_MODES, **options)
            stamp(f"{name} modes")
            cms.reduce(body, modes, stress=False, geometric=False)
            stamp(f"{name} reduce")
    return {
        "s": time.perf_counter() - start, "cpu": time.process_time() - cpu, "stages": stages, "n_dof": body.n_dof
    }  # fmt: skip


def main():
    sizes = [float(a) for a in sys.argv[1:]] or [SIZE]
    for size in sizes:
        records = {}
        for what in ("single", "six", "single"):
            records.setdefault(what, []).append(record_of("compare_sets", what, size))
        (six,), singles = records["six"], records["single"]
        clock, cpu = (np.mean([r[key] for r in singles]) for key in ("s", "cpu"))
        single = " and ".join(f"{r['s']:.1f} [{r['cpu']:.1f}]" for r in singles)
        print(
            f"{six['n_dof']} dofs: six sets {six['s']:.1f} s [{six['cpu']:.1f}], peak {six['GB']:.1f} GB; single "
            f"{single} s, peak {singles[0]['GB']:.1f} GB; "
            f"ratio {six['s'] / clock:.2f} [{six['cpu'] / cpu:.2f}]"
        )
        for what, record in (("six", six), ("single", singles[-1])):
            print(f"  {what}:", ", ".join(f"{stage} {s:.1f}" for stage, s in record["stages"].items()), flush=True)


if __name__ == "__main__":
    if sys.argv[1:] and sys.argv[1] in ("single", "six"):
        record = run(SETS[:1] if sys.argv[1] == "single" else SETS, float(sys.argv[2]))
        record["GB"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
        print_record(record)
    else:
        main()
