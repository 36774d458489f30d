"""Fixed-interface modes by multilevel substructures against the direct way, shells and solids.

    python -m benchmarks.multilevel                    # shells of 100 and 260 thousand dofs, 300 and 1000 modes, solids
    python -m benchmarks.multilevel shell 408 300      # 1 million dofs: ten minutes
    python -m benchmarks.multilevel solid 24 100       # a cube of 24 x 24 x 24 hexahedra
    python -m benchmarks.multilevel errors             # cutoff factors on several bodies, against the true frequencies

"multilevel" is `cms.modes.multilevel` with its default options, "direct" `cms.craig_bampton` with as many modes:
constraint modes, fixed-interface modes, the mode set; assembly is not counted. Each is a process of its own, so the
peaks of memory are their own, of the whole process. The shell is a curved panel of n x n quads between two rigid
edges, the solid a cube between two rigid faces. The error: multilevel frequencies against the direct ones.
"""

import resource
import sys
import time

import numpy as np

from benchmarks.records import print_record, record_of

TOLERANCE = 1e-3
STUDY = [("shell", 128, 300), ("shell", 208, 300), ("shell", 208, 1000), ("solid", 16, 100), ("solid", 28, 100)]
FACTORS = (4.0, 10.0, 14.0, 20.0)
BODIES = [
    ("shell", 40, 30), ("shell", 64, 100), ("shell", 64, 400), ("plate", 64, 100), ("cantilever", 64, 100),
    ("solid", 10, 40), ("solid", 14, 100), ("bar", 60, 60), ("bar", 60, 150),
]  # fmt: skip


def body_of(kind, n):
    """Return a coupled body."""
    import cms
    import fe_models as fm
    from fe_models.elements.solids.body import solid_body
    from tests.bodies import STEEL, box_mesh
    from tests.cms.linear_algebra.substructures.shells import between, panel
    from tests.fe_models.small_shells import SI

    if kind == "shell":
        return panel(n)
    if kind == "bar":
        return between("rigid", n)
    if kind == "solid":
        mesh = box_mesh(n, n, n, 1.0, 1.0, 1.0, "hexahedron")
        ends = [
            fm.Interface(name, "rigid", mesh.node_sets[name], np.array([x, 0.5, 0.5]))
            for name, x in (("left", 0.0), ("right", 1.0))
        ]
        return cms.couple(solid_body(mesh, STEEL, name="cube", units=SI, interfaces=ends))
    mesh = fm.shells.flat_plate(1.0, 0.7, n, n)
    edges = ("u0", "u1") if kind == "plate" else ("u0",)  # held along two edges, or almost free
    property_ = fm.shells.ShellProperty(0.004, fm.Material("steel", E=2.1e11, nu=0.3, rho=7850.0))
    return cms.couple(
        fm.shell_body(
            mesh,
            property_,
            name=kind,
            units=SI,
            interfaces=[fm.shells.shell_interface(mesh, e, fm.selections.NodeSet(e)) for e in edges],
        )
    )


def run(what, kind, n, n_modes):
    """Return time, memory and frequencies of one way."""
    import cms

    small = body_of(kind, 6)
    body = body_of(kind, n)
    way = {"multilevel": cms.modes.multilevel, "direct": cms.craig_bampton}[what]
    way(small, n_modes=4)  # compiled
    clock, processor = time.perf_counter(), time.process_time()
    modes = way(body, n_modes=n_modes)
    record = {"s": time.perf_counter() - clock, "processor": time.process_time() - processor, "n_dof": body.n_dof}
    record["GB"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    record["estimate"] = float(np.nanmax(modes.data["frequency error"])) if what == "multilevel" else 0.0
    record["words"] = modes.options.get("substructures", "")
    return record | {"frequencies": modes.frequencies[-n_modes:].tolist()}


def measured(kind, n, n_modes):
    """Return the records of both ways, and the largest relative error of a frequency."""
    records = []
    for what in ("multilevel", "direct"):
        records.append(record_of("multilevel", "run", what, kind, n, n_modes))
    one, two = records
    return one, two, np.max(np.array(one["frequencies"]) / np.array(two["frequencies"]) - 1)


def figures(short):
    """Return what the watch keeps."""
    kind, n, n_modes = ("shell", 72, 200) if short else ("shell", 208, 300)
    one, two, error = measured(kind, n, n_modes)
    name = f"shell of {one['n_dof'] // 1000}k dofs, {n_modes} modes"
    return {
        f"multilevel over direct, time, {name}": one["s"] / two["s"],
        f"multilevel over direct, processor time, {name}": one["processor"] / two["processor"],
        f"multilevel over direct, peak of memory, {name}": one["GB"] / two["GB"],
        f"largest error of a frequency over the tolerance, {name}": error / TOLERANCE,
    }


def table(cases):
    """Print both ways side by side."""
    for kind, n, n_modes in cases:
        one, two, error = measured(kind, n, n_modes)
        print(
            f"{kind}, {one['n_dof']} dofs, {n_modes} modes: multilevel {one['s']:.1f} s (processor "
            f"{one['processor']:.1f}), {one['GB']:.2f} GB; direct {two['s']:.1f} s ({two['processor']:.1f}), "
            f"{two['GB']:.2f} GB; ratio {one['s'] / two['s']:.2f} ({one['processor'] / two['processor']:.2f}); "
            f"largest error {error:.1e}, estimated {one['estimate']:.1e}; {one['words']}",
            flush=True,
        )


def errors():
    """Print the largest error for several cutoff factors, without a step of inverse iteration and as delivered."""
    import cms
    from cms.linear_algebra.substructures import modes

    cms_modes, most = cms.modes.multilevel, modes.MOST_STEPS
    for kind, n, n_modes in BODIES:
        body = body_of(kind, n)
        true = cms.craig_bampton(body, n_modes=n_modes).frequencies[-n_modes:]
        told = []
        for factor in FACTORS:
            found = []
            for modes.MOST_STEPS in (0, most):
                made = cms_modes(body, n_modes=n_modes, cutoff_factor=factor)
                estimate = np.nanmax(made.data["frequency error"])
                found.append(((made.frequencies[-n_modes:] / true - 1).max(), estimate))
            (first, guess), (last, _) = found
            told.append(f"{factor:g}: {first:.1e} ({guess:.1e}) {last:.1e}")
        print(f"{kind} {body.n_dof} dofs, {n_modes} modes; " + "; ".join(told), flush=True)


def main():
    if sys.argv[1:2] == ["errors"]:
        errors()
    elif sys.argv[1:]:
        table([(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))])
    else:
        table(STUDY)


if __name__ == "__main__":
    if sys.argv[1:2] == ["run"]:
        print_record(run(*sys.argv[2:4], *map(int, sys.argv[4:6])))
    else:
        main()
