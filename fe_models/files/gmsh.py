"""Gmsh meshes, formats 2.2 and 4.1, text and binary.

meshio is not used: it lists a cell of two groups twice (2.2), drops all but one of several physical groups (4.1 without
names), merges groups with the same name and different dimensions, fails if only some entities have a physical group,
and does not support node numbers with gaps (2.2 binary). Format: Gmsh reference manual, "MSH file format" and "Legacy
formats: MSH file format version 2".
"""

import shlex
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fe_models.errors import MeshError
from fe_models.foundation.arrays import Array, IntArray
from fe_models.meshes.cells.raw_mesh import RawBlock, RawMesh

__all__ = ["read_gmsh"]

_TYPES = {
    1: ("line", 1, 2),
    2: ("triangle", 2, 3),
    3: ("quad", 2, 4),
    4: ("tetra", 3, 4),
    5: ("hexahedron", 3, 8),
    6: ("wedge", 3, 6),
    7: ("pyramid", 3, 5),
    8: ("line3", 1, 3),
    9: ("triangle6", 2, 6),
    10: ("quad9", 2, 9),
    11: ("tetra10", 3, 10),
    12: ("hexahedron27", 3, 27),
    13: ("wedge18", 3, 18),
    14: ("pyramid14", 3, 14),
    15: ("vertex", 0, 1),
    16: ("quad8", 2, 8),
    17: ("hexahedron20", 3, 20),
    18: ("wedge15", 3, 15),
    19: ("pyramid13", 3, 13),
    20: ("triangle9", 2, 9),
    21: ("triangle10", 2, 10),
    26: ("line4", 1, 4),
    29: ("tetra20", 3, 20),
    36: ("quad16", 2, 16),
    90: ("wedge40", 3, 40),
    92: ("hexahedron64", 3, 64),
}  # number of the type in the file -> meshio name, dimension, nodes per cell

_ORDER = {
    "tetra10": [0, 1, 2, 3, 4, 5, 6, 7, 9, 8],
    "wedge15": [0, 1, 2, 3, 4, 5, 6, 9, 7, 12, 14, 13, 8, 10, 11],
    "pyramid13": [0, 1, 2, 3, 4, 5, 8, 10, 6, 7, 9, 11, 12],
    "hexahedron20": [0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15],
    "hexahedron27": [0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15, 22, 23, 21, 24, 20, 25, 26],
}  # meshio (VTK) place -> Gmsh place, for types that differ: the edges are numbered in another sequence


_BINARY = {"real": "<f8", "int": "<i4", "size": "<u8"}  #: numpy type of each kind of number in binary files
MOST_EXACT = 2.0**53  #: largest integer up to which all integers are exact as float64


class _Text:
    """Numbers in one section of a text file, in sequence."""

    def __init__(self, text: bytes, where: str) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("error", DeprecationWarning)  # numpy warns if the text does not only contain numbers
            try:
                self._values = np.fromstring(text.decode("ascii"), sep=" ")
            except (DeprecationWarning, ValueError) as error:
                raise MeshError(f"{where}: expected numbers only, got other text; the file is damaged") from error
        self._at = 0
        self._where = where

    def take(self, kind: str, count: int) -> np.ndarray:
        """Return the next numbers of a kind in `_BINARY` as float64 or int64."""
        end = self._at + int(count)
        if count < 0 or end > len(self._values):
            raise MeshError(f"{self._where}: ends too early; the file is truncated or damaged")
        values = self._values[self._at : end]
        self._at = end
        if kind == "real":
            return values
        bad = ~(np.abs(values) < MOST_EXACT) | (values != np.round(values))
        if bad.any():
            raise MeshError(f"{self._where}: expected whole numbers, got {values[bad][0]:g}; the file is damaged")
        return values.astype(np.int64)


@dataclass
class _Binary:
    """Numbers in a binary file, in sequence from a start position."""

    data: bytes
    at: int  #: position of the next number
    where: str  #: file and section, for messages

    def take(self, kind: str, count: int) -> np.ndarray:
        """Return the next numbers of a kind in `_BINARY` as float64 or int64."""
        dtype = np.dtype(_BINARY[kind])
        size = dtype.itemsize * int(count)
        if count < 0 or self.at + size > len(self.data):
            raise MeshError(f"{self.where}: ends too early; the file is truncated or damaged")
        values = np.frombuffer(self.data, dtype, int(count), self.at)
        self.at += size
        return values if kind == "real" else values.astype(np.int64)


_Numbers = _Text | _Binary


class _Names(dict[tuple[int, int], str]):
    """Names of physical groups by dimension and tag; a group without a name is `group_<tag>`."""

    def __missing__(self, key: tuple[int, int]) -> str:
        return f"group_{key[1]}"


def read_gmsh(path: Path, data: bytes) -> RawMesh:
    """Return the nodes, cells and physical groups of a Gmsh file.

    A physical group without a name is named `group_<tag>`. Groups of surfaces are face groups; groups of curves and
    points are node sets.

    Parameters
    ----------
    path
        File name, for messages.
    data
        Content of the file.

    Raises
    ------
    MeshError
        If the file is damaged, of another version, or partitioned.
    """
    where = f"mesh {path}"
    version, is_binary = _header(where, data)
    sections = _sections(where, data, is_binary)
    for name in ("PartitionedEntities", "GhostElements"):
        if name in sections:
            raise MeshError(f"{where}: the mesh is partitioned (${name}); save it as one part")
    if "Nodes" not in sections or "Elements" not in sections:
        missing = "Nodes" if "Nodes" not in sections else "Elements"
        raise MeshError(f"{where}: expected a section ${missing}, got none; is the file complete?")
    names = _physical_names(where, data, sections)
    if version == "4.1":
        numbers: dict[str, _Numbers] = {}
        for name in ("Entities", "Nodes", "Elements"):
            if name in sections:
                (start, end), place = sections[name], f"{where}: section ${name}"
                numbers[name] = _Binary(data, start, place) if is_binary else _Text(data[start:end], place)
        return _read_41(where, numbers, names)
    nodes, node_numbers = _nodes_22(where, data, sections["Nodes"], is_binary)
    place_of = _places(where, node_numbers)
    blocks = _cells_22(where, data, sections["Elements"], is_binary, place_of, names)
    return RawMesh(nodes, tuple(blocks), node_numbers=node_numbers, repeats_are_memberships=True)


def _header(where: str, data: bytes) -> tuple[str, bool]:
    at = data.find(b"$MeshFormat")
    fields = data[at:].split(b"\n", 2)[1].split() if at >= 0 else []
    if len(fields) < 3:
        raise MeshError(
            f"{where}: expected a Gmsh file (a line $MeshFormat, then version, kind and size), got {data[:20]!r}"
        )
    version = fields[0].decode("ascii", "replace")
    version = {"2": "2.2", "4": "4.1"}.get(version, version)
    if version not in ("2.2", "4.1"):
        raise MeshError(
            f"{where}: Gmsh format {version} is not supported; expected 2.2 or 4.1. Convert it: "
            f"gmsh -save -format msh41 -o new.msh {Path(where[5:]).name}"
        )
    if fields[1] == b"1":
        start = data.index(b"\n", data.index(b"\n", at) + 1) + 1
        if data[start : start + 4] != b"\x01\x00\x00\x00" or fields[2] != b"8":
            raise MeshError(f"{where}: binary Gmsh file of another kind of machine; save it as text")
    return version, fields[1] == b"1"


def _sections(where: str, data: bytes, is_binary: bool) -> dict[str, tuple[int, int]]:
    """Return start and end of the content of each section, by name."""
    sections: dict[str, tuple[int, int]] = {}
    at = 0
    while (at := data.find(b"$", at)) >= 0:
        line_end = data.find(b"\n", at)
        name = data[at + 1 : line_end if line_end >= 0 else len(data)].strip().decode("ascii", "replace")
        end = data.find(b"$End" + name.encode("ascii", "replace"), max(line_end, at)) if name else -1
        if line_end < 0 or end < 0:
            raise MeshError(f"{where}: section ${name[:30]} is not closed; the file is truncated or damaged")
        if name in sections:
            raise MeshError(f"{where}: section ${name} is there twice; expected one mesh in a file")
        sections[name] = (line_end + 1, end)
        at = end + len(name) + 4
        if is_binary and data[at : at + 1] not in (b"\n", b"\r", b""):
            raise MeshError(f"{where}: section ${name[:30]} is damaged")
    return sections


def _physical_names(where: str, data: bytes, sections: dict[str, tuple[int, int]]) -> _Names:
    """Return the name of each physical group, by (dimension, tag)."""
    if "PhysicalNames" not in sections:
        return _Names()
    start, end = sections["PhysicalNames"]
    names = _Names()
    for line in data[start:end].decode("utf-8", "replace").splitlines()[1:]:
        if not line.strip():
            continue
        dim, tag, *rest = shlex.split(line)
        if len(rest) != 1:
            raise MeshError(f"{where}: section $PhysicalNames: expected dimension, tag and name, got {line.strip()!r}")
        names[int(dim), int(tag)] = rest[0]
    return names


def _places(where: str, node_numbers: IntArray) -> IntArray:
    """Return the row of each node number, (largest number + 2,); -1 for a missing node."""
    if len(node_numbers) == 0:
        return np.full(1, -1)
    if node_numbers.min() < 0 or node_numbers.max() > 100 * len(node_numbers) + 10_000_000:
        raise MeshError(
            f"{where}: section $Nodes: node numbers from {node_numbers.min()} to {node_numbers.max()} "
            f"for {len(node_numbers)} nodes; the file is damaged"
        )
    places = np.full(int(node_numbers.max()) + 2, -1)
    places[node_numbers] = np.arange(len(node_numbers))
    if (places >= 0).sum() != len(node_numbers):
        raise MeshError(f"{where}: section $Nodes: a node number is listed twice")
    return places


def _connectivity(place_of: IntArray, kind: str, rows: IntArray) -> IntArray:
    inside = np.where((rows >= 0) & (rows < len(place_of)), rows, len(place_of) - 1)
    nodes = place_of[inside]
    return nodes[:, _ORDER[kind]] if kind in _ORDER else nodes


def _type(where: str, code: int) -> tuple[str, int, int]:
    if code not in _TYPES:
        raise MeshError(
            f"{where}: section $Elements: unsupported cells of Gmsh type {code}; supported: linear and "
            f"quadratic tetrahedra and hexahedra, and linear wedges"
        )
    return _TYPES[code]


def _read_41(where: str, numbers: Mapping[str, _Numbers], names: _Names) -> RawMesh:
    physical: dict[tuple[int, int], list[int]] = {}
    if "Entities" in numbers:
        source = numbers["Entities"]
        for dim, count in enumerate(source.take("size", 4)):
            for _ in range(count):
                tag = int(source.take("int", 1)[0])
                source.take("real", 3 if dim == 0 else 6)
                physical[dim, tag] = [int(t) for t in source.take("int", source.take("size", 1)[0])]
                if dim:
                    source.take("int", source.take("size", 1)[0])
    source = numbers["Nodes"]
    n_blocks, n_nodes, _, _ = source.take("size", 4)
    coordinates, node_numbers = [np.zeros((0, 3))], [np.zeros(0, np.int64)]
    for _ in range(n_blocks):
        dim, _, is_parametric = source.take("int", 3)
        count = source.take("size", 1)[0]
        node_numbers.append(source.take("size", count))
        width = 3 + (dim if is_parametric else 0)
        coordinates.append(source.take("real", count * width).reshape(count, width)[:, :3])
    numbers_of_nodes = np.concatenate(node_numbers)
    if len(numbers_of_nodes) != n_nodes:
        raise MeshError(f"{where}: section $Nodes: {n_nodes} nodes announced, {len(numbers_of_nodes)} found")
    place_of = _places(where, numbers_of_nodes)
    source = numbers["Elements"]
    n_blocks, n_cells, _, _ = source.take("size", 4)
    blocks, found = [], 0
    for _ in range(n_blocks):
        dim, tag, code = (int(v) for v in source.take("int", 3))
        count = int(source.take("size", 1)[0])
        kind, _, n_local = _type(where, code)
        rows = source.take("size", count * (1 + n_local)).reshape(count, 1 + n_local)
        everything = np.arange(count)
        groups = {names[dim, abs(t)]: everything for t in physical.get((dim, tag), [])}
        blocks.append(RawBlock(kind, _connectivity(place_of, kind, rows[:, 1:]), groups, rows[:, 0]))
        found += count
    if found != n_cells:
        raise MeshError(f"{where}: section $Elements: {n_cells} cells announced, {found} found")
    return RawMesh(np.concatenate(coordinates), tuple(blocks), node_numbers=numbers_of_nodes)


def _nodes_22(where: str, data: bytes, section: tuple[int, int], is_binary: bool) -> tuple[Array, IntArray]:
    start, end = section
    first = data.index(b"\n", start, end) + 1
    count = int(data[start:first])
    if is_binary:
        kind = np.dtype([("number", "<i4"), ("x", "<f8", 3)])
        if count < 0 or first + count * kind.itemsize > len(data):
            raise MeshError(f"{where}: section $Nodes: {count} nodes announced, but the file ends before")
        rows = np.frombuffer(data, kind, count, first)
        return rows["x"].astype(float), rows["number"].astype(np.int64)
    table = _Text(data[first:end], f"{where}: section $Nodes").take("real", 4 * count).reshape(count, 4)
    return table[:, 1:], table[:, 0].astype(np.int64)


def _cells_22(
    where: str, data: bytes, section: tuple[int, int], is_binary: bool, place_of: IntArray, names: _Names
) -> list[RawBlock]:
    """Return one block for each run of cells with equal type and number of tags."""
    start, end = section
    first = data.index(b"\n", start, end) + 1
    count = int(data[start:first])
    runs = _runs_binary(where, data, first, count) if is_binary else _runs_text(where, data[first:end], count)
    blocks = []
    for code, n_tags, table in runs:
        kind, dim, _ = _type(where, code)
        tags = table[:, 1] if n_tags else np.zeros(len(table), np.int64)
        groups = {names[dim, abs(tag)]: np.flatnonzero(tags == tag) for tag in np.unique(tags) if tag}
        blocks.append(RawBlock(kind, _connectivity(place_of, kind, table[:, 1 + n_tags :]), groups, table[:, 0]))
    return blocks


def _runs_text(where: str, text: bytes, count: int) -> list[tuple[int, int, IntArray]]:
    """Return (type, number of tags, rows of number, tags, nodes) of the cells in a text section."""
    lines = [line for line in text.splitlines() if line.strip()]
    if len(lines) != count:
        raise MeshError(f"{where}: section $Elements: {count} cells announced, {len(lines)} lines found")
    by_type: dict[tuple[int, int], list[bytes]] = {}
    for line in lines:
        head = line.split(None, 3)
        by_type.setdefault((int(head[1]), int(head[2])), []).append(line)
    runs = []
    for (code, n_tags), mine in by_type.items():
        width = 3 + n_tags + _type(where, code)[2]
        table = _Text(b"\n".join(mine), f"{where}: section $Elements").take("int", len(mine) * width).reshape(-1, width)
        runs.append((code, n_tags, np.delete(table, [1, 2], axis=1)))
    return runs


def _runs_binary(where: str, data: bytes, at: int, count: int) -> list[tuple[int, int, IntArray]]:
    """Return the runs in a binary section: heads (type, number of cells, number of tags), each with its rows."""
    source = _Binary(data, at, f"{where}: section $Elements")
    tables: dict[tuple[int, int], list[IntArray]] = {}
    found = 0
    while found < count:
        code, n_here, n_tags = (int(v) for v in source.take("int", 3))
        width = 1 + n_tags + _type(where, code)[2]
        tables.setdefault((code, n_tags), []).append(source.take("int", n_here * width).reshape(n_here, width))
        if n_here <= 0:
            raise MeshError(f"{where}: section $Elements: an empty run of cells; the file is damaged")
        found += n_here
    return [(code, n_tags, np.concatenate(parts)) for (code, n_tags), parts in tables.items()]
