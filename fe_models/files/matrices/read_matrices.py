"""Reading of matrix files: formats by suffix and content, several files of one model, one kind of error."""

import io
import os
import zipfile
from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
import scipy.sparse as sp

from fe_models.errors import FeModelsError, MatrixError
from fe_models.files.ansys_matrices.records import is_ansys_binary
from fe_models.files.matrices.ansys import read_full_part, read_sub_part
from fe_models.files.matrices.foreign_matrices import ROLES, ForeignMatrices, joined
from fe_models.files.matrices.matlab import (
    MOST_INFLATED,
    from_named,
    is_matlab_5,
    is_matlab_7,
    read_matlab_5,
    read_matlab_7,
    real_matrix,
)
from fe_models.files.matrices.nastran import read_op2_part, read_op4_part, read_punch_part
from fe_models.files.matrices.request import MatrixFormat, Request
from fe_models.files.matrices.text_files.abaqus import (
    calculix_neighbours,
    is_labelled,
    is_user_element,
    read_calculix_dofs,
    read_calculix_matrix,
    read_labelled,
    read_user_element,
)
from fe_models.files.matrices.text_files.abaqus_text import is_coordinates, read_coordinates
from fe_models.files.matrices.text_files.matrix_market import is_matrix_market, read_matrix_market, role_by_stem
from fe_models.files.matrices.triangles import mirrored
from fe_models.files.nastran_matrices.op2 import is_op2
from fe_models.files.nastran_matrices.op4 import is_op4
from fe_models.foundation.digest import file_digest
from fe_models.foundation.paths import near_file
from fe_models.foundation.words import damage, nearest, quoted

__all__ = [
    "MATRIX_FORMATS",
    "MatrixFiles",
    "in_basic_axes",
    "is_harwell_boeing",
    "read_harwell_boeing",
    "read_matrices",
    "read_npz",
]


# transformation of dofs in local axes of their nodes to basic axes: K_basic = D K Dᵀ ----------------------------------


ORTHONORMAL = 1e-8  #: largest |Rᵀ R - 1| of axes from files with nine digits


def in_basic_axes(read: ForeignMatrices) -> ForeignMatrices:
    """Return matrices and loads with all rows in basic axes, without local systems.

    u_basic = D u_local with D = blockdiag(R) on the three translations and the three rotations of a node, so that
    K_basic = D K Dᵀ and f_basic = D f.

    Raises
    ------
    MatrixError
        If axes are not orthonormal and right-handed, or a node with local axes lacks a component: a constraint in
        oblique axes does not correspond to one row in basic axes.
    """
    if not read.systems:
        return read
    if read.dofs is None:
        raise MatrixError("local systems: the dofs of the rows are not known; give the list of dofs with the matrices")
    turned = {node: R for node, R in read.systems.items() if not np.array_equal(R, np.eye(3))}
    places: dict[tuple[int, int], int] = {
        (int(node), int(component)): row
        for row, (node, component) in enumerate(read.dofs)
        if int(node) in turned and component >= 0
    }
    rows: list[Any] = []
    columns: list[Any] = []
    values: list[Any] = []
    is_turned = np.zeros(len(read.dofs), dtype=bool)
    for node, R in turned.items():
        if np.abs(R.T @ R - np.eye(3)).max() > ORTHONORMAL or np.linalg.det(R) < 0:
            raise MatrixError(f"local system of node {node}: expected orthonormal right-handed axes, got {R.tolist()}")
        for first in (0, 3):
            at = [places[node, first + c] for c in range(3) if (node, first + c) in places]
            if not at:
                continue
            if len(at) < 3:
                raise MatrixError(
                    f"local system of node {node}: {3 - len(at)} of its components have no row, while others in "
                    "oblique axes have; give all rows of the node (without its supports)"
                )
            rows += np.repeat(at, 3).tolist()
            columns += at * 3
            values += R.ravel().tolist()
            is_turned[at] = True
    rest = np.flatnonzero(~is_turned)
    n = len(read.dofs)
    place = (np.concatenate([rest, rows]).astype(np.int64), np.concatenate([rest, columns]).astype(np.int64))
    D = sp.csc_array((np.concatenate([np.ones(len(rest)), values]), place), shape=(n, n))
    held = [int(read.dofs[row, 0]) for row in read.constrained if is_turned[row]]
    if held:
        raise MatrixError(
            f"local system of node {held[0]}: some of its rows are held in oblique axes ({len(held)} such rows), which "
            "basic axes cannot say; give the matrices without supports"
        )
    matrices = {role: D @ matrix @ D.T for role in ROLES if (matrix := getattr(read, role)) is not None}
    note = f"dofs of {len(turned)} nodes turned from local to basic axes"
    return replace(
        read,
        **matrices,
        loads={name: D @ load for name, load in read.loads.items()},
        systems={},
        notes=(*read.notes, note) if turned else read.notes,
    )


# scipy files ----------------------------------------------------------------------------------------------------------
# Matrices from Python programs (`scipy.sparse.save_npz`, arrays of `numpy.savez`), and Harwell-Boeing files.


SPARSE = {"format", "shape", "data"}  #: keys that `save_npz` always writes


def read_npz(path: Path, request: Request) -> ForeignMatrices:
    """Read one sparse matrix from `scipy.sparse.save_npz`, or several named dense arrays.

    Pickled objects are refused.

    Raises
    ------
    MatrixError
        If it contains something else, or declares more memory than its bytes can fill.
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
    """Return whether the third line begins with the type of a matrix, such as RSA."""
    lines = head.split(b"\n", 3)
    kind = lines[2][:3].upper() if len(lines) > 2 else b""
    return len(kind) == 3 and kind[:1] in b"RCP" and kind[1:2] in b"SUHZR" and kind[2:3] in b"AE"


def read_harwell_boeing(path: Path, request: Request) -> ForeignMatrices:
    """Read an assembled real matrix; for a symmetric matrix the file has one triangle.

    Raises
    ------
    MatrixError
        If it is complex, a pattern, unassembled or rectangular, or its header does not fit its size.
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
            f"{where}, line 3: expected the numbers of rows, columns and entries, none above the file size of "
            f"{n_bytes} bytes; got {counts}"
        )
    role = request.role_of(where, role_by_stem(path), ", and it is not named K.rsa, M.rsa, stiffness.hb, mass.hb")
    text = path.read_text("ascii", "replace").replace(lines[2], "RUA" + lines[2][3:], 1)
    stored = sp.csc_array(scipy.io.hb_read(io.StringIO(text), spmatrix=False))  # one triangle is not mirrored
    if stored.shape[0] != stored.shape[1]:
        raise MatrixError(f"{where}: {role}: expected a square matrix, got {stored.shape[0]} x {stored.shape[1]}")
    if not np.isfinite(stored.data).all():
        raise MatrixError(f"{where}: {role}: expected finite numbers, got NaN or infinity")
    declared = "symmetric" if kind == "RSA" else "general"
    matrix, triangle = mirrored(f"{where}: {role}", stored, declared=declared)
    return ForeignMatrices(**{role: matrix}, triangle={role: triangle}, program="Harwell-Boeing")


# read matrices --------------------------------------------------------------------------------------------------------


HEAD = 4096  #: number of first bytes that identify the format of a file

MATRIX_FORMATS: tuple[MatrixFormat, ...] = (
    MatrixFormat("Nastran OP4", (".op4",), read_op4_part, is_op4),
    MatrixFormat("Nastran OP2", (".op2",), read_op2_part, is_op2),
    MatrixFormat("Nastran punch", (".pch", ".asm"), read_punch_part),
    MatrixFormat("Matrix Market", (".mtx", ".mm", ".mmf", ".txt"), read_matrix_market, is_matrix_market),
    MatrixFormat("Abaqus matrix (MATRIX INPUT)", (".mtx",), read_labelled, is_labelled),
    MatrixFormat("substructure text", (".mtx",), read_user_element, is_user_element),
    MatrixFormat("CalculiX matrix", (".sti", ".mas"), read_calculix_matrix, is_coordinates),
    MatrixFormat("CalculiX list of dofs", (".dof",), read_calculix_dofs),
    MatrixFormat("MATLAB 7.3", (".mat",), read_matlab_7, is_matlab_7),
    MatrixFormat("MATLAB", (".mat",), read_matlab_5, is_matlab_5),
    MatrixFormat("SciPy or NumPy archive", (".npz",), read_npz),
    MatrixFormat("Harwell-Boeing", (".hb", ".rb", ".rsa", ".rua", ".matrix"), read_harwell_boeing, is_harwell_boeing),
    MatrixFormat("ANSYS full", (".full",), read_full_part, is_ansys_binary),
    MatrixFormat("ANSYS superelement", (".sub",), read_sub_part, is_ansys_binary),
    MatrixFormat("Abaqus matrix (COORDINATE)", (".mtx",), read_coordinates, is_coordinates),
)  #: supported formats; if several have the same suffix, the first that recognises the content is used

#: one file, several files, or the file of each role
MatrixFiles = str | Path | Iterable[str | Path] | Mapping[str, str | Path]


def read_matrices(files: MatrixFiles, *, names: Mapping[str, str] | None = None) -> ForeignMatrices:
    """Read mass and stiffness of one model from files of another program.

    Parameters
    ----------
    files
        One path; several paths, each with a part of the model (stiffness, mass, list of dofs); or paths by role. The
        roles are "K", "M", "D" for files that do not state which matrix they contain, and "dofs" for a list of rows.
        For CalculiX files without roles, the other files with the same name in the folder are read too; the notes
        report them.
    names
        Name of the matrix for each role, for files with several named matrices and without the usual names.

    Returns
    -------
    ForeignMatrices
        Content of all files, with rows in basic axes; missing data are None.

    Raises
    ------
    MatrixError
        If a file is missing, damaged or of an unknown kind, if it could only be read with another meaning than in its
        own program, or if the files do not fit together.
    """
    if isinstance(files, (str, Path)):
        listed: list[tuple[str | None, Path]] = [(None, Path(files))]
    elif isinstance(files, Mapping):
        listed = [(role, Path(path)) for role, path in files.items()]
    else:
        listed = [(None, Path(path)) for path in files]
    if not listed:
        raise MatrixError("matrices: expected at least one file, got none")
    for asked in (names or {}, {role: None for role, _ in listed if role}):
        for role in asked:
            if role not in (*ROLES, "dofs"):
                raise MatrixError(f"matrices: unknown role {quoted(role)}{nearest(role, (*ROLES, 'dofs'))}")
    beside = [] if any(role for role, _ in listed) else calculix_neighbours([path for _, path in listed])
    listed += [(None, path) for path in beside]
    parts = [read_part(path, Request(role, dict(names or {}))) for role, path in listed]
    where = f"matrices {', '.join(path.name for _, path in listed)}"
    read = in_basic_axes(joined(parts, where))
    return replace(read, notes=(*read.notes, *(f"{path.name} taken from beside the named files" for path in beside)))


def read_part(path: Path, request: Request) -> ForeignMatrices:
    """Read the content of one file; every fault becomes one message."""
    where = f"matrices {path}"
    if not path.exists():
        raise MatrixError(f"{where}: there is no such file{near_file(path)}")
    if path.is_dir():
        raise MatrixError(f"{where}: expected a file, got a directory")
    try:
        with path.open("rb") as file:
            head = file.read(HEAD)
    except OSError as error:
        raise MatrixError(f"{where}: cannot be read: {error.strerror or error}") from error
    if not head.strip():
        raise MatrixError(f"{where}: the file is empty")
    form = format_of(where, path, head)
    try:
        with ThreadPoolExecutor(1) as beside:  # the digest uses another core
            digest = beside.submit(file_digest, path)
            part = form.read(path, request)
    except FeModelsError:
        raise
    except MemoryError as error:
        size = os.path.getsize(path)
        raise MatrixError(f"{where}: not enough memory to read {size / 1e6:.0f} MB as {form.name}") from error
    except (Exception, SystemExit) as error:  # one message for any error that a damaged file causes in a parser
        raise MatrixError(f"{where}: could not be read as {form.name}: {damage(error)}") from error
    return replace(part, files={**part.files, str(path): digest.result()})


def format_of(where: str, path: Path, head: bytes) -> MatrixFormat:
    """Return the format of a file by its suffix, and by its content if several formats have this suffix."""
    suffix = path.suffix.lower()
    mine = [form for form in MATRIX_FORMATS if suffix in form.suffixes]
    if not mine:
        known = sorted({suffix for form in MATRIX_FORMATS for suffix in form.suffixes})
        raise MatrixError(f"{where}: unknown suffix {quoted(suffix)}{nearest(suffix, known)}")
    for form in mine:
        if form.is_it(head):
            return form
    raise MatrixError(
        f"{where}: expected {' or '.join(form.name for form in mine)}, got a file that begins with {quoted(head[:30])}"
    )
