"""Substructures as text of a linear user element: `*SUBSTRUCTURE MATRIX OUTPUT` of Abaqus and of CalculiX."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from fe_models.errors import MatrixError
from fe_models.files.matrices.foreign_matrices import ForeignMatrices
from fe_models.files.matrices.request import Request
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["is_user_element", "read_user_element"]

TYPES = {"STIFFNESS": "K", "MASS": "M", "VISCOUS DAMPING": "D"}


def is_user_element(head: bytes) -> bool:
    """Whether the file begins with comments or a keyword of a deck."""
    return head.lstrip().startswith(b"*")


def read_user_element(path: Path, request: Request) -> ForeignMatrices:
    """Read `*USER ELEMENT` with its nodes and dofs, and the triangles of `*MATRIX, TYPE=...`.

    (1) nodes of the element: the comment below `** ELEMENT NODES`; a node may be listed for each of its dofs
    (2) dofs: those of the first node, then `position, dofs` from which node on others hold
    (3) a matrix: column j from row 1 to the diagonal, four numbers to a line

    Raises
    ------
    MatrixError
        If nodes or dofs are missing, or a matrix has another number of entries.
    """
    where = f"matrices {path}"
    nodes: list[int] = []
    blocks: list[tuple[str, list[str]]] = []
    in_nodes = False
    for line in path.read_text("ascii", "replace").splitlines():
        text = line.strip()
        if text.startswith("**"):
            words = text.strip("* ").upper()
            in_nodes = words == "ELEMENT NODES" or (in_nodes and bool(words) and words[0].isdigit())
            if in_nodes and words[:1].isdigit():
                nodes += integers(where, words)  # (1)
        elif text.startswith("*"):
            in_nodes = False
            blocks.append((" ".join(text.upper().replace(" ", "").split()), []))
        elif text and blocks:
            blocks[-1][1].append(text)
    elements = [lines for keyword, lines in blocks if keyword.startswith("*USERELEMENT")]
    if len(elements) != 1 or not nodes:
        raise MatrixError(
            f"{where}: expected one *USER ELEMENT with its nodes below ** ELEMENT NODES, got {len(elements)} elements "
            f"and {len(nodes)} nodes; files of element matrices are no model"
        )
    dofs = dofs_of_element(where, nodes, [integers(where, line) for line in elements[0]])
    matrices: dict[str, sp.csc_array] = {}
    for keyword, lines in blocks:
        if not keyword.startswith("*MATRIX"):
            continue
        role = role_of_matrix(where, keyword)
        if role in matrices:
            raise MatrixError(f"{where}: {role} is there twice; expected each matrix once")
        values = np.array([float(word) for word in words_of(lines)])
        matrices[role] = from_columns(  # (3)
            f"{where}: {role}", values, len(dofs)
        )
    if not matrices:
        raise MatrixError(f"{where}: expected *MATRIX, TYPE=STIFFNESS or MASS, got none")
    return ForeignMatrices(**matrices, dofs=dofs, triangle=dict.fromkeys(matrices, "upper"), program="Abaqus, CalculiX")


def words_of(lines: list[str]) -> Iterator[str]:
    """Yield all fields of lines with commas."""
    for line in lines:
        yield from (word for word in (part.strip() for part in line.split(",")) if word)


def integers(where: str, line: str) -> list[int]:
    """Return the whole numbers of a line with commas."""
    try:
        return [int(word) for word in words_of([line])]
    except ValueError as error:
        raise MatrixError(f"{where}: expected numbers of nodes or dofs, got {line[:60]!r}") from error


def dofs_of_element(where: str, nodes: list[int], lines: list[list[int]]) -> IntArray:
    """Return (node number, component) of every row, (n_dof, 2), of the lists below `*USER ELEMENT`."""
    if not lines or not lines[0]:
        raise MatrixError(f"{where}: expected the dofs of the first node below *USER ELEMENT, got none")
    of_node: dict[int, list[int]] = {1: lines[0]}  # (2)
    for position, *components in lines[1:]:
        if not (1 <= position <= len(nodes)) or not components:
            raise MatrixError(f"{where}: expected position 1 to {len(nodes)} and dofs, got {[position, *components]}")
        of_node[position] = components
    rows: list[tuple[int, int]] = []
    current = lines[0]
    for position, node in enumerate(nodes, start=1):
        current = of_node.get(position, current)
        rows += [(node, component - 1) for component in current]
    dofs = np.array(rows, dtype=np.int64)
    if dofs[:, 1].min() < 0 or dofs[:, 1].max() > 5:
        raise MatrixError(
            f"{where}: expected dofs 1 to 6 of nodes, got {dofs[:, 1].min() + 1} to {dofs[:, 1].max() + 1}"
        )
    if len(np.unique(dofs, axis=0)) < len(dofs):
        raise MatrixError(
            f"{where}: a dof is listed twice; generalized coordinates of retained modes have no dofs 1 to 6"
        )
    return dofs


def role_of_matrix(where: str, keyword: str) -> str:
    """Return K, M or D of a line `*MATRIX, TYPE=...`."""
    kind = keyword.partition("TYPE=")[2].partition(",")[0]
    for name, role in TYPES.items():
        if kind == name.replace(" ", ""):
            return role
    raise MatrixError(f"{where}: unknown matrix {kind or keyword!r}; expected {', '.join(TYPES)}")


def from_columns(where: str, values: Array, n: int) -> sp.csc_array:
    """Return the full matrix of the upper triangle by columns."""
    if len(values) != n * (n + 1) // 2:
        raise MatrixError(
            f"{where}: expected {n * (n + 1) // 2} entries, one triangle of {n} rows, got {len(values)}; the file is "
            "cut off, or it lists other dofs than it has"
        )
    if not np.isfinite(values).all():
        raise MatrixError(f"{where}: expected finite numbers, got NaN or infinity")
    full = np.zeros((n, n))
    full.T[np.tril_indices(n)] = values
    return sp.csc_array(full + np.triu(full, 1).T)
