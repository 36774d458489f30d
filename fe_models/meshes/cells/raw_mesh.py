"""Unchecked content of a mesh file: blocks of cells of any type with their groups; and the checks."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from fe_models.errors import MeshError
from fe_models.foundation.arrays import Array, IntArray
from fe_models.meshes.boundary import first_of_equal_rows
from fe_models.meshes.cell_shapes import CELL_SHAPES, cell_jacobians
from fe_models.meshes.mesh import FACE_TYPES, SOLID_TYPES, Mesh

__all__ = [
    "LINES",
    "RawBlock",
    "RawMesh",
    "chosen_cells",
    "collect_cells",
    "groups_apart",
    "mesh_from_raw",
    "mirrored_cells",
    "mirrored_order",
    "require_node_order",
    "require_nodes",
    "turned_upright",
]


LINES = ("vertex", "line", "line3", "line4")  #: cell types below two dimensions, which only select nodes


@dataclass(frozen=True, eq=False)
class RawBlock:
    """Cells of one type, as listed in a file."""

    kind: str  #: meshio name of the cell type, or its name in the file if meshio has none
    nodes: IntArray  #: node indices in meshio order, (n_cells, nodes per cell)
    groups: Mapping[str, IntArray] = field(default_factory=dict)  #: rows of this block in each group
    numbers: IntArray | None = None  #: numbers of the cells in the file, (n_cells,)


@dataclass(frozen=True, eq=False)
class RawMesh:
    """Nodes and cell blocks of a file."""

    nodes: Array  #: node positions, (n_nodes, 3)
    blocks: tuple[RawBlock, ...]
    node_sets: Mapping[str, IntArray] = field(default_factory=dict)
    node_numbers: IntArray | None = None  #: node numbers in the file, (n_nodes,)
    repeats_are_memberships: bool = False  #: whether a repeated cell only adds a group to it, as in Gmsh 2.2
    notes: tuple[str, ...] = ()
    #: instances in a deck with repeated numbers; numbers of the k-th are increased by k `instance_step`
    instances: tuple[str, ...] = ()
    instance_step: int = 0  #: step between numbers of instances; 0: numbers are unchanged
    included: Mapping[str, str] = field(default_factory=dict)  #: sha256 of each file that the file includes


def mesh_from_raw(raw: RawMesh, path: Path, digest: str) -> Mesh:
    """Return the mesh of a file after checks; raise an error that describes what is wrong.

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
        nodes that do not exist, cells are listed twice, or middle nodes are in the wrong order for their cell type.
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
    """Return a mesh with only some cell types and groups, and the faces that select; all nodes remain.

    Parameters
    ----------
    kinds
        Cell types to keep; if these are solids, faces are kept too.
    groups
        Groups whose cells are kept; None: all cells of these types.
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
    """Return nodes and non-empty blocks, after checking that there are nodes and that coordinates are finite."""
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
    """Join the blocks of each cell type, drop repeated cells, and renumber the groups."""
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
    """Return the rows to keep, (n_kept,), and the position of each row among them, (n_rows,)."""
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


# check of the positions of nodes within their cells, and the node order of mirrored cells -----------------------------


_REFLECTED_CORNERS = {
    "tetra": (0, 2, 1, 3),
    "tetra10": (0, 2, 1, 3),
    "hexahedron": (0, 3, 2, 1, 4, 7, 6, 5),
    "hexahedron20": (0, 3, 2, 1, 4, 7, 6, 5),
    "hexahedron27": (0, 3, 2, 1, 4, 7, 6, 5),
    "wedge": (0, 2, 1, 3, 5, 4),
    "wedge15": (0, 2, 1, 3, 5, 4),
    "pyramid": (0, 3, 2, 1, 4),
    "pyramid13": (0, 3, 2, 1, 4),
}
_CHUNK = 20_000  #: number of cells that are checked at a time, so that a million dofs need 100 MB


def require_node_order(where: str, kind: str, nodes: Array, cells: IntArray) -> None:
    """Raise `MeshError` if the middle nodes of most cells are nearest to the middle of another edge or face.

    A wrong order is systematic: the same position is wrong in (nearly) all cells. Single cells whose middle node was
    moved across a thin edge are reported by the mesh report instead.
    """
    middles = CELL_SHAPES[kind].middles
    if not middles:
        return
    n_corners = len(CELL_SHAPES[kind].corners)
    wrong = np.zeros(len(middles), dtype=np.int64)
    found = np.zeros((len(middles), len(middles)), dtype=np.int64)
    for start in range(0, len(cells), _CHUNK):
        X = nodes[cells[start : start + _CHUNK]]
        expected = np.stack([X[:, list(parents)].mean(axis=1) for parents in middles], axis=1)
        own = np.linalg.norm(X[:, n_corners:] - expected, axis=2)
        size = np.linalg.norm(np.ptp(X[:, :n_corners], axis=1), axis=1)
        doubtful = np.flatnonzero((own > 0.05 * size[:, None]).any(axis=1))
        if doubtful.size == 0:
            continue
        far = np.linalg.norm(X[doubtful, n_corners:, None] - expected[doubtful, None], axis=3)
        nearest = far.argmin(axis=2)
        clear = far.min(axis=2) < 0.5 * own[doubtful]
        wrong += clear.sum(axis=0)
        for place in range(len(middles)):
            found[place] += np.bincount(nearest[clear[:, place], place], minlength=len(middles))
    if wrong.max() > len(cells) / 2:
        place = int(wrong.argmax())
        other = middles[int(found[place].argmax())]
        raise MeshError(
            f"{where}: the middle nodes of {kind} cells are in another order than this file format has: "
            f"node {n_corners + place + 1} of the cells should lie between their nodes "
            f"{_numbers(middles[place])}, in {wrong[place]} of {len(cells)} cells it lies between nodes "
            f"{_numbers(other)}; export the mesh again with the node order of the format"
        )


def _numbers(local: tuple[int, ...]) -> str:
    return " and ".join(str(k + 1) for k in local)


def mirrored_order(kind: str) -> IntArray:
    """Return the local node order that reverses the orientation of a cell, (n_nodes,), with valid middle nodes."""
    corners = _REFLECTED_CORNERS[kind]
    n_corners = len(corners)
    place = {frozenset(parents): n_corners + k for k, parents in enumerate(CELL_SHAPES[kind].middles)}
    middles = [place[frozenset(corners[p] for p in parents)] for parents in CELL_SHAPES[kind].middles]
    return np.array([*corners, *middles], dtype=np.int64)


def mirrored_cells(kind: str, nodes: Array, cells: IntArray) -> bool:
    """Return whether every cell is numbered inside out: its Jacobian at the centre is negative."""
    return bool(_is_mirrored(kind, nodes, cells).all())


def turned_upright(kind: str, nodes: Array, cells: IntArray) -> IntArray:
    """Return the cells with inverted ones reversed, for programs that accept both orientations."""
    upright = cells.copy()
    for start in range(0, len(cells), _CHUNK):
        rows = start + np.flatnonzero(_is_mirrored(kind, nodes, cells[start : start + _CHUNK]))
        upright[rows] = cells[rows][:, mirrored_order(kind)]
    return upright


def _is_mirrored(kind: str, nodes: Array, cells: IntArray) -> np.ndarray:
    """Return whether the Jacobian at the centre of each cell is negative, (n_cells,) bool."""
    middle = CELL_SHAPES[kind].nodes[: len(CELL_SHAPES[kind].corners)].mean(axis=0)[None]
    return np.asarray(cell_jacobians(kind, nodes[cells], middle)[:, 0] < 0)


# layers of shells and beams: groups with cells on the same nodes go to different parts --------------------------------


def groups_apart(raw: RawMesh, kinds: Iterable[str], groups: Iterable[str]) -> list[tuple[str, ...]]:
    """Split groups, in their order, into parts without two cells on the same nodes; one part if none is doubled.

    Each group goes to the first part in which none of its cells is doubled. Cells of one group on the same nodes stay
    together: they are a fault, or one cell that is listed twice.

    Parameters
    ----------
    raw
        The mesh.
    kinds
        Types of the cells that are compared.
    groups
        Names of groups of cells.
    """
    groups, kinds = list(groups), tuple(kinds)
    doubled = _doubled(raw, kinds)
    parts: list[tuple[list[str], dict[int, int]]] = []
    for group in groups:
        mine = _of_group(raw, kinds, group, doubled)
        for names, taken in parts:
            if all(taken.get(place, cell) == cell for place, cell in mine.items()):
                names.append(group)
                taken |= mine
                break
        else:
            parts.append(([group], dict(mine)))
    return [tuple(names) for names, _ in parts]


def _doubled(raw: RawMesh, kinds: tuple[str, ...]) -> list[IntArray]:
    """Return for each cell of each block the number of its node set if it is shared with another cell; else -1."""
    found = [np.full(len(block.nodes), -1) for block in raw.blocks]
    first = 0
    for kind in kinds:
        blocks = [k for k, block in enumerate(raw.blocks) if block.kind == kind and len(block.nodes)]
        if not blocks:
            continue
        rows = np.sort(np.concatenate([raw.blocks[k].nodes for k in blocks]), axis=1)
        _, place, count = np.unique(rows, axis=0, return_inverse=True, return_counts=True)
        place = np.where(count[place.ravel()] > 1, first + place.ravel(), -1)
        first += len(count)
        for k, own in zip(blocks, np.split(place, np.cumsum([len(found[k]) for k in blocks])[:-1]), strict=True):
            found[k] = own
    return found


def _of_group(raw: RawMesh, kinds: tuple[str, ...], group: str, doubled: list[IntArray]) -> dict[int, int]:
    """Return number of the node set -> index of the cell over all blocks, for the doubled cells of a group."""
    found: dict[int, int] = {}
    first = 0
    for block, places in zip(raw.blocks, doubled, strict=True):
        if block.kind in kinds and group in block.groups:
            rows = block.groups[group]
            rows = rows[places[rows] >= 0]
            found |= dict(zip(places[rows].tolist(), (first + rows).tolist(), strict=True))
        first += len(block.nodes)
    return found
