"""Binary files of ANSYS: records of 4-byte words, little endian, located by pointers in a header."""

from pathlib import Path

import numpy as np

from fe_models.errors import MatrixError
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["AnsysFile", "is_ansys_binary"]

INTEGERS, REALS = 0x80000000, 0x00000000  #: flags of records of integers and reals
STANDARD_WORDS, HEADER_AT = 100, 103  #: length of the standard header, and word at which the file header begins


def is_ansys_binary(content: bytes) -> bool:
    """Return whether the first bytes are those of a binary ANSYS file: a record of 100 integers."""
    return content[:8] == np.array([STANDARD_WORDS, INTEGERS], "<u4").tobytes()


class AnsysFile:
    """File of records; each consists of its length in words, a flag, the data, and the length again.

    Raises
    ------
    MatrixError
        If the file cannot be read, has the other byte order, or is no binary file of ANSYS.
    """

    def __init__(self, where: str, path: Path, kind: tuple[int, ...]) -> None:
        self.where = where
        try:
            self.n_words = path.stat().st_size // 4
            with path.open("rb") as file:
                start = file.read(8)
        except OSError as error:
            raise MatrixError(f"{where}: cannot be read: {error.strerror or error}") from error
        if start == np.array([STANDARD_WORDS, INTEGERS], ">u4").tobytes():
            raise MatrixError(f"{where}: is in big-endian byte order; expected a file of a PC (little endian)")
        if not is_ansys_binary(start):
            raise MatrixError(f"{where}: expected a record of {STANDARD_WORDS} integers first; this is no ANSYS file")
        self.words: np.ndarray = np.memmap(path, dtype="<i4", mode="r", shape=(self.n_words,))
        self.header = self.integers(HEADER_AT, "the header")
        if self.header[0] not in kind:
            raise MatrixError(
                f"{where}: expected a file of kind {' or '.join(str(k) for k in kind)}, got {self.header[0]}; this is "
                "another file of ANSYS"
            )

    def record(self, at: int, what: str, flag: int) -> tuple[np.ndarray, int]:
        """Return the words of the record that begins at this word, and the start of the next record."""
        if not 0 < at <= self.n_words - 3:
            raise MatrixError(
                f"{self.where}: {what}: expected a record at word {at}, the file has {self.n_words}: it is truncated"
            )
        length, found = int(self.words[at]), int(self.words[at + 1]) & 0xFFFFFFFF
        end = at + 2 + length
        if length < 0 or end >= self.n_words:
            raise MatrixError(
                f"{self.where}: {what}: a record of {length} words at word {at} of {self.n_words}: the file is "
                "truncated or damaged"
            )
        if int(self.words[end]) != length:
            raise MatrixError(
                f"{self.where}: {what}: the record at word {at} has the length {length} at its "
                f"beginning and {int(self.words[end])} at its end: the file is damaged"
            )
        if found != flag:
            raise MatrixError(
                f"{self.where}: {what}: expected a record of {'integers' if flag == INTEGERS else 'doubles'}, got one "
                f"with the flag 0x{found:08x} (single precision, or compressed: write the file with /FCOMP off)"
            )
        return self.words[at + 2 : end], end + 1

    def integers(self, at: int, what: str, n: int | None = None) -> IntArray:
        """Return a record of integers, after checking their number if n is known."""
        data, _ = self.record(at, what, INTEGERS)
        self._require(what, len(data), n)
        return data.astype(np.int64)

    def reals(self, at: int, what: str, n: int | None = None) -> Array:
        """Return a record of doubles, after checking their number if n is known."""
        data, _ = self.record(at, what, REALS)
        self._require(what, len(data) / 2, n)
        return self.doubles(data)

    @staticmethod
    def doubles(data: np.ndarray) -> Array:
        """Return the words of a record as float64 numbers."""
        return np.frombuffer(data.tobytes(), "<f8")

    def pointer(self, low: int, high: int) -> int:
        """Return a pointer from its two words in the header."""
        return int(self.header[low]) & 0xFFFFFFFF | int(self.header[high]) << 32

    def _require(self, what: str, got: float, n: int | None) -> None:
        if n is not None and got != n:
            raise MatrixError(f"{self.where}: {what}: expected {n} numbers, got {got:g}: the file is damaged")
