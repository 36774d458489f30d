"""The hinge of exudyn's tutorial on component mode synthesis: its free modes by exudyn and by us, on the same matrices.

    python -m benchmarks.exudyn_hinge              # elements of 10, 5 and 3 mm
    python -m benchmarks.exudyn_hinge 2.0 1.4      # other sizes [mm]; exudyn needs hours and much memory
    python -m benchmarks.exudyn_hinge 1.4 --alone  # ours alone

A plate of 400 x 40 x 20 mm with a bolt and a bushing, linear tetrahedra, 8 free modes beside the rigid ones. The
tutorial meshes the same shape by Netgen; a comment there gives 1540 s for the modes of 203 443
nodes. Here gmsh meshes it. Each side is a process of its own that loads K, M and the nodes; the time is from the
matrices in memory to the modes. Exudyn: `FEMinterface.ComputeEigenmodes`, as in the tutorial; ours: `normal_modes`,
checks included. Memory: peak of the process above what it held before. Both must find the same frequencies.
"""

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from benchmarks.records import print_record, record_of
from benchmarks.rods import OUT

N_MODES = 8


def hinge_file(size):
    """Return the mesh file of the hinge with elements of this size [mm]; lengths in metres."""
    import gmsh

    OUT.mkdir(exist_ok=True)
    path = OUT / f"hinge_{size:g}.msh"
    if path.is_file():
        return path
    length, width, height, bore, depth = 0.4, 0.04, 0.02, 0.03, 0.05
    gmsh.initialize()
    try:
        gmsh.option.set_number("General.Terminal", 0)
        occ = gmsh.model.occ

        def cylinder(x, top, bottom, radius):
            """Return a cylinder along y."""
            return [(3, occ.add_cylinder(x, top, 0, 0, bottom - top, 0, radius))]

        plate = [(3, occ.add_box(0, 0, -height / 2, length, width, height))]
        bolt = cylinder(0, width, 0, 1.6 * height) + cylinder(0, width / 2, -depth, bore / 2)
        bushing, _ = occ.cut(cylinder(length, width, -depth, bore), cylinder(length, 0, -1.1 * depth, bore / 2))
        occ.fuse(plate, bolt + bushing)
        occ.synchronize()
        gmsh.model.add_physical_group(3, [tag for _, tag in gmsh.model.get_entities(3)], name="hinge")
        gmsh.option.set_number("Mesh.MeshSizeMax", size * 1e-3)
        gmsh.model.mesh.generate(3)
        gmsh.write(str(path))
    finally:
        gmsh.finalize()
    return path


def make(size, folder):
    """Write K, M and the nodes of the hinge into a folder; return its number of dofs."""
    import fe_models

    steel = fe_models.Material("steel", E=210e9, nu=0.3, rho=7850.0)
    mesh = fe_models.read_mesh(hinge_file(size))
    body = fe_models.solid_body(mesh, steel, name="hinge", units=fe_models.unit_system("m-kg-s"))
    for name, matrix in (("K", body.K), ("M", body.M)):
        sp.save_npz(folder / f"{name}.npz", sp.csr_matrix(matrix), compressed=False)
    np.save(folder / "nodes.npy", mesh.nodes)
    return body.n_dof


def own(K, M, nodes):
    """Return our computation of the frequencies [Hz]; libraries are loaded before the clock starts."""
    from cms import couple
    from cms.linear_algebra.solvers.pardiso import mkl_runtime
    from cms.modes import normal_modes
    from fe_models.body.fe_body import FEBody

    mkl_runtime()
    dofs = np.stack([np.repeat(np.arange(len(nodes)), 3), np.tile(np.arange(3), len(nodes))], axis=1)
    return lambda: normal_modes(couple(FEBody("hinge", M, K, nodes, dofs, [])), N_MODES).frequencies[-N_MODES:]


def exudyn(K, M, nodes):
    """Return exudyn's computation of the frequencies [Hz]."""
    from exudyn.FEM import FEMinterface

    fem = FEMinterface()
    fem.nodes = {"Position": nodes}
    fem.massMatrix, fem.stiffnessMatrix = M, K

    def run():
        fem.ComputeEigenmodes(N_MODES, excludeRigidBodyModes=6, useSparseSolver=True)
        return np.sqrt(np.asarray(fem.eigenValues)) / (2 * np.pi)

    return run


def measure(side, folder):
    """Run one side in this process and print its record."""
    K, M = (sp.load_npz(folder / f"{name}.npz") for name in "KM")
    run = {"own": own, "exudyn": exudyn}[side](K, M, np.load(folder / "nodes.npy"))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    start, cpu = time.perf_counter(), time.process_time()
    frequencies = run()
    seconds, cpu = time.perf_counter() - start, time.process_time() - cpu
    GB = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1e6
    print_record({"s": seconds, "cpu": cpu, "GB": GB, "Hz": [float(f) for f in frequencies]})


def record(side, folder):
    """Return the record of one side, run in a process of its own."""
    return record_of("exudyn_hinge", "--side", side, folder)


def words(each):
    """Return time and memory of a record."""
    return f"{each['s']:.2f} s, cpu {each['cpu']:.1f} s, {each['GB']:.2f} GB"


def both(size):
    """Return the number of nodes and the records of both sides, ours first."""
    with tempfile.TemporaryDirectory() as folder:
        n_nodes = make(size, Path(folder)) // 3
        ours, theirs = record("own", folder), record("exudyn", folder)
    np.testing.assert_allclose(ours["Hz"], sorted(theirs["Hz"]), rtol=1e-6)
    return n_nodes, ours, theirs


def figures(short):
    """Return what the watch keeps."""
    n_nodes, ours, theirs = both(3.0 if short else 2.0)
    name = f"{n_nodes / 1000:.0f}k nodes"
    return {
        f"against exudyn, {name}, speedup": theirs["s"] / ours["s"],
        f"against exudyn, {name}, processor time, speedup": theirs["cpu"] / ours["cpu"],
        f"{name} [s]": ours["s"],
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sizes", nargs="*", type=float, default=[10.0, 5.0, 3.0])
    parser.add_argument("--alone", action="store_true", help="ours alone")
    parser.add_argument("--side", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.side:
        measure(options.side[0], Path(options.side[1]))
        return
    compiled = [sys.executable, "-m", "floatframe.cli.compile_kernels", "cholesky", "reduction"]  # once on a machine
    subprocess.run(compiled, stdout=subprocess.DEVNULL, check=True)
    print("| elements | nodes | floatframe | exudyn 1.13.6 | time |\n|---|---|---|---|---|")
    for size in options.sizes:
        if options.alone:
            with tempfile.TemporaryDirectory() as folder:
                n_nodes = make(size, Path(folder)) // 3
                ours, more = record("own", folder), " | "
        else:
            n_nodes, ours, theirs = both(size)
            more = f"{words(theirs)} | {theirs['s'] / ours['s']:.0f}x, cpu {theirs['cpu'] / ours['cpu']:.0f}x"
        print(f"| {size:g} mm | {n_nodes} | {words(ours)} | {more} |", flush=True)


if __name__ == "__main__":
    main()
