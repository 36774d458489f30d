"""OUTPUT4 files of Nastran (.op4): matrices by name, binary in every variant, or text."""

from pathlib import Path

from fe_models.errors import MatrixError
from fe_models.files.nastran_matrices.op4_binary import HEADER_BYTES, read_binary
from fe_models.files.nastran_matrices.op4_text import read_text
from fe_models.files.nastran_matrices.raw_matrix import NastranMatrix

__all__ = ["is_op4", "read_op4"]

FEWEST_BYTES = 32  #: of an OP4 file: the record of one header


def is_op4(content: bytes) -> bool:
    """Whether a file that begins so is an OP4 file: a record of 24 or 48 bytes, or a line of integers."""
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

    Binary with integers of 32 and 64 bits in either byte order, dense columns, strings and bigmat strings, in single
    and double precision, real and complex; text in the formats that its headers name.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    tuple
        In the order of the file; names may occur twice (`matrix_named`).

    Raises
    ------
    MatrixError
        If the file is missing, truncated, damaged or no OP4 file, or if sizes in it do not fit it or each other.
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
