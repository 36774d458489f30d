"""A body with many interfaces from the mesh file to the modal file, by the command itself, against the bare solver.

    python -m benchmarks.interface_rich                    # 40 rigid interfaces and one of 601 nodes, all variants
    python -m benchmarks.interface_rich small              # 10 and one of 153 nodes
    python -m benchmarks.interface_rich plain reduced      # some variants
    python -m benchmarks.interface_rich error              # of frequencies by the number of interface modes (small)

A steel block of hex20 cells. Its end x = 0 is an interface of kind "nodes", single faces of its top are rigid
interfaces; Craig-Bampton with 20 fixed-interface modes. Variants: "plain" all constraint modes without stress and
geometric stiffness, "stress" with stress, "whole" with both, "chosen" with the loads of the frame and of one interface;
"reduced" is "whole" with 20 characteristic modes of the nodes interface, "rigid" is "whole" without that interface.
"bare": one PARDISO factorisation of K_II and a solve of as many columns as the body has boundary dofs, nothing else
counted. Every run is a process of its own, with one thread of BLAS each, so that its processor time (user + system)
counts no waiting threads; the ratio is of processor times. With columns on disk: `benchmarks.memory_forecast`.
"""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from benchmarks.records import print_record, record_in

OUT = Path(__file__).parent / "out"
SIZES = {  # cells along x, y, z and where single top faces are interfaces: numbers of cells along x and y
    "full": ((22, 13, 14), range(2, 22, 2), (1, 4, 7, 10)),
    "small": ((12, 6, 7), range(2, 12, 2), (1, 4)),
}
CELL = 0.02  #: edge of a cell [m]
ALL = ""  #: all constraint modes of the nodes interface
FEW = "interface_modes = 20\n"
VARIANTS = {  # further lines of [reduction], and whether there is the nodes interface
    "plain": (ALL + "stress = false\ngeometric_stiffness = false\n", True),
    "stress": (ALL + "geometric_stiffness = false\n", True),
    "whole": (ALL + "geometric_stiffness = true\n", True),
    "chosen": (ALL + 'geometric_stiffness = ["top_2_1"]\n', True),
    "reduced plain": (FEW + "stress = false\ngeometric_stiffness = false\n", True),
    "reduced": (FEW + "geometric_stiffness = true\n", True),
    "rigid": (ALL + "geometric_stiffness = true\n", False),
}


def mesh_file(size):
    """Write the block once, as VTK."""
    import meshio

    from tests.bodies import box_mesh

    path = OUT / f"interface_rich_{size}.vtu"
    if not path.is_file():
        OUT.mkdir(exist_ok=True)
        n = SIZES[size][0]
        mesh = box_mesh(*n, *(CELL * k for k in n), kind="hexahedron20")
        cells = {kind: np.asarray(rows) for kind, rows in mesh.cells.items()}
        meshio.Mesh(np.asarray(mesh.nodes), cells).write(path)
    return path


def job_file(size, variant, folder):
    """Write the job of a variant."""
    (_, ny, nz), along, across = SIZES[size]
    lines, has_nodes = VARIANTS[variant]
    text = (
        f'[body]\nname = "block"\nunits = "m-kg-s"\nmesh = "{mesh_file(size).resolve()}"\n'
        "[materials.steel]\nyoung = 2.1e11\npoisson = 0.3\ndensity = 7850.0\n"
    )
    if has_nodes:
        hi = [0.0, CELL * ny, CELL * nz]
        text += f'[interfaces.end]\nkind = "nodes"\nbox = {{lo = [0.0, 0.0, 0.0], hi = {hi}}}\n'
    for i in along:
        for j in across:
            lo, hi = [CELL * i, CELL * j, CELL * nz], [CELL * (i + 1), CELL * (j + 1), CELL * nz]
            text += f'[interfaces.top_{i}_{j}]\nkind = "rigid"\nbox = {{lo = {lo}, hi = {hi}}}\n'
    path = Path(folder) / "job.toml"
    path.write_text(text + f'[reduction]\nset = "craig-bampton"\nn_modes = 20\n{lines}')
    return path


def command(size, variant):
    """Run `cms reduce` on a variant; returns seconds, processor seconds, peak in GB, size of the file in MB, stages."""
    with tempfile.TemporaryDirectory(dir=OUT) as folder:
        job, modal = job_file(size, variant, folder), Path(folder) / "job.h5"
        made = measured(["-m", "cms.cli", "reduce", str(job), "-o", str(modal)])
        if made["code"]:
            print(made["output"][-2000:])
        made["MB"] = modal.stat().st_size / 1e6 if modal.is_file() else 0.0
    lines = made["output"].splitlines()
    begin = next((k for k, line in enumerate(lines) if line.strip() == "Time"), len(lines))
    words = [line.split() for line in lines[begin + 3 :]]
    made["stages"] = {" ".join(each[:-1]): each[-1] for each in words if len(each) > 1 and each[-1][:1].isdigit()}
    return made


def measured(arguments):
    """Run Python in a process of its own; what it took and printed."""
    start = time.perf_counter()
    with tempfile.TemporaryFile("w+") as output:
        environment = os.environ | {"OMP_NUM_THREADS": "1"}
        child = subprocess.Popen([sys.executable, *arguments], stdout=output, stderr=subprocess.STDOUT, env=environment)
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        output.seek(0)
        text = output.read()
    return {
        "s": time.perf_counter() - start,
        "cpu": usage.ru_utime + usage.ru_stime,
        "GB": usage.ru_maxrss / 1e6,
        "output": text,
        "code": child.returncode,
    }


def bare(size):
    """One factorisation of K_II, one solve of as many columns as there are boundary dofs, in blocks of 60."""
    from cms.jobs.body_of_job import job_body
    from cms.jobs.job import read_job
    from cms.linear_algebra.solvers.factorization import lower_triangle
    from cms.linear_algebra.solvers.pardiso import PardisoFactor
    from fe_models.foundation.sparse.submatrix import principal_block
    from fe_models.foundation.stages import Stages

    with tempfile.TemporaryDirectory(dir=OUT) as folder:
        body = job_body(read_job(job_file(size, "plain", folder)), Stages())
    lower = lower_triangle(principal_block(body.K, body.i))
    columns = np.asfortranarray(np.random.default_rng(0).standard_normal((lower.shape[0], 60)))
    start = time.process_time()
    factor = PardisoFactor(lower, definite=True)
    factored = time.process_time()
    for _ in range(-(-len(body.b) // 60)):
        factor.solve(columns)
    solved = time.process_time()
    return {
        "cpu": solved - start, "factor": factored - start, "solve": solved - factored, "n_dof": body.n_dof,
        "n_b": len(body.b),
    }  # fmt: skip


def error():
    """Print the largest relative error of eight free-free frequencies by the number of interface modes, small body."""
    import cms
    from cms.jobs.body_of_job import job_body
    from cms.jobs.job import read_job
    from fe_models.foundation.stages import Stages

    mesh_file("small")
    with tempfile.TemporaryDirectory(dir=OUT) as folder:
        body = job_body(read_job(job_file("small", "plain", folder)), Stages())
    whole = cms.craig_bampton(body, 20)

    def frequencies(modes):
        return cms.reduce(body, modes, geometric=False, stress=False).free_frequencies[:8]

    exact = frequencies(whole)
    for n in (0, 5, 10, 20, 40, 80):
        errors = frequencies(cms.modes.with_characteristic_modes(whole, body, n)) / exact - 1
        print(f"{n:3} modes kept: {errors.max():.1e} (least {errors.min():.1e})", flush=True)


def figures(short):
    """Return what the watch keeps."""
    size, name = ("small", "reduced") if short else ("full", "plain")
    mesh_file(size)
    solver = record_in(measured(["-m", "benchmarks.interface_rich", "bare", size])["output"])
    made = command(size, name)
    return {
        f"cms reduce over the bare solver, {solver['n_b']} boundary dofs, {name}": made["cpu"] / solver["cpu"],
        f"peak of memory, {solver['n_b']} boundary dofs, {name} [GB]": made["GB"],
        f"modal file, {solver['n_b']} boundary dofs, {name} [MB]": made["MB"],
    } | geometric_figures(size if short else "", solver)


def geometric_figures(size, solver):
    """Return what the geometric stiffness of all modes adds, with all loads and with those of one interface."""
    if not size:
        return {}
    bare = command(size, "stress")["cpu"]
    return {
        f"geometric stiffness of all {solver['n_b']} constraint modes, {name}, over the bare solver": (
            (command(size, name)["cpu"] - bare) / solver["cpu"]
        )
        for name in ("whole", "chosen")
    }


def main():
    size = "small" if "small" in sys.argv else "full"
    chosen = [name for name in VARIANTS if name in sys.argv[1:]] or list(VARIANTS)
    mesh_file(size)
    made = measured(["-m", "benchmarks.interface_rich", "bare", size])
    if made["code"]:
        sys.exit(made["output"])
    solver = record_in(made["output"])
    print(
        f"{solver['n_dof']} dofs, {solver['n_b']} of them on interfaces; bare: cpu {solver['cpu']:.1f} s (factor "
        f"{solver['factor']:.1f}, {solver['n_b']} columns {solver['solve']:.1f})",
        flush=True,
    )
    for name in chosen:
        made = command(size, name)
        print(
            f"{name:14} {made['s']:6.1f} s, cpu {made['cpu']:6.1f} s, ratio {made['cpu'] / solver['cpu']:5.2f}, peak "
            f"{made['GB']:5.2f} GB, file {made['MB']:7.1f} MB{'' if made['code'] == 0 else ' FAILED'}"
        )
        print("  ", ", ".join(f"{stage} {s}" for stage, s in made["stages"].items()), flush=True)


if __name__ == "__main__":
    if sys.argv[1:2] == ["bare"]:
        print_record(bare(sys.argv[2]))
    elif sys.argv[1:] == ["error"]:
        error()
    else:
        main()
