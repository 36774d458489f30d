"""Binary OP4 files: Fortran records of 4-byte words, read in one pass over the mapped file."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from fe_models.errors import MatrixError
from fe_models.files.nastran.matrices.raw_matrix import NastranMatrix

__all__ = ["HEADER_BYTES", "LARGEST", "read_binary", "require_sizes"]

HEADER_BYTES = {24, 48}  #: size of the header of a matrix with 32-bit and with 64-bit integers [bytes]
LARGEST = 2**31 - 2  #: largest number of rows or columns
EMPTY_COLUMNS = 20_000_000  #: largest number of columns without any byte in the file
NOT_BIGMAT = 65536  #: number of rows from which strings need a head of more than one word


def read_binary(where: str, path: Path) -> Iterator[NastranMatrix]:
    """Yield the matrices of a binary OP4 file.

    Memory is only used for columns that are in the file: about their size in the file, or 1.5 times that for doubles.
    The sizes declared in a header use no memory.

    Raises
    ------
    MatrixError
        If the file is truncated or damaged.
    """
    from fe_models.files.nastran.matrices import op4_kernels

    size = path.stat().st_size
    words: np.ndarray = np.memmap(path, dtype="<i4", mode="r", shape=(size // 4,))
    swapped = int(words[0]) not in HEADER_BYTES
    words = words.view(">i4").astype(np.int32) if swapped else words.view(np.ndarray)
    step = 1 if words[0] == 24 else 2
    at = 0
    names: list[str] = []
    while at < len(words):
        here = f"{where}: matrix {len(names) + 1}"
        n_head = 6 * step
        if at + n_head + 2 > len(words):
            raise MatrixError(f"{here}: its header ends beyond the file, at byte {size}: the file is truncated")
        if words[at] != 4 * n_head or words[at + n_head + 1] != 4 * n_head:
            raise MatrixError(
                f"{here}: expected a header of {4 * n_head} bytes at byte {4 * at}, got a record of {words[at]}: the "
                "file is damaged, or something else stands behind its matrices"
            )
        numbers = [int(op4_kernels.integer(words, at + 1 + step * k, step, swapped)) for k in range(4)]
        name = _name(words[at + 1 + 4 * step : at + 1 + n_head], step, swapped)
        n_columns, n_rows, form, kind = numbers
        here = f"{where}: matrix {name or len(names) + 1}"
        require_sizes(here, n_columns, n_rows, kind, size)
        reals = 1 if kind < 3 else 2
        is_single = kind in (1, 3) and step == 1
        at += n_head + 2
        capacity = (len(words) - at) // (reals if is_single else 2 * reals)
        index = np.int32 if capacity < LARGEST else np.int64
        indptr = np.zeros(n_columns + 1, index)
        indices = np.empty(capacity, index)  # more than needed; the unused rest is never touched
        values = np.empty(capacity * reals, np.int32 if is_single else np.int64)
        none = np.empty(0, np.int64 if is_single else np.int32)
        status, at, count, column = op4_kernels.read_columns(
            words,
            at,
            step,
            swapped,
            abs(n_rows),
            n_columns,
            n_rows < 0 or n_rows >= NOT_BIGMAT,
            reals,
            indptr,
            indices,
            values if is_single else none,
            none if is_single else values,
        )
        if status != op4_kernels.COMPLETE:
            raise MatrixError(
                f"{here}: column {column} of {n_columns}, at byte {4 * at} of {size}: {op4_kernels.FAULTS[status]}; "
                "write the file again"
            )
        indices.resize(count, refcheck=False)
        values.resize(count * reals, refcheck=False)
        yield NastranMatrix(
            name=name or f"M{len(names) + 1}",
            matrix=_compressed(_numbers(values, kind), indices, indptr, abs(n_rows)),
            form=form,
            kind=kind,
            where=here,
        )
        names.append(name)
    if size % 4:
        raise MatrixError(f"{where}: {size % 4} bytes stand behind the last record: the file is damaged")


def require_sizes(here: str, n_columns: int, n_rows: int, kind: int, size: int) -> None:
    """Raise an error for a header that is invalid, or too large for a file of this size [bytes]."""
    if kind not in (1, 2, 3, 4):
        raise MatrixError(f"{here}: expected a type of 1 to 4 (real, complex, single, double), got {kind}")
    if not (0 < n_columns <= LARGEST and 0 < abs(n_rows) <= LARGEST):
        raise MatrixError(
            f"{here}: expected 1 to {LARGEST} rows and columns, got {abs(n_rows)} and {n_columns}: the file is damaged"
        )
    if n_columns > size // 4 + EMPTY_COLUMNS:
        raise MatrixError(f"{here}: {n_columns} columns do not fit a file of {size} bytes: it is truncated or damaged")


def _name(words: np.ndarray, step: int, swapped: bool) -> str:
    """Return the name of a header; with 64-bit integers it is written as twice four letters and four blanks."""
    text = (words.byteswap() if swapped else words).tobytes()
    if step == 2 and not text[4:8].strip(b" \0"):
        text = text[:4] + text[8:12]
    return text.decode("latin-1").replace("\0", " ").strip().upper()


def _numbers(values: np.ndarray, kind: int) -> np.ndarray:
    """Return the words as float64 or complex128 numbers."""
    is_single = values.dtype == np.int32
    real = values.view(np.float32).astype(np.float64) if is_single else values.view(np.float64)
    return real if kind < 3 else real.view(np.complex128)


def _compressed(values: np.ndarray, indices: np.ndarray, indptr: np.ndarray, n_rows: int) -> sp.csc_array:
    matrix = sp.csc_array((values, indices, indptr), shape=(n_rows, len(indptr) - 1))
    matrix.has_canonical_format = True  # the columns were read so
    return matrix
