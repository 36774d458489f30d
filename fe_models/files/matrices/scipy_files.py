"""Matrices that Python programs keep: `scipy.sparse.save_npz`, arrays of `numpy.savez`; and Harwell-Boeing files."""

import io
import zipfile
from pathlib import Path

import numpy as np
import scipy.io
import scipy.sparse as sp

from fe_models.errors import MatrixError
from fe_models.files.matrices.foreign_matrices import ForeignMatrices
from fe_models.files.matrices.matlab import MOST_INFLATED, from_named, real_matrix
from fe_models.files.matrices.request import Request
from fe_models.files.matrices.text_files.matrix_market import role_by_stem
from fe_models.files.matrices.triangles import mirrored

__all__ = ["is_harwell_boeing", "read_harwell_boeing", "read_npz"]

SPARSE = {"format", "shape", "data"}  #: keys that `save_npz` always writes


def read_npz(path: Path, request: Request) -> ForeignMatrices:
    """Read one sparse matrix of `scipy.sparse.save_npz`, or several dense arrays by name, as a MATLAB file has them.

    Pickled objects are refused.

    Raises
    ------
    MatrixError
        If it holds something else, or claims more memory than its bytes can fill.
    """
    where = f"matrices {path}"
    with zipfile.ZipFile(path) as archive:
        for entry in archive.infolist():
            if entry.file_size > MOST_INFLATED * max(entry.compress_size, 1):
                raise MatrixError(f"{where}: {entry.filename} claims {entry.file_size} bytes; the file is damaged")
    with np.load(path, allow_pickle=False) as content:
        if not set(content.files) >= SPARSE:
            return from_named(where, {name: content[name] for name in content.files}, request, "NumPy")
        for key in ("indptr", "row"):
            if key in content.files and len(content[key]) > 10 * path.stat().st_size + 10:
                raise MatrixError(f"{where}: {key} is longer than the file can be; it is damaged")
    role = request.role_of(where, role_by_stem(path), ", and it is not named K.npz, M.npz, stiffness.npz, mass.npz")
    matrix, triangle = real_matrix(f"{where}: {role}", sp.load_npz(path))
    return ForeignMatrices(**{role: matrix}, triangle={role: triangle}, program="SciPy")


def is_harwell_boeing(head: bytes) -> bool:
    """Whether the third line begins with the type of a matrix, such as RSA."""
    lines = head.split(b"\n", 3)
    kind = lines[2][:3].upper() if len(lines) > 2 else b""
    return len(kind) == 3 and kind[:1] in b"RCP" and kind[1:2] in b"SUHZR" and kind[2:3] in b"AE"


def read_harwell_boeing(path: Path, request: Request) -> ForeignMatrices:
    """Read an assembled real matrix; of a symmetric one the file has one triangle.

    Raises
    ------
    MatrixError
        If it is complex, a pattern, in elements, rectangular, or its header does not fit its size.
    """
    where = f"matrices {path}"
    with path.open("rb") as file:
        lines = [file.readline(200).decode("ascii", "replace") for _ in range(3)]
    kind, counts = lines[2][:3].upper(), lines[2][3:].split()
    if kind not in ("RSA", "RUA"):
        raise MatrixError(f"{where}: expected a real, assembled matrix (RSA, RUA), got {kind!r}")
    n_bytes = path.stat().st_size
    if len(counts) < 3 or not all(word.isdigit() for word in counts[:3]) or max(map(int, counts[:3])) > n_bytes:
        raise MatrixError(
            f"{where}, line 3: expected rows, columns, entries of a file of {n_bytes} bytes, got {counts}"
        )
    role = request.role_of(where, role_by_stem(path), ", and it is not named K.rsa, M.rsa, stiffness.hb, mass.hb")
    text = path.read_text("ascii", "replace").replace(lines[2], "RUA" + lines[2][3:], 1)
    stored = sp.csc_array(scipy.io.hb_read(io.StringIO(text), spmatrix=False))  # which reads one triangle as it stands
    if stored.shape[0] != stored.shape[1]:
        raise MatrixError(f"{where}: {role}: expected a square matrix, got {stored.shape[0]} x {stored.shape[1]}")
    if not np.isfinite(stored.data).all():
        raise MatrixError(f"{where}: {role}: expected finite numbers, got NaN or infinity")
    declared = "symmetric" if kind == "RSA" else "general"
    matrix, triangle = mirrored(f"{where}: {role}", stored, declared=declared)
    return ForeignMatrices(**{role: matrix}, triangle={role: triangle}, program="Harwell-Boeing")
