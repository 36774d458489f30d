"""Whole decks of ANSYS, as written by CDWRITE (.cdb): blocks of nodes, elements and components, and commands."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from fe_models.errors import MeshError
from fe_models.files.ansys.command_fields import COMMANDS, HARMLESS, check_columns, check_command, says_something
from fe_models.files.decks.deck import Deck, DeckLayer, DeckMaterial, Load, ShellSection, SolidSection, Support
from fe_models.files.decks.ledger import Ledger
from fe_models.foundation.arrays import Array, IntArray
from fe_models.meshes.cells.raw_mesh import RawBlock, RawMesh
from fe_models.meshes.numbering import rows_of_numbers

__all__ = ["read_cdb_deck"]

COLUMNS = 11  #: number of columns of an element before its nodes
#: element -> integration, mass, difference from ANSYS
SOLIDS = {
    185: (
        "incompatible",
        "consistent",
        "stiffness by incompatible modes instead of the selective integration of ANSYS",
    ),
    186: ("reduced", "14-point", ""),
    187: ("reduced", "consistent", ""),
}
MESH_ONLY = 200  #: number of the ANSYS element type that is only a mesh
#: number of nodes, and kind of cell, for each shell element; equal third and fourth corners: a triangle
SHELLS = {181: (4, "quad"), 281: (8, "quad8")}
_DOFS = {"UX": 0, "UY": 1, "UZ": 2, "ROTX": 3, "ROTY": 4, "ROTZ": 5}
_FORCES = {"FX": 0, "FY": 1, "FZ": 2, "MX": 3, "MY": 4, "MZ": 5}
#: element -> number of KEYOPT -> its values, and the integration that each selects; "": the default
KEYOPTS: dict[int, dict[int, dict[int, str]]] = {
    185: {2: {0: "", 2: "", 3: ""}},
    186: {2: {0: "reduced", 1: "full"}},
    187: {},
    181: {1: {0: ""}, 3: {0: "", 2: ""}},
    281: {1: {0: ""}},
}
#: KEYOPTs for output, layers and wave-absorbing boundary layers, which change neither mass nor stiffness
OUTPUT_KEYOPTS = (4, 5, 8, 9, 10, 15)
DAMPING_LABELS = ("DMPR", "DMPS", "ALPD", "BETD")
ISOTROPIC = ("EX", "PRXY", "NUXY", "DENS")
ORTHOTROPIC = ("EY", "EZ", "PRXZ", "PRYZ", "NUXZ", "NUYZ", "GXY", "GXZ", "GYZ")
#: labels of MP that change no mass or stiffness: thermal expansion, friction, heat, electromagnetics
OTHER_LABELS = (
    "ALPX", "ALPY", "ALPZ", "CTEX", "CTEY", "CTEZ", "THSX", "THSY", "THSZ", "REFT", "MU", "KXX", "KYY", "KZZ", "C",
    "ENTH", "HF", "EMIS", "QRATE", "VISC", "SONC", "RSVX", "RSVY", "RSVZ", "PERX", "PERY", "PERZ", "MURX", "MURY",
    "MURZ", "LSST", "LSSM", "MGXX", "MGYY", "MGZZ",
)  # fmt: skip


@dataclass
class _Draft:
    """Content of the file that has been read so far."""

    where: str
    ledger: Ledger
    nodes: list[tuple[int, list[float]]] = field(default_factory=list)
    elements: list[list[int]] = field(default_factory=list)  #: columns of each element, then its nodes
    kinds: dict[int, int] = field(default_factory=dict)  #: ANSYS element of each type number
    components: dict[str, tuple[str, IntArray]] = field(default_factory=dict)
    #: material -> label -> values by their place in the table of temperatures
    constants: dict[int, dict[str, dict[int, float]]] = field(default_factory=dict)
    keyopts: dict[int, dict[int, int]] = field(default_factory=dict)  #: value of each KEYOPT, by type number
    is_lumped: bool = False  #: whether LUMPM,ON is in the file
    section: int = 0  #: number of the last SECTYPE
    #: number of a section -> thickness, material, angle of its layers, bottom to top
    layers: dict[int, list[tuple[float, int, float]]] = field(default_factory=dict)
    offsets: dict[int, str] = field(default_factory=dict)  #: MID, TOP or BOT, by section number
    held: dict[int, set[int]] = field(default_factory=dict)
    forces: dict[int, Array] = field(default_factory=dict)


def read_cdb_deck(path: Path, data: bytes) -> Deck:
    """Return the content of a .cdb file: solids and shells, materials, components, supports, forces.

    Raises
    ------
    MeshError
        If the file is damaged. Content that cannot be converted is in the ledger.
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
            if name in COMMANDS:
                check_command(name, words, draft.ledger, number)
            if name in BLOCKS:
                BLOCKS[name](here, words, lines, draft)
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
    """Read nodes: numbers, then up to three coordinates and three angles; trailing zeros may be missing."""
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
    """Read elements: eleven columns and eight nodes on a line, further nodes on the next line."""
    if words[1] != "19":  # another layout
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
        check_columns(row, draft.ledger)
        draft.elements.append(row[: COLUMNS + n])
    raise MeshError(f"{here}: the block does not end (-1); the file is truncated")


def _component(here: str, words: list[str], lines: Iterator[tuple[int, str]], draft: _Draft) -> None:
    """Read a component: numbers, where a negative one ends a range."""
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


def _section_block(here: str, words: list[str], lines: Iterator[tuple[int, str]], draft: _Draft) -> None:
    """Read the layers of the last SECTYPE, one on a line: thickness, material, angle, points."""
    for _ in range(int(words[1])):
        _, line = next(lines)
        _layer([word.strip() for word in line.split(",")], draft)


def _layer(words: list[str], draft: _Draft) -> None:
    thickness, material, angle = (*words, "", "", "")[:3]
    draft.layers.setdefault(draft.section, []).append((float(thickness), int(material or 0), float(angle or 0.0)))


#: command -> reader of the lines below it
BLOCKS = {"NBLOCK": _nodes, "EBLOCK": _elements, "CMBLOCK": _component, "SECBLOCK": _section_block}


def _command(name: str, words: list[str], draft: _Draft, line: int) -> None:
    """Read one command, or add it to the ledger."""
    if name == "ET" and len(words) > 2 and words[1].isdigit():
        draft.kinds[int(words[1])] = int(re.sub(r"\D", "", words[2]))
    elif name == "MPDATA" and len(words) > 6:  # MPDATA,R5.0, 1,EX  ,       1, 1, value, value, value
        table = draft.constants.setdefault(int(words[4]), {}).setdefault(words[3].upper(), {})
        table |= {int(words[5]) + k: float(word) for k, word in enumerate(words[6:]) if word}
    elif name == "MP" and len(words) > 3:
        draft.constants.setdefault(int(words[2]), {})[words[1].upper()] = {1: float(words[3])}
    elif name in ("KEYOP", "KEYOPT") and len(words) > 3 and words[1].isdigit():
        draft.keyopts.setdefault(int(words[1]), {})[int(words[2])] = int(float(words[3] or 0))
    elif name == "SECTYPE":
        draft.section = int(words[1])
        if words[2].upper() != "SHELL":
            draft.ledger.refuse(name, f"TYPE = {words[2]}: only SHELL", line=line)
    elif name == "SECDATA":
        _layer(words[1:], draft)
    elif name == "SECOFFSET":
        draft.offsets[draft.section] = words[1].upper()
    elif name == "SECCONTROL" and any(says_something(word) for word in words[1:] if word):
        draft.ledger.refuse(name, "stiffness or mass that is added to a section", line=line)
    elif name == "LUMPM":
        draft.is_lumped = words[1].upper() == "ON" or (words[1].isdigit() and words[1] != "0")
    elif name == "SFE" and len(words) > 3 and words[3].upper() == "PRES":
        draft.ledger.note(name, "pressure on faces: no load case of a deck has it", line=line)
    elif name == "D" and words[1].isdigit():
        labels = list(_DOFS) if words[2].upper() == "ALL" else [words[2].upper()]
        draft.held.setdefault(int(words[1]), set()).update(_DOFS[label] for label in labels if label in _DOFS)
    elif name == "F" and words[1].isdigit() and words[2].upper() in _FORCES:
        draft.forces.setdefault(int(words[1]), np.zeros(6))[_FORCES[words[2].upper()]] += float(words[3])
    elif name in ("N", "EN") and "-1" in words:
        return  # ends a list of nodes or elements
    elif name in HARMLESS:
        draft.ledger.note(name, "belongs to the analysis, not to the body", line=line)
    elif (
        name not in COMMANDS
        and not name.startswith(("/", "*", "_", "(", "-"))
        and name.isalnum()
        and not name[0].isdigit()
    ):
        draft.ledger.refuse(name, "this command is not known here", line=line)


def _deck(path: Path, draft: _Draft) -> Deck:
    if not draft.nodes or not draft.elements:
        what = "nodes (NBLOCK)" if not draft.nodes else "elements (EBLOCK)"
        raise MeshError(f"{draft.where}: expected {what}, got none; write the model with CDWRITE,DB or ALL")
    numbers = np.array([number for number, _ in draft.nodes], dtype=np.int64)
    order = np.argsort(numbers, kind="stable")
    if (np.diff(numbers[order]) == 0).any():
        raise MeshError(f"{draft.where}: nodes are defined twice; keep one of each")
    sections: dict[str, SolidSection] = {}
    shells: dict[str, ShellSection] = {}
    cells: dict[tuple[str, str], tuple[list[int], list[list[int]]]] = {}
    for row in draft.elements:
        kind = draft.kinds.get(row[1], 0)
        if kind == MESH_ONLY:
            draft.ledger.note("MESH200", "has neither mass nor stiffness")
            continue
        if kind in SHELLS:
            found = _shell(draft, kind, row)
            if found is not None:
                shells[found[1].group] = found[1]
                listed = cells.setdefault((found[0], found[1].group), ([], []))
                listed[0].append(row[10])
                listed[1].append(found[2])
            continue
        if kind not in SOLIDS:
            draft.ledger.refuse(f"element {kind or 'of type ' + str(row[1])}", "this element is not known here")
            continue
        shape, nodes = _shape(draft.where, kind, row)
        group = f"mat_{row[0]}_solid{kind}" + ("" if _plain_type(draft, row[1]) else f"_type_{row[1]}")
        integration, mass, different = SOLIDS[kind]
        integration = _integration(draft, row[1], kind) or integration
        if kind == 186 and shape == "wedge":  # without middle nodes: fewer points would not hold it
            integration, group = "full", f"{group}_wedge"
        mass = "lumped" if draft.is_lumped else mass
        if different:
            draft.ledger.note(f"SOLID{kind}", different)
        if row[4] and any(label in draft.constants.get(row[0], {}) for label in ORTHOTROPIC):
            why = f"orthotropic material {row[0]} along element system {row[4]} (ESYS): only along basic axes"
            draft.ledger.refuse(f"SOLID{kind}", why)
        sections[group] = SolidSection(group, str(row[0]), integration, mass)
        listed = cells.setdefault((shape, group), ([], []))
        listed[0].append(row[10])
        listed[1].append(nodes)
    blocks = []
    for (shape, group), (own, rows) in cells.items():
        table = rows_of_numbers(numbers, order, np.array(rows, dtype=np.int64))
        own_numbers = np.array(own, dtype=np.int64)
        groups = {group: np.arange(len(own))}
        for name, (what, members) in draft.components.items():
            inside = np.flatnonzero(np.isin(own_numbers, members))
            if what.startswith("ELEM") and inside.size:
                groups[name] = inside
        blocks.append(RawBlock(shape, table, groups, own_numbers))
    sets = {
        name: rows_of_numbers(numbers, order, members)
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
            sets[f"node_{number}"] = rows_of_numbers(numbers, order, np.array([number]))
            given[f"node_{number}"] = tuple(force.tolist())
        loads.append(Load("forces", forces=given))
    used_materials = {row[0] for row in draft.elements}
    used_materials |= {material for layers in draft.layers.values() for _, material, _ in layers}
    materials = {
        str(number): _material(draft, number, labels, number in used_materials)
        for number, labels in draft.constants.items()
    }
    return Deck(
        path,
        "ansys",
        replace(mesh, node_sets=sets),
        draft.ledger,
        materials,
        solids=tuple(sections.values()),
        shells=tuple(shells.values()),
        supports=tuple(supports),
        loads=tuple(loads),
        lumped=frozenset(("shells",) if draft.is_lumped else ()),
    )


def _shell(draft: _Draft, kind: int, row: list[int]) -> tuple[str, ShellSection, list[int]] | None:
    """Return cell, section and nodes of a shell element; None if it cannot be converted.

    The nodes lie on the middle, top or bottom surface (SECOFFSET). Only layers of isotropic materials are read: the
    directions of orthotropic layers would follow the axes of the element.
    """
    layers = draft.layers.get(row[3])
    offset = draft.offsets.get(row[3], "MID")
    n_nodes, cell = SHELLS[kind]
    _integration(draft, row[1], kind)
    materials = [material or row[0] for _, material, _ in layers or ()]
    is_orthotropic = any(label in draft.constants.get(m, {}) for m in materials for label in ORTHOTROPIC)
    if not layers or offset not in ("MID", "TOP", "BOT") or is_orthotropic or len(row) - COLUMNS < n_nodes:
        why = f"section {row[3]}: expected SECBLOCK or SECDATA with thicknesses of isotropic materials"
        draft.ledger.refuse(f"SHELL{kind}", f"{why}, and SECOFFSET MID, TOP or BOT")
        return None
    thickness = sum(t for t, _, _ in layers)
    middle = {"MID": 0.0, "TOP": -thickness / 2, "BOT": thickness / 2}[offset]
    group = f"sec_{row[3]}" + ("" if all(m for _, m, _ in layers) else f"_mat_{row[0]}")
    section = ShellSection(group, str(materials[0]), thickness, middle)
    if len(layers) > 1:
        listed = tuple(DeckLayer(str(m), t) for (t, _, _), m in zip(layers, materials, strict=True))
        section = replace(section, material="", layers=listed)
    draft.ledger.note(f"SHELL{kind}", "flat shells in place of the elements of ANSYS")
    n = row[COLUMNS : COLUMNS + n_nodes]
    if n[2] == n[3]:
        return ("triangle", section, n[:3]) if kind == 181 else ("triangle6", section, [*n[:3], n[4], n[5], n[7]])
    return cell, section, n


def _plain_type(draft: _Draft, number: int) -> bool:
    """Return whether no KEYOPT of the element type changes its integration."""
    return not any(key == 2 and value for key, value in draft.keyopts.get(number, {}).items())


def _integration(draft: _Draft, number: int, kind: int) -> str:
    """Return the integration chosen by a KEYOPT; empty for the default. Other KEYOPTs go to the ledger."""
    chosen = ""
    for key, value in draft.keyopts.get(number, {}).items():
        known = KEYOPTS[kind].get(key, {0: ""})
        if value in known:
            chosen = known[value] or chosen
        elif key not in OUTPUT_KEYOPTS:
            name = "SHELL" if kind in SHELLS else "SOLID"
            draft.ledger.refuse(f"KEYOPT({key}) = {value} of {name}{kind}", "this formulation is not known here")
    return chosen


def _material(draft: _Draft, number: int, tables: dict[str, dict[int, float]], is_used: bool) -> DeckMaterial:
    """Return a material at the first temperature of its tables.

    The defaults of ANSYS are EY = EZ = EX, PRXY = 0.3, PRXZ = PRYZ = PRXY and G = E/(2 (1 + nu)). PR are the major
    Poisson's ratios, with nu_xy/E_x = nu_yx/E_y, and NU the minor ones: PR_xy = NU_xy E_x/E_y.
    """
    labels = {label: table[min(table)] for label, table in tables.items() if table}
    for label, table in tables.items() if is_used else ():
        if label in (*ISOTROPIC, *ORTHOTROPIC) and len(set(table.values())) > 1:
            why = f"material {number} depends on temperature, {len(table)} values: the first is taken"
            draft.ledger.note(f"MPDATA, {label}", why)
        elif label in DAMPING_LABELS and any(table.values()):
            draft.ledger.note(f"MPDATA, {label}", f"damping of material {number} is left out: give a table [damping]")
        elif label not in (*ISOTROPIC, *ORTHOTROPIC, *DAMPING_LABELS, *OTHER_LABELS):
            draft.ledger.refuse(f"MPDATA, {label}", f"material {number}: this property is not known here")
    young = labels.get("EX")
    if young is not None and is_used and not {"PRXY", "NUXY"} & set(labels):
        draft.ledger.note("MPDATA, PRXY", f"material {number} has none: 0.3, as ANSYS takes it")
    if young is None or not any(label in labels for label in ORTHOTROPIC):
        return DeckMaterial(str(number), young, labels.get("PRXY", labels.get("NUXY", 0.3)), labels.get("DENS"))
    E = (young, labels.get("EY", young), labels.get("EZ", young))
    pairs = {"XY": (0, 1), "XZ": (0, 2), "YZ": (1, 2)}
    nu: list[float] = []
    G: list[float] = []
    for pair, (a, b) in pairs.items():
        major = labels.get(f"PR{pair}")
        if major is None and f"NU{pair}" in labels:
            major = labels[f"NU{pair}"] * E[a] / E[b]
        nu.append(nu[0] if major is None and nu else 0.3 if major is None else major)
        G.append(labels.get(f"G{pair}", E[a] / (2 * (1 + nu[-1]))))
    return DeckMaterial(str(number), E, (nu[0], nu[1], nu[2]), labels.get("DENS"), (G[0], G[1], G[2]))


def _shape(where: str, kind: int, row: list[int]) -> tuple[str, list[int]]:
    """Return cell and nodes of an element. A brick with coinciding nodes is another kind of cell."""
    n = row[COLUMNS:]
    if kind == 187 and len(n) >= 10:
        return "tetra10", n[:10]
    if kind == 187 and len(n) == 4:
        return "tetra", n
    if len(n) < 8 or kind == 187:
        expected = "4 or 10" if kind == 187 else "8" if kind == 185 else "8 or 20"
        raise MeshError(f"{where}: element {row[10]} (SOLID{kind}) has {len(n)} nodes; expected {expected}")
    if len(n) > 8 and 0 in n:
        raise MeshError(f"{where}: element {row[10]} (SOLID{kind}) lacks some of its middle nodes; write all or none")
    is_quadratic = len(n) == 20 and kind == 186
    if len(set(n[4:8])) == 1:
        if n[2] != n[3]:
            return ("pyramid13", [*n[:5], *n[8:12], *n[16:20]]) if is_quadratic else ("pyramid", n[:5])
        return ("tetra10", [*n[:3], n[4], n[8], n[9], n[11], *n[16:19]]) if is_quadratic else ("tetra", [*n[:3], n[4]])
    if n[2] == n[3] and n[6] == n[7]:
        corners = [*n[:3], *n[4:7]]
        if not is_quadratic:
            return "wedge", corners
        return "wedge15", [*corners, n[8], n[9], n[11], n[12], n[13], n[15], *n[16:19]]
    return ("hexahedron20", n[:20]) if is_quadratic else ("hexahedron", n[:8])


def _supports(
    draft: _Draft, numbers: IntArray, order: IntArray, used: IntArray, sets: dict[str, IntArray]
) -> tuple[list[Support], dict[str, IntArray]]:
    """Return one support for each set of fixed components, and the groups of its nodes."""
    by: dict[tuple[int, ...], list[int]] = {}
    for number, components in draft.held.items():
        row = int(rows_of_numbers(numbers, order, np.array([number]))[0])
        if row in used and components:
            by.setdefault(tuple(sorted(components)), []).append(row)
    supports = []
    for same, rows in by.items():
        name = f"support_{''.join(str(c + 1) for c in same)}"
        sets[name] = np.array(sorted(rows), dtype=np.int64)
        supports.append(Support(name, name, same))
    return supports, sets
