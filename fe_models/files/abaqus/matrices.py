"""Matrices of Abaqus and CalculiX as text: entries by row and column, by labels of dofs, and user elements."""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from fe_models.errors import MatrixError
from fe_models.files.matrices.foreign_matrices import ForeignMatrices
from fe_models.files.matrices.request import Request
from fe_models.files.matrices.triangles import full_matrix
from fe_models.files.matrices.triplet_text import parsed_triplets, triplet_matrix
from fe_models.foundation.arrays import Array, IntArray

__all__ = [
    "calculix_neighbours",
    "is_coordinates",
    "is_labelled",
    "is_user_element",
    "read_calculix_dofs",
    "read_calculix_matrix",
    "read_coordinates",
    "read_labelled",
    "read_user_element",
]


# matrices of Abaqus, `*MATRIX GENERATE` with FORMAT=COORDINATE --------------------------------------------------------


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


# matrices of CalculiX, `*FREQUENCY, SOLVER=MATRIXSTORAGE`: .sti, .mas, and the list of dofs .dof ----------------------


ROLES_OF_SUFFIXES = {".sti": "K", ".mas": "M"}
WRITTEN_TOGETHER = (".sti", ".mas", ".dof")  #: suffixes of files that one run writes with the same name


def calculix_neighbours(paths: Sequence[Path]) -> list[Path]:
    """Return the files that CalculiX wrote with the same name as the given files, and that are not given.

    Parameters
    ----------
    paths
        Paths of one model. If they have different names or include other kinds of files, nothing is added.
    """
    names = {path.with_suffix("") for path in paths}
    given = {path.suffix.lower() for path in paths}
    if len(names) != 1 or not given <= set(WRITTEN_TOGETHER) or given == {".dof"}:
        return []
    beside = [next(iter(names)).with_suffix(suffix) for suffix in WRITTEN_TOGETHER if suffix not in given]
    return [path for path in beside if path.is_file()]


def read_calculix_matrix(path: Path, request: Request) -> ForeignMatrices:
    """Read lines `row column value` of the upper triangle, numbered from 1; the .dof file next to it has the rows.

    Raises
    ------
    MatrixError
        If a line is something else, or an entry is listed twice.
    """
    where = f"matrices {path}"
    role = request.role_of(where, ROLES_OF_SUFFIXES.get(path.suffix.lower()))
    matrix, triangle, _ = triplet_matrix(where, role, path.read_bytes())
    return ForeignMatrices(**{role: matrix}, triangle={role: triangle}, program="CalculiX")


def read_calculix_dofs(path: Path, request: Request) -> ForeignMatrices:
    """Read lines `node.component`, one for each row, with components from 1.

    Raises
    ------
    MatrixError
        If a line is something else.
    """
    where = f"matrices {path}"
    lines = path.read_text("ascii", "replace").split()
    parts = [line.partition(".") for line in lines]
    for k, (node, dot, component) in enumerate(parts):
        if not (dot and node.isdigit() and component in "123456" and len(component) == 1):
            raise MatrixError(f"{where}, line {k + 1}: expected node.component such as 12.3, got {lines[k][:40]!r}")
    dofs = np.array([(int(node), int(component) - 1) for node, _, component in parts], dtype=np.int64)
    return ForeignMatrices(dofs=dofs.reshape(-1, 2), program="CalculiX")


# abaqus labels --------------------------------------------------------------------------------------------------------
# Matrices that Abaqus writes with the numbers of nodes: lines `node, dof, node, dof, value` (FORMAT=MATRIX INPUT).


LABELLED = re.compile(rb"\s*-?\d+\s*,\s*\d+\s*,\s*-?\d+\s*,\s*\d+\s*,\s*[-+.\d]")
COMMA, BLANK, LINE = b",", b" ", b"\n"
DENSE = 4  #: number of keys per row up to which a table of all keys finds the rows


def is_labelled(head: bytes) -> bool:
    """Return whether the first line has the form `node, dof, node, dof, value`."""
    return LABELLED.match(head) is not None


def read_labelled(path: Path, request: Request) -> ForeignMatrices:
    """Read lines `node, dof, node, dof, value`, where each pair appears once; rows are sorted by node and dof.

    Raises
    ------
    MatrixError
        If a line is something else, a dof is none of the six of a node, or the matrix is not symmetric.
    """
    where = f"matrices {path}"
    role = request.role_of(where, role_by_name(path), ", and it is not named as Abaqus does it (job_STIF1, job_MASS1)")
    keys_1, keys_2, values = parsed_triplets(where, joined_labels(where, path.read_bytes()))
    keys = unique_keys(keys_1, keys_2)
    dofs = np.stack([keys // 10, keys % 10 - 1], axis=1)
    if not len(keys) or dofs[:, 1].min() < 0 or dofs[:, 1].max() > 5:
        wrong = dofs[(dofs[:, 1] < 0) | (dofs[:, 1] > 5)]
        got = f"dof {wrong[0, 1] + 1} at node {wrong[0, 0]}" if len(wrong) else "none"
        raise MatrixError(f"{where}: expected dofs 1 to 6 of nodes, got {got}; others are no motion of a body")
    rows, columns = rows_of_keys(keys, keys_1), rows_of_keys(keys, keys_2)
    matrix, triangle = full_matrix(f"{where}: {role}", rows, columns, values, len(keys))
    return ForeignMatrices(**{role: matrix}, dofs=dofs, triangle={role: triangle}, program="Abaqus")


def joined_labels(where: str, data: bytes) -> bytes:
    """Return the lines as `key key value` with key = 10 node + dof + 1, by removing and replacing commas.

    Node 12, dof 3 are written `12,3,`. Without the first comma they are the number 123, because a dof has one digit.
    """
    text = np.frombuffer(data.translate(None, delete=b" \t\r"), np.uint8).copy()
    commas = np.flatnonzero(text == COMMA[0])
    lines = np.flatnonzero(text == LINE[0])
    if len(commas) != 4 * len(lines):
        raise MatrixError(
            f"{where}: expected lines node, dof, node, dof, value with four commas, got {len(commas)} commas on "
            f"{len(lines)} lines; the file is cut off or of another format"
        )
    at = commas.reshape(-1, 4)
    fits = (at[:, 1] - at[:, 0] == 2) & (at[:, 3] - at[:, 2] == 2) & (at[:, 3] < lines)
    fits[1:] &= at[1:, 0] > lines[:-1]
    if not fits.all():
        line = int(np.argmin(fits))
        begin = lines[line - 1] + 1 if line else 0
        got = text[begin : lines[line]].tobytes()[:60].decode("ascii", "replace")
        raise MatrixError(f"{where}, line {line + 1}: expected node, dof 1 to 6, node, dof 1 to 6, value, got {got!r}")
    text[at[:, [1, 3]]] = BLANK[0]
    kept = np.ones(len(text), dtype=bool)
    kept[at[:, [0, 2]]] = False
    return bytes(text[kept].tobytes())


def unique_keys(first: IntArray, second: IntArray) -> IntArray:
    """Return all keys of both arrays, ascending, plus one, because the parser subtracts one."""
    largest = int(max(first.max(initial=-1), second.max(initial=-1))) + 1
    if largest > DENSE * max(len(first), 1_000_000):
        return np.unique(np.concatenate([first, second])) + 1
    is_there = np.zeros(largest, dtype=bool)
    is_there[first] = is_there[second] = True
    return np.flatnonzero(is_there) + 1


def rows_of_keys(keys: IntArray, wanted: IntArray) -> IntArray:
    """Return the index (from 0) of each wanted key (from 1) in ascending keys."""
    largest = int(keys[-1])
    if largest > DENSE * max(len(wanted), 1_000_000):
        return np.searchsorted(keys, wanted + 1)
    place = np.zeros(largest, np.int64)
    place[keys - 1] = np.arange(len(keys))
    return np.asarray(place[wanted])


# substructures as text of a linear user element: `*SUBSTRUCTURE MATRIX OUTPUT` of Abaqus and of CalculiX --------------


TYPES = {"STIFFNESS": "K", "MASS": "M", "VISCOUS DAMPING": "D"}


def is_user_element(head: bytes) -> bool:
    """Return whether the file begins with comments or a keyword of a deck."""
    return head.lstrip().startswith(b"*")


def read_user_element(path: Path, request: Request) -> ForeignMatrices:
    """Read `*USER ELEMENT` with its nodes and dofs, and the triangles of `*MATRIX, TYPE=...`.

    (1) nodes of the element: the comment below `** ELEMENT NODES`; a node may be listed once for each of its dofs
    (2) dofs: those of the first node, then lines `position, dofs`; these dofs apply from the node at this position on
    (3) matrix: column j from row 1 to the diagonal, four numbers on each line

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
    """Yield all fields of lines that are separated by commas."""
    for line in lines:
        yield from (word for word in (part.strip() for part in line.split(",")) if word)


def integers(where: str, line: str) -> list[int]:
    """Return the integers in a line, separated by commas."""
    try:
        return [int(word) for word in words_of([line])]
    except ValueError as error:
        raise MatrixError(f"{where}: expected numbers of nodes or dofs, got {line[:60]!r}") from error


def dofs_of_element(where: str, nodes: list[int], lines: list[list[int]]) -> IntArray:
    """Return (node number, component) of each row, (n_dof, 2), from the lists below `*USER ELEMENT`."""
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
    """Return the role K, M or D in a line `*MATRIX, TYPE=...`."""
    kind = keyword.partition("TYPE=")[2].partition(",")[0]
    for name, role in TYPES.items():
        if kind == name.replace(" ", ""):
            return role
    raise MatrixError(f"{where}: unknown matrix {kind or keyword!r}; expected {', '.join(TYPES)}")


def from_columns(where: str, values: Array, n: int) -> sp.csc_array:
    """Return the full matrix, given its upper triangle by columns."""
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
