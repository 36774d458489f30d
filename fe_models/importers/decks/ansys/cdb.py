"""Whole decks of ANSYS as CDWRITE writes them (.cdb): blocks of nodes, elements and components, and the commands."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from fe_models.errors import MeshError
from fe_models.foundation.arrays import Array, IntArray
from fe_models.importers.decks.deck import Deck, DeckMaterial, Load, SolidSection, Support
from fe_models.importers.decks.ledger import Ledger
from fe_models.importers.raw_mesh import RawBlock, RawMesh

__all__ = ["read_cdb_deck"]

COLUMNS = 11  #: of an element before its nodes
#: element -> integration, mass, what is different
SOLIDS = {
    185: (
        "incompatible",
        "consistent",
        "stiffness by incompatible modes instead of the selective integration of ANSYS",
    ),
    186: ("reduced", "14-point", ""),
    187: ("reduced", "consistent", ""),
}
_DOFS = {"UX": 0, "UY": 1, "UZ": 2, "ROTX": 3, "ROTY": 4, "ROTZ": 5}
_FORCES = {"FX": 0, "FY": 1, "FZ": 2, "MX": 3, "MY": 4, "MZ": 5}
_BODY = ("CP", "CE", "CERIG", "RBE3", "TB", "TBDATA", "SECTYPE", "SECDATA", "RLBLOCK", "R", "EDGE", "SFE")
_SILENT = re.compile(r"(/|\*|N$|NUMOFF|ET$|KEYOP|DOF|MPTEMP|EXTOPT|SHPP|FINISH|TREF|BFUNIF|ALPHAD|BETAD|DMPRAT|CRPLIM)")


@dataclass
class _Draft:
    """What the file has said so far."""

    where: str
    ledger: Ledger
    nodes: list[tuple[int, list[float]]] = field(default_factory=list)
    elements: list[list[int]] = field(default_factory=list)  #: columns of each, then its nodes
    kinds: dict[int, int] = field(default_factory=dict)  #: number of the type -> element of ANSYS
    components: dict[str, tuple[str, IntArray]] = field(default_factory=dict)
    constants: dict[int, dict[str, float]] = field(default_factory=dict)  #: material -> label -> value
    held: dict[int, set[int]] = field(default_factory=dict)
    forces: dict[int, Array] = field(default_factory=dict)


def read_cdb_deck(path: Path, data: bytes) -> Deck:
    """Return what a .cdb file says: solids 185, 186, 187, materials, components, supports, forces.

    Raises
    ------
    MeshError
        If the file is damaged. What cannot be taken over is in the ledger.
    """
    where = f"deck {path}"
    draft = _Draft(where, Ledger(where))
    lines = enumerate(data.decode("latin-1").splitlines(), start=1)
    for number, raw in lines:
        line = raw.partition("!")[0].strip()
        if not line:
            continue
        words = [word.strip() for word in line.split(",")]
        name, here = words[0].upper(), f"{where}, line {number}: {words[0].upper()}"
        try:
            if name in ("NBLOCK", "EBLOCK", "CMBLOCK"):
                {"NBLOCK": _nodes, "EBLOCK": _elements, "CMBLOCK": _component}[name](here, words, lines, draft)
            else:
                _command(name, words, draft, number)
        except (ValueError, IndexError, StopIteration) as error:
            if isinstance(error, MeshError):
                raise
            raise MeshError(f"{here}: cannot be understood ({error or 'the file ends'}): {line[:60]!r}") from error
    return _deck(path, draft)


def _format(here: str, line: str) -> tuple[int, int, int]:
    """Return number and width of the integers, and the width of the reals, of a line such as (3i9,6e21.13e3)."""
    match = re.fullmatch(r"\((\d+)i(\d+)(?:,\d+[eg](\d+)\.\d+(?:e\d+)?)?\)", line.strip().lower())
    if not match:
        raise MeshError(f"{here}: expected a format such as (3i9,6e21.13e3), got {line.strip()[:40]!r}")
    return int(match[1]), int(match[2]), int(match[3] or 0)


def _nodes(here: str, words: list[str], lines: Iterator[tuple[int, str]], draft: _Draft) -> None:
    """Numbers, then up to three coordinates and three angles; zeros at the end are left out."""
    n, width, real = _format(here, next(lines)[1])
    for _, line in lines:
        head = line[: n * width]
        if not head.strip() or not head[:width].strip().lstrip("-").isdigit() or head[:width].strip() == "-1":
            return
        values = [line[k : k + real] for k in range(n * width, len(line.rstrip()), real)]
        numbers = [float(value) if value.strip() else 0.0 for value in values]
        if any(numbers[3:]):
            draft.ledger.note("NBLOCK", "axes of nodes of their own: supports and forces are taken along basic axes")
        draft.nodes.append((int(head[:width]), [*numbers[:3], 0.0, 0.0, 0.0][:3]))


def _elements(here: str, words: list[str], lines: Iterator[tuple[int, str]], draft: _Draft) -> None:
    """Eleven columns and eight nodes on a line, further nodes on the next."""
    if words[1] != "19":
        raise MeshError(f"{here}: expected 19 columns (EBLOCK,19,SOLID), got {words[1]}")
    _, width, _ = _format(here, next(lines)[1])
    for _, line in lines:
        row = [int(line[k : k + width]) for k in range(0, len(line.rstrip()), width)]
        if row[0] == -1:
            return
        n = row[8]
        if not 0 < n <= 20 or len(row) < COLUMNS:
            raise MeshError(f"{here}: expected 11 columns and 1 to 20 nodes, got {line.strip()[:60]!r}")
        while len(row) < COLUMNS + n:
            _, more = next(lines)
            row += [int(more[k : k + width]) for k in range(0, len(more.rstrip()), width)]
        draft.elements.append(row[: COLUMNS + n])
    raise MeshError(f"{here}: the block does not end (-1); the file is truncated")


def _component(here: str, words: list[str], lines: Iterator[tuple[int, str]], draft: _Draft) -> None:
    """Numbers, a negative one the end of a range."""
    per_line, width, _ = _format(here, next(lines)[1])
    count = int(words[3])
    values: list[int] = []
    while len(values) < count:
        _, line = next(lines)
        values += [int(line[k : k + width]) for k in range(0, len(line.rstrip()), width)][:per_line]
    members: list[int] = []
    for value in values:
        if value < 0 and (not members or -value - members[-1] > 10_000_000):
            raise MeshError(f"{here} {words[1]}: {value} ends no range")
        members += range(members[-1] + 1, -value + 1) if value < 0 else [value]
    draft.components[words[1]] = (words[2].upper(), np.array(members, dtype=np.int64))


def _command(name: str, words: list[str], draft: _Draft, line: int) -> None:
    """Take one command, or count it."""
    if name == "ET" and len(words) > 2 and words[1].isdigit():
        draft.kinds[int(words[1])] = int(re.sub(r"\D", "", words[2]))
    elif name == "MPDATA" and len(words) > 6:  # MPDATA,R5.0, 1,EX  ,       1, 1, value
        draft.constants.setdefault(int(words[4]), {})[words[3].upper()] = float(words[6])
    elif name == "MP" and len(words) > 3:
        draft.constants.setdefault(int(words[2]), {})[words[1].upper()] = float(words[3])
    elif name == "D" and words[1].isdigit():
        labels = list(_DOFS) if words[2].upper() == "ALL" else [words[2].upper()]
        draft.held.setdefault(int(words[1]), set()).update(_DOFS[label] for label in labels if label in _DOFS)
    elif name == "F" and words[1].isdigit() and words[2].upper() in _FORCES:
        draft.forces.setdefault(int(words[1]), np.zeros(6))[_FORCES[words[2].upper()]] += float(words[3])
    elif name in _BODY:
        draft.ledger.refuse(
            name, "couplings, tables of materials, sections and real constants are not known here", line=line
        )
    elif not _SILENT.match(name) and not name.startswith(("_", "(")) and name.isalnum():
        draft.ledger.note(name, "belongs to the analysis, not to the body", line=line)


def _deck(path: Path, draft: _Draft) -> Deck:
    if not draft.nodes or not draft.elements:
        what = "nodes (NBLOCK)" if not draft.nodes else "elements (EBLOCK)"
        raise MeshError(f"{draft.where}: expected {what}, got none; write the model with CDWRITE,DB or ALL")
    numbers = np.array([number for number, _ in draft.nodes], dtype=np.int64)
    order = np.argsort(numbers, kind="stable")
    if (np.diff(numbers[order]) == 0).any():
        raise MeshError(f"{draft.where}: nodes are defined twice; keep one of each")
    sections: dict[str, SolidSection] = {}
    cells: dict[tuple[str, str], tuple[list[int], list[list[int]]]] = {}
    for row in draft.elements:
        kind = draft.kinds.get(row[1], 0)
        if kind not in SOLIDS:
            draft.ledger.refuse(f"element {kind or 'of type ' + str(row[1])}", "this element is not known here")
            continue
        shape, nodes = _shape(draft.where, kind, row)
        group = f"mat_{row[0]}_solid{kind}"
        integration, mass, different = SOLIDS[kind]
        if different:
            draft.ledger.note(f"SOLID{kind}", different)
        sections[group] = SolidSection(group, str(row[0]), integration, mass)
        listed = cells.setdefault((shape, group), ([], []))
        listed[0].append(row[10])
        listed[1].append(nodes)
    blocks = []
    for (shape, group), (own, rows) in cells.items():
        table = _rows(numbers, order, np.array(rows, dtype=np.int64))
        own_numbers = np.array(own, dtype=np.int64)
        groups = {group: np.arange(len(own))}
        for name, (what, members) in draft.components.items():
            inside = np.flatnonzero(np.isin(own_numbers, members))
            if what.startswith("ELEM") and inside.size:
                groups[name] = inside
        blocks.append(RawBlock(shape, table, groups, own_numbers))
    sets = {
        name: _rows(numbers, order, members)
        for name, (what, members) in draft.components.items()
        if what.startswith("NODE")
    }
    sets = {name: rows[rows >= 0] for name, rows in sets.items()}
    used = np.unique(np.concatenate([np.zeros(0, np.int64), *(block.nodes.ravel() for block in blocks)]))
    mesh = RawMesh(np.array([x for _, x in draft.nodes]), tuple(blocks), sets, numbers)
    supports, sets = _supports(draft, numbers, order, used, dict(sets))
    loads = []
    if draft.forces:
        given = {}
        for number, force in draft.forces.items():
            sets[f"node_{number}"] = _rows(numbers, order, np.array([number]))
            given[f"node_{number}"] = tuple(force.tolist())
        loads.append(Load("forces", forces=given))
    materials = {str(number): _material(draft, number, labels) for number, labels in draft.constants.items()}
    return Deck(
        path,
        "ansys",
        replace(mesh, node_sets=sets),
        draft.ledger,
        materials,
        solids=tuple(sections.values()),
        supports=tuple(supports),
        loads=tuple(loads),
    )


def _material(draft: _Draft, number: int, labels: dict[str, float]) -> DeckMaterial:
    young = labels.get("EX")
    if any(labels.get(label, young) != young for label in ("EY", "EZ")):
        draft.ledger.refuse("MPDATA, EY", f"material {number} is orthotropic: only isotropic materials")
    return DeckMaterial(str(number), young, labels.get("PRXY", labels.get("NUXY", 0.3)), labels.get("DENS"))


def _shape(where: str, kind: int, row: list[int]) -> tuple[str, list[int]]:
    """Return the cell of an element and its nodes; equal nodes of a brick make it another one."""
    n = row[COLUMNS:]
    if kind == 187 and len(n) >= 10:
        return "tetra10", n[:10]
    if len(n) < 8:
        raise MeshError(f"{where}: element {row[10]} (SOLID{kind}) has {len(n)} nodes; expected 8, 10 or 20")
    is_quadratic = len(n) == 20 and kind == 186
    if len(set(n[4:8])) == 1:
        if n[2] != n[3]:
            return ("pyramid13", [*n[:5], *n[8:12], *n[16:20]]) if is_quadratic else ("pyramid", n[:5])
        return ("tetra10", [*n[:3], n[4], n[8], n[9], n[11], *n[16:19]]) if is_quadratic else ("tetra", [*n[:3], n[4]])
    if n[2] == n[3] and n[6] == n[7]:
        corners = [*n[:3], *n[4:7]]
        middles = [n[8], n[9], n[11], n[12], n[13], n[15], *n[16:19]]
        return ("wedge15", [*corners, *middles]) if is_quadratic else ("wedge", corners)
    return ("hexahedron20", n[:20]) if is_quadratic else ("hexahedron", n[:8])


def _rows(numbers: IntArray, order: IntArray, wanted: IntArray) -> IntArray:
    """Return the rows of node numbers, -1 where there is none."""
    ordered = numbers[order]
    at = np.minimum(np.searchsorted(ordered, wanted), len(ordered) - 1)
    return np.where(ordered[at] == wanted, order[at], -1)


def _supports(
    draft: _Draft, numbers: IntArray, order: IntArray, used: IntArray, sets: dict[str, IntArray]
) -> tuple[list[Support], dict[str, IntArray]]:
    """Return one support for each set of components that nodes are held in, and the groups with theirs."""
    by: dict[tuple[int, ...], list[int]] = {}
    for number, components in draft.held.items():
        row = int(_rows(numbers, order, np.array([number]))[0])
        if row in used and components:
            by.setdefault(tuple(sorted(components)), []).append(row)
    supports = []
    for same, rows in by.items():
        name = f"support_{''.join(str(c + 1) for c in same)}"
        sets[name] = np.array(sorted(rows), dtype=np.int64)
        supports.append(Support(name, name, same))
    return supports, sets
