"""Damping of the parts of a body: what it adds to `cms split`, beside the reduction of the parts.

python -m benchmarks.split_damping                 # a bar of 100 thousand dofs in four parts
python -m benchmarks.split_damping --length 20     # another number of elements along the bar, 925 dofs each
"""

import argparse
import logging
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from cms.cli.split import SplitRequest, split_job
from cms.pipeline import reduce_job
from tests.bodies import box_mesh
from tests.decks import write_deck

JOB = """
[body]
mesh = "bar.inp"
units = "m-kg-s"
[materials.steel]
young = 210e9
poisson = 0.3
density = 7850
[interfaces.left]
kind = "rigid"
nodes = "left"
[interfaces.right]
kind = "rigid"
nodes = "right"
[reduction]
set = "craig-bampton"
n_modes = 20
frame = "tisserand"
"""


def measured(action: Callable[[], Any]) -> tuple[Any, float, float]:
    """Return the result of a call, its wall time and its processor time [s]."""
    wall, work = time.perf_counter(), time.process_time()
    return action(), time.perf_counter() - wall, time.process_time() - work


def main() -> None:
    """Split the bar with and without damping, reduce its parts, print the times and the ratios."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--length", type=int, default=108, help="number of elements along the bar")
    parser.add_argument("--parts", type=int, default=4, help="number of parts")
    arguments = parser.parse_args()
    logging.basicConfig(format="%(message)s")
    mesh = box_mesh(arguments.length, 8, 8, lx=3.0, ly=0.1, lz=0.15, kind="hexahedron20")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_deck(folder / "bar.inp", mesh)
        (folder / "undamped.toml").write_text(JOB)
        (folder / "damped.toml").write_text(JOB + "[damping]\nratio = 0.02\n")
        rows = []
        for job in ("undamped", "damped"):
            request = SplitRequest(folder / f"{job}.toml", arguments.parts)
            files, *times = measured(lambda request=request: split_job(request))
            rows.append((f"split, {job}", *times))
        _, *times = measured(lambda: [reduce_job(path) for path in files[:-1]])
        rows.append(("reduction of the parts", *times))
        size = sum(path.stat().st_size for path in files[0].parent.glob("*.npz"))
    print(f"{3 * len(mesh.nodes)} dofs in {arguments.parts} parts; files of damping {size / 1e6:.1f} MB")
    print("| | wall [s] | processor [s] |\n|---|---|---|")
    for what, wall, work in rows:
        print(f"| {what} | {wall:.1f} | {work:.1f} |")


if __name__ == "__main__":
    main()
