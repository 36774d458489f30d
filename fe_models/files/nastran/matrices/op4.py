"""OUTPUT4 files of Nastran (.op4): matrices by name, binary in every variant, or text."""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from fe_models.errors import MatrixError
from fe_models.files.nastran.matrices.op4_binary import HEADER_BYTES, LARGEST, NOT_BIGMAT, read_binary, require_sizes
from fe_models.files.nastran.matrices.raw_matrix import NastranMatrix

__all__ = ["is_op4", "read_op4", "read_text"]


# OP4 files as text: numbers in columns of fixed width, in the format given in the header of a matrix ------------------


DEFAULT = (5, 16)  #: numbers in a line and their width, in the format 5E16.9 of a header without format
FORMAT = re.compile(rb"(?:1P,?)?\s*(\d+)[ED](\d+)\.\d+(?:E\d+)?$", re.IGNORECASE)
NO_LETTER = re.compile(r"(?<=\d)([+-]\d+)$")  #: exponent with three digits, before which the letter E is omitted


def read_text(where: str, path: Path) -> Iterator[NastranMatrix]:
    """Yield the matrices of a text OP4 file.

    Raises
    ------
    MatrixError
        If the file is truncated or damaged, or names another format of numbers.
    """
    content = path.read_bytes()
    lines = _Lines(where, content.splitlines())
    number = 0
    while lines.more():
        number += 1
        yield _matrix(lines, number, len(content))


class _Lines:
    """Lines of a file in sequence, with the number of the line read last for messages."""

    def __init__(self, where: str, lines: list[bytes]) -> None:
        self.file = where
        self.lines = lines
        self.at = 0
        self.name = ""

    @property
    def here(self) -> str:
        """Beginning of a message about the last line."""
        return f"{self.file}: {self.name}line {self.at}"

    def more(self) -> bool:
        """Whether a non-empty line follows."""
        while self.at < len(self.lines) and not self.lines[self.at].strip():
            self.at += 1
        return self.at < len(self.lines)

    def next(self) -> bytes:
        """Return the next line."""
        return self.take(1)[0]

    def take(self, n: int) -> list[bytes]:
        """Return the next n lines."""
        if self.at + n > len(self.lines):
            raise MatrixError(
                f"{self.file}: {self.name}expected {self.at + n - len(self.lines)} lines more behind line "
                f"{len(self.lines)}: the file is truncated"
            )
        self.at += n
        return self.lines[self.at - n : self.at]

    def integers(self, count: int, width: int = 8) -> list[int]:
        """Return the integers in the next line, in columns of this width."""
        line = self.next()
        words = [line[width * k : width * (k + 1)] for k in range(count)]
        try:
            return [int(word) for word in words]
        except ValueError:
            raise MatrixError(
                f"{self.here}: expected {count} integers in columns of {width} characters, got {line[:60]!r}"
            ) from None


def _matrix(lines: _Lines, number: int, size: int) -> NastranMatrix:
    """Read one matrix, its header first."""
    line = lines.next().rstrip()
    lines.name = f"matrix {number}: "
    width = 8
    if line.endswith(b"|I16"):
        line, width = line[:-4].rstrip(), 16
    words = [line[:width], line[width : 2 * width], line[2 * width : 2 * width + 8], line[2 * width + 8 :][:8]]
    try:
        n_columns, n_rows, form, kind = (int(word) for word in words)
    except ValueError:
        raise MatrixError(
            f"{lines.here}: expected columns, rows, form and type of a matrix, got {line[:60]!r}"
        ) from None
    name = line[2 * width + 16 :][:8].decode("latin-1").replace("\0", " ").strip().upper() or f"M{number}"
    lines.name = f"matrix {name}: "
    require_sizes(f"{lines.file}: matrix {name}", n_columns, n_rows, kind, size)
    per_line, number_width = _format(lines, line[2 * width + 24 :].strip())
    is_bigmat = n_rows < 0 or n_rows >= NOT_BIGMAT
    n_rows = abs(n_rows)
    reals = 1 if kind < 3 else 2  # of an entry
    words_of_real = 1 if kind in (1, 3) else 2
    last, above = 0, 0
    columns: list[int] = []
    firsts: list[int] = []
    counts: list[int] = []
    values: list[np.ndarray] = []

    def string(first: int, n_reals: int) -> None:
        """Read one string of real numbers that begins in this row, counted from 1."""
        n, rest = divmod(n_reals, reals)
        if n < 1 or rest:
            raise MatrixError(f"{lines.here}: expected at least one value in a string, got {n_reals} numbers")
        if first < 1 or first - 1 + n > n_rows:
            raise MatrixError(f"{lines.here}: rows {first} to {first - 1 + n} lie outside the {n_rows} of the matrix")
        if first <= above:
            raise MatrixError(f"{lines.here}: a string begins in row {first}, the one before it ends in row {above}")
        columns.append(last)
        firsts.append(first)
        counts.append(n)
        values.append(_reals(lines, n_reals, per_line, number_width))

    while True:
        column, row, n_words = lines.integers(3)
        if not last < column <= n_columns + 1:
            raise MatrixError(
                f"{lines.here}: expected a column from {last + 1} to {n_columns}, or {n_columns + 1} as the end, got "
                f"{column}"
            )
        if column == n_columns + 1:
            if lines.more():
                lines.next()  # a number that means nothing
            break
        last, above = column, 0
        if row > 0:
            string(row, n_words)
            continue
        while n_words > 0:
            if is_bigmat:
                head, first = lines.integers(2)
                length, n_words = head - 1, n_words - head - 1
            else:
                (head,) = lines.integers(1, 16)
                length, first = (head >> 16) - 1, head & 0xFFFF
                n_words -= length + 1
            if n_words < 0 or length % words_of_real:
                raise MatrixError(f"{lines.here}: {length} words of a string do not fit its column")
            string(first, length // words_of_real)
            above = first - 1 + counts[-1]
    data = np.concatenate(values) if values else np.zeros(0)
    return NastranMatrix(
        name=name,
        matrix=_compressed(
            data if reals == 1 else data.view(np.complex128), columns, firsts, counts, n_rows, n_columns
        ),
        form=form,
        kind=kind,
        where=f"{lines.file}: matrix {name}",
    )


def _format(lines: _Lines, text: bytes) -> tuple[int, int]:
    """Return the number of values in a line and their width."""
    if not text:
        return DEFAULT
    found = FORMAT.match(text.strip(b"()"))
    if not found or not 0 < int(found[1]) < 100 or not 8 <= int(found[2]) < 100:
        raise MatrixError(f"{lines.here}: expected a format of numbers such as 1P,3E23.16, got {text[:24]!r}")
    return int(found[1]), int(found[2])


def _reals(lines: _Lines, n: int, per_line: int, width: int) -> np.ndarray:
    """Return the next n numbers, (n,)."""
    taken = lines.take(-(-n // per_line))
    text = b"".join(line[: per_line * width].ljust(per_line * width) for line in taken[:-1]) + taken[-1]
    if len(text) < width * n:
        text = text.ljust(width * n)
    fields = np.frombuffer(text[: width * n], f"S{width}")
    try:
        return fields.astype(np.float64)
    except ValueError:
        pass
    numbers = []
    for field in fields.tolist():
        word = field.decode("latin-1").strip().upper().replace("D", "E")
        try:
            numbers.append(float(word if "E" in word else NO_LETTER.sub(r"E\1", word)))
        except ValueError:
            raise MatrixError(
                f"{lines.here}: expected numbers of {width} characters, {per_line} in a line, got {word!r}"
            ) from None
    return np.array(numbers)


def _compressed(
    values: np.ndarray, columns: list[int], firsts: list[int], counts: list[int], n_rows: int, n_columns: int
) -> sp.csc_array:
    """Return the matrix of strings, sorted by columns and rows."""
    index = np.int32 if max(len(values), n_rows) < LARGEST else np.int64
    n = np.array(counts, dtype=np.int64)
    ends = np.cumsum(n)
    first = np.array(firsts, dtype=np.int64) - 1
    rows = np.arange(len(values)) + np.repeat(first - (ends - n), n)
    in_column = (
        np.bincount(np.array(columns, dtype=np.int64) - 1, weights=n, minlength=n_columns)
        if len(n)
        else np.zeros(n_columns)
    )
    indptr = np.concatenate([[0], np.cumsum(in_column)])
    matrix = sp.csc_array((values, rows.astype(index), indptr.astype(index)), shape=(n_rows, n_columns))
    matrix.has_canonical_format = True
    return matrix


# op4 ------------------------------------------------------------------------------------------------------------------


FEWEST_BYTES = 32  #: size of the smallest OP4 file: the record of one header [bytes]


def is_op4(content: bytes) -> bool:
    """Return whether the first bytes are those of an OP4 file: a record of 24 or 48 bytes, or a line of integers."""
    if len(content) < FEWEST_BYTES:
        return False
    if HEADER_BYTES & {int.from_bytes(content[:4], order) for order in ("little", "big")}:
        return True
    line = content.splitlines()[0]
    width = 16 if line.rstrip().endswith(b"|I16") else 8
    words = [line[:width], line[width : 2 * width], line[2 * width : 2 * width + 8], line[2 * width + 8 :][:8]]
    try:
        numbers = [int(word) for word in words]
    except ValueError:
        return False
    return numbers[3] in (1, 2, 3, 4) and line[2 * width + 16 :][:8].strip() != b""


def read_op4(path: str | Path) -> tuple[NastranMatrix, ...]:
    """Read all matrices of an OP4 file.

    Supported are binary files with integers of 32 and 64 bits in either byte order, with dense columns, strings and
    bigmat strings, in single and double precision, real and complex; and text files in the formats given in their
    headers.

    Parameters
    ----------
    path
        Path of the file.

    Returns
    -------
    tuple
        Matrices in the order of the file; names may occur twice (`matrix_named`).

    Raises
    ------
    MatrixError
        If the file is missing, truncated, damaged or no OP4 file, or if sizes in it do not fit the file or each other.
    """
    path = Path(path)
    where = f"OP4 file {path}"
    try:
        size = path.stat().st_size
        if not path.is_file():
            raise MatrixError(f"{where}: expected a file, got a directory or a device")
        with path.open("rb") as file:
            start = file.read(4096)
    except OSError as error:
        raise MatrixError(f"{where}: cannot be read: {error.strerror or error}") from error
    if size < FEWEST_BYTES:
        raise MatrixError(f"{where}: expected matrices, got {size} bytes; the file is empty or truncated")
    if not is_op4(start):
        raise MatrixError(
            f"{where}: expected a record of 24 or 48 bytes, or a line with columns, rows, form, type and name; "
            f"got {start[:24]!r}: this is no OP4 file"
        )
    is_binary = HEADER_BYTES & {int.from_bytes(start[:4], order) for order in ("little", "big")}
    found = read_binary(where, path) if is_binary else read_text(where, path)
    return tuple(found)
