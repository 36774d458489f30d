"""Benchmarks of shells: errors of both elements on refined meshes, and the cost of a large one.

python -m benchmarks.shells            # errors in % on 8, 16 and 32 cells a side
python -m benchmarks.shells --cost 128 # time and memory of a plate of 128 x 128 quads: 99 846 dofs
"""

import argparse
import resource
import time

import numpy as np

import cms
import fe_models as fm
from tests.fe_models import test_shell_benchmarks as cases
from tests.fe_models.shells import KINDS, SI, STEEL, frequencies, of_nodes, plate


def errors(kind, n):
    """Return name -> error in %, the worst mode of each case."""
    mesh = fm.flat_plate(10.0, 10.0, n, n, kind=kind)
    thin = plate(kind, n)
    found = {}
    exact = np.array([13.468, 19.596, 24.270, 34.801, 34.801, 61.093]) * cases.THIN_PLATE
    found["FV12 free thin plate"] = frequencies(thin, cases.across(mesh), 9)[3:] / exact
    exact = np.array([3.471, 8.507, 21.285, 27.199, 30.957, 54.19]) * cases.THIN_PLATE
    fixed = np.union1d(cases.across(mesh), of_nodes(mesh.node_sets["u0"], *range(6)))
    found["FV16 cantilevered thin plate"] = frequencies(thin, fixed, 6) / exact
    taper = fm.mapped_shell(
        lambda u, v: np.stack([10 * u, (v - 0.5) * (5 - 4 * u), 0 * u], axis=1), 2 * n, n, kind=kind
    )
    membrane = fm.shell_body(taper, fm.ShellProperty(0.05, STEEL), name="membrane", units=SI)
    fixed = np.union1d(cases.in_plane(taper), of_nodes(taper.node_sets["u0"], 0, 1))
    found["FV32 tapered membrane"] = frequencies(membrane, fixed, 6) / [44.623, 130.03, 162.70, 246.05, 379.90, 391.44]
    exact = cases.thick_plate_frequencies(10.0, 1.0, [(1, 1), (1, 2), (2, 1), (2, 2)], STEEL)
    found["FV22 hinged thick plate"] = frequencies(plate(kind, n, t=1.0), cases.hinged(mesh), 4) / exact
    rim = np.unique(np.concatenate(list(mesh.node_sets.values())))
    supported = frequencies(plate(kind, n, t=1.0), of_nodes(rim, 2), 7)[3:]
    found["FV52 plate on a line support"] = supported / [45.897, 109.44, 109.44, 167.89]
    found["Scordelis-Lo roof"] = np.array([cases.scordelis_lo(kind, n) / 0.3024])
    found["pinched cylinder"] = np.array([cases.pinched_cylinder(kind, n) / 1.8248e-5])
    return {name: 100 * (ratio - 1)[np.abs(ratio - 1).argmax()] for name, ratio in found.items()}


def cost(n):
    """Print time and memory of a plate of n x n quads with an interface, up to the reduced body."""
    mesh = fm.flat_plate(1.0, 1.0, n, n)
    root = fm.shell_interface(mesh, "root", fm.NodeSet("u0"))
    start = time.perf_counter()
    body = fm.shell_body(mesh, fm.ShellProperty(0.005, STEEL), name="plate", units=SI, interfaces=[root])
    done = time.perf_counter()
    print(f"{body.n_dof} dofs: body {done - start:.1f} s")
    coupled = cms.couple(body)
    for geometric in (False, True):
        start = time.perf_counter()
        cms.reduce(coupled, cms.craig_bampton(coupled, n_modes=20), frame=cms.NodalFrame("root"), geometric=geometric)
        done = time.perf_counter()
        print(
            f"Craig-Bampton, 20 modes, {'with' if geometric else 'without'} geometric stiffness: {done - start:.1f} s"
        )
    print(f"peak memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6:.2f} GB")


def main():
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cost", type=int, metavar="N")
    options = parser.parse_args()
    if options.cost:
        cost(options.cost)
        return
    table = {(kind, n): errors(kind, n) for kind in KINDS for n in (8, 16, 32)}
    print("case".ljust(32) + "".join(f"{kind[:4]} {n}".rjust(10) for kind, n in table))
    for name in next(iter(table.values())):
        print(name.ljust(32) + "".join(f"{row[name]:10.2f}" for row in table.values()))


if __name__ == "__main__":
    main()
