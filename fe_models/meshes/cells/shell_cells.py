"""Conversion of triangles and quads in a mesh file to the mesh of a shell."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from fe_models.errors import MeshError
from fe_models.foundation.arrays import IntArray
from fe_models.foundation.words import nearest
from fe_models.meshes.cells.line_cells import collect_lines
from fe_models.meshes.cells.raw_mesh import RawBlock, RawMesh, collect_cells, require_nodes
from fe_models.meshes.shell_mesh import FLAT_TYPES, ShellMesh

__all__ = ["SHELL_TYPES", "shell_mesh_from_raw", "with_centres"]

SHELL_TYPES = ("triangle", "triangle6", "quad", "quad8", "quad9")  #: cell types that can be shells

_PARTS: dict[str, tuple[str, list[tuple[int, ...]]]] = {
    "triangle": ("triangle", [(0, 1, 2)]),
    "quad": ("quad", [(0, 1, 2, 3)]),
    "triangle6": ("triangle", [(0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)]),
    "quad9": ("quad", [(0, 4, 8, 7), (4, 1, 5, 8), (8, 5, 2, 6), (7, 8, 6, 3)]),
}  #: type and nodes of the flat parts of each cell type in the file
_LOWER = ("vertex", "line", "line3", "line4")


def shell_mesh_from_raw(
    raw: RawMesh, path: Path, digest: str, groups: tuple[str, ...] | None, stiffeners: tuple[str, ...]
) -> ShellMesh:
    """Return the triangles and quads of a file, the lines that stiffen them, and the nodes on both, renumbered.

    Parameters
    ----------
    raw
        Content of the file.
    path, digest
        Name of the file and its sha256, for the record and the messages.
    groups
        Groups whose cells are kept; None: all cells.
    stiffeners
        Groups of lines that are stiffeners; other lines only select nodes.

    Raises
    ------
    MeshError
        If there are no triangles or quads, a group is unknown, or a cell names a node that is not there.
    """
    where = f"mesh {path}"
    require_nodes(where, raw)
    raw = with_centres(raw)
    nodes, blocks = require_nodes(where, raw)
    notes = list(raw.notes)
    flat = [_flat_parts(block) for block in blocks if block.kind in _PARTS]
    split = sum(len(block.nodes) for block in blocks if block.kind in ("triangle6", "quad9"))
    if split:
        notes.append(f"{split} quadratic cells were split into four flat ones each")
    cells, sets, numbers = collect_cells(where, flat, FLAT_TYPES, raw.repeats_are_memberships, notes)
    if groups is not None:
        cells, sets, numbers = _only(where, groups, cells, sets, numbers)
    if not any(len(rows) for rows in cells.values()):
        found = ", ".join(f"{len(block.nodes)} {block.kind}" for block in blocks) or "no cells"
        raise MeshError(f"{where}: expected triangles or quads (shells), got {found}; export the surfaces, meshed")
    others = sum(len(block.nodes) for block in blocks if block.kind not in (*_PARTS, *_LOWER))
    if others:
        notes.append(f"{others} cells that are neither flat nor lines were left out")
    lines, line_sets, line_numbers = collect_lines(where, blocks, raw, notes)
    unknown = [group for group in stiffeners if group not in line_sets]
    if unknown:
        raise MeshError(f"{where}: no group of lines {unknown[0]!r}{nearest(unknown[0], line_sets)}")
    kept = np.unique(np.concatenate([np.zeros(0, np.int64), *[line_sets[group] for group in stiffeners]]))
    used = np.zeros(len(nodes), dtype=bool)
    for rows in cells.values():
        used[rows] = True
    used[lines[kept]] = True
    if not used.all():
        notes.append(f"{int((~used).sum())} nodes that belong to no shell or stiffener were dropped")
    place = np.full(len(nodes), -1)
    place[used] = np.arange(used.sum())
    node_sets = {name: np.unique(members) for name, members in raw.node_sets.items()}
    for block in blocks:
        if block.kind in _LOWER:
            for group, rows in block.groups.items():
                members = block.nodes[rows].ravel()
                node_sets[group] = np.union1d(node_sets.get(group, np.zeros(0, np.int64)), members)
    node_sets = {name: place[members][place[members] >= 0] for name, members in node_sets.items()}
    for group, by_type in sets.items():
        members = np.concatenate([cells[kind][rows].ravel() for kind, rows in by_type.items()])
        node_sets.setdefault(group, np.unique(place[members]))
    return ShellMesh(
        nodes=nodes[used],
        cells={kind: place[rows] for kind, rows in cells.items()},
        cell_sets=sets,
        lines=place[lines[kept]],
        line_sets={group: np.searchsorted(kept, line_sets[group]) for group in stiffeners},
        node_sets={name: members for name, members in node_sets.items() if len(members)},
        source=str(path),
        digest=digest,
        included=raw.included,
        node_numbers=np.zeros(0, np.int64) if raw.node_numbers is None else raw.node_numbers[used],
        cell_numbers=numbers,
        line_numbers=line_numbers[kept] if line_numbers.size else line_numbers,
        notes=tuple(notes),
    )


def with_centres(raw: RawMesh) -> RawMesh:
    """Return a mesh in which quads with eight nodes get a ninth node at the middle of the quadratic field.

    The new nodes come last, with the number -1, because the file has no numbers for them.
    """
    nodes, numbers = [raw.nodes], [raw.node_numbers]
    blocks, n = [], len(raw.nodes)
    for block in raw.blocks:
        if block.kind != "quad8" or not len(block.nodes):
            blocks.append(block)
            continue
        X = raw.nodes[block.nodes]
        nodes.append(X[:, 4:].sum(axis=1) / 2 - X[:, :4].sum(axis=1) / 4)
        numbers.append(np.full(len(X), -1))
        centres = n + np.arange(len(X))
        n += len(X)
        blocks.append(RawBlock("quad9", np.column_stack([block.nodes, centres]), block.groups, block.numbers))
    given = None if raw.node_numbers is None else np.concatenate([each for each in numbers if each is not None])
    return replace(raw, nodes=np.concatenate(nodes), blocks=tuple(blocks), node_numbers=given)


def _flat_parts(block: RawBlock) -> RawBlock:
    """Return a block as flat cells; the parts of a cell are adjacent in every group."""
    kind, parts = _PARTS[block.kind]
    n = len(parts)
    cells: IntArray = np.asarray(block.nodes)[:, np.array(parts)].reshape(-1, len(parts[0]))
    groups = {group: (n * np.asarray(rows)[:, None] + np.arange(n)).ravel() for group, rows in block.groups.items()}
    return RawBlock(kind, cells, groups, None if block.numbers is None else np.repeat(block.numbers, n))


def _only(
    where: str,
    groups: tuple[str, ...],
    cells: dict[str, IntArray],
    sets: dict[str, dict[str, IntArray]],
    numbers: dict[str, IntArray],
) -> tuple[dict[str, IntArray], dict[str, dict[str, IntArray]], dict[str, IntArray]]:
    """Keep only the cells of some groups."""
    unknown = [group for group in groups if group not in sets]
    if unknown:
        raise MeshError(f"{where}: no group of triangles or quads {unknown[0]!r}{nearest(unknown[0], sets)}")
    kept_sets: dict[str, dict[str, IntArray]] = {}
    kept_cells, kept_numbers = {}, {}
    for kind, rows in cells.items():
        parts = [sets[group][kind] for group in groups if kind in sets[group]]
        kept = np.unique(np.concatenate([np.zeros(0, np.int64), *parts]))
        place = np.full(len(rows), -1)
        place[kept] = np.arange(len(kept))
        kept_cells[kind] = rows[kept]
        if kind in numbers:
            kept_numbers[kind] = numbers[kind][kept]
        for group, by_type in sets.items():
            members = place[by_type[kind]] if kind in by_type else np.zeros(0, np.int64)
            if (members >= 0).any():
                kept_sets.setdefault(group, {})[kind] = members[members >= 0]
    return kept_cells, kept_sets, kept_numbers
