"""Frames from two tables, one of nodes and one of lines: comma, semicolon or tab separated text with a header."""

import csv
from hashlib import sha256
from pathlib import Path

import numpy as np

from fe_models.errors import MeshError
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.words import nearest, quoted
from fe_models.meshes.line_mesh import LineMesh, divide_lines

__all__ = ["read_tables"]

NODE_COLUMNS = ("node", "x", "y", "z", "sets")
LINE_COLUMNS = ("line", "node1", "node2", "group", "vx", "vy", "vz", "third", "elements")
OFFSET_COLUMNS = ("x1", "y1", "z1", "x2", "y2", "z2")


def read_tables(nodes: str | Path, lines: str | Path) -> LineMesh:
    """Read the mesh of a frame from a table of nodes and a table of lines.

    Parameters
    ----------
    nodes
        Columns `node, x, y, z` and optionally `sets` (names of node sets, separated by blanks). Node numbers are
        free; a blank coordinate is zero.
    lines
        Columns `node1, node2` and optionally `group` (of the section), the orientation vector `vx, vy, vz` or a
        `third` node in the local x-y plane, offsets of the axis `x1, y1, z1, x2, y2, z2`, and the number of `elements`
        into which the line is cut (default 1; `divide_lines`). Text from # on is a
        comment. Nodes that only serve as third nodes are no part of the body.

    Raises
    ------
    MeshError
        If a table is incomplete, a number is invalid, or a node is unknown or repeated; the message names file, line
        and column.
    """
    node_path, line_path = Path(nodes), Path(lines)
    node_rows, node_digest = _table(node_path, NODE_COLUMNS, ("node", "x", "y"))
    line_rows, line_digest = _table(line_path, LINE_COLUMNS + OFFSET_COLUMNS, ("node1", "node2"))
    place: dict[int, int] = {}
    for row in node_rows:
        number = _integer(row, "node")
        if number in place:
            raise MeshError(f"{row['where']}: node {number} is listed twice")
        place[number] = len(place)
    X = np.array([[_real(row, key) for key in "xyz"] for row in node_rows]).reshape(-1, 3)
    pairs = np.array([[_node(row, key, place) for key in ("node1", "node2")] for row in line_rows], np.int64)
    pairs = pairs.reshape(-1, 2)
    if not len(pairs):
        raise MeshError(f"table {line_path}: expected lines, got none")
    line_sets: dict[str, list[int]] = {}
    for k, row in enumerate(line_rows):
        if row.get("group"):
            line_sets.setdefault(row["group"], []).append(k)
    node_sets: dict[str, list[int]] = {}
    for k, row in enumerate(node_rows):
        for name in row.get("sets", "").split():
            node_sets.setdefault(name, []).append(k)
    for name, rows in line_sets.items():
        node_sets.setdefault(name, np.unique(pairs[rows]).tolist())
    orientations = np.array([_orientation(row, pair, X, place) for row, pair in zip(line_rows, pairs, strict=True)])
    offsets = np.array([[_real(row, key) for key in OFFSET_COLUMNS] for row in line_rows]).reshape(-1, 2, 3)
    used = np.zeros(len(X), dtype=bool)
    used[pairs] = True
    thirds = [place[_integer(row, "third")] for row in line_rows if row.get("third")]
    only_third = np.setdiff1d(thirds, np.flatnonzero(used))
    keep = np.setdiff1d(np.arange(len(X)), only_third)
    new = np.full(len(X), -1)
    new[keep] = np.arange(len(keep))
    mesh = LineMesh(
        nodes=X[keep],
        lines=new[pairs],
        line_sets={name: np.array(rows) for name, rows in line_sets.items()},
        node_sets={name: new[[m for m in members if new[m] >= 0]] for name, members in node_sets.items()},
        orientations=None if np.isnan(orientations).all() else orientations,
        offsets=offsets if offsets.any() else None,
        source=f"{node_path}, {line_path}",
        digest=sha256((node_digest + line_digest).encode()).hexdigest(),
        node_numbers=np.array(list(place))[keep],
        line_numbers=line_numbers(line_rows),
        notes=(f"{len(only_third)} nodes only orient lines and were left out",) if len(only_third) else (),
    )
    elements = np.array([_integer(row, "elements") if row.get("elements") else 1 for row in line_rows])
    if (elements < 1).any():
        row = line_rows[int(np.argmax(elements < 1))]
        raise MeshError(f"{row['where']}: column elements: expected a whole number from 1 on, got {row['elements']!r}")
    return mesh if (elements == 1).all() else divide_lines(mesh, elements)


def line_numbers(rows: list[dict[str, str]]) -> IntArray:
    """Return the numbers in the column `line`, (n_lines,); none if any line has no number."""
    if not all(row.get("line") for row in rows):
        return np.zeros(0, np.int64)
    numbers = np.array([_integer(row, "line") for row in rows])
    if len(np.unique(numbers)) < len(numbers) or numbers.min() < 0:
        raise MeshError(f"{rows[0]['where']}: column line: expected a number from 0 of its own for each line")
    return numbers


def _table(path: Path, columns: tuple[str, ...], required: tuple[str, ...]) -> tuple[list[dict[str, str]], str]:
    """Return the rows of a table by column name, each with its position under "where", and the sha256 of the file."""
    where = f"table {path}"
    try:
        data = path.read_bytes()
    except OSError as error:
        raise MeshError(f"{where}: cannot be read: {error.strerror or error}") from error
    text = [line.partition("#")[0].rstrip() for line in data.decode("utf-8-sig", "replace").splitlines()]
    filled = [(number, line) for number, line in enumerate(text, start=1) if line.strip(" ,;\t")]
    if not filled:
        raise MeshError(f"{where}: the table is empty; expected a header with {', '.join(required)}")
    head = filled[0][1]
    delimiter = next((mark for mark in ";\t," if mark in head), ",")
    names = [name.strip().lower() for name in next(csv.reader([head], delimiter=delimiter))]
    for name in names:
        if name not in columns:
            raise MeshError(f"{where}: unknown column {quoted(name)}{nearest(name, columns)}")
    missing = [name for name in required if name not in names]
    if missing or len(set(names)) < len(names):
        what = f"missing {', '.join(missing)}" if missing else "a column is there twice"
        raise MeshError(f"{where}: {what}; expected a header such as {','.join(columns[:4])}, got {head!r}")
    rows = []
    for number, line in filled[1:]:
        words = [word.strip() for word in next(csv.reader([line], delimiter=delimiter))]
        if len(words) > len(names):
            raise MeshError(f"{where}, line {number}: {len(words)} entries, but the header has {len(names)} columns")
        rows.append({**dict(zip(names, words, strict=False)), "where": f"{where}, line {number}"})
    return rows, sha256(data).hexdigest()


def _real(row: dict[str, str], key: str) -> float:
    word = row.get(key, "")
    try:
        value = float(word) if word else 0.0
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise MeshError(f"{row['where']}: column {key}: expected a finite number, got {word!r}")
    return value


def _integer(row: dict[str, str], key: str) -> int:
    try:
        return int(row.get(key, ""))
    except ValueError:
        raise MeshError(f"{row['where']}: column {key}: expected a whole number, got {row.get(key, '')!r}") from None


def _node(row: dict[str, str], key: str, place: dict[int, int]) -> int:
    number = _integer(row, key)
    if number not in place:
        raise MeshError(f"{row['where']}: column {key}: there is no node {number} in the table of nodes")
    return place[number]


def _orientation(row: dict[str, str], pair: IntArray, X: Array, place: dict[int, int]) -> Array:
    """Return the vector towards the local y axis, from the row's own vector or its third node; NaN: default."""
    given = [key for key in ("vx", "vy", "vz") if row.get(key)]
    if row.get("third"):
        if given:
            raise MeshError(f"{row['where']}: gives both a vector ({', '.join(given)}) and a third node; leave one out")
        return np.asarray(X[_node(row, "third", place)] - X[pair[0]])
    return np.array([_real(row, key) for key in ("vx", "vy", "vz")]) if given else np.full(3, np.nan)
