"""Groups of cells parted so that none of a part has a cell on the same nodes as another: layers of shells and beams."""

from collections.abc import Iterable

import numpy as np

from fe_models.foundation.arrays import IntArray
from fe_models.meshes.cells.raw_mesh import RawMesh

__all__ = ["groups_apart"]


def groups_apart(raw: RawMesh, kinds: Iterable[str], groups: Iterable[str]) -> list[tuple[str, ...]]:
    """Return the groups in as few parts as going through them in their order needs, one where no cell is doubled.

    Cells of one group on the same nodes are not parted: they are a fault, or one cell that is listed twice.

    Parameters
    ----------
    raw
        The mesh.
    kinds
        Of cells that count.
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
    """Return for each block the number of the place of each cell that shares its nodes with another, -1 for others."""
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
    """Return place -> number of the cell, counted through all blocks, of the doubled cells of a group."""
    found: dict[int, int] = {}
    first = 0
    for block, places in zip(raw.blocks, doubled, strict=True):
        if block.kind in kinds and group in block.groups:
            rows = block.groups[group]
            rows = rows[places[rows] >= 0]
            found |= dict(zip(places[rows].tolist(), (first + rows).tolist(), strict=True))
        first += len(block.nodes)
    return found
