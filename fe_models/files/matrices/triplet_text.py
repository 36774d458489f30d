"""Text of matrix entries `row column value`, read by a compiled parser after a check of every byte.

SciPy's Matrix Market parser is fast, but accepts invalid text: it reads `3.0D+03` as 3.0, `1.5e` as 1.5, and only the
first three columns of a longer line. All bytes are therefore checked first. Only numbers in the syntax of C are
allowed, three on each line, and the last line must end with a line break.
"""

import io

import numpy as np
import scipy.io
import scipy.sparse as sp

from fe_models.errors import MatrixError
from fe_models.files.matrices.triangles import full_matrix, require_size
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["HeadAndData", "judged", "parsed_triplets", "triplet_matrix"]

UNBOUNDED = 2**40  #: number of rows given to the parser, which only compares it


def parsed_triplets(where: str, data: bytes, *, first_line: int = 1) -> tuple[IntArray, IntArray, Array]:
    """Return rows and columns, both from 0, and values in the lines of a text.

    Parameters
    ----------
    where
        Name of the file, for messages.
    data
        Lines of the text.
    first_line
        Line number of the first line in the file.

    Raises
    ------
    MatrixError
        If a line does not consist of two integers from 1 and a finite real number, or the last line does not end.
    """
    if not data.endswith(b"\n"):
        raise MatrixError(
            f"{where}: the last line does not end: the file was cut off; write it again (or end the line, if it is "
            "whole)"
        )
    n_lines, n_words = judged(where, data, first_line)
    if n_words != 3 * n_lines:
        raise MatrixError(
            f"{where}: expected three numbers on each line (row, column, value), got {n_words} on {n_lines} lines; "
            "are the values complex, or is there another list in the file?"
        )
    head = b"%%%%MatrixMarket matrix coordinate real general\n%d %d %d\n" % (UNBOUNDED, UNBOUNDED, n_lines)
    try:
        entries = scipy.io.mmread(HeadAndData(head, data))
    except (ValueError, OverflowError) as error:
        raise MatrixError(f"{where}: {located(str(error), first_line - 3)}") from error
    if not np.isfinite(entries.data).all():
        k = int(np.argmin(np.isfinite(entries.data)))
        raise MatrixError(f"{where}: entry {k + 1}: expected a finite number, got one beyond the range of doubles")
    return np.asarray(entries.row, np.int64), np.asarray(entries.col, np.int64), entries.data


def triplet_matrix(where: str, role: str, data: bytes) -> tuple[sp.csc_array, str, bool]:
    """Return the matrix in a text of entries, the stored triangle, and whether any entry is nonzero.

    The largest index is the number of rows.

    Raises
    ------
    MatrixError
        If a line is something else, an entry is listed twice, or the matrix is too large for its file.
    """
    rows, columns, values = parsed_triplets(where, data)
    n = max(int(rows.max(initial=-1)), int(columns.max(initial=-1))) + 1
    require_size(where, n, len(data))
    del data  # the text is larger than the matrix
    matrix, triangle = full_matrix(f"{where}: {role}", rows, columns, values, n)
    return matrix, triangle, bool(np.any(values))


def judged(where: str, data: bytes, first_line: int) -> tuple[int, int]:
    """Return the number of non-empty lines and of words, after a check of every pair of successive bytes."""
    from fe_models.files.matrices.text_kernels import judged_bytes

    n_words, n_lines, bad = judged_bytes(np.frombuffer(data, np.uint8))
    if bad >= 0:
        line = first_line + data.count(b"\n", 0, bad)
        text = data[data.rfind(b"\n", 0, bad) + 1 : bad + 60].split(b"\n")[0].decode("ascii", "replace")
        raise MatrixError(f"{where}, line {line}: expected two whole numbers and a real (1 2 -3.0e+04), got {text!r}")
    return n_lines, n_words


class HeadAndData(io.RawIOBase):
    """Stream of a head followed by data, without a copy of both."""

    def __init__(self, head: bytes, data: bytes) -> None:
        self.parts = [memoryview(head), memoryview(data)]

    def readable(self) -> bool:
        """Return True: the stream can be read."""
        return True

    def read(self, size: int = -1) -> bytes:
        """Return the next bytes of one part."""
        while self.parts:
            part = self.parts[0]
            taken = part if size < 0 else part[:size]
            self.parts[0] = part[len(taken) :]
            if len(taken):
                return bytes(taken)
            self.parts.pop(0)
        return b""


def located(text: str, shift: int) -> str:
    """Return a message of the parser with the line number in the file."""
    head, _, rest = text.partition(":")
    number = head.removeprefix("Line ")
    return f"line {int(number) + shift}:{rest}" if head.startswith("Line ") and number.isdigit() else text
