"""Matrices of MATLAB files: version 5 by SciPy, version 7.3 by h5py; with nodes and dofs if the file has them."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
import scipy.sparse as sp

from fe_models.errors import MatrixError
from fe_models.files.matrices.foreign_matrices import ForeignMatrices
from fe_models.files.matrices.request import Request
from fe_models.files.matrices.triangles import mirrored

__all__ = ["NAMED", "from_named", "is_matlab_5", "is_matlab_7", "read_matlab_5", "read_matlab_7"]

NAMED = {
    "K": ("k", "stiffness", "kaa", "kgg", "kff"),
    "M": ("m", "mass", "maa", "mgg", "mff"),
    "D": ("d", "c", "damping", "baa", "bgg", "bff"),
}  #: usual names of the matrices, in lower case
MOST_INFLATED = 1100  #: largest compression ratio of deflate


def is_matlab_7(head: bytes) -> bool:
    """Return whether the file has the format of MATLAB 7.3: HDF5 after a text header of 512 bytes."""
    return head[512:520] == b"\x89HDF\r\n\x1a\n" or head[:8] == b"\x89HDF\r\n\x1a\n"


def is_matlab_5(head: bytes) -> bool:
    """Return whether the file has the format of MATLAB 5 to 7.2."""
    return head[:6] == b"MATLAB" and head[126:128] in (b"IM", b"MI")


def read_matlab_5(path: Path, request: Request) -> ForeignMatrices:
    """Read a file of MATLAB 5 to 7.2 (`save -v7`).

    Raises
    ------
    MatrixError
        If `from_named` raises it.
    """
    where = f"matrices {path}"
    wanted = [name for name, _, _ in scipy.io.whosmat(path)]
    content = scipy.io.loadmat(path, variable_names=wanted, spmatrix=False)
    return from_named(where, {name: content[name] for name in wanted if name in content}, request, "MATLAB")


def read_matlab_7(path: Path, request: Request) -> ForeignMatrices:
    """Read a file of MATLAB 7.3 (`save -v7.3`): HDF5, arrays transposed, sparse ones as groups of data, ir, jc.

    Raises
    ------
    MatrixError
        If `from_named` raises it, or an array declares more memory than its stored bytes can fill.
    """
    import h5py

    where = f"matrices {path}"
    content: dict[str, Any] = {}
    with h5py.File(path, "r") as file:
        for name, entry in file.items():
            if isinstance(entry, h5py.Dataset):
                if entry.dtype.kind in "fiucV" and entry.ndim == 2:
                    content[name] = array_of(where, name, entry).T
                    if entry.attrs.get("MATLAB_class") == b"char":
                        content[name] = np.array(["".join(map(chr, row)) for row in content[name].tolist()])
            elif "MATLAB_sparse" in entry.attrs:
                n_rows = int(entry.attrs["MATLAB_sparse"])
                parts = {
                    key: array_of(where, f"{name}/{key}", entry[key]) for key in ("data", "ir", "jc") if key in entry
                }
                if len(parts) == 3:
                    shape = (n_rows, len(parts["jc"]) - 1)
                    content[name] = sp.csc_array((parts["data"], parts["ir"], parts["jc"]), shape=shape)
                    content[name].check_format(full_check=True)
    return from_named(where, content, request, "MATLAB")


def array_of(where: str, name: str, entry: Any) -> np.ndarray:
    """Return an array of an HDF5 file after checking that its declared size fits the stored bytes."""
    claimed, stored = entry.size * entry.dtype.itemsize, entry.id.get_storage_size()
    if claimed > MOST_INFLATED * max(stored, 1):
        raise MatrixError(f"{where}: {name} claims {claimed} bytes and has {stored}; the file is damaged")
    return np.asarray(entry[()])


def from_named(where: str, content: Mapping[str, Any], request: Request, program: str) -> ForeignMatrices:
    """Return the record of named arrays: matrices, and `dofs` and `nodes` with numbers from 1.

    `dofs` contains (node number, component 1-6) of every row, or (number, 0) for a modal coordinate, (n_dof, 2).
    `nodes` has one row for each node: (number, x, y, z), or (x, y, z) if nodes are numbered 1, 2, ....

    Raises
    ------
    MatrixError
        If no matrix is found, a matrix is complex or does not consist of numbers, or dofs or nodes are invalid.
    """
    chosen = request.chosen(where, NAMED, content)
    matrices, triangle = {}, {}
    for role, name in chosen.items():
        matrices[role], triangle[role] = real_matrix(f"{where}: {name}", content[name])
    used = set(chosen.values())
    others = {name: value for name, value in content.items() if name not in (*used, "dofs", "nodes")}
    lower = {name.lower(): np.asarray(value) for name, value in content.items() if name.lower() in ("dofs", "nodes")}
    dofs = node_numbers = nodes = None
    if "dofs" in lower:
        table = table_of(f"{where}: dofs", lower["dofs"], (2,))
        if not np.array_equal(table, np.rint(table)) or table[:, 1].min() < 0 or table[:, 1].max() > 6:
            raise MatrixError(f"{where}: dofs: expected whole numbers (node, component 1 to 6) of every row")
        modal = table[:, 1] == 0
        if np.isin(table[modal, 0], table[~modal, 0]).any():
            raise MatrixError(
                f"{where}: dofs: expected whole numbers (node, component 1 to 6) of every row, got component 0 of "
                "nodes that have others too; 0 is a modal coordinate, with a number of its own"
            )
        dofs = np.stack([table[:, 0], table[:, 1] - 1], axis=1).astype(np.int64)
    if "nodes" in lower:
        table = table_of(f"{where}: nodes", lower["nodes"], (3, 4))
        nodes = table[:, -3:]
        node_numbers = np.arange(1, len(nodes) + 1) if table.shape[1] == 3 else table[:, 0].astype(np.int64)
    return ForeignMatrices(
        **matrices, dofs=dofs, nodes=nodes, node_numbers=node_numbers, others=others, triangle=triangle, program=program
    )


def real_matrix(where: str, value: Any) -> tuple[sp.csc_array, str]:
    """Return a real, symmetric matrix with both triangles, and the description of the stored triangle."""
    if sp.issparse(value):
        kind = value.dtype
        if value.format in ("csc", "csr"):
            try:
                value.check_format(full_check=True)
            except ValueError as error:
                raise MatrixError(f"{where}: its parts do not make a matrix ({error}); the file is damaged") from error
    else:
        value = np.asarray(value)
        kind = value.dtype
    is_complex = kind.kind == "c" or (kind.names is not None and "imag" in kind.names)
    if is_complex and not (kind.kind == "c" and np.abs((value.data if sp.issparse(value) else value).imag).max() == 0):
        raise MatrixError(
            f"{where}: expected a real matrix, got a complex one; structural damping is given to the modes"
        )
    if kind.kind not in "fiub" and not is_complex:
        raise MatrixError(f"{where}: expected a matrix of numbers, got {kind}")
    if value.ndim != 2 or value.shape[0] != value.shape[1]:
        raise MatrixError(f"{where}: expected a square matrix, got {' x '.join(map(str, value.shape))}")
    matrix = sp.csc_array(value.real if is_complex else value, dtype=float)
    matrix.sum_duplicates()
    if not np.isfinite(matrix.data).all():
        raise MatrixError(f"{where}: expected finite numbers, got NaN or infinity")
    return mirrored(where, matrix)


def table_of(where: str, value: Any, widths: tuple[int, ...]) -> np.ndarray:
    """Return a table of real numbers with one of these widths."""
    table = np.asarray(value)
    if table.dtype.kind not in "fiu" or table.ndim != 2 or table.shape[1] not in widths or not len(table):
        raise MatrixError(
            f"{where}: expected a table with {' or '.join(map(str, widths))} columns, got {table.dtype} {table.shape}"
        )
    if not np.isfinite(table).all():
        raise MatrixError(f"{where}: expected finite numbers, got NaN or infinity")
    return table.astype(float)
