"""Files of matrices: how long readers take beside reading the bytes of the same files, and how many MB/s that is.

python -m benchmarks.matrix_files                  # .mtx of 100 thousand dofs, OP4 of a million
python -m benchmarks.matrix_files --dofs 200000    # the OP4 pair of another size
"""

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

import fe_models
from fe_models.files.nastran.matrices.op4 import read_op4
from fe_models.files.nastran.matrices.write_op4 import write_op4

TRIES = 3


def block_pattern(n_dof: int) -> tuple[sp.csc_array, sp.csc_array]:
    """Return stiffness and mass with the entries of a cube of bricks, about n_dof rows: 81 and 27 to a row."""
    n = round((n_dof / 3) ** (1 / 3))
    line = sp.diags_array([np.ones(n), np.ones(n - 1), np.ones(n - 1)], offsets=[0, 1, -1])
    neighbours = sp.csr_array(sp.kron(sp.kron(line, line), line))
    K = sp.csc_array(sp.kron(neighbours, np.ones((3, 3))))
    M = sp.csc_array(sp.kron(neighbours, np.eye(3)))
    for matrix in (K, M):
        column = np.repeat(np.arange(matrix.shape[1]), np.diff(matrix.indptr))
        low, high = np.minimum(matrix.indices, column), np.maximum(matrix.indices, column)
        matrix.data = np.sin(1.0 + low * 0.37 + high * 0.11) * 1e9  # symmetric, all digits in use
        matrix.eliminate_zeros()
    return K, M


def write_mtx(path: Path, A: sp.csc_array) -> None:
    """Write both triangles as Abaqus does."""
    entries = sp.coo_array(A)
    with path.open("w") as file:
        for start in range(0, entries.nnz, 1 << 18):
            part = slice(start, start + (1 << 18))
            rows, columns, values = ((x[part]).tolist() for x in (entries.row, entries.col, entries.data))
            file.write("".join(f"{i + 1} {j + 1}  {v:.15e}\n" for i, j, v in zip(rows, columns, values, strict=True)))


def best(action: Callable[[], Any]) -> tuple[float, float]:
    """Return the least wall time and the least processor time of some tries [s]."""
    walls, works = [], []
    for _ in range(TRIES):
        wall, work = time.perf_counter(), time.process_time()
        action()
        walls.append(time.perf_counter() - wall)
        works.append(time.process_time() - work)
    return min(walls), min(works)


def measured(files: list[Path], action: Callable[[], Any]) -> tuple[float, float, float, float]:
    """Return megabytes, the time of reading the bytes, that of the reader and its processor time [s]."""
    size = sum(path.stat().st_size for path in files) / 1e6
    action()  # compiled code, and the pages of the files
    bytes_wall, _ = best(lambda: [path.read_bytes() for path in files])
    return size, bytes_wall, *best(action)


def report(name: str, files: list[Path], action: Callable[[], Any]) -> None:
    """Print one line of the table."""
    size, bytes_wall, wall, work = measured(files, action)
    print(
        f"| {name} | {size:.0f} MB | {bytes_wall:.2f} s | {wall:.2f} s, cpu {work:.2f} s | {wall / bytes_wall:.1f} "
        f"| {size / wall:.0f} MB/s |"
    )


def figures(short: bool) -> dict[str, float]:
    """Return what the watch keeps."""
    K, M = block_pattern(20_000 if short else 100_000)
    with tempfile.TemporaryDirectory() as folder:
        texts = [Path(folder) / "block_STIF1.mtx", Path(folder) / "block_MASS1.mtx"]
        for path, matrix in zip(texts, (K, M), strict=True):
            write_mtx(path, matrix)
        size, bytes_wall, wall, _ = measured(texts, lambda: fe_models.files.read_matrices(texts))
        pair = Path(folder) / "pair.op4"
        write_op4(pair, {"KAA": K, "MAA": M})
        _, pair_bytes, pair_wall, _ = measured([pair], lambda: read_op4(pair))
    return {
        "text matrices over their bytes": wall / bytes_wall,
        "text matrices [s/GB]": 1e3 * wall / size,
        "OP4 over its bytes": pair_wall / pair_bytes,
    }


def main() -> None:
    """Write the files, read them, print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--dofs", type=int, default=1_000_000, help="of the OP4 pair")
    parser.add_argument("--text-dofs", type=int, default=100_000, help="of the .mtx files")
    arguments = parser.parse_args()
    print("| file | size | its bytes | reader | ratio | speed |\n|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        K, M = block_pattern(arguments.text_dofs)
        texts = [Path(folder) / "block_STIF1.mtx", Path(folder) / "block_MASS1.mtx"]
        for path, matrix in zip(texts, (K, M), strict=True):
            write_mtx(path, matrix)
        report(f".mtx, {K.shape[0]} dofs", texts, lambda: fe_models.files.read_matrices(texts))
        for path in texts:
            path.unlink()
        K, M = block_pattern(arguments.dofs)
        n_dof = K.shape[0]
        pair = Path(folder) / "pair.op4"
        write_op4(pair, {"KAA": K, "MAA": M})
        del K, M
        report(f"OP4, {n_dof} dofs, matrices alone", [pair], lambda: read_op4(pair))
        report(f"OP4, {n_dof} dofs, read_matrices", [pair], lambda: fe_models.files.read_matrices(pair))


if __name__ == "__main__":
    main()
