"""Unchecked matrix from a file of Nastran."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from fe_models.errors import MatrixError
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["NastranMatrix", "dense_matrix", "matrix_named", "real_square"]


@dataclass(frozen=True, eq=False)
class NastranMatrix:
    """Matrix in an OP4, DMIG or OP2 file."""

    name: str  #: name of the matrix in upper case
    matrix: sp.csc_array  #: matrix (n_rows, n_columns), both triangles, float64 or complex128, in units of the model
    form: int  #: form code: 1 square, 2 rectangular, 6 symmetric, 9 rectangular DMIG, ...
    kind: int  #: number type: 1, 2 real and 3, 4 complex, in single and double precision
    where: str = ""  #: file and matrix name, for messages
    rows: IntArray | None = None  #: (id, component) of each row, component 0 for a scalar point; None: not in the file
    columns: IntArray | None = None  #: (id, component) of each column, or its number and 0; None: not in the file

    @property
    def is_complex(self) -> bool:
        """Whether the numbers are complex."""
        return self.matrix.dtype.kind == "c"


def matrix_named(where: str, matrices: Iterable[NastranMatrix], *names: str) -> NastranMatrix:
    """Return the matrix with one of these names; there must be exactly one.

    Raises
    ------
    MatrixError
        If there is none, or more than one.
    """
    matrices = tuple(matrices)
    found = [matrix for matrix in matrices if matrix.name in names]
    if len(found) == 1:
        return found[0]
    if found:
        raise MatrixError(
            f"{where}: expected one matrix {' or '.join(names)}, got {', '.join(matrix.name for matrix in found)}; "
            "write each once, or into files of their own"
        )
    got = ", ".join(matrix.name for matrix in matrices[:12]) + (", ..." if len(matrices) > 12 else "")
    raise MatrixError(f"{where}: expected a matrix {' or '.join(names)}, got {got or 'none'}")


def real_square(matrix: NastranMatrix) -> sp.csc_array:
    """Return a mass, damping or stiffness matrix, (n, n), after checking that it is real and square.

    Raises
    ------
    MatrixError
        If it is complex or not square. Symmetry is checked later, with the body.
    """
    n_rows, n_columns = matrix.matrix.shape
    if matrix.is_complex:
        raise MatrixError(
            f"{matrix.where}: is complex (type {matrix.kind}); a body needs real matrices: write the real part, "
            "structural damping as viscous damping or a loss factor"
        )
    if n_rows != n_columns:
        raise MatrixError(f"{matrix.where}: expected a square matrix, got {n_rows} rows and {n_columns} columns")
    return matrix.matrix


def dense_matrix(matrix: NastranMatrix, n_rows: int, n_columns: int, what: str) -> Array:
    """Return a recovery or load matrix in full, (n_rows, n_columns); `what` names the source of these sizes."""
    if matrix.is_complex:
        raise MatrixError(f"{matrix.where}: is complex (type {matrix.kind}); expected real numbers")
    if matrix.matrix.shape != (n_rows, n_columns):
        raise MatrixError(
            f"{matrix.where}: expected {n_rows} rows and {n_columns} columns as {what} says, got "
            f"{matrix.matrix.shape[0]} and {matrix.matrix.shape[1]}"
        )
    return np.ascontiguousarray(matrix.matrix.toarray())
