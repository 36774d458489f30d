"""Compiled check of every byte in a text of numbers; imported only when used, because importing numba is slow."""

import numpy as np

from fe_models.foundation.arrays import IntArray
from fe_models.foundation.kernels.jit import jit

__all__ = ["FORBIDDEN", "LINE", "judged_bytes"]


BLANK, DIGIT, SIGN, DOT, EXPONENT, LINE, OTHER = range(7)  #: kinds of bytes
FOLLOWS = {
    BLANK: (BLANK, DIGIT, SIGN, DOT, LINE),
    LINE: (BLANK, DIGIT, SIGN, DOT, LINE),
    DIGIT: (DIGIT, DOT, EXPONENT, BLANK, LINE),
    SIGN: (DIGIT, DOT),
    DOT: (DIGIT, EXPONENT, BLANK, LINE),
    EXPONENT: (SIGN, DIGIT),
}  #: kinds of bytes that may follow each kind
#: meaning of a pair of bytes: not allowed in numbers; allowed; start of a word; end of a line
FORBIDDEN, FINE, WORD, FULL_LINE = range(4)


def kinds_of_bytes() -> np.ndarray:
    """Return the kind of each possible byte, (256,) uint8."""
    kinds = np.full(256, OTHER, np.uint8)
    for letters, kind in ((b" \t\r", BLANK), (b"0123456789", DIGIT), (b"+-", SIGN), (b".", DOT), (b"eE", EXPONENT)):
        kinds[np.frombuffer(letters, np.uint8)] = kind
    kinds[ord("\n")] = LINE
    return kinds


def judgement_of_pairs() -> np.ndarray:
    """Return the meaning of each pair of successive kinds, (8, 8) uint8."""
    judgement = np.full((8, 8), FORBIDDEN, np.uint8)
    for first, seconds in FOLLOWS.items():
        judgement[first, list(seconds)] = FINE
        if first in (BLANK, LINE):
            judgement[first, [DIGIT, SIGN, DOT]] = WORD
        else:
            judgement[first, [second for second in seconds if second == LINE]] = FULL_LINE
    judgement[BLANK, LINE] = FULL_LINE
    return judgement


KINDS, JUDGEMENT = kinds_of_bytes(), judgement_of_pairs()


def judged_bytes(data: np.ndarray) -> tuple[int, int, int]:
    """Return the number of words and of non-empty lines, and the position of the first invalid byte.

    Parameters
    ----------
    data
        Bytes, uint8, (n,).

    Returns
    -------
    n_words, n_lines
        Number of words and of non-empty lines up to this position.
    bad
        Position of the first invalid byte; -1 if there is none.
    """
    count, bad = judged_pairs(data, KINDS, JUDGEMENT)
    return int(count[WORD]), int(count[FULL_LINE]), int(bad)


@jit
def judged_pairs(data: np.ndarray, kinds: np.ndarray, judgement: np.ndarray) -> tuple[IntArray, int]:
    """Count the meanings of all pairs of successive bytes, the first after a line end; stop at an invalid pair."""
    count = np.zeros(4, np.int64)
    words = lines = 0
    before = np.uint8(LINE)
    for at in range(len(data)):
        kind = kinds[data[at]]
        said = judgement[before, kind]
        if said == FORBIDDEN:
            return count, at
        words += said == WORD
        lines += said == FULL_LINE
        before = kind
    count[WORD], count[FULL_LINE] = words, lines
    return count, -1
