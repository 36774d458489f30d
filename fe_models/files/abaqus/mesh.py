"""The mesh of an Abaqus or CalculiX deck: nodes, elements and sets.

meshio is not used: it replaces repeated *NODE, *NSET and *ELSET blocks instead of appending them, ends a block at a
comment line, ignores sets of sets, the coordinate system of *NODE and instance transformations, and confuses the sets
of *ELEMENT blocks. Loads, sections and materials are not read. Keywords that create or move nodes or elements and that
are not supported raise an error.
"""

import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from fe_models.errors import MeshError
from fe_models.files.abaqus.assembly import only_part
from fe_models.files.abaqus.blocks import DeckBlock, deck_blocks, refuse_unread
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.words import nearest, quoted
from fe_models.meshes.cells.raw_mesh import RawBlock, RawMesh
from fe_models.meshes.mesh import SOLID_TYPES
from fe_models.meshes.numbering import rows_of_numbers

__all__ = ["DeckMesh", "deck_mesh", "naming_note", "raw_mesh_of", "read_abaqus"]

_SOLIDS = {4: "tetra", 5: "pyramid", 6: "wedge", 8: "hexahedron", 10: "tetra10", 15: "wedge15", 20: "hexahedron20"}
_SOLID = re.compile(r"C3D(\d+)[A-Z]*$")
_FACES = {
    "3": ("triangle", 3),
    "4": ("quad", 4),
    "6": ("triangle6", 6),
    "65": ("triangle6", 6),
    "8": ("quad8", 8),
    "9": ("quad9", 9),
}
_FACE = re.compile(r"(?:STRI|S|DS|CPS|CPE|CPEG|CAX|M3D|SFM3D|R3D)(\d+)(?:R|RS|RSW|5|R5|H|I|T|RT)?$")
_LINES = {
    "B31": 2,
    "B31R": 2,
    "B32": 3,
    "B32R": 3,
    "B33": 2,
    "T3D2": 2,
    "T3D3": 3,
    "T2D2": 2,
    "B21": 2,
    "B22": 3,
    "R2D2": 2,
}
_IGNORED = (
    "MASS", "ROTARYI", "SPRING", "DASHPOT", "CONN3D", "DCOUP3D", "GAPUNI", "JOINTC",
    "B23", "B31OS", "B32OS", "B31H", "B32H", "B33H", "PIPE", "ELBOW", "FRAME", "ITS", "SC6R", "SC8R",
)  # fmt: skip

#: keywords that affect the body but not its mesh
_CONNECTING = ("SURFACE", "TIE", "MPC", "EQUATION", "COUPLING", "RIGID BODY", "TRANSFORM")


@dataclass(frozen=True)
class _OfElements:
    """Nodes of a set of elements, as a member of a node set."""

    elements: str


#: entry of a set: numbers, the name of another set, or the nodes of a set of elements
_Entry = IntArray | str | _OfElements


@dataclass
class _Sets:
    """Sets under construction; names are compared in upper case and keep their first spelling."""

    where: str
    kind: str  #: "NSET" or "ELSET"
    spelling: dict[str, str] = field(default_factory=dict)
    entries: dict[str, list[_Entry]] = field(default_factory=dict)

    def add(self, name: str | None, entry: _Entry) -> None:
        if name:
            self.spelling.setdefault(name.upper(), name)
            self.entries.setdefault(name.upper(), []).append(entry)

    def resolve(self, nodes_of: Callable[[str], IntArray]) -> dict[str, IntArray]:
        """Return the numbers in each set, ascending, including those of sets that it refers to."""
        return {self.spelling[key]: self._members(key, nodes_of, ()) for key in self.entries}

    def _members(self, key: str, nodes_of: Callable[[str], IntArray], seen: tuple[str, ...]) -> IntArray:
        here = f"{self.where}: {self.kind} {self.spelling.get(key, key)!r}"
        if key in seen:
            raise MeshError(f"{here} contains itself")
        parts = [np.zeros(0, np.int64)]
        for entry in self.entries[key]:
            if isinstance(entry, np.ndarray):
                parts.append(entry)
            elif isinstance(entry, _OfElements):
                parts.append(nodes_of(entry.elements))
            elif entry in self.entries:
                parts.append(self._members(entry, nodes_of, (*seen, key)))
            else:
                raise MeshError(f"{here} names an unknown set {quoted(entry)}{nearest(entry, self.entries)}")
        return np.unique(np.concatenate(parts))


@dataclass
class _Content:
    """Nodes and elements as listed in the deck."""

    node_numbers: list[IntArray] = field(default_factory=list)
    coordinates: list[Array] = field(default_factory=list)
    #: type in the deck, kind of cell, and rows of element number and node numbers
    elements: list[tuple[str, str, IntArray]] = field(default_factory=list)
    ignored: dict[str, int] = field(default_factory=dict)  #: number of ignored elements of each type
    #: orientation node of each line, by line number, in addition to its end nodes
    orienting: dict[int, int] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class DeckMesh:
    """Nodes, elements and sets with the numbers of the deck; names of sets in upper case."""

    where: str
    node_numbers: IntArray  #: node numbers, (n_nodes,)
    coordinates: Array  #: node positions, (n_nodes, 3)
    #: type in the deck, kind of cell, and rows of element number and node numbers
    elements: tuple[tuple[str, str, IntArray], ...]
    node_sets: dict[str, IntArray]  #: numbers of the existing nodes in each set, ascending
    element_sets: dict[str, IntArray]  #: numbers of the elements in each set, ascending
    spelling: dict[str, str]  #: spelling of each set where it first appears, by "NSET name" and "ELSET name"
    ignored: dict[str, int]  #: number of ignored elements of each type
    notes: tuple[str, ...] = ()
    #: orientation node of each line, by line number, in addition to its end nodes
    orienting: Mapping[int, int] = field(default_factory=dict)
    instances: tuple[str, ...] = ()  #: instances whose numbers were shifted, the k-th by k `instance_step`
    instance_step: int = 0

    def rows_of(self, numbers: IntArray) -> IntArray:
        """Return the rows of these node numbers; -1 for a missing node."""
        order = np.argsort(self.node_numbers, kind="stable")
        return rows_of_numbers(self.node_numbers, order, numbers)


def read_abaqus(path: Path, data: bytes) -> RawMesh:
    """Return the nodes, elements and sets of a deck.

    Sets keep the spelling of their first appearance; names are compared without regard to case, as Abaqus does.
    Repeated sets are joined. A deck of one part with one instance that is not moved is read like a flat deck. Included
    files are inserted. Nodes of a set that do not exist are left out of it, as CalculiX does.

    Parameters
    ----------
    path
        File name, for messages.
    data
        Content of the file.

    Raises
    ------
    MeshError
        If the deck creates or moves nodes or elements in a way that is not supported, or is damaged.
    """
    where = f"mesh {path}"
    included: dict[str, str] = {}
    blocks = deck_blocks(where, data.decode("utf-8", "replace"), path, included)
    refuse_unread(where, blocks)
    blocks, notes = only_part(where, blocks)
    counts = Counter(block.keyword for block in blocks)
    notes += [f"{counts[keyword]} blocks *{keyword} were left out" for keyword in counts if keyword in _CONNECTING]
    mesh = deck_mesh(where, blocks)
    return replace(raw_mesh_of(mesh, [*notes, *naming_note(mesh)]), included=included)


def naming_note(mesh: DeckMesh) -> list[str]:
    """Return a note about lines and faces next to solids, which only name edges and faces in a mesh."""
    counts: dict[str, int] = {}
    if any(kind in SOLID_TYPES for _, kind, _ in mesh.elements):
        for name, kind, table in mesh.elements:
            if kind not in SOLID_TYPES:
                counts[name] = counts.get(name, 0) + len(table)
    listed = ", ".join(f"{count} {name}" for name, count in counts.items())
    return [f"elements that name edges and faces, and are no part of the body: {listed}"] if counts else []


def deck_mesh(where: str, blocks: list[DeckBlock]) -> DeckMesh:
    """Return nodes, elements and sets of the blocks of a deck.

    Raises
    ------
    MeshError
        If there are no nodes, numbers repeat, or a set refers to an unknown set.
    """
    node_sets, element_sets = _Sets(where, "NSET"), _Sets(where, "ELSET")
    content = _Content()
    notes = content.notes
    for block in blocks:
        _take(f"{where}, {block.place}: *{block.keyword}", block, content, node_sets, element_sets)
    if not content.coordinates:
        raise MeshError(f"{where}: expected nodes (*NODE), got none")
    numbers = np.concatenate(content.node_numbers)
    _require_unique(where, "node", numbers)
    tables = [table for _, _, table in content.elements]
    known = np.concatenate([table[:, 0] for table in tables]) if tables else np.zeros(0, np.int64)
    _require_unique(where, "element", known[known > 0])
    groups = element_sets.resolve(lambda name: np.zeros(0, np.int64))
    if not content.ignored:
        for name, members in groups.items():
            missing = members[~np.isin(members, known)]
            if missing.size:
                notes.append(
                    f"ELSET {name!r} names {missing.size} elements that are not in the deck, first {missing[0]}: left "
                    "out of it"
                )

    def nodes_of(name: str) -> IntArray:
        if name not in element_sets.spelling:
            raise MeshError(
                f"{where}: a node set names an unknown ELSET {quoted(name)}{nearest(name, element_sets.entries)}"
            )
        members = groups[element_sets.spelling[name]]
        return np.concatenate([table[np.isin(table[:, 0], members), 1:].ravel() for table in tables])

    sets = {}
    for name, members in node_sets.resolve(nodes_of).items():
        missing = members[~np.isin(members, numbers)]
        if missing.size:
            notes.append(
                f"NSET {name!r} names {missing.size} nodes that are not in the deck, first {missing[0]}: left out of it"
            )
        sets[name.upper()] = np.setdiff1d(members, missing)
    spelling = {f"NSET {key}": name for key, name in node_sets.spelling.items()}
    spelling |= {f"ELSET {key}": name for key, name in element_sets.spelling.items()}
    return DeckMesh(
        where,
        numbers,
        np.concatenate(content.coordinates),
        tuple(content.elements),
        sets,
        {name.upper(): members for name, members in groups.items()},
        spelling,
        content.ignored,
        tuple(notes),
        content.orienting,
    )


def raw_mesh_of(mesh: DeckMesh, notes: list[str]) -> RawMesh:
    """Return the mesh of a deck after checks, with the names of sets as in the deck."""
    groups = {mesh.spelling[f"ELSET {name}"]: members for name, members in mesh.element_sets.items()}
    order = np.argsort(mesh.node_numbers, kind="stable")
    raw_blocks = []
    for _, kind, table in mesh.elements:
        rows = {name: np.flatnonzero(np.isin(table[:, 0], members)) for name, members in groups.items()}
        rows = {name: found for name, found in rows.items() if found.size}
        raw_blocks.append(RawBlock(kind, rows_of_numbers(mesh.node_numbers, order, table[:, 1:]), rows, table[:, 0]))
    sets = {
        mesh.spelling[f"NSET {name}"]: rows_of_numbers(mesh.node_numbers, order, members)
        for name, members in mesh.node_sets.items()
    }
    notes = [*notes, *mesh.notes]
    notes += [
        f"{count} {name} elements were omitted: they are no part of the solid" for name, count in mesh.ignored.items()
    ]
    return RawMesh(
        mesh.coordinates,
        tuple(raw_blocks),
        sets,
        mesh.node_numbers,
        notes=tuple(notes),
        instances=mesh.instances,
        instance_step=mesh.instance_step,
    )


def _take(here: str, block: DeckBlock, content: _Content, node_sets: _Sets, element_sets: _Sets) -> None:
    """Add the content of one block to nodes, elements and sets."""
    if block.keyword == "NODE":
        numbers, points = _nodes(here, block)
        content.node_numbers.append(numbers)
        content.coordinates.append(points)
        node_sets.add(block.parameters.get("NSET"), numbers)
    elif block.keyword == "ELEMENT":
        if "TYPE" not in block.parameters:
            raise MeshError(f"{here}: expected TYPE=..., got none")
        name = block.parameters["TYPE"].upper()
        kind, n_nodes = _element_type(name)
        if kind == "ignored":
            content.ignored[name] = content.ignored.get(name, 0) + len(block.lines)
            first = [line.split(",")[0].strip() for line in block.lines]
            numbers = np.array([int(word) for word in first if word.isdigit()], dtype=np.int64)
            element_sets.add(block.parameters.get("ELSET"), numbers)
            return
        orienting = content.orienting if kind in ("line", "line3") else {}
        table = _elements(here, block, kind, n_nodes, content.notes, orienting)
        if kind == "line3":  # the middle node is between the ends; here, as in meshio, it comes last
            table = table[:, [0, 1, 3, 2]]
        content.elements.append((name, kind, table))
        element_sets.add(block.parameters.get("ELSET"), table[:, 0])
    elif block.keyword in ("NSET", "ELSET"):
        sets = node_sets if block.keyword == "NSET" else element_sets
        name = block.parameters.get(block.keyword, "")
        if not name:
            raise MeshError(f"{here}: expected {block.keyword}=name, got none")
        for entry in _set_entries(here, block):
            sets.add(name, entry)
        if block.keyword == "NSET" and "ELSET" in block.parameters:
            sets.add(name, _OfElements(block.parameters["ELSET"].upper()))


def _nodes(here: str, block: DeckBlock) -> tuple[IntArray, Array]:
    rows = [[word.strip() for word in line.rstrip(", ").split(",")] for line in block.lines]
    if not rows:
        return np.zeros(0, np.int64), np.zeros((0, 3))
    try:
        width = max(len(row) for row in rows)
        if width == min(len(row) for row in rows) and width >= 4:
            table = np.array([row[:4] for row in rows], dtype=float)
        else:  # omitted coordinates are zero
            table = np.array([[float(word or 0) for word in (*row, "0", "0", "0")[:4]] for row in rows])
    except ValueError as error:
        raise MeshError(f"{here}: expected number, x, y, z on each line below; {error}") from error
    return table[:, 0].astype(np.int64), table[:, 1:]


def _element_type(name: str) -> tuple[str, int]:
    """Return meshio name and number of nodes of an element type; ("ignored", 0) if it is not part of a solid."""
    upper = name.upper()
    if match := _SOLID.match(upper):
        n_nodes = int(match[1])
        return _SOLIDS.get(n_nodes, upper), n_nodes
    if match := _FACE.match(upper):
        digits = match[1] if match[1] in _FACES else match[1][0]
        if digits in _FACES:
            return _FACES[digits]
    if upper in _LINES:
        return {2: "line", 3: "line3"}[_LINES[upper]], _LINES[upper]
    if upper.startswith(_IGNORED):
        return "ignored", 0
    return upper, 0


def _elements(
    here: str, block: DeckBlock, kind: str, n_nodes: int, notes: list[str], orienting: dict[int, int]
) -> IntArray:
    """Return rows of number and nodes; numbers that follow an element on its line are dropped, as CalculiX does.

    One number more is kept in `orienting`: Abaqus orients beams by a further node.
    """
    if n_nodes == 0:  # unknown type: count the lines; the type is refused by name later
        return np.zeros((len(block.lines), 2), dtype=np.int64)
    try:
        lines = [np.array(line.rstrip(", ").split(","), dtype=np.int64) for line in block.lines]
    except ValueError as error:
        raise MeshError(f"{here}: expected element and node numbers below; {error}") from error
    rows, row, surplus = [], np.zeros(0, np.int64), 0
    for numbers in lines:
        row = np.concatenate([row, numbers]) if row.size else numbers
        while row.size > n_nodes:
            rows.append(row[: n_nodes + 1])
            row = row[n_nodes + 1 :]
            if 0 < row.size <= n_nodes:
                if row.size == 1:
                    orienting[int(rows[-1][0])] = int(row[0])
                surplus, row = surplus + 1, row[:0]
    if row.size:
        raise MeshError(
            f"{here}: {kind} elements have {n_nodes} nodes: expected a multiple of {n_nodes + 1} numbers "
            f"below, got {sum(len(numbers) for numbers in lines)}"
        )
    if surplus:
        notes.append(f"{surplus} {kind} elements have more numbers on their line than nodes: these were dropped")
    return np.array(rows, dtype=np.int64).reshape(-1, n_nodes + 1)


def _set_entries(here: str, block: DeckBlock) -> Iterator[_Entry]:
    """Yield arrays of numbers, and the upper-case names of other sets."""
    if "GENERATE" in block.parameters:
        for line in block.lines:
            limits = [int(word) for word in line.rstrip(", ").split(",")]
            if len(limits) not in (2, 3) or (len(limits) == 3 and limits[2] <= 0):
                raise MeshError(f"{here}, GENERATE: expected first, last, increment, got {line!r}")
            yield np.arange(limits[0], limits[1] + 1, limits[2] if len(limits) == 3 else 1)
        return
    words = block.tokens
    numeric = [word for word in words if word.lstrip("+").isdigit()]
    if numeric:
        yield np.array(numeric, dtype=np.int64)
    for word in words:
        if not word.lstrip("+").isdigit():
            yield word.strip('"').upper()


def _require_unique(where: str, what: str, numbers: IntArray) -> None:
    values, count = np.unique(numbers, return_counts=True)
    if (count > 1).any():
        raise MeshError(
            f"{where}: {(count > 1).sum()} {what} numbers are defined twice, first "
            f"{values[count > 1][0]}; keep one of each"
        )
