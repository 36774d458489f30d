"""Compiled loops over the records of binary OP4 files; imported only when used, because numba takes half a second.

A file is an array of 4-byte words in the byte order of this machine. Integers have `step` words (1 or 2), and 8-byte
reals have two. For files with the other byte order (`is_swapped`), the bytes of each word have been reversed, so that
the first of two words is the high one.
"""

import numpy as np

from fe_models.foundation.kernels.jit import jit

__all__ = ["COMPLETE", "FAULTS", "fill_records", "read_columns", "record_words"]

COMPLETE, CUT, BROKEN, COLUMN, ROWS, LENGTH, ORDER = range(7)

FAULTS = {
    CUT: "the file ends within a record: it is truncated",
    BROKEN: "the length at the end of a record is not the one at its beginning: the file is damaged",
    COLUMN: "the number of a column is impossible or not larger than the one before",
    ROWS: "values lie outside the rows of the matrix",
    LENGTH: "the numbers of words in a column do not add up",
    ORDER: "strings of a column overlap or are not in the order of the rows",
}  #: description of the error for each status of `read_columns`

LOW = np.int64(0xFFFFFFFF)


@jit
def integer(words, at, step, is_swapped):
    """Return the integer that begins at this word."""
    if step == 1:
        return np.int64(words[at])
    low, high = (words[at + 1], words[at]) if is_swapped else (words[at], words[at + 1])
    return (np.int64(high) << np.int64(32)) | (np.int64(low) & LOW)


@jit
def read_columns(words, at, step, is_swapped, n_rows, n_columns, is_bigmat, reals, indptr, indices, singles, doubles):
    """Read the columns of one matrix, from the first record after the header.

    (1) a record consists of its length in bytes, column, row (0: strings), number of words, these words, and its length
    (2) a dense column is one string that begins at this row
    (3) each string begins with (length + 1, row) for bigmat, otherwise with row + 65536 (length + 1); length in words
    (4) column n_columns + 1 ends the matrix

    Parameters
    ----------
    reals
        Number of reals in one entry of the matrix: 2 if it is complex, otherwise 1.
    indptr, indices
        Output: compressed columns, (n_columns + 1,), (capacity,).
    singles, doubles
        Output, in the byte order of this machine: reals of 4 bytes in `singles`, (capacity reals,), or of 8 bytes in
        `doubles`, (capacity reals,) of 64 bits; the other array is empty.

    Returns
    -------
    status
        `COMPLETE`, or a fault (see `FAULTS`).
    at
        Word after the matrix, or first word of the faulty record.
    count
        Number of entries.
    column
        Faulty column, from 1.
    """
    last, count = 0, 0
    real_size = 1 if singles.size else 2
    is_plain = real_size == 2 and reals == 1 and not is_swapped
    n_words = words.size
    while True:
        if at + 2 + 3 * step > n_words:  # (1)
            return CUT, at, count, last + 1
        length = words[at]
        if length < 12 * step or length % 4:
            return BROKEN, at, count, last + 1
        end = at + 1 + length // 4
        if end >= n_words:
            return CUT, at, count, last + 1
        if words[end] != length:
            return BROKEN, at, count, last + 1
        column = integer(words, at + 1, step, is_swapped)
        row = integer(words, at + 1 + step, step, is_swapped)
        if column <= last or column > n_columns + 1:
            return COLUMN, at, count, last + 1
        if column == n_columns + 1:  # (4)
            for k in range(last, n_columns):
                indptr[k + 1] = count
            return COMPLETE, end + 1, count, column
        for k in range(last, column):
            indptr[k] = count
        last = column
        here = at + 1 + 3 * step
        n_data = integer(words, at + 1 + 2 * step, step, is_swapped) * step
        if n_data < 0 or here + n_data != end:
            return LENGTH, at, count, column
        above = 0  # last row of the string before
        while here < end:
            if row > 0:  # (2)
                first, size = row, n_data
            elif is_bigmat:  # (3)
                if here + 2 * step > end:
                    return LENGTH, at, count, column
                size = (integer(words, here, step, is_swapped) - 1) * step
                first = integer(words, here + step, step, is_swapped)
                here += 2 * step
            else:
                head = integer(words, here, step, is_swapped)
                size = ((head >> 16) - 1) * step
                first = head & 0xFFFF
                here += step
            if size < 0 or size > end - here or size % (reals * real_size):
                return LENGTH, at, count, column
            n = size // (reals * real_size)
            if first < 1 or first - 1 + n > n_rows:
                return ROWS, at, count, column
            if first <= above:
                return ORDER, at, count, column
            above = first - 1 + n
            to = count * reals
            if is_plain:  # one loop without branches: most strings are short
                for k in range(n):
                    indices[count + k] = first - 1 + k
                    doubles[count + k] = (np.int64(words[here + 2 * k + 1]) << 32) | (
                        np.int64(words[here + 2 * k]) & LOW
                    )
            else:
                for k in range(n):
                    indices[count + k] = first - 1 + k
                for k in range(n * reals):
                    if real_size == 1:
                        singles[to + k] = words[here + k]
                    else:
                        doubles[to + k] = integer(words, here + 2 * k, 2, is_swapped)
            count += n
            here += size
        at = end + 1
        indptr[last] = count


@jit
def record_words(indptr, indices):
    """Return the number of words for columns of doubles as bigmat strings, without the last record."""
    total = 0
    for j in range(indptr.size - 1):
        if indptr[j] == indptr[j + 1]:
            continue
        strings = 1
        for k in range(indptr[j] + 1, indptr[j + 1]):
            strings += indices[k] != indices[k - 1] + 1
        total += 5 + 2 * strings + 2 * (indptr[j + 1] - indptr[j])
    return total


@jit
def fill_records(indptr, indices, values, words):
    """Write columns as records of bigmat strings, with `values` as words of 4 bytes; see `record_words`."""
    at = 0
    for j in range(indptr.size - 1):
        begin, stop = indptr[j], indptr[j + 1]
        if begin == stop:
            continue
        record = at
        words[record + 1] = j + 1
        words[record + 2] = 0
        at += 4
        k = begin
        while k < stop:
            n = 1
            while k + n < stop and indices[k + n] == indices[k] + n:
                n += 1
            words[at] = 2 * n + 1
            words[at + 1] = indices[k] + 1
            at += 2
            for i in range(2 * n):
                words[at + i] = values[2 * k + i]
            at += 2 * n
            k += n
        words[record + 3] = at - record - 4
        words[record] = words[at] = 4 * (at - record - 1)
        at += 1
    return at
