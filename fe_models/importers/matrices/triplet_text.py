"""Text of matrix entries `row column value`: read by a compiled parser, after a look at every byte.

SciPy's Matrix Market parser is quick and reads what it can: of `3.0D+03` it takes 3.0, of a line with more columns the
first three, of `1.5e` 1.5. So the bytes are judged before: only numbers in the grammar of C, three to a line, and a
last line that ends.
"""

import io

import numpy as np
import scipy.io

from fe_models.errors import MatrixError
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["parsed_triplets"]

PIECE = 1 << 22  #: bytes that are judged at once: they stay in the cache
UNBOUNDED = 2**40  #: rows told to the parser, which only compares
BLANK, DIGIT, SIGN, DOT, EXPONENT, LINE, OTHER = range(7)  #: kinds of bytes


def kinds_of_bytes() -> np.ndarray:
    """Return the kind of every byte, (256,) uint8."""
    kinds = np.full(256, OTHER, np.uint8)
    for letters, kind in ((b" \t\r", BLANK), (b"0123456789", DIGIT), (b"+-", SIGN), (b".", DOT), (b"eE", EXPONENT)):
        kinds[np.frombuffer(letters, np.uint8)] = kind
    kinds[ord("\n")] = LINE
    return kinds


def allowed_pairs() -> np.ndarray:
    """Return which kind may follow which, (64,) bool, at 8 first + second."""
    follows = {
        BLANK: (BLANK, DIGIT, SIGN, DOT, LINE),
        LINE: (BLANK, DIGIT, SIGN, DOT, LINE),
        DIGIT: (DIGIT, DOT, EXPONENT, BLANK, LINE),
        SIGN: (DIGIT, DOT),
        DOT: (DIGIT, EXPONENT, BLANK, LINE),
        EXPONENT: (SIGN, DIGIT),
    }
    allowed = np.zeros(64, dtype=bool)
    for first, seconds in follows.items():
        allowed[[8 * first + second for second in seconds]] = True
    return allowed


KINDS, ALLOWED = kinds_of_bytes(), allowed_pairs()


def parsed_triplets(where: str, data: bytes, *, first_line: int = 1) -> tuple[IntArray, IntArray, Array]:
    """Return rows, columns, both from 0, and values of the lines of a text.

    Parameters
    ----------
    where
        The file, for messages.
    data
        The lines.
    first_line
        Number of the first of them in the file.

    Raises
    ------
    MatrixError
        If a line is not two whole numbers from 1 and a finite real, or the last one does not end.
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
        entries = scipy.io.mmread(io.BytesIO(head + data))
    except (ValueError, OverflowError) as error:
        raise MatrixError(f"{where}: {located(str(error), first_line - 3)}") from error
    if not np.isfinite(entries.data).all():
        k = int(np.argmin(np.isfinite(entries.data)))
        raise MatrixError(f"{where}: entry {k + 1}: expected a finite number, got one beyond the range of doubles")
    return entries.row.astype(np.int64), entries.col.astype(np.int64), entries.data


def judged(where: str, data: bytes, first_line: int) -> tuple[int, int]:
    """Return the numbers of lines that are not blank and of words, after a look at every pair of neighbouring bytes."""
    n_lines = n_words = 0
    before = np.array([LINE], np.uint8)
    for start in range(0, len(data), PIECE):
        kinds = np.concatenate([before, KINDS[np.frombuffer(data, np.uint8, min(PIECE, len(data) - start), start)]])
        pairs = (kinds[:-1] << 3) | kinds[1:]
        count = np.bincount(pairs, minlength=64)
        if count[~ALLOWED].any():
            at = start + int(np.argmin(ALLOWED[pairs]))
            line = first_line + data.count(b"\n", 0, at)
            text = data[data.rfind(b"\n", 0, at) + 1 : at + 60].split(b"\n")[0].decode("ascii", "replace")
            raise MatrixError(
                f"{where}, line {line}: expected two whole numbers and a real (1 2 -3.0e+04), got {text!r}"
            )
        starts = sum(int(count[8 * first + second]) for first in (BLANK, LINE) for second in (DIGIT, SIGN, DOT))
        ends = int(count[8 * DIGIT + LINE] + count[8 * DOT + LINE])
        blank_ends = int(count[8 * BLANK + LINE])
        n_words += starts
        n_lines += ends + blank_ends  # a line of blanks alone counts too: then the words are too few, and it is said
        before = kinds[-1:]
    return n_lines, n_words


def located(text: str, shift: int) -> str:
    """Return a message of the parser with the number of the line in the file."""
    head, _, rest = text.partition(":")
    number = head.removeprefix("Line ")
    return f"line {int(number) + shift}:{rest}" if head.startswith("Line ") and number.isdigit() else text
