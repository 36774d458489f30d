"""Benchmarks of shells: errors of both elements on refined meshes, and the cost of a large one.

python -m benchmarks.shells            # errors in % on 8, 16 and 32 cells a side
python -m benchmarks.shells --choices  # what the drilling stiffness, the parabolic sides and the size of cells bring
python -m benchmarks.shells --stiffeners # ribs against strips of shells in their place
python -m benchmarks.shells --cost 128 # time and memory of a plate of 128 x 128 quads: 99 846 dofs
"""

import argparse
import resource
import time

import numpy as np

import cms
import fe_models as fm
from fe_models.elements.beams.torsion import rectangle_torsion_constant
from fe_models.elements.shells import elements
from tests.fe_models.elements.shells import test_benchmarks as cases
from tests.fe_models.elements.shells import test_stiffeners as ribs
from tests.fe_models.small_shells import KINDS, SI, STEEL, frequencies, of_nodes, plate, solved


def errors(kind, n):
    """Return name -> error in %, the worst mode of each case."""
    mesh = fm.shells.flat_plate(10.0, 10.0, n, n, kind=kind)
    thin = plate(kind, n)
    found = {}
    exact = np.array([13.468, 19.596, 24.270, 34.801, 34.801, 61.093]) * cases.THIN_PLATE
    found["FV12 free thin plate"] = frequencies(thin, cases.across(mesh), 9)[3:] / exact
    exact = np.array([3.471, 8.507, 21.285, 27.199, 30.957, 54.19]) * cases.THIN_PLATE
    fixed = np.union1d(cases.across(mesh), of_nodes(mesh.node_sets["u0"], *range(6)))
    found["FV16 cantilevered thin plate"] = frequencies(thin, fixed, 6) / exact
    taper = fm.shells.mapped_shell(
        lambda u, v: np.stack([10 * u, (v - 0.5) * (5 - 4 * u), 0 * u], axis=1), 2 * n, n, kind=kind
    )
    membrane = fm.shell_body(taper, fm.shells.ShellProperty(0.05, STEEL), name="membrane", units=SI)
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
    """Print time and memory of a plate of n x n quads with an interface, up to the reduced body.

    Beside the time of the wall that of the processor, which other work on the machine disturbs less; compiled code is
    loaded by a small plate before.
    """

    def reduced(n_cells, told=print):
        mesh = fm.shells.flat_plate(1.0, 1.0, n_cells, n_cells)
        root = fm.shells.shell_interface(mesh, "root", fm.selections.NodeSet("u0"))
        seconds = [time.perf_counter(), time.process_time()]

        def since(what):
            now = [time.perf_counter(), time.process_time()]
            spent = [b - a for a, b in zip(seconds, now, strict=True)]
            told(f"{what}: {spent[0]:.1f} s, cpu {spent[1]:.1f} s")
            seconds[:] = now
            return spent[1]

        body = fm.shell_body(mesh, fm.shells.ShellProperty(0.005, STEEL), name="plate", units=SI, interfaces=[root])
        made = since(f"{body.n_dof} dofs: body")
        coupled = cms.couple(body)
        costs = []
        for geometric in (False, True):
            modes = cms.craig_bampton(coupled, n_modes=20)
            cms.reduce(coupled, modes, frame=cms.NodalFrame("root"), geometric=geometric)
            what = "with" if geometric else "without"
            costs.append(since(f"Craig-Bampton, 20 modes, {what} geometric stiffness"))
        added = costs[1] - costs[0]
        told(f"geometric stiffness adds {100 * added / (made + costs[0]):.0f} % of the processor time from the mesh on")

    reduced(8, told=lambda words: None)
    reduced(n)
    print(f"peak memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6:.2f} GB")


def hemisphere(kind, n):
    """Deflection of a pinched hemisphere with a hole of 18 degrees, R/t = 250, over 0.093 (MacNeal & Harder)."""

    def surface(u, v):
        phi, theta = np.pi / 2 * u, np.deg2rad(72) * v
        return 10 * np.stack([np.cos(theta) * np.cos(phi), np.cos(theta) * np.sin(phi), np.sin(theta)], axis=1)

    mesh = fm.shells.mapped_shell(surface, n, n, kind=kind)
    material = fm.Material("m", E=6.825e7, nu=0.3, rho=1.0)
    body = fm.shell_body(mesh, fm.shells.ShellProperty(0.04, material), name="hemisphere", units=SI)
    sets = mesh.node_sets
    a, b = (int(np.intersect1d(sets[s], sets["v0"])[0]) for s in ("u0", "u1"))
    fixed = np.unique(np.concatenate([of_nodes(sets["u0"], 1, 3, 5), of_nodes(sets["u1"], 0, 4, 5), [6 * a + 2]]))
    f = np.zeros(body.n_dof)
    f[6 * a], f[6 * b + 1] = 1.0, -1.0
    return solved(body, f, fixed)[6 * a] / 0.093


def twisted_beam(kind):
    """Deflection of the twisted beam under a force across, over 0.005424 (MacNeal & Harder), 24 x 4 cells."""

    def surface(u, v):
        angle, y = np.pi / 2 * u, 1.1 * (v - 0.5)
        return np.stack([12 * u, y * np.cos(angle), y * np.sin(angle)], axis=1)

    mesh = fm.shells.mapped_shell(surface, 24, 4, kind=kind)
    material = fm.Material("m", E=29e6, nu=0.22, rho=1.0)
    body = fm.shell_body(mesh, fm.shells.ShellProperty(0.32, material), name="beam", units=SI)
    tip = np.flatnonzero(np.abs(mesh.nodes - [12.0, 0.0, 0.0]).max(axis=1) < 1e-9)[0]
    f = np.zeros(body.n_dof)
    f[6 * tip + 2] = 1.0
    return solved(body, f, of_nodes(mesh.node_sets["u0"], *range(6)))[6 * tip + 2] / 0.005424


def torsion(kind, n):
    """Torsional stiffness of a strip five times as wide as thick, n square cells across, over St Venant's."""
    b, t = 0.1, 0.02
    material = fm.Material("m", E=2e11, nu=0.0, rho=1.0)
    mesh = fm.shells.flat_plate(5 * b, b, 5 * n, n, kind=kind)
    body = fm.shell_body(mesh, fm.shells.ShellProperty(t, material), name="strip", units=SI)
    start, end = mesh.node_sets["u0"], mesh.node_sets["u1"]
    fixed = np.concatenate([of_nodes(start, 0, 1, 2, 3, 5), of_nodes(end, 2, 3)])
    turned = np.stack([mesh.nodes[end, 1] - b / 2, np.ones(len(end))], axis=1).ravel()
    values = np.concatenate([np.zeros(5 * len(start)), turned])
    order = np.argsort(fixed)
    u = solved(body, np.zeros(body.n_dof), fixed[order], values[order])
    return u @ (body.K @ u) * 5 * b / (material.mu * rectangle_torsion_constant(b, t))


def choices():
    """Print what the drilling stiffness, the parabolic sides and the size of cells bring."""
    chosen = elements.DRILLING, elements.translations
    print("drilling of quads over G t: hemisphere 8 x 8, 16 x 16, twisted beam (1 is exact)")
    for gamma in (1.0, 0.1, 0.001):
        elements.DRILLING = gamma
        print(f"{gamma:8g} {hemisphere('quad', 8):8.3f} {hemisphere('quad', 16):8.3f} {twisted_beam('quad'):8.3f}")
    elements.DRILLING = chosen[0]
    print(
        f"triangles {hemisphere('triangle', 8):7.3f} {hemisphere('triangle', 16):8.3f} {twisted_beam('triangle'):8.3f}"
    )
    mesh = fm.shells.flat_plate(10.0, 10.0, 16, 16)
    exact = np.array([13.468, 19.596, 24.270, 34.801, 34.801, 61.093]) * cases.THIN_PLATE
    print("worst of FV12 in %, 16 x 16: sides of the mass straight, parabolic")
    for kind in KINDS:
        worst = []
        for factor in (0.0, 1.0):
            elements.translations = lambda planes, N, E, shape, share, factor=factor: chosen[1](
                planes, N, factor * E, shape, share
            )
            error = frequencies(plate(kind, 16), cases.across(mesh), 9)[3:] / exact - 1
            worst.append(100 * np.abs(error).max())
        elements.translations = chosen[1]
        print(f"{kind:9s} {worst[0]:8.2f} {worst[1]:8.2f}")
    print("torsional stiffness of a strip of width 5 t, cells of t 5/n: n = 4, 8, 16 (1 is exact)")
    for kind in KINDS:
        print(f"{kind:9s}" + "".join(f"{torsion(kind, n):8.3f}" for n in (4, 8, 16)))


def stiffeners():
    """Print errors in % of the first six frequencies of ribbed plates against those with strips of shells."""
    upright, beside = (0.0, 0.0, ribs.HEIGHT), (0.0, -0.06, 0.0)
    bar = fm.beams.BeamProperty(fm.beams.Rectangle(0.06, 0.008), STEEL, offset=(-0.03, 0.0))
    cases = {
        "one rib": ((("x", 0.3),), upright, ribs.WIDTH, ribs.rib()),
        "four ribs that cross": ((("x", 0.15), ("x", 0.45), ("y", 0.3), ("y", 0.7)), upright, ribs.WIDTH, ribs.rib()),
        "bar beside an edge": ((("x", 0.0),), beside, 0.008, bar),
    }
    for name, (places, across, t, section) in cases.items():
        exact = ribs.free_frequencies(ribs.with_strips(*ribs.ribbed_plate("quad", 40, places), across, t, 12), 6)
        print(f"{name}: {', '.join(f'{f:.2f}' for f in exact)} Hz with strips")
        for kind in ribs.KINDS:
            for n in (10, 20, 40):
                found = ribs.free_frequencies(ribs.with_beams(*ribs.ribbed_plate(kind, n, places), section), 6)
                print(f"  {kind:9s} {2 * n:3d} cells " + " ".join(f"{100 * e:6.2f}" for e in found / exact - 1))


def main():
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cost", type=int, metavar="N")
    parser.add_argument("--choices", action="store_true")
    parser.add_argument("--stiffeners", action="store_true")
    options = parser.parse_args()
    if options.choices:
        choices()
        return
    if options.stiffeners:
        stiffeners()
        return
    if options.cost:
        cost(options.cost)
        return
    table = {(kind, n): errors(kind, n) for kind in KINDS for n in (8, 16, 32)}
    print("case".ljust(32) + "".join(f"{kind[:4]} {n}".rjust(10) for kind, n in table))
    for name in next(iter(table.values())):
        print(name.ljust(32) + "".join(f"{row[name]:10.2f}" for row in table.values()))


if __name__ == "__main__":
    main()
