"""The mesh of a Nastran bulk data deck: grid points, elements, and property numbers as groups.

meshio is not used: it ignores coordinate systems (CP) and INCLUDE, skips elements in large field format and cards in
lower case, and assigns property numbers to the wrong elements if some have none. Cards are read as for whole decks
(`fe_models.files.nastran.bulk_data`).
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from fe_models.errors import MeshError
from fe_models.files.nastran.bulk_data.cards import Card, read_cards
from fe_models.files.nastran.bulk_data.coordinate_systems import SYSTEM_CARDS, read_grid_points
from fe_models.files.nastran.bulk_data.includes import bulk_parts, bulk_text
from fe_models.foundation.arrays import Array, IntArray
from fe_models.meshes.cells.raw_mesh import RawBlock, RawMesh
from fe_models.meshes.numbering import rows_of_numbers

__all__ = ["ELEMENT_TYPES", "element_of", "mesh_of_elements", "read_nastran"]

_HEXA20 = [*range(12), *range(16, 20), *range(12, 16)]  # Nastran numbers the upright edges before those of the top
_PENTA15 = [*range(9), *range(12, 15), *range(9, 12)]
ELEMENT_TYPES: dict[str, dict[int, tuple[str, list[int] | None]]] = {
    "CTETRA": {4: ("tetra", None), 10: ("tetra10", None)},
    "CHEXA": {8: ("hexahedron", None), 20: ("hexahedron20", _HEXA20)},
    "CPENTA": {6: ("wedge", None), 15: ("wedge15", _PENTA15)},
    "CPYRA": {5: ("pyramid", None), 13: ("pyramid13", None)},
    "CPYRAM": {5: ("pyramid", None), 13: ("pyramid13", None)},
    "CTRIA3": {3: ("triangle", None)},
    "CTRIAR": {3: ("triangle", None)},
    "CTRIA6": {3: ("triangle", None), 6: ("triangle6", None)},
    "CQUAD4": {4: ("quad", None)},
    "CQUADR": {4: ("quad", None)},
    "CQUAD8": {4: ("quad", None), 8: ("quad8", None)},
    "CROD": {2: ("line", None)},
    "CBAR": {2: ("line", None)},
    "CBEAM": {2: ("line", None)},
}  # card -> number of nodes -> meshio name and order
_SOLID_CARDS = ("CTETRA", "CHEXA", "CPENTA", "CPYRA", "CPYRAM")
_SOLID_PREFIXES = ("CTET", "CHEX", "CPEN", "CPYR")
_NOTED = ("RBE", "RBAR", "RROD", "MPC", "CON", "CEL", "CBU", "CGA", "CMA", "CDA", "CTR", "CQU", "CSH", "CWE", "CTU")

PLACING = ("GRID", "GRDSET", *SYSTEM_CARDS)
BEGIN, END = re.compile(r"(?im)^[ \t]*BEGIN"), re.compile(r"(?im)^[ \t]*ENDDATA")


def read_nastran(path: Path, data: bytes) -> RawMesh:
    """Return grid points and elements; elements with property n form the group `pid_n`.

    Cards, includes and coordinate systems are read as for whole decks. A deck may start with its bulk data.
    Displacement coordinate systems (CD) do not move nodes and are not read.

    Parameters
    ----------
    path
        File name, for messages and as base of the paths of included files.
    data
        Content of the file.

    Raises
    ------
    MeshError
        If a coordinate system or an included file is missing, cards are not in sequence, or the deck is damaged.
    """
    where = f"mesh {path}"
    included: dict[str, str] = {}
    parts = bulk_parts(where, bulk_text(where, path, data.decode("utf-8", "replace"), included))
    if len(parts) > 1:
        why = "a deck of several superelements; expected one body"
        raise MeshError(f"{where}: BEGIN SUPER = {max(parts)}: {why}; read it as a whole deck ([body] deck)")
    text = parts[0]
    placing: list[Card] = []  # cards that define positions of grid points
    elements: list[Element] = []
    noted: dict[str, int] = {}
    for card in read_cards(where, text):
        if card.name in PLACING:
            placing.append(card)
        elif card.name in ELEMENT_TYPES:
            pid = card.text(2)
            elements.append(element_of(card, f"pid_{pid}" if pid else ""))
        elif card.name.startswith(_SOLID_PREFIXES):
            raise MeshError(f"{card.where}: unknown solid element; expected {', '.join(_SOLID_CARDS)}")
        elif card.name.startswith(_NOTED):
            noted[card.name] = noted.get(card.name, 0) + 1
    points = read_grid_points(placing, only_positions=True).positions
    if not points:
        raise MeshError(f"{where}: expected grid points (GRID), got none; is this a Nastran bulk data file?")
    notes = [f"{times} {name} cards were left out" for name, times in noted.items()]
    if BEGIN.search(text) and not END.search(text):
        notes.append("BEGIN BULK without ENDDATA at the end: is the file complete?")
    mesh = mesh_of_elements(where, points, elements)
    _require_unique(where, mesh.blocks)
    return replace(mesh, notes=tuple(notes), included=included)


class Element(NamedTuple):
    """One element of a deck."""

    card: str
    number: int
    group: str  #: group of its cell; empty: none
    nodes: list[str]  #: numbers of its grid points


def element_of(card: Card, group: str, ends: Mapping[int, str] = MappingProxyType({})) -> Element:
    """Return the element of a card.

    Parameters
    ----------
    ends
        Grid points that replace those of the card, by their place in it, from 0.

    Raises
    ------
    MeshError
        If some of its middle nodes are left out.
    """
    widest = max(ELEMENT_TYPES[card.name])
    given = [*card.fields[2 : 2 + widest], *[""] * (2 + widest - len(card.fields))]
    for k, node in ends.items():
        given[k] = node
    return Element(card.name, card.integer(1), group, nodes_of(card.where, card.name, given))


def mesh_of_elements(where: str, points: Mapping[int, Array], elements: Iterable[Element]) -> RawMesh:
    """Return grid points and elements as a mesh, one block for the elements of one card, number of nodes and group.

    Raises
    ------
    MeshError
        If an element names a grid point that is not defined.
    """
    numbers = np.array(list(points), dtype=np.int64)
    order = np.argsort(numbers, kind="stable")
    cells: dict[tuple[str, int, str], tuple[list[int], list[list[str]]]] = {}
    for card, number, group, nodes in elements:
        own_numbers, rows = cells.setdefault((card, len(nodes), group), ([], []))
        own_numbers.append(number)
        rows.append(nodes)
    blocks = []
    for (card, count, group), (own_numbers, rows) in cells.items():
        kind, local = ELEMENT_TYPES[card][count]
        try:
            wanted = np.array(rows, dtype=np.int64)
        except ValueError as error:
            raise MeshError(f"{where}: {card}: expected grid numbers; {error}") from error
        table = rows_of_numbers(numbers, order, wanted)
        missing = np.argwhere(table < 0)
        if len(missing):
            row, column = missing[0]
            raise MeshError(
                f"{where}: {card} {own_numbers[row]} names grid point {wanted[row, column]}, which is not defined"
            )
        table = table if local is None else table[:, local]
        groups = {group: np.arange(len(rows))} if group else {}
        blocks.append(RawBlock(kind, table, groups, np.array(own_numbers, dtype=np.int64)))
    return RawMesh(np.array(list(points.values())), tuple(blocks), node_numbers=numbers)


def nodes_of(here: str, card: str, given: list[str]) -> list[str]:
    """Return the numbers of the nodes of an element."""
    counts = sorted(ELEMENT_TYPES[card])
    filled = [bool(word) for word in given[: counts[-1]]]
    for count in reversed(counts):
        if all(filled[:count]) and not any(filled[count:]):
            return given[:count]
    raise MeshError(
        f"{here}: expected {' or '.join(str(c) for c in counts)} nodes, got {sum(filled)}; elements with "
        f"some middle nodes left out are not supported"
    )


def _require_unique(where: str, blocks: Iterable[RawBlock]) -> None:
    parts = [block.numbers for block in blocks if block.numbers is not None]
    numbers: IntArray = np.sort(np.concatenate(parts)) if parts else np.zeros(0, np.int64)
    twice = numbers[:-1][np.diff(numbers) == 0]
    if twice.size:
        raise MeshError(f"{where}: {twice.size} element numbers are defined twice, first {twice[0]}; keep one of each")
