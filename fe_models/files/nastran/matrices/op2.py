"""Matrix data blocks in OUTPUT2 files of Nastran (.op2), read by pyYeti."""

import struct
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from fe_models.errors import MatrixError
from fe_models.files.nastran.matrices.raw_matrix import NastranMatrix
from fe_models.foundation.extras import extra_module

__all__ = ["is_op2", "read_op2"]

MOST_BYTES = 2_000_000_000  #: largest size of a full matrix, as pyYeti reads it [bytes]
SMALL_BYTES = 50_000_000  #: size of a full matrix that is accepted from any file [bytes]
FULLNESS = 200  #: size of a full matrix divided by that of its file; above it, the file is damaged or nearly empty


def is_op2(content: bytes) -> bool:
    """Return whether the first bytes can be those of an OP2 file: a record of one 32- or 64-bit integer."""
    return content[:4] in (b"\4\0\0\0", b"\0\0\0\4", b"\10\0\0\0", b"\0\0\0\10")


def read_op2(path: str | Path) -> tuple[NastranMatrix, ...]:
    """Read all matrices of an OP2 file, in the order of the file; tables are omitted.

    Raises
    ------
    MatrixError
        If the file is missing, truncated, damaged or no OP2 file, if it has no matrices, or if one of them is too large
        as a full matrix.
    MissingExtraError
        If pyYeti is not installed.
    """
    path = Path(path)
    where = f"OP2 file {path}"
    if not path.is_file():
        raise MatrixError(f"{where}: there is no such file")
    with path.open("rb") as file:
        if not is_op2(file.read(4)):
            raise MatrixError(f"{where}: expected a record of 4 or 8 bytes at the beginning; this is no OP2 file")
    op2 = extra_module("pyyeti.nastran.op2", extra="nastran", purpose=where)
    try:
        with op2.OP2(str(path)) as file:
            blocks = [block for block in file.dblist if block.dbtype > 0]
            for block in blocks:
                _require_size(where, block.name, block.trailer, path.stat().st_size)
            found = []
            for block in blocks:
                file.set_position(block.start)
                name, trailer, _ = file.rdop2nt()
                found.append((str(name).strip().upper(), trailer, file.rdop2matrix(trailer)))
    except MatrixError:
        raise
    except (Exception, SystemExit) as error:  # whatever a damaged file does to the library, the user gets one message
        words = str(error).strip().splitlines()
        kind = "truncated" if isinstance(error, (struct.error, EOFError)) else "damaged, or of another kind"
        raise MatrixError(
            f"{where}: could not be read: it is {kind} ({type(error).__name__}{': ' + words[0][:120] if words else ''})"
        ) from error
    if not found:
        raise MatrixError(f"{where}: expected matrices (KAA, MAA, ...), got tables alone")
    return tuple(
        NastranMatrix(
            name=name,
            matrix=sp.csc_array(np.asarray(matrix)),
            form=int(trailer[3]),
            kind=int(trailer[4]),
            where=f"{where}: matrix {name}",
        )
        for name, trailer, matrix in found
    )


def _require_size(where: str, name: str, trailer: tuple[int, ...], size: int) -> None:
    """Raise an error for a matrix whose header declares an unreasonable size."""
    n_columns, n_rows, kind = trailer[1], trailer[2], trailer[4]
    if kind not in (1, 2, 3, 4) or n_columns < 1 or n_rows < 1:
        raise MatrixError(f"{where}: matrix {name}: {n_rows} rows, {n_columns} columns of type {kind}: it is damaged")
    limit = min(MOST_BYTES, max(SMALL_BYTES, FULLNESS * size))
    if 8 * n_rows * n_columns * (2 if kind > 2 else 1) > limit:
        raise MatrixError(
            f"{where}: matrix {name}: {n_rows} rows and {n_columns} columns are read in full here, which is more than "
            f"{limit / 1e6:.0f} MB for a file of {size} bytes; it is damaged, or write it into an OP4 file, "
            "which is read sparse"
        )
