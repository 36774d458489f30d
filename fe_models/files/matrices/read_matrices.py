"""One door for matrix files: formats by suffix and content, several files that make one model, one error."""

import os
from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

from fe_models.errors import FeModelsError, MatrixError
from fe_models.files.ansys_matrices.records import is_ansys_binary
from fe_models.files.matrices.ansys import read_full_part, read_sub_part
from fe_models.files.matrices.foreign_matrices import ROLES, ForeignMatrices, joined
from fe_models.files.matrices.local_systems import in_basic_axes
from fe_models.files.matrices.matlab import is_matlab_5, is_matlab_7, read_matlab_5, read_matlab_7
from fe_models.files.matrices.nastran import read_op2_part, read_op4_part, read_punch_part
from fe_models.files.matrices.request import MatrixFormat, Request
from fe_models.files.matrices.scipy_files import is_harwell_boeing, read_harwell_boeing, read_npz
from fe_models.files.matrices.text_files.abaqus_labels import is_labelled, read_labelled
from fe_models.files.matrices.text_files.abaqus_text import is_coordinates, read_coordinates
from fe_models.files.matrices.text_files.calculix import (
    calculix_neighbours,
    read_calculix_dofs,
    read_calculix_matrix,
)
from fe_models.files.matrices.text_files.matrix_market import is_matrix_market, read_matrix_market
from fe_models.files.matrices.text_files.user_element import is_user_element, read_user_element
from fe_models.files.nastran_matrices.op2 import is_op2
from fe_models.files.nastran_matrices.op4 import is_op4
from fe_models.foundation.digest import file_digest
from fe_models.foundation.paths import near_file
from fe_models.foundation.words import damage, nearest, quoted

__all__ = ["MATRIX_FORMATS", "MatrixFiles", "read_matrices"]

HEAD = 4096  #: bytes by which the format of a file is told

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
)  #: every format that is read; of those with one suffix the first that knows the content

MatrixFiles = str | Path | Iterable[str | Path] | Mapping[str, str | Path]  #: one file, several, or role -> file


def read_matrices(files: MatrixFiles, *, names: Mapping[str, str] | None = None) -> ForeignMatrices:
    """Read mass and stiffness of one model from files of another program.

    Parameters
    ----------
    files
        One path; several, each with a part of the model (stiffness, mass, list of dofs); or role -> path, with roles
        "K", "M", "D" where a file does not say which matrix it holds, and "dofs" for a list of rows. Files of CalculiX
        without roles bring those of the same name beside them along, which the notes say.
    names
        Role -> name of its matrix, for files that hold several by name and not under the usual ones.

    Returns
    -------
    ForeignMatrices
        All that the files say, rows in basic axes; what is missing is None.

    Raises
    ------
    MatrixError
        If a file is missing, damaged, of an unknown kind, or could only be read with another meaning than its own
        program gives it; if the files do not fit together.
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
    """Read what one file says; whatever is wrong with it becomes one message."""
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
        with ThreadPoolExecutor(1) as beside:  # the digest takes a core of its own
            digest = beside.submit(file_digest, path)
            part = form.read(path, request)
    except FeModelsError:
        raise
    except MemoryError as error:
        size = os.path.getsize(path)
        raise MatrixError(f"{where}: not enough memory to read {size / 1e6:.0f} MB as {form.name}") from error
    except (Exception, SystemExit) as error:  # whatever a damaged file does to a parser, the user gets one message
        raise MatrixError(f"{where}: could not be read as {form.name}: {damage(error)}") from error
    return replace(part, files={**part.files, str(path): digest.result()})


def format_of(where: str, path: Path, head: bytes) -> MatrixFormat:
    """Return the format of a file: by its suffix, and by its content where several share one."""
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
