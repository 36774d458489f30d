"""The mesh of a Nastran bulk data deck: grid points, elements, and property numbers as groups.

Read here and not by meshio, which ignores coordinate systems (CP) and INCLUDE, skips elements in large field format
and cards in lower case, and assigns property numbers to the wrong elements where some have none. Cards that would
change where the nodes are, and are not understood here, are refused.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from fe_models.errors import MeshError
from fe_models.foundation.arrays import IntArray
from fe_models.importers.raw_mesh import RawBlock, RawMesh

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
    "CTRIA6": {6: ("triangle6", None)},
    "CQUAD4": {4: ("quad", None)},
    "CQUADR": {4: ("quad", None)},
    "CQUAD8": {8: ("quad8", None)},
    "CROD": {2: ("line", None)},
    "CBAR": {2: ("line", None)},
    "CBEAM": {2: ("line", None)},
}  # card -> number of nodes -> meshio name and order
_SOLID_CARDS = ("CTETRA", "CHEXA", "CPENTA", "CPYRA", "CPYRAM")
_SOLID_PREFIXES = ("CTET", "CHEX", "CPEN", "CPYR")
_NOTED = ("RBE", "RBAR", "RROD", "MPC", "CON", "CEL", "CBU", "CGA", "CMA", "CDA", "CTR", "CQU", "CSH", "CWE", "CTU")


def read_nastran(path: Path, data: bytes) -> RawMesh:
    """Return grid points and elements; the elements of property n are group `pid_n`, those without one in none.

    A deck may start with its bulk data. Displacement coordinate systems (CD) do not move nodes and are not read.

    Parameters
    ----------
    path
        File name, for messages.
    data
        Content of the file.

    Raises
    ------
    MeshError
        If grid points are given in another coordinate system, cards are included from elsewhere, replicated, or not
        in sequence, or the deck is damaged.
    """
    where = f"mesh {path}"
    text = data.decode("utf-8", "replace")
    grid_numbers: list[int] = []
    coordinates: list[tuple[float, float, float]] = []
    cells: dict[tuple[str, int, str], tuple[list[int], list[list[str]]]] = {}  # card, nodes, property -> elements
    noted: dict[str, int] = {}
    default_cp = ""
    without_cp: list[int] = []
    for line, card, fields in _cards(where, text):
        here = f"{where}, line {line}: {card}"
        if card == "GRID":
            number = _integer(here, fields, 1)
            cp = fields[2] if len(fields) > 2 else ""
            if cp not in ("", "0"):
                raise MeshError(
                    f"{here} {number}: position in coordinate system {cp} (CP), which is not read; "
                    f"expected basic coordinates. Export the deck with all grid points in the basic system"
                )
            if not cp:
                without_cp.append(number)
            grid_numbers.append(number)
            coordinates.append((_real(here, fields, 3), _real(here, fields, 4), _real(here, fields, 5)))
        elif card in ELEMENT_TYPES:
            n_fields = 2 + max(ELEMENT_TYPES[card])
            given = [*fields[3 : n_fields + 1], *[""] * (n_fields + 1 - len(fields))]
            count, nodes = nodes_of(here, card, given)
            number = _integer(here, fields, 1)
            numbers, rows = cells.setdefault((card, count, fields[2]), ([], []))
            numbers.append(number)
            rows.append(nodes)
        elif card == "GRDSET":
            default_cp = fields[2] if len(fields) > 2 else ""
        elif card.startswith(_SOLID_PREFIXES):
            raise MeshError(f"{here}: unknown solid element; expected {', '.join(_SOLID_CARDS)}")
        elif card.startswith(_NOTED):
            noted[card] = noted.get(card, 0) + 1
    if default_cp not in ("", "0") and without_cp:
        raise MeshError(
            f"{where}: GRDSET puts {len(without_cp)} grid points into coordinate system {default_cp}, "
            f"which is not read; expected basic coordinates"
        )
    if not grid_numbers:
        raise MeshError(f"{where}: expected grid points (GRID), got none; is this a Nastran bulk data file?")
    numbers_of_nodes = np.array(grid_numbers, dtype=np.int64)
    order = np.argsort(numbers_of_nodes, kind="stable")
    ordered = numbers_of_nodes[order]
    if (np.diff(ordered) == 0).any():
        twice = ordered[:-1][np.diff(ordered) == 0]
        raise MeshError(f"{where}: {twice.size} grid points are defined twice, first {twice[0]}; keep one of each")
    blocks = []
    for (card, count, pid), (element_numbers, rows) in cells.items():
        kind, local = ELEMENT_TYPES[card][count]
        try:
            wanted = np.array(rows, dtype=np.int64)
        except ValueError as error:
            raise MeshError(f"{where}: {card}: expected grid numbers; {error}") from error
        at = np.minimum(np.searchsorted(ordered, wanted), len(ordered) - 1)
        nodes_of_cells: IntArray = np.where(ordered[at] == wanted, order[at], -1)
        if local is not None:
            nodes_of_cells = nodes_of_cells[:, local]
        group = {f"pid_{pid}": np.arange(len(rows))} if pid else {}
        blocks.append(RawBlock(kind, nodes_of_cells, group, np.array(element_numbers, dtype=np.int64)))
    _require_unique(where, blocks)
    notes = tuple(f"{times} {card} cards were left out" for card, times in noted.items())
    return RawMesh(np.array(coordinates), tuple(blocks), node_numbers=numbers_of_nodes, notes=notes)


def _cards(where: str, text: str) -> Iterator[tuple[int, str, list[str]]]:
    """Yield line number, name without '*', and the fields of each bulk data card, continuations joined."""
    lines = text.splitlines()
    begins = [k for k, line in enumerate(lines) if line.lstrip().upper().startswith("BEGIN")]
    for k, line in enumerate(lines):
        if line.lstrip().upper().startswith("INCLUDE"):
            raise MeshError(f"{where}, line {k + 1}: INCLUDE is not read; put the included text into this file")
    if len(begins) > 1:
        raise MeshError(f"{where}, line {begins[1] + 1}: a second BEGIN (superelement) is not read; expected one body")
    start = begins[0] + 1 if begins else 0
    number, mark, has_end = 0, "", False
    fields: list[str] = []
    for k, raw in enumerate(lines[start:], start=start + 1):
        line = raw.partition("$")[0].rstrip()
        if not line:
            continue
        if line[:7].upper() == "ENDDATA":
            has_end = True
            break
        new, own_mark, next_mark = _fields(line)
        if line[0] in "=":
            raise MeshError(f"{where}, line {k}: replicated cards (=) are not read; write them out")
        if line[0] in "+*, " and not new[0].strip("+*"):
            new[0] = ""
        if line[0] in "+*" or not new[0]:
            if not fields:
                raise MeshError(f"{where}, line {k}: a continuation without a card before it: {line[:40]!r}")
            if own_mark.strip("+*") and mark.strip("+*") and own_mark.strip("+*") != mark.strip("+*"):
                raise MeshError(
                    f"{where}, line {k}: continuation {own_mark!r} does not follow its card, which asks "
                    f"for {mark!r}; write the continuations in sequence"
                )
            fields += new[1:]
        else:
            if fields:
                yield number, fields[0].upper().rstrip("*"), fields
            number, fields = k, new
        mark = next_mark
    if fields:
        yield number, fields[0].upper().rstrip("*"), fields
    if begins and not has_end:
        raise MeshError(f"{where}: expected ENDDATA at the end, got none; the file is truncated")


def _fields(line: str) -> tuple[list[str], str, str]:
    """Return name and data fields of a line (9 small or 5 large ones), its own and the next continuation mark."""
    if "," in line:
        parts = [part.strip() for part in line.split(",")]
        is_large = parts[0].endswith("*") or parts[0].startswith("*")
        width = 5 if is_large else 9
        data = [*parts[:width], *[""] * (width - len(parts))]
        return data, parts[0], parts[width] if len(parts) > width else ""
    line = line.expandtabs(8)
    first = line[:8].strip()
    is_large = "*" in first
    width, count = (16, 4) if is_large else (8, 8)
    data = [line[8 + width * k : 8 + width * (k + 1)].strip() for k in range(count)]
    return [first, *data], first, line[72:80].strip()


def nodes_of(here: str, card: str, given: list[str]) -> tuple[int, list[str]]:
    """Return the number of nodes of an element and their numbers."""
    counts = sorted(ELEMENT_TYPES[card])
    filled = [bool(word) for word in given[: counts[-1]]]
    for count in reversed(counts):
        if all(filled[:count]) and (card not in _SOLID_CARDS or not any(filled[count:])):
            return count, given[:count]
    raise MeshError(
        f"{here}: expected {' or '.join(str(c) for c in counts)} nodes, got {sum(filled)}; elements with "
        f"some middle nodes left out are not supported"
    )


def _integer(here: str, fields: list[str], place: int) -> int:
    try:
        return int(fields[place])
    except (ValueError, IndexError) as error:
        got = fields[place] if place < len(fields) else ""
        raise MeshError(f"{here}: field {place + 1}: expected a number, got {got!r}") from error


def _real(here: str, fields: list[str], place: int) -> float:
    """Return a real; Nastran may leave out the E of the exponent (1.5-3) and a zero (blank)."""
    word = fields[place] if place < len(fields) else ""
    if not word:
        return 0.0
    try:
        return float(word)
    except ValueError:
        try:
            return float(
                word[0] + word[1:].upper().replace("D", "").replace("E", "").replace("+", "E+").replace("-", "E-")
            )
        except ValueError as error:
            raise MeshError(f"{here}: field {place + 1}: expected a coordinate, got {word!r}") from error


def _require_unique(where: str, blocks: list[RawBlock]) -> None:
    parts = [block.numbers for block in blocks if block.numbers is not None]
    numbers: IntArray = np.sort(np.concatenate(parts)) if parts else np.zeros(0, np.int64)
    twice = numbers[:-1][np.diff(numbers) == 0]
    if twice.size:
        raise MeshError(f"{where}: {twice.size} element numbers are defined twice, first {twice[0]}; keep one of each")
