"""The mesh of a Nastran bulk data deck: grid points, elements, and property numbers as groups.

meshio is not used: it ignores coordinate systems (CP) and INCLUDE, skips elements in large field format and cards in
lower case, and assigns property numbers to the wrong elements if some have none. Cards are read as for whole decks
(`fe_models.files.bulk_data`).
"""

import re
from pathlib import Path

import numpy as np

from fe_models.errors import MeshError
from fe_models.files.bulk_data.cards import Card, read_cards
from fe_models.files.bulk_data.coordinate_systems import SYSTEM_CARDS, read_grid_points
from fe_models.files.bulk_data.includes import bulk_parts, bulk_text
from fe_models.foundation.arrays import IntArray
from fe_models.meshes.cells.raw_mesh import RawBlock, RawMesh

__all__ = ["ELEMENT_TYPES", "nodes_of", "read_nastran"]

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

    Cards, includes and coordinate systems are read as for whole decks (`fe_models.files.bulk_data`). A deck may start
    with its bulk data. Displacement coordinate systems (CD) do not move nodes and are not read.

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
    cells: dict[tuple[str, int, str], tuple[list[int], list[list[str]]]] = {}  # card, nodes, property -> elements
    noted: dict[str, int] = {}
    for card in read_cards(where, text):
        if card.name in PLACING:
            placing.append(card)
        elif card.name in ELEMENT_TYPES:
            widest = max(ELEMENT_TYPES[card.name])
            given = [*card.fields[2 : 2 + widest], *[""] * (2 + widest - len(card.fields))]
            count, nodes = nodes_of(card.where, card.name, given)
            numbers, rows = cells.setdefault((card.name, count, card.text(2)), ([], []))
            numbers.append(card.integer(1))
            rows.append(nodes)
        elif card.name.startswith(_SOLID_PREFIXES):
            raise MeshError(f"{card.where}: unknown solid element; expected {', '.join(_SOLID_CARDS)}")
        elif card.name.startswith(_NOTED):
            noted[card.name] = noted.get(card.name, 0) + 1
    points = read_grid_points(placing, only_positions=True).positions
    if not points:
        raise MeshError(f"{where}: expected grid points (GRID), got none; is this a Nastran bulk data file?")
    listed = dict.fromkeys(card.integer(1) for card in placing if card.name == "GRID")
    numbers_of_nodes = np.array(list(listed), dtype=np.int64)
    order = np.argsort(numbers_of_nodes, kind="stable")
    ordered = numbers_of_nodes[order]
    blocks = []
    for (card_name, count, pid), (element_numbers, rows) in cells.items():
        kind, local = ELEMENT_TYPES[card_name][count]
        try:
            wanted = np.array(rows, dtype=np.int64)
        except ValueError as error:
            raise MeshError(f"{where}: {card_name}: expected grid numbers; {error}") from error
        at = np.minimum(np.searchsorted(ordered, wanted), len(ordered) - 1)
        nodes_of_cells: IntArray = np.where(ordered[at] == wanted, order[at], -1)
        if local is not None:
            nodes_of_cells = nodes_of_cells[:, local]
        group = {f"pid_{pid}": np.arange(len(rows))} if pid else {}
        blocks.append(RawBlock(kind, nodes_of_cells, group, np.array(element_numbers, dtype=np.int64)))
    _require_unique(where, blocks)
    notes = [f"{times} {name} cards were left out" for name, times in noted.items()]
    if BEGIN.search(text) and not END.search(text):
        notes.append("BEGIN BULK without ENDDATA at the end: is the file complete?")
    positions = np.array([points[number] for number in listed])
    return RawMesh(positions, tuple(blocks), node_numbers=numbers_of_nodes, notes=tuple(notes), included=included)


def nodes_of(here: str, card: str, given: list[str]) -> tuple[int, list[str]]:
    """Return the number of nodes of an element and their numbers."""
    counts = sorted(ELEMENT_TYPES[card])
    filled = [bool(word) for word in given[: counts[-1]]]
    for count in reversed(counts):
        if all(filled[:count]) and not any(filled[count:]):
            return count, given[:count]
    raise MeshError(
        f"{here}: expected {' or '.join(str(c) for c in counts)} nodes, got {sum(filled)}; elements with "
        f"some middle nodes left out are not supported"
    )


def _require_unique(where: str, blocks: list[RawBlock]) -> None:
    parts = [block.numbers for block in blocks if block.numbers is not None]
    numbers: IntArray = np.sort(np.concatenate(parts)) if parts else np.zeros(0, np.int64)
    twice = numbers[:-1][np.diff(numbers) == 0]
    if twice.size:
        raise MeshError(f"{where}: {twice.size} element numbers are defined twice, first {twice[0]}; keep one of each")
