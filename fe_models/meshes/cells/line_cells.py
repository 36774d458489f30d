"""Conversion of the lines in a mesh file to the mesh of a frame."""

from pathlib import Path

import numpy as np

from fe_models.errors import MeshError
from fe_models.foundation.arrays import IntArray
from fe_models.foundation.words import nearest
from fe_models.meshes.cells.raw_mesh import RawBlock, RawMesh, collect_cells, require_nodes
from fe_models.meshes.line_mesh import LineMesh

__all__ = ["collect_lines", "line_mesh_from_raw"]


def line_mesh_from_raw(raw: RawMesh, path: Path, digest: str, groups: tuple[str, ...] | None) -> LineMesh:
    """Return the lines of a file and the nodes on them, renumbered.

    Parameters
    ----------
    raw
        Content of the file.
    path, digest
        Name of the file and its sha256, for the record and the messages.
    groups
        Groups whose lines are kept; None: all lines.

    Raises
    ------
    MeshError
        If there are no lines, a group is unknown, or a cell names a node that is not there.
    """
    where = f"mesh {path}"
    nodes, blocks = require_nodes(where, raw)
    notes = list(raw.notes)
    lines, line_sets, line_numbers = collect_lines(where, blocks, raw, notes)
    if groups is not None:
        unknown = [group for group in groups if group not in line_sets]
        if unknown:
            raise MeshError(f"{where}: no group of lines {unknown[0]!r}{nearest(unknown[0], line_sets)}")
        kept = np.unique(np.concatenate([np.zeros(0, np.int64), *[line_sets[group] for group in groups]]))
        place = np.full(len(lines), -1)
        place[kept] = np.arange(len(kept))
        lines = lines[kept]
        line_numbers = line_numbers[kept] if line_numbers.size else line_numbers
        line_sets = {group: place[rows][place[rows] >= 0] for group, rows in line_sets.items()}
        line_sets = {group: rows for group, rows in line_sets.items() if rows.size}
    if not len(lines):
        found = ", ".join(f"{len(block.nodes)} {block.kind}" for block in blocks) or "no cells"
        raise MeshError(f"{where}: expected lines (beams), got {found}; export the curves of the model, meshed")
    others = [block for block in blocks if block.kind not in ("vertex", "line", "line3")]
    if others:
        notes.append(f"{sum(len(block.nodes) for block in others)} cells that are no lines were left out")
    node_sets = {name: np.unique(members) for name, members in raw.node_sets.items()}
    for block in blocks:
        if block.kind == "vertex":
            for group, rows in block.groups.items():
                node_sets[group] = np.union1d(node_sets.get(group, np.zeros(0, np.int64)), block.nodes[rows].ravel())
    used = np.zeros(len(nodes), dtype=bool)
    used[lines] = True
    if not used.all():
        notes.append(f"{int((~used).sum())} nodes that belong to no line were dropped")
    place = np.full(len(nodes), -1)
    place[used] = np.arange(used.sum())
    kept_sets = {name: place[members][place[members] >= 0] for name, members in node_sets.items()}
    for group, rows in line_sets.items():
        kept_sets.setdefault(group, np.unique(place[lines[rows]]))
    return LineMesh(
        nodes=nodes[used],
        lines=place[lines],
        line_sets=line_sets,
        node_sets=kept_sets,
        source=str(path),
        digest=digest,
        included=raw.included,
        node_numbers=np.zeros(0, np.int64) if raw.node_numbers is None else raw.node_numbers[used],
        line_numbers=line_numbers,
        notes=tuple(notes),
    )


def collect_lines(
    where: str, blocks: list[RawBlock], raw: RawMesh, notes: list[str]
) -> tuple[IntArray, dict[str, IntArray], IntArray]:
    """Return lines with two nodes, (n_lines, 2), rows of each group, and numbers; three-node lines are divided."""
    halves = [_two_nodes(block) for block in blocks if block.kind in ("line", "line3")]
    cells, sets, numbers = collect_cells(where, halves, ("line",), raw.repeats_are_memberships, notes)
    line_sets = {group: by_type["line"] for group, by_type in sets.items()}
    return cells.get("line", np.zeros((0, 2), np.int64)), line_sets, numbers.get("line", np.zeros(0, np.int64))


def _two_nodes(block: RawBlock) -> RawBlock:
    """Return three-node lines (ends, middle) as two lines each; both halves are adjacent in every group."""
    if block.kind == "line":
        return block
    first, second, middle = block.nodes.T
    halves: IntArray = np.stack([np.stack([first, middle], axis=1), np.stack([middle, second], axis=1)], axis=1)
    groups = {group: (2 * np.asarray(rows)[:, None] + np.arange(2)).ravel() for group, rows in block.groups.items()}
    numbers = None if block.numbers is None else np.repeat(block.numbers, 2)
    return RawBlock("line", halves.reshape(-1, 2), groups, numbers)
