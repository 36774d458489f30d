"""Content of a `meshio.Mesh`: its cells; named sets and integer data become groups."""

from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from fe_models.meshes.cells.raw_mesh import RawBlock, RawMesh, mirrored_cells, mirrored_order

__all__ = ["CELL_NUMBERS", "NODE_NUMBERS", "groups_of_values", "numbers_among", "raw_from_meshio", "upright_wedges"]

NODE_NUMBERS = ("node", "node_id", "GlobalNodeId")  #: names of point data that contain node numbers
CELL_NUMBERS = ("element", "element_id", "GlobalElementId")  #: names of cell data that contain cell numbers
MOST_GROUPS = 1000  #: number of distinct values above which cell data are cell numbers, not groups


def raw_from_meshio(mesh: Any) -> RawMesh:
    """Return nodes, cells and groups of a `meshio.Mesh`.

    Cell sets keep their names; every value of whole-number cell data is a group `<array>_<value>`. Point sets, and
    whole-number point data with only 0 and 1, become node sets. Point data "node" and cell data "element" (in VTK
    "GlobalNodeId" and "GlobalElementId") are the numbers of nodes and cells, if these are distinct whole numbers.
    Linear wedges that do not follow VTK's own definition of their orientation are reversed.
    """
    nodes = np.asarray(mesh.points, dtype=float)
    cell_numbers = numbers_of_cells(mesh)
    blocks = []
    for k, block in enumerate(mesh.cells):
        cells = upright_wedges(block.type, nodes, np.asarray(block.data, dtype=np.int64))
        groups: dict[str, IntArray] = {}
        for name, values in mesh.cell_data.items():
            if name not in CELL_NUMBERS or cell_numbers is None:
                groups |= groups_of_values(name, np.asarray(values[k]))
        for name, sets in mesh.cell_sets.items():
            members = None if sets[k] is None else np.asarray(sets[k])
            if members is not None and members.size and not name.startswith("gmsh:"):
                groups[name] = np.flatnonzero(members) if members.dtype == bool else members.astype(np.int64)
        blocks.append(RawBlock(block.type, cells, groups, None if cell_numbers is None else cell_numbers[k]))
    node_sets = {
        name: np.flatnonzero(values)
        for name, values in mesh.point_data.items()
        if np.ndim(values) == 1 and np.asarray(values).dtype.kind in "iub" and set(np.unique(values)) == {0, 1}
    }
    node_sets |= {name: np.asarray(members, dtype=np.int64) for name, members in mesh.point_sets.items()}
    return RawMesh(nodes, tuple(blocks), node_sets, numbers_among(mesh.point_data, NODE_NUMBERS, len(nodes)))


def numbers_of_cells(mesh: Any) -> list[IntArray] | None:
    """Return the numbers of the cells, block by block; None if there are none."""
    ends = np.cumsum([0, *(len(block.data) for block in mesh.cells)])
    joined = {
        name: np.concatenate([np.asarray(part).reshape(-1) for part in values])
        for name, values in mesh.cell_data.items()
        if name in CELL_NUMBERS and len(values)
    }
    found = numbers_among(joined, CELL_NUMBERS, int(ends[-1]))
    return None if found is None else np.split(found, ends[1:-1])


def numbers_among(data: Any, names: tuple[str, ...], n: int) -> IntArray | None:
    """Return the first of these arrays that can number n things: distinct nonnegative integers."""
    for name in names:
        values = np.asarray(data[name]).reshape(-1) if name in data else np.zeros(0)
        if values.size == n and n and values.dtype.kind in "iu" and values.min() >= 0 and len(np.unique(values)) == n:
            return values.astype(np.int64)
    return None


def upright_wedges(kind: str, nodes: Array, cells: IntArray) -> IntArray:
    """Return the cells; linear wedges that are inverted by the definition of VTK are reversed."""
    inside = cells.size and cells.min() >= 0 and cells.max() < len(nodes)
    if kind == "wedge" and inside and np.isfinite(nodes).all() and mirrored_cells("wedge", nodes, cells):
        return np.asarray(cells[:, mirrored_order("wedge")])
    return cells


def groups_of_values(name: str, values: np.ndarray) -> dict[str, IntArray]:
    """Return the rows of each group for integer data, with one group for each value."""
    if values.ndim == 2 and values.shape[1] == 1:
        values = values[:, 0]
    if values.ndim != 1 or values.dtype.kind not in "iub":
        return {}
    found, which = np.unique(values, return_inverse=True)
    if len(found) > MOST_GROUPS:
        return {}
    order = np.argsort(which, kind="stable")
    parts = np.split(order, np.cumsum(np.bincount(which))[:-1])
    return {f"{name}_{int(value)}": rows for value, rows in zip(found, parts, strict=True)}
