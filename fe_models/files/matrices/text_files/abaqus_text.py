"""Matrices that Abaqus writes as text: `*MATRIX GENERATE` with FORMAT=COORDINATE."""

import re
from pathlib import Path

from fe_models.errors import MatrixError
from fe_models.files.matrices.foreign_matrices import ForeignMatrices
from fe_models.files.matrices.request import Request
from fe_models.files.matrices.text_files.triplet_text import triplet_matrix

__all__ = ["is_coordinates", "read_coordinates", "role_by_name"]

NAMED = {"K": ("STIF",), "M": ("MASS",), "D": ("DMPV",)}  #: parts of file names by role; Abaqus writes job_STIF1.mtx
COORDINATES = re.compile(rb"\s*\d+\s+\d+\s+[-+.\d]")


def is_coordinates(head: bytes) -> bool:
    """Return whether the first line has the form `row column value`."""
    return COORDINATES.match(head) is not None


def role_by_name(path: Path) -> str | None:
    """Return the role of an Abaqus file by its name, such as job_STIF1.mtx; None if the name has another form."""
    for role, marks in NAMED.items():
        if any(re.search(rf"_{mark}\d+$", path.stem, re.IGNORECASE) for mark in marks):
            return role
    return None


def read_coordinates(path: Path, request: Request) -> ForeignMatrices:
    """Read lines `row column value`, numbered from 1; they do not contain the dofs of the rows.

    Raises
    ------
    MatrixError
        If a line is something else, an entry is listed twice, or the matrix is not symmetric.
    """
    where = f"matrices {path}"
    role = request.role_of(where, role_by_name(path), ", and it is not named as Abaqus does it (job_STIF1, job_MASS1)")
    matrix, triangle, says_something = triplet_matrix(where, role, path.read_bytes())
    if not says_something:
        raise MatrixError(f"{where}: {role}: expected entries, got none but zeros")
    return ForeignMatrices(**{role: matrix}, triangle={role: triangle}, program="Abaqus")
