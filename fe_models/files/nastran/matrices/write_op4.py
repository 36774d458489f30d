"""Writing of OUTPUT4 files: little-endian binary with 32-bit integers, or text; always double precision."""

from collections.abc import Iterator, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from fe_models.errors import MatrixError
from fe_models.files.nastran.matrices.op4_binary import LARGEST
from fe_models.foundation.paths import replace_file

__all__ = ["op4_parts", "write_op4"]

LARGEST_TEXT = 9_999_998  #: largest number of rows or columns that fits into 8 characters with a sign
PER_LINE, WIDTH, DIGITS = 3, 24, 16  #: numbers per line, width and digits; 17 significant digits reproduce every double
RECTANGULAR, SYMMETRIC, SQUARE = 2, 6, 1  #: form codes of matrices


def write_op4(path: str | Path, matrices: Mapping[str, Any], *, text: bool = False) -> None:
    """Write matrices to an OP4 file in double precision, as columns of bigmat strings without zero entries.

    Parameters
    ----------
    path
        Path of the file, which is replaced as a whole.
    matrices
        Real matrices by name, dense or sparse, with both triangles. A name has letters, digits and _, at most 8
        characters, and is written in upper case.
    text
        Whether to write text in the format 1P,3E24.16, which reproduces every double, instead of binary.

    Raises
    ------
    MatrixError
        If a name does not fit or occurs twice, or a matrix is empty, too large, complex or not finite.
    """
    replace_file(Path(path), *op4_parts(f"OP4 file {path}", matrices, text=text))


def op4_parts(where: str, matrices: Mapping[str, Any], *, text: bool = False) -> list[bytes]:
    """Return the bytes of an OP4 file, part by part, for `write_op4` and for writers of several files at once."""
    parts: list[bytes] = []
    seen: set[str] = set()
    for given, values in matrices.items():
        name = given.upper()
        if not (given.isascii() and given.isidentifier() and len(given) <= 8):
            raise MatrixError(f"{where}: name {given!r}: expected a letter, then letters, digits or _, 8 at most")
        if name in seen:
            raise MatrixError(f"{where}: two matrices have the name {name}")
        seen.add(name)
        matrix = _compressed(f"{where}: matrix {name}", values)
        if text and max(matrix.shape) > LARGEST_TEXT:
            raise MatrixError(f"{where}: matrix {name}: {matrix.shape} is too large for text; write it binary")
        parts += _text(name, matrix) if text else _binary(name, matrix)
    return parts


def _compressed(here: str, values: Any) -> sp.csc_array:
    """Return the matrix as float64 in compressed columns without zero entries."""
    matrix = sp.csc_array(values)
    if matrix.dtype.kind not in "fiub":
        raise MatrixError(f"{here}: expected real numbers, got {matrix.dtype}")
    if min(matrix.shape) < 1 or max(matrix.shape) > LARGEST:
        raise MatrixError(f"{here}: expected 1 to {LARGEST} rows and columns, got {matrix.shape}")
    matrix = matrix.astype(np.float64)  # a copy: the next lines change it
    matrix.sum_duplicates()
    matrix.eliminate_zeros()
    if not np.isfinite(matrix.data).all():
        raise MatrixError(f"{here}: expected finite numbers, got NaN or infinite ones")
    return matrix


def _form(matrix: sp.csc_array) -> int:
    if matrix.shape[0] != matrix.shape[1]:
        return RECTANGULAR
    return SYMMETRIC if (matrix != matrix.T).nnz == 0 else SQUARE


def _binary(name: str, matrix: sp.csc_array) -> Iterator[bytes]:
    """Yield the header, the columns and the last record of a binary matrix."""
    from fe_models.files.nastran.matrices import op4_kernels

    n_rows, n_columns = matrix.shape
    head = np.array([24, n_columns, -n_rows, _form(matrix), 2], "<i4").tobytes()
    yield head + name.ljust(8).encode() + np.array([24], "<i4").tobytes()
    words = np.empty(op4_kernels.record_words(matrix.indptr, matrix.indices), np.int32)
    op4_kernels.fill_records(matrix.indptr, matrix.indices, matrix.data.view(np.int32), words)
    yield words.astype("<i4", copy=False).tobytes()
    last = np.array([20, n_columns + 1, 1, 2], "<i4").tobytes() + np.array([1.0], "<f8").tobytes()
    yield last + np.array([20], "<i4").tobytes()


def _text(name: str, matrix: sp.csc_array) -> Iterator[bytes]:
    """Yield the header, the columns and the last record of a matrix as text lines."""
    n_rows, n_columns = matrix.shape
    yield f"{n_columns:8d}{-n_rows:8d}{_form(matrix):8d}{2:8d}{name:8s}1P,{PER_LINE}E{WIDTH}.{DIGITS}\n".encode()
    for column in range(n_columns):
        span = slice(matrix.indptr[column], matrix.indptr[column + 1])
        rows, values = matrix.indices[span], matrix.data[span]
        if not len(rows):
            continue
        breaks = [0, *(np.flatnonzero(np.diff(rows) != 1) + 1).tolist(), len(rows)]
        lines = [f"{column + 1:8d}{0:8d}{2 * (len(breaks) - 1) + 2 * len(rows):8d}"]
        for first, end in pairwise(breaks):
            lines.append(f"{2 * (end - first) + 1:8d}{rows[first] + 1:8d}")
            numbers = [f"{value:{WIDTH}.{DIGITS}E}" for value in values[first:end].tolist()]
            lines += ["".join(numbers[k : k + PER_LINE]) for k in range(0, len(numbers), PER_LINE)]
        yield ("\n".join(lines) + "\n").encode()
    yield f"{n_columns + 1:8d}{1:8d}{1:8d}\n{1.0:{WIDTH}.{DIGITS}E}\n".encode()
