"""Full symmetric matrices from stored entries: both triangles, one triangle, or each pair once."""

import numpy as np
import scipy.sparse as sp

from fe_models.errors import MatrixError
from fe_models.foundation.arrays import SYMMETRY_DEFECT, Array, IntArray, symmetry_defect

__all__ = ["LARGEST", "full_matrix", "require_size", "stored_as"]

COLUMNS = 4096  #: number of columns that are compared at a time
LARGEST = 10_000_000  #: number of rows that needs no check; a file with more rows has at least one byte for each


def require_size(where: str, n_rows: int, n_bytes: int) -> None:
    """Raise `MatrixError` if a header declares more rows than its file can contain, before memory is allocated."""
    if n_rows > max(LARGEST, n_bytes):
        raise MatrixError(
            f"{where}: expected at most {n_bytes} rows in a file of {n_bytes} bytes, got {n_rows}; it is damaged"
        )


def full_matrix(
    where: str, rows: IntArray, columns: IntArray, values: Array, n: int, *, declared: str | None = None
) -> tuple[sp.csc_array, str]:
    """Return the full matrix from listed entries, (n, n), and which triangle was stored.

    If only one entry of each pair is listed, it is mirrored. This is not a guess, because a matrix with entries in one
    triangle only cannot be symmetric. If both entries of pairs are listed, they must be equal.

    Parameters
    ----------
    where
        File and matrix, for messages.
    rows, columns, values
        Entries, indices from 0, (n_entries,).
    n
        Number of rows.
    declared
        Declaration in the file: "symmetric" (each pair once) or "general" (both entries); None: no declaration.

    Returns
    -------
    matrix
        Matrix with both triangles.
    triangle
        "both", "lower", "upper", "diagonal", or "each pair once" (in either triangle).

    Raises
    ------
    MatrixError
        If an index is out of range, an entry is listed twice, or the matrix is not symmetric.
    """
    if len(rows) and not (rows.min() >= 0 and columns.min() >= 0 and max(rows.max(), columns.max()) < n):
        largest = max(int(rows.max()), int(columns.max())) + 1
        raise MatrixError(
            f"{where}: expected rows and columns 1 to {n}, got {min(rows.min(), columns.min()) + 1} to {largest}"
        )
    n_entries = len(values)
    stored = sp.csc_array(sp.coo_array((values, (rows, columns)), shape=(n, n)))
    stored.sum_duplicates()
    if stored.nnz < n_entries:
        raise MatrixError(
            f"{where}: {n_entries - stored.nnz} entries are listed twice; expected each once: was the "
            "file written to twice?"
        )
    return mirrored(where, stored, declared=declared)


def mirrored(where: str, stored: sp.csc_array, *, declared: str | None = None) -> tuple[sp.csc_array, str]:
    """Return the full matrix from stored entries, and which triangle was stored."""
    try:
        stored.check_format(full_check=True)  # an index beyond the matrix would be read from anywhere in memory
    except ValueError as error:
        raise MatrixError(f"{where}: its columns do not make a matrix ({error}); the file is damaged") from error
    kind = stored_as(stored)
    if kind == "diagonal":
        return stored, kind
    if kind in ("lower", "upper"):
        if declared == "general":
            raise MatrixError(
                f"{where}: the file says general, but only the {kind} triangle has entries; expected both triangles, "
                "or symmetric in its header"
            )
        return with_mirror(stored), kind
    defect = symmetry_defect(stored)
    if declared == "symmetric" or (declared is None and defect > SYMMETRY_DEFECT):
        pairs = abs(stored).multiply(abs(stored).T)
        pairs.setdiag(0)
        if not pairs.data.any():
            return with_mirror(stored), "each pair once"
        if declared == "symmetric":
            raise MatrixError(
                f"{where}: the file says symmetric, each pair once, but lists both entries of "
                f"{np.count_nonzero(pairs.data) // 2} pairs; expected one triangle, or general in its header"
            )
    if defect > SYMMETRY_DEFECT:
        raise MatrixError(
            f"{where}: expected a symmetric matrix, got |A - A.T| = {defect:.1e} of its largest entry; gyroscopic, "
            "contact and follower terms are no part of a body; or the file is cut off"
        )
    return stored, "both"


def stored_as(matrix: sp.csc_array) -> str:
    """Return which triangle has entries: both, lower, upper or diagonal."""
    below = above = False
    n = matrix.shape[1]
    for first in range(0, n, COLUMNS):
        last = min(first + COLUMNS, n)
        part = slice(matrix.indptr[first], matrix.indptr[last])
        rows, is_there = matrix.indices[part], matrix.data[part] != 0
        column = np.repeat(np.arange(first, last, dtype=rows.dtype), np.diff(matrix.indptr[first : last + 1]))
        below = below or bool(((rows > column) & is_there).any())
        above = above or bool(((rows < column) & is_there).any())
        if below and above:
            return "both"
    return "lower" if below else "upper" if above else "diagonal"


def with_mirror(stored: sp.csc_array) -> sp.csc_array:
    """Return A + Aᵀ - diag(A)."""
    entries = sp.coo_array(stored)
    off = np.flatnonzero(entries.row != entries.col)
    rows = np.concatenate([entries.row, entries.col[off]])
    columns = np.concatenate([entries.col, entries.row[off]])
    return sp.csc_array((np.concatenate([entries.data, entries.data[off]]), (rows, columns)), shape=stored.shape)
