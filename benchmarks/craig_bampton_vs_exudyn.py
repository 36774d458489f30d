"""Craig-Bampton modes of a steel bar against exudyn's FEMinterface, on the same hex8 matrices.

    python -m benchmarks.craig_bampton_vs_exudyn           # 160x9x9 elements, 48 thousand dofs
    python -m benchmarks.craig_bampton_vs_exudyn --large   # adds 220x14x14, 149 thousand dofs: exudyn needs 10 GB

Bar of 1 x 0.05 x 0.05 m, rigid interfaces (RBE2) at both ends, 14 fixed-interface modes. Each side is a process of its
own that loads K, M and the nodes. Time: from the matrices in memory to the Hurty-Craig-Bampton modes, with libraries
and our compiled kernels loaded; here with checks and couplings. "+ reduce" adds what the peer does not do there:
finishing step and inertia invariants. Memory: peak of the process above what it held before. "cpu": seconds of
processor of the process, all threads, over the same time: on a busy machine it says more than the clock. Both must
find the same fixed-interface frequencies.
"""

import resource
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from benchmarks.records import print_record, record_of

N_MODES = 14
BARS = {"48k": (160, 9, 9), "149k": (220, 14, 14)}


def make(elements, folder):
    from fe_models.elements.solids.body import solid_body
    from fe_models.foundation.units import unit_system
    from tests.bodies import STEEL, box_mesh

    mesh = box_mesh(*elements, 1.0, 0.05, 0.05, "hexahedron")
    body = solid_body(mesh, STEEL, name="bar", units=unit_system("m-kg-s"))
    sp.save_npz(folder / "K.npz", sp.csr_matrix(body.K), compressed=False)
    sp.save_npz(folder / "M.npz", sp.csr_matrix(body.M), compressed=False)
    np.savez(folder / "nodes.npz", nodes=mesh.nodes, left=mesh.node_sets["left"], right=mesh.node_sets["right"])
    return body.n_dof


def own(folder):
    # libraries and kernels are loaded before the clock starts, as libraries are on the other side
    import cms.modes.families.families
    import cms.reduction.basis.finishing  # noqa: F401
    from cms import NodalFrame, couple, craig_bampton, reduce
    from cms.linear_algebra.solvers.pardiso import mkl_runtime
    from fe_models.body.fe_body import FEBody, Interface
    from floatframe.cli.compile_kernels import make_cholesky

    K, M, nodes, left, right = load(folder)
    mkl_runtime()
    make_cholesky()
    dofs = np.stack([np.repeat(np.arange(len(nodes)), 3), np.tile(np.arange(3), len(nodes))], axis=1)

    def run():
        ends = [Interface(name, "rigid", n, nodes[n].mean(axis=0)) for name, n in (("left", left), ("right", right))]
        body = couple(FEBody("bar", M, K, nodes, dofs, ends))
        modes = craig_bampton(body, n_modes=N_MODES)
        clock, cpu = time.perf_counter(), time.process_time()
        reduce(body, modes, frame=NodalFrame("left"), geometric=False)
        return modes.frequencies[12:], time.perf_counter() - clock, time.process_time() - cpu

    return run


def exudyn(folder):
    from exudyn.FEM import FEMinterface, HCBstaticModeSelection

    K, M, nodes, left, right = load(folder)
    fem = FEMinterface()
    fem.nodes = {"Position": nodes}
    fem.massMatrix, fem.stiffnessMatrix = M, K

    def run():
        fem.ComputeHurtyCraigBamptonModes(
            [left.tolist(), right.tolist()], N_MODES, computationMode=HCBstaticModeSelection.RBE2
        )
        return np.sqrt(np.asarray(fem.eigenValues)) / (2 * np.pi), 0.0, 0.0

    return run


def load(folder):
    table = np.load(folder / "nodes.npz")
    K, M = sp.load_npz(folder / "K.npz"), sp.load_npz(folder / "M.npz")
    return K, M, table["nodes"], table["left"], table["right"]


def measure(side, folder):
    """Run one side in this process and print its record."""
    run = {"own": own, "exudyn": exudyn}[side](folder)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    start, cpu = time.perf_counter(), time.process_time()
    frequencies, more, more_cpu = run()
    seconds, cpu = time.perf_counter() - start - more, time.process_time() - cpu - more_cpu
    after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    record = {
        "s": seconds,
        "more": more,
        "cpu": cpu,
        "GB": (after - before) / 1e6,
        "Hz": [float(f) for f in frequencies],
    }
    print_record(record)


def both(name):
    """Return the records of both sides, ours first, and the number of dofs."""
    with tempfile.TemporaryDirectory() as folder:
        n_dof = make(BARS[name], Path(folder))
        ours, theirs = (record_of("craig_bampton_vs_exudyn", side, folder) for side in ("own", "exudyn"))
    np.testing.assert_allclose(ours["Hz"], sorted(theirs["Hz"])[:N_MODES], rtol=1e-6)
    return ours, theirs, n_dof


def figures(short):
    """Return what the watch keeps."""
    name = "48k" if short else "149k"
    ours, theirs, _ = both(name)
    return {
        f"against exudyn, {name} dofs, speedup": theirs["s"] / ours["s"],
        f"against exudyn, {name} dofs, processor time, speedup": theirs["cpu"] / ours["cpu"],
        f"memory beside exudyn, {name} dofs, saving": theirs["GB"] / ours["GB"],
        f"{name} dofs [s]": ours["s"],
    }


def main():
    names = list(BARS) if "--large" in sys.argv else ["48k"]
    print("| dofs | floatframe | exudyn 1.13.6 | time | memory |\n|---|---|---|---|---|")
    for name in names:
        ours, theirs, n_dof = both(name)
        print(
            f"| {n_dof} | {ours['s']:.2f} s, cpu {ours['cpu']:.1f} s (+ reduce {ours['more']:.2f} s), "
            f"{ours['GB']:.2f} GB "
            f"| {theirs['s']:.1f} s, cpu {theirs['cpu']:.1f} s, {theirs['GB']:.2f} GB "
            f"| {theirs['s'] / ours['s']:.1f}x, cpu {theirs['cpu'] / ours['cpu']:.1f}x "
            f"| {theirs['GB'] / ours['GB']:.1f}x |",
            flush=True,
        )


if __name__ == "__main__":
    if len(sys.argv) > 2:
        measure(sys.argv[1], Path(sys.argv[2]))
    else:
        main()
