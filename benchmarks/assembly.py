"""Assembly of K and M of a tet10 box against scikit-fem's own, in chunks of 20 000 elements.

    python -m benchmarks.assembly                # 0.1 and 0.5 million dofs
    python -m benchmarks.assembly 0.1 1.0        # others

Every measurement is a process of its own. Time: from the mesh in memory to K and M in compressed columns, warm:
compiled code comes from the cache; loading it, and the first compilation into an empty cache, are printed apart
(they include importing the libraries). Memory: peak of the process above what it held before.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

CHUNK = 20_000


def box(million_dofs):
    from tests.bodies import box_mesh

    n = max(2, round(((million_dofs * 1e6 / 3) ** (1 / 3) - 1) / 2))
    return box_mesh(n, n, n, kind="tetra10")


def own(mesh):
    from fe_models.elements.solids.assembly import assemble, expand_scalar_mass
    from tests.bodies import STEEL

    properties = np.array([[STEEL.lam, STEEL.mu, STEEL.rho]])
    K, M_s = assemble(mesh, properties, {"tetra10": np.zeros(len(mesh.cells["tetra10"]), int)})
    return K, expand_scalar_mass(M_s)


def scikit_fem(mesh):
    import scipy.sparse as sp
    import skfem
    from skfem.helpers import ddot, eye, sym_grad, trace

    from tests.bodies import STEEL

    corners, cells = np.unique(mesh.cells["tetra10"][:, :4], return_inverse=True)
    linear = skfem.MeshTet1(mesh.nodes[corners].T.copy(), cells.reshape(-1, 4).T.copy())
    theirs = skfem.MeshTet2.from_mesh(linear)

    @skfem.BilinearForm
    def stiffness(u, v, w):
        strain = sym_grad(u)
        return ddot(STEEL.lam * eye(trace(strain), 3) + 2 * STEEL.mu * strain, sym_grad(v))

    @skfem.BilinearForm
    def mass(u, v, w):
        return STEEL.rho * u * v

    K = M_s = 0
    for begin in range(0, theirs.nelements, CHUNK):
        elements = np.arange(begin, min(begin + CHUNK, theirs.nelements))
        vector = skfem.ElementVector(skfem.ElementTetP2())
        K = K + stiffness.assemble(skfem.CellBasis(theirs, vector, intorder=2, elements=elements))
        M_s = M_s + mass.assemble(skfem.CellBasis(theirs, skfem.ElementTetP2(), intorder=4, elements=elements))
    return sp.csc_array(K), sp.csc_array(sp.kron(M_s, sp.eye_array(3)))


ROUTES = {"own": own, "scikit-fem": scikit_fem}


def memory(key):
    """VmRSS or VmHWM of this process [GB]."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(key):
            return float(line.split()[1]) / 1e6
    raise RuntimeError(f"no {key} in /proc/self/status; this benchmark needs Linux")


def measure(route, million_dofs):
    begin = time.perf_counter()
    ROUTES[route](box(1e-4))
    start_up = time.perf_counter() - begin
    mesh = box(million_dofs)
    Path("/proc/self/clear_refs").write_text("5")  # the peak starts anew
    before = memory("VmRSS")
    begin = time.perf_counter()
    K, M = ROUTES[route](mesh)
    seconds = time.perf_counter() - begin
    held = sum(array.nbytes for matrix in (K, M) for array in (matrix.data, matrix.indices, matrix.indptr)) / 1e9
    return {
        "n_dof": K.shape[0],
        "nnz": K.nnz,
        "seconds": seconds,
        "peak": memory("VmHWM") - before,
        "held": held,
        "start_up": start_up,
        "mass": float(M.sum() / 3),
    }


def child(route, million_dofs, cache=None):
    environment = os.environ | ({"NUMBA_CACHE_DIR": cache} if cache else {})
    command = [sys.executable, "-m", "benchmarks.assembly", "--measure", route, str(million_dofs)]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True, env=environment).stdout)


def figures(short):
    """Return what the watch keeps."""
    size = 0.1 if short else 0.5
    ours, theirs = (child(route, size) for route in ROUTES)
    return {
        f"against scikit-fem, {size} M dofs, speedup": theirs["seconds"] / ours["seconds"],
        f"memory beside scikit-fem, {size} M dofs, saving": theirs["peak"] / ours["peak"],
        f"{size} M dofs [s]": ours["seconds"],
    }


def main(sizes):
    with tempfile.TemporaryDirectory() as cache:
        first = child("own", 1e-4, cache)
        again = child("own", 1e-4, cache)
    print(f"first use, with compilation: {first['start_up']:.1f} s; from the cache: {again['start_up']:.2f} s")
    print(f"{'dofs':>9} {'route':>11} {'time':>8} {'peak':>8} {'matrices':>9}")
    for size in sizes:
        results = {route: child(route, size) for route in ROUTES}
        for route, r in results.items():
            print(f"{r['n_dof']:>9} {route:>11} {r['seconds']:>6.2f} s {r['peak']:>5.2f} GB {r['held']:>6.2f} GB")
        ours, theirs = results["own"], results["scikit-fem"]
        assert abs(ours["mass"] / theirs["mass"] - 1) < 1e-10
        assert ours["n_dof"] == theirs["n_dof"]
        faster, smaller = theirs["seconds"] / ours["seconds"], theirs["peak"] / ours["peak"]
        print(f"{'':>9} {'ratio':>11} {faster:>7.1f}x {smaller:>7.1f}x")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--measure"]:
        print(json.dumps(measure(sys.argv[2], float(sys.argv[3]))))
    else:
        main([float(size) for size in sys.argv[1:]] or [0.1, 0.5])
