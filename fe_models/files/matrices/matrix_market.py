"""Matrix Market files: matrices, and vectors with node or dof of each row (ANSYS `*EXPORT, ..., MMF`)."""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.io
import scipy.sparse as sp

from fe_models.errors import MatrixError
from fe_models.files.matrices.foreign_matrices import ForeignMatrices
from fe_models.files.matrices.request import Request
from fe_models.files.matrices.triangles import full_matrix, mirrored, require_size
from fe_models.files.matrices.triplet_text import HeadAndData, judged, parsed_triplets
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["is_matrix_market", "read_matrix_market"]

BANNER = re.compile(rb"%%MatrixMarket\s+matrix\s+(\w+)\s+(\w+)\s+([\w-]+)\s*", re.IGNORECASE)
#: file names without suffix, by role
NAMES = {"K": ("k", "stiffness", "stiff"), "M": ("m", "mass"), "D": ("d", "c", "damping")}


@dataclass(frozen=True)
class Header:
    """Content of the first lines of a file."""

    form: str  #: form of the file: coordinate or array
    symmetry: str  #: symmetry: general or symmetric
    sizes: tuple[int, ...]  #: numbers of rows, columns and, in a coordinate file, entries
    length: int  #: length of these lines [bytes]
    n_lines: int


def is_matrix_market(head: bytes) -> bool:
    """Return whether the file begins with the banner of Matrix Market."""
    return head[:14].lower() == b"%%matrixmarket"


def role_by_stem(path: Path) -> str | None:
    """Return the role K, M or D that a file name such as K.mtx or mass.mtx indicates."""
    return next((role for role, names in NAMES.items() if path.stem.lower() in names), None)


def read_matrix_market(path: Path, request: Request) -> ForeignMatrices:
    """Read a matrix in coordinate or array form, or a vector with the node or dof of each row.

    A file with one column is a list of node numbers, one for every row or one for every 3 or 6 rows. A file with two
    columns is a list of (node, component from 1).

    Raises
    ------
    MatrixError
        If the matrix is complex, a pattern or not symmetric, or header and content differ.
    """
    where = f"matrices {path}"
    data = path.read_bytes()
    header = header_of(where, data)
    n_rows, n_columns = header.sizes[:2]
    if request.role == "dofs" or (n_columns in (1, 2) and n_rows > n_columns):
        return rows_said(where, dense_values(where, data, header).reshape(n_columns, n_rows).T)
    role = request.role_of(where, role_by_stem(path), ", and it is not named K.mtx, M.mtx, stiffness.mtx, mass.mtx")
    if n_rows != n_columns:
        raise MatrixError(f"{where}: {role}: expected a square matrix, got {n_rows} x {n_columns}")
    if header.form == "coordinate":
        require_size(where, n_rows, len(data))
        rows, columns, values = parsed_triplets(where, data[header.length :], first_line=header.n_lines + 1)
        if len(values) != header.sizes[2]:
            raise MatrixError(f"{where}: expected {header.sizes[2]} entries by its header, got {len(values)}")
        matrix, triangle = full_matrix(f"{where}: {role}", rows, columns, values, n_rows, declared=header.symmetry)
    else:
        values = dense_values(where, data, header)
        if header.symmetry == "symmetric":
            full = np.zeros((n_rows, n_rows))
            full.T[np.triu_indices(n_rows)] = values  # the lower triangle by columns
        else:
            full = values.reshape(n_rows, n_rows)
        matrix, triangle = mirrored(f"{where}: {role}", sp.csc_array(full), declared=header.symmetry)
    return ForeignMatrices(**{role: matrix}, triangle={role: triangle}, program="Matrix Market")


def header_of(where: str, data: bytes) -> Header:
    """Return the content of banner, comments and size line."""
    banner = BANNER.match(data)
    if banner is None:
        raise MatrixError(f"{where}: expected %%MatrixMarket matrix FORM FIELD SYMMETRY, got {data[:60]!r}")
    form, field, symmetry = (word.decode().lower() for word in banner.groups())
    if form not in ("coordinate", "array") or field not in ("real", "integer", "double"):
        raise MatrixError(
            f"{where}: expected a real matrix, coordinate or array, got {form} {field}; structural "
            "damping is given as damping of the modes"
        )
    if symmetry not in ("general", "symmetric"):
        raise MatrixError(f"{where}: expected a general or symmetric matrix, got {symmetry}")
    at, n_lines = 0, 0
    while True:
        end = data.find(b"\n", at)
        if end < 0:
            raise MatrixError(f"{where}: expected a line of sizes after the comments, got the end of the file")
        line, at, n_lines = data[at:end].strip(), end + 1, n_lines + 1
        if line and not line.startswith(b"%"):
            break
    n_sizes = 3 if form == "coordinate" else 2
    words = line.split()
    if len(words) != n_sizes or not all(word.isdigit() and len(word) <= 18 for word in words):
        raise MatrixError(f"{where}, line {n_lines}: expected {n_sizes} sizes, got {line[:60]!r}")
    return Header(form, symmetry, tuple(int(word) for word in words), at, n_lines)


def dense_values(where: str, data: bytes, header: Header) -> Array:
    """Return the numbers of an array file, or of a vector in coordinate form, column by column, (n,)."""
    n_rows, n_columns = header.sizes[:2]
    content = data[header.length :]
    _, n_words = judged(where, content, header.n_lines + 1)
    if header.form == "coordinate":
        if n_words != 3 * header.sizes[2] or header.sizes[2] != n_rows * n_columns:
            raise MatrixError(f"{where}: expected all {n_rows * n_columns} entries of a list, got {header.sizes[2]}")
        rows, columns, values = parsed_triplets(where, content, first_line=header.n_lines + 1)
        if max(rows.max(), 0) >= n_rows or max(columns.max(), 0) >= n_columns:
            raise MatrixError(f"{where}: expected rows and columns within {n_rows} x {n_columns}")
        dense = np.full((n_columns, n_rows), np.nan)
        dense[columns, rows] = values
    else:
        n = n_rows * (n_rows + 1) // 2 if header.symmetry == "symmetric" else n_rows * n_columns
        if n_words != n:
            raise MatrixError(f"{where}: expected {n} numbers by its header, got {n_words}")
        head = b"%%%%MatrixMarket matrix array real general\n%d 1\n" % n
        dense = scipy.io.mmread(HeadAndData(head, content if content.endswith(b"\n") else content + b"\n"))
    if not np.isfinite(dense).all():
        raise MatrixError(f"{where}: expected finite numbers, got some beyond the range of doubles or missing")
    return np.asarray(dense, dtype=float).ravel()


def rows_said(where: str, table: Array) -> ForeignMatrices:
    """Return the dofs in a list of nodes, or of nodes with components from 1."""
    numbers = np.rint(table).astype(np.int64)
    if not np.array_equal(numbers, table) or numbers[:, 0].min() < 1:
        raise MatrixError(f"{where}: expected whole numbers of nodes from 1, got others")
    if table.shape[1] == 2:
        return ForeignMatrices(dofs=np.stack([numbers[:, 0], numbers[:, 1] - 1], axis=1))
    nodes = numbers[:, 0]
    if len(np.unique(nodes)) == len(nodes):
        return ForeignMatrices(row_nodes=nodes)
    return ForeignMatrices(dofs=repeated_nodes(where, nodes))


def repeated_nodes(where: str, nodes: IntArray) -> IntArray:
    """Return the dofs if each row has a node number: x, y, z (and rotations) in the order of the rows."""
    order = np.argsort(nodes, kind="stable")
    first = np.flatnonzero(np.diff(nodes[order], prepend=nodes[order][0] - 1))
    per_node = np.diff(np.append(first, len(nodes)))
    if not np.isin(per_node, (3, 6)).all():
        raise MatrixError(
            f"{where}: expected each node 3 or 6 times, once for each of its rows, got {per_node.min()} to "
            f"{per_node.max()} times; give (node, component) in two columns"
        )
    component = np.empty(len(nodes), np.int64)
    component[order] = np.arange(len(nodes)) - np.repeat(first, per_node)
    return np.stack([nodes, component], axis=1)
