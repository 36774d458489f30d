"""Reading of matrix files: formats by suffix and content, several files of one model, one kind of error."""

import io
import zipfile
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
import scipy.sparse as sp

from fe_models.errors import FeModelsError, MatrixError
from fe_models.files.abaqus.matrices import (
    calculix_neighbours,
    is_coordinates,
    is_labelled,
    is_user_element,
    read_calculix_dofs,
    read_calculix_matrix,
    read_coordinates,
    read_labelled,
    read_user_element,
)
from fe_models.files.ansys.matrices import read_full_part, read_sub_part
from fe_models.files.ansys.records import is_ansys_binary
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
from fe_models.files.matrices.matrix_market import is_matrix_market, read_matrix_market, role_by_stem
from fe_models.files.matrices.request import Request
from fe_models.files.matrices.triangles import mirrored
from fe_models.files.nastran.matrices.op2 import is_op2
from fe_models.files.nastran.matrices.op4 import is_op4
from fe_models.files.nastran.matrices.parts import read_op2_part, read_op4_part, read_punch_part
from fe_models.foundation.formats import HEAD, ReadFormat, format_of
from fe_models.foundation.paths import bytes_of, file_digest, reading
from fe_models.foundation.words import nearest, quoted

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


#: reads a part of a model from a file, as requested
MatrixReader = Callable[[Path, Request], ForeignMatrices]

#: if several formats have the same suffix, the first that recognises the content is used
MATRIX_FORMATS: tuple[ReadFormat[MatrixReader], ...] = (
    ReadFormat(
        "OUTPUT4", "Nastran", "matrices", (".op4",), tried="NX 9.1, Simcenter of 2020, MSC 2017",
        lost="structural damping (K4) of external superelements", read=read_op4_part, is_it=is_op4,
    ),
    ReadFormat(
        "OUTPUT2, matrix data blocks", "Nastran", "matrices", (".op2",), tried="NX 9.1", extra="nastran",
        lost="tables", read=read_op2_part, is_it=is_op2,
    ),
    ReadFormat(
        "DMIG, EXTRN", "Nastran", "matrices", (".pch", ".asm"), tried="NX 9.1, Simcenter of 2020, MSC 2017",
        read=read_punch_part,
    ),
    ReadFormat(
        ".full", "ANSYS", "matrices", (".full",), tried="2017 to 2019 (100033)",
        lost="positions: a deck beside it; lumped masses and constraint equations are refused",
        read=read_full_part, is_it=is_ansys_binary,
    ),
    ReadFormat(
        ".sub, superelement", "ANSYS", "matrices", (".sub",), tried="2019 to 2020 (121656)",
        read=read_sub_part, is_it=is_ansys_binary,
    ),
    ReadFormat(
        "Matrix Market, with nodes of its rows", "Ansys, SciPy", "matrices", (".mtx", ".mm", ".mmf", ".txt"),
        tried="SciPy 1.17", read=read_matrix_market, is_it=is_matrix_market,
    ),
    ReadFormat(
        "*MATRIX GENERATE, MATRIX INPUT", "Abaqus", "matrices", (".mtx",), tried="by its layout",
        read=read_labelled, is_it=is_labelled,
    ),
    ReadFormat(
        "*SUBSTRUCTURE MATRIX OUTPUT", "Abaqus, CalculiX", "matrices", (".mtx",), tried="CalculiX 2.20",
        lost="modes that are retained", read=read_user_element, is_it=is_user_element,
    ),
    ReadFormat(
        "*MATRIX GENERATE, COORDINATE", "Abaqus", "matrices", (".mtx",), tried="Abaqus 2021",
        lost="the numbers of nodes: a deck beside it", read=read_coordinates, is_it=is_coordinates,
    ),
    ReadFormat(
        "MATRIXSTORAGE", "CalculiX", "matrices", (".sti", ".mas"), tried="CalculiX 2.20",
        read=read_calculix_matrix, is_it=is_coordinates,
    ),
    ReadFormat(
        "MATRIXSTORAGE, list of dofs", "CalculiX", "matrices", (".dof",), tried="CalculiX 2.20",
        read=read_calculix_dofs,
    ),
    ReadFormat(
        "MAT 7.3", "MATLAB", "matrices", (".mat",), tried="h5py 3", read=read_matlab_7, is_it=is_matlab_7
    ),
    ReadFormat(
        "MAT 5", "MATLAB, Octave", "matrices", (".mat",), tried="SciPy 1.17", read=read_matlab_5, is_it=is_matlab_5
    ),
    ReadFormat(
        "sparse and dense npz", "SciPy, NumPy", "matrices", (".npz",), tried="SciPy 1.17", read=read_npz
    ),
    ReadFormat(
        "Harwell-Boeing RSA, RUA", "Ansys", "matrices", (".hb", ".rb", ".rsa", ".rua", ".matrix"),
        tried="by its layout", read=read_harwell_boeing, is_it=is_harwell_boeing,
    ),
)  # fmt: skip

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
    head = bytes_of(where, path, MatrixError, n=HEAD)
    known = format_of(where, path, head, MATRIX_FORMATS, MatrixError)
    with reading(where, path, known, MatrixError, FeModelsError), ThreadPoolExecutor(1) as beside:
        digest = beside.submit(file_digest, path)  # on another core
        part = known.read(path, request)
        return replace(part, files={**part.files, str(path): digest.result()})
