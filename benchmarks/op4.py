"""A pair of OP4 matrices of a million dofs: read, against reading the bytes of the files.

python benchmarks/op4.py [--nodes 70] [--repeat 5]

K and M are those of a cube of nodes x nodes x nodes solid elements' nodes, three dofs each: 81 and 27 entries in a row,
written as Nastran's bigmat strings. Both ways of reading take turns, in processor time of this process and by the
clock; the least of each is compared. The files are in the cache of the system.
"""

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from fe_models.importers.nastran_matrices.op4 import read_op4
from fe_models.importers.nastran_matrices.write_op4 import write_op4


def pair(n: int) -> dict[str, sp.csc_array]:
    """Return matrices with the pattern of a cube of hexahedra, n nodes along each edge."""
    line = sp.diags_array([np.full(n - 1, -1.0), np.full(n, 2.5), np.full(n - 1, -1.0)], offsets=[-1, 0, 1])
    nodes = sp.kron(sp.kron(line, line), line, format="csc")
    rng = np.random.default_rng(0)
    block = rng.standard_normal((3, 3))
    return {"K": sp.csc_array(sp.kron(nodes, block @ block.T)), "M": sp.csc_array(sp.kron(nodes, np.eye(3), "csc"))}


def bytes_of(paths: list[Path]) -> list[np.ndarray]:
    """Read the files into memory."""
    return [np.fromfile(path, np.uint8) for path in paths]


def matrices_of(paths: list[Path]) -> list[sp.csc_array]:
    """Read the files as matrices."""
    return [read_op4(path)[0].matrix for path in paths]


def timed(read: Callable[[list[Path]], object], paths: list[Path]) -> tuple[float, float]:
    """Return processor time and time by the clock [s]."""
    cpu, clock = time.process_time(), time.perf_counter()
    held = read(paths)
    times = time.process_time() - cpu, time.perf_counter() - clock
    del held
    return times


def main() -> None:
    """Write the pair, read it in turns, print the least times."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--nodes", type=int, default=70, help="along an edge of the cube")
    parser.add_argument("--repeat", type=int, default=5)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        matrices = pair(given.nodes)
        paths = [Path(folder) / f"{name}.op4" for name in matrices]
        start = time.process_time()
        for path, (name, matrix) in zip(paths, matrices.items(), strict=True):
            write_op4(path, {name: matrix})
        written = time.process_time() - start
        size = sum(path.stat().st_size for path in paths) / 1e6
        n_dof, entries = matrices["K"].shape[0], [matrix.nnz for matrix in matrices.values()]
        for path, matrix in zip(paths, matrices.values(), strict=True):
            assert (read_op4(path)[0].matrix != matrix).nnz == 0
        del matrices, matrix
        times = {"bytes": [], "matrices": []}
        for _ in range(given.repeat):
            times["bytes"].append(timed(bytes_of, paths))
            times["matrices"].append(timed(matrices_of, paths))
    print(f"{n_dof} dofs, {entries[0]} and {entries[1]} entries, {size:.0f} MB, written in {written:.1f} s")
    least = {way: np.min(values, axis=0) for way, values in times.items()}
    for way, (cpu, clock) in least.items():
        print(f"{way:9s} {cpu:6.2f} s processor, {clock:6.2f} s clock, {size / clock:6.0f} MB/s")
    ratio = least["matrices"] / least["bytes"]
    print(f"matrices in {ratio[0]:.2f} (processor) and {ratio[1]:.2f} (clock) of the time of their bytes")


if __name__ == "__main__":
    main()
