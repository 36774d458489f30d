"""What a file says, before it is judged: blocks of cells of any type with their groups; and the judgement."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from fe_models.errors import MeshError
from fe_models.foundation.arrays import Array, IntArray
from fe_models.meshes.boundary import first_of_equal_rows
from fe_models.meshes.cells.node_order import require_node_order
from fe_models.meshes.mesh import FACE_TYPES, SOLID_TYPES, Mesh

__all__ = ["LINES", "RawBlock", "RawMesh", "chosen_cells", "collect_cells", "mesh_from_raw", "require_nodes"]

LINES = ("vertex", "line", "line3", "line4")  #: cells below two dimensions: they select nodes


@dataclass(frozen=True, eq=False)
class RawBlock:
    """Cells of one type, as listed in a file."""

    kind: str  #: meshio name where there is one, else the name in the file
    nodes: IntArray  #: indices of nodes, (n_cells, nodes per cell), meshio order
    groups: Mapping[str, IntArray] = field(default_factory=dict)  #: group -> rows of this block
    numbers: IntArray | None = None  #: numbers of the cells in the file, (n_cells,)


@dataclass(frozen=True, eq=False)
class RawMesh:
    """Nodes and blocks of a file."""

    nodes: Array  #: (n_nodes, 3)
    blocks: tuple[RawBlock, ...]
    node_sets: Mapping[str, IntArray] = field(default_factory=dict)
    node_numbers: IntArray | None = None  #: numbers of the nodes in the file, (n_nodes,)
    repeats_are_memberships: bool = False  #: Gmsh 2.2 lists a cell once for every group it is in
    notes: tuple[str, ...] = ()
    instances: tuple[str, ...] = ()  #: of a deck that repeats numbers: the k-th has k `instance_step` added to them
    instance_step: int = 0  #: 0: numbers are those of the deck
    included: Mapping[str, str] = field(default_factory=dict)  #: files that the file includes -> their sha256


def mesh_from_raw(raw: RawMesh, path: Path, digest: str) -> Mesh:
    """Return the mesh of a file, or say what is wrong with it.

    Parameters
    ----------
    raw
        Content of the file.
    path, digest
        Name of the file and its sha256, for the record and the messages.

    Raises
    ------
    MeshError
        If there are no nodes or solid cells, a coordinate is not finite, a cell type is not supported, cells name
        nodes that do not exist, cells are listed twice, or middle nodes are not where their type has them.
    """
    where = f"mesh {path}"
    nodes, blocks = require_nodes(where, raw)
    _require_supported(where, blocks)
    notes = list(raw.notes)
    cells, cell_sets, numbers = collect_cells(where, blocks, SOLID_TYPES, raw.repeats_are_memberships, notes)
    faces, face_sets, _ = collect_cells(where, blocks, FACE_TYPES, True, notes)
    if not cells:
        found = ", ".join(f"{len(b.nodes)} {b.kind}" for b in blocks) or "no cells"
        raise MeshError(
            f"{where}: expected solid cells ({', '.join(SOLID_TYPES)}), got {found}; export the volume "
            f"mesh, not only its surface; a shell needs its thickness (tables [shells.NAME] in a job, or shell_body)"
        )
    for kind, rows in cells.items():
        require_node_order(where, kind, nodes, rows)
    node_sets = {name: np.unique(members) for name, members in raw.node_sets.items()}
    below: dict[str, list[IntArray]] = {}
    for block in blocks:
        if block.kind in LINES:
            for group, rows in block.groups.items():
                below.setdefault(group, []).append(block.nodes[rows].ravel())
    for group, parts in below.items():
        node_sets.setdefault(group, np.unique(np.concatenate(parts)))
    return Mesh(
        nodes,
        cells,
        cell_sets,
        faces,
        face_sets,
        node_sets,
        source=str(path),
        digest=digest,
        included=raw.included,
        node_numbers=np.zeros(0, np.int64) if raw.node_numbers is None else raw.node_numbers,
        cell_numbers=numbers,
        notes=tuple(notes),
    )


def chosen_cells(raw: RawMesh, kinds: tuple[str, ...], groups: tuple[str, ...] | None) -> RawMesh:
    """Return a mesh with the cells of some kinds and groups only, beside faces that select; its nodes all stay.

    Parameters
    ----------
    kinds
        That are kept; of other kinds, faces stay where `kinds` are solid.
    groups
        Whose cells are kept; None: all of these kinds.
    """
    selecting = FACE_TYPES if set(kinds) <= set(SOLID_TYPES) else ()
    blocks = []
    for block in raw.blocks:
        if block.kind in selecting:
            blocks.append(block)
        elif block.kind in kinds:
            inside = np.full(len(block.nodes), groups is None)
            for group in groups or ():
                inside[block.groups.get(group, np.zeros(0, np.int64))] = True
            place = np.cumsum(inside) - 1
            kept = {group: place[rows[inside[rows]]] for group, rows in block.groups.items()}
            numbers = None if block.numbers is None else block.numbers[inside]
            own = {group: rows for group, rows in kept.items() if rows.size}
            blocks.append(RawBlock(block.kind, block.nodes[inside], own, numbers))
    return replace(raw, blocks=tuple(block for block in blocks if len(block.nodes)), notes=())


def require_nodes(where: str, raw: RawMesh) -> tuple[Array, list[RawBlock]]:
    """Return nodes and blocks that hold cells, after checking that coordinates are numbers and nodes are there."""
    nodes = np.asarray(raw.nodes, dtype=float)
    if nodes.ndim != 2 or len(nodes) == 0:
        raise MeshError(f"{where}: expected nodes, got none; is the file complete?")
    if nodes.shape[1] != 3:
        raise MeshError(f"{where}: expected nodes in space (x, y, z), got {nodes.shape[1]} coordinates per node")
    node_numbers = np.arange(len(nodes)) if raw.node_numbers is None else raw.node_numbers
    if not np.isfinite(nodes).all():
        bad = np.flatnonzero(~np.isfinite(nodes).all(axis=1))
        raise MeshError(
            f"{where}: expected finite coordinates, got NaN or infinity at {bad.size} of {len(nodes)} "
            f"nodes, first node {node_numbers[bad[0]]}; write the mesh again"
        )
    blocks = [block for block in raw.blocks if len(block.nodes)]
    for block in blocks:
        if block.nodes.min() < 0 or block.nodes.max() >= len(nodes):
            row = int(np.argmax(((block.nodes < 0) | (block.nodes >= len(nodes))).any(axis=1)))
            raise MeshError(
                f"{where}: {block.kind} cell {_number(block, row)} names a node that is not in the file; "
                f"the file is incomplete or damaged"
            )
    return nodes, blocks


def _require_supported(where: str, blocks: list[RawBlock]) -> None:
    counts: dict[str, int] = {}
    for block in blocks:
        if block.kind not in SOLID_TYPES + FACE_TYPES + LINES:
            counts[block.kind] = counts.get(block.kind, 0) + len(block.nodes)
    if counts:
        listed = ", ".join(f"{count} of type {kind}" for kind, count in counts.items())
        raise MeshError(
            f"{where}: unsupported cells: {listed}; supported solids: {', '.join(SOLID_TYPES)}; faces: "
            f"{', '.join(FACE_TYPES)}. Mesh the part again with these, or split the cells into tetrahedra"
        )


def _number(block: RawBlock, row: int) -> str:
    return str(row if block.numbers is None else block.numbers[row])


def collect_cells(
    where: str, blocks: list[RawBlock], kinds: tuple[str, ...], repeats_allowed: bool, notes: list[str]
) -> tuple[dict[str, IntArray], dict[str, dict[str, IntArray]], dict[str, IntArray]]:
    """Join the blocks of each kind, drop repeats, and renumber the groups."""
    cells: dict[str, IntArray] = {}
    sets: dict[str, dict[str, IntArray]] = {}
    numbers: dict[str, IntArray] = {}
    for kind in kinds:
        mine = [block for block in blocks if block.kind == kind]
        if not mine:
            continue
        rows = np.concatenate([block.nodes for block in mine])
        starts = np.cumsum([0, *(len(block.nodes) for block in mine)])
        names = np.concatenate([np.arange(len(b.nodes)) if b.numbers is None else b.numbers for b in mine])
        kept, place = _without_repeats(where, kind, rows, names, repeats_allowed)
        if len(kept) < len(rows) and kind in SOLID_TYPES:
            notes.append(
                f"{len(rows) - len(kept)} {kind} cells were listed more than once, because they are in "
                f"several groups; each is kept once, in all its groups"
            )
        cells[kind] = rows[kept]
        if all(block.numbers is not None for block in mine):
            numbers[kind] = names[kept]
        members: dict[str, list[IntArray]] = {}
        for start, block in zip(starts, mine, strict=False):
            for group, group_rows in block.groups.items():
                members.setdefault(group, []).append(place[start + np.asarray(group_rows, dtype=np.int64)])
        for group, parts in members.items():
            joined = np.unique(np.concatenate(parts))
            if joined.size:
                sets.setdefault(group, {})[kind] = joined
    return cells, sets, numbers


def _without_repeats(
    where: str, kind: str, rows: IntArray, names: IntArray, allowed: bool
) -> tuple[IntArray, IntArray]:
    """Return the rows to keep, (n_kept,), and for every row its place among them, (n_rows,)."""
    classes, count = first_of_equal_rows(np.sort(rows, axis=1))
    if len(count) == len(rows):
        everything = np.arange(len(rows))
        return everything, everything
    first = np.full(len(count), len(rows))
    np.minimum.at(first, classes, np.arange(len(rows)))
    again = np.flatnonzero(first[classes] != np.arange(len(rows)))
    same_order = (rows[again] == rows[first[classes[again]]]).all(axis=1)
    if not allowed or (kind in SOLID_TYPES and not same_order.all()):
        row = again[0] if not allowed else again[~same_order][0]
        raise MeshError(
            f"{where}: {again.size} {kind} cells are listed twice, first {names[first[classes[row]]]} and "
            f"{names[row]} on the same nodes: their mass and stiffness would count double; remove one"
        )
    kept = np.unique(first)
    place = np.searchsorted(kept, first[classes])
    return kept, place
