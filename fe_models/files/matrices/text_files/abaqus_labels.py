"""Matrices that Abaqus writes with the numbers of nodes: lines `node, dof, node, dof, value` (FORMAT=MATRIX INPUT)."""

import re
from pathlib import Path

import numpy as np

from fe_models.errors import MatrixError
from fe_models.files.matrices.foreign_matrices import ForeignMatrices
from fe_models.files.matrices.request import Request
from fe_models.files.matrices.text_files.abaqus_text import role_by_name
from fe_models.files.matrices.text_files.triplet_text import parsed_triplets
from fe_models.files.matrices.triangles import full_matrix
from fe_models.foundation.arrays import IntArray

__all__ = ["is_labelled", "read_labelled"]

LABELLED = re.compile(rb"\s*-?\d+\s*,\s*\d+\s*,\s*-?\d+\s*,\s*\d+\s*,\s*[-+.\d]")
COMMA, BLANK, LINE = b",", b" ", b"\n"
DENSE = 4  #: keys per row up to which rows are found by a table of all keys


def is_labelled(head: bytes) -> bool:
    """Whether the first line is `node, dof, node, dof, value`."""
    return LABELLED.match(head) is not None


def read_labelled(path: Path, request: Request) -> ForeignMatrices:
    """Read lines `node, dof, node, dof, value`, each pair once; rows in ascending order of node and dof.

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
    """Return the lines as `key key value` with key = 10 node + dof + 1, by taking out and replacing commas.

    Node 12, dof 3 are written `12,3,`: without the comma between them they are the number 123, as a dof has one digit.
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
    """Return all keys of both, ascending, plus one, as the parser counts from 0."""
    largest = int(max(first.max(initial=-1), second.max(initial=-1))) + 1
    if largest > DENSE * max(len(first), 1_000_000):
        return np.unique(np.concatenate([first, second])) + 1
    is_there = np.zeros(largest, dtype=bool)
    is_there[first] = is_there[second] = True
    return np.flatnonzero(is_there) + 1


def rows_of_keys(keys: IntArray, wanted: IntArray) -> IntArray:
    """Return the place of each wanted key, counted from 0, in ascending keys, counted from 1."""
    largest = int(keys[-1])
    if largest > DENSE * max(len(wanted), 1_000_000):
        return np.searchsorted(keys, wanted + 1)
    place = np.zeros(largest, np.int64)
    place[keys - 1] = np.arange(len(keys))
    return np.asarray(place[wanted])
