"""What a `meshio.Mesh` says: its cells; named sets and whole-number data become groups."""

from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from fe_models.importers.node_order import mirrored_cells, mirrored_order
from fe_models.importers.raw_mesh import RawBlock, RawMesh

__all__ = ["groups_of_values", "raw_from_meshio", "upright_wedges"]

MOST_GROUPS = 1000  #: cell data with more distinct values are numbers of cells, not groups


def raw_from_meshio(mesh: Any) -> RawMesh:
    """Return nodes, cells and groups of a `meshio.Mesh`.

    Cell sets keep their names; every value of whole-number cell data is a group `<array>_<value>`. Point sets, and
    whole-number point data that hold only 0 and 1, become node sets. Linear wedges are taken inside out where they
    do not follow VTK's own definition of their orientation.
    """
    nodes = np.asarray(mesh.points, dtype=float)
    blocks = []
    for k, block in enumerate(mesh.cells):
        cells = upright_wedges(block.type, nodes, np.asarray(block.data, dtype=np.int64))
        groups: dict[str, IntArray] = {}
        for name, values in mesh.cell_data.items():
            groups |= groups_of_values(name, np.asarray(values[k]))
        for name, sets in mesh.cell_sets.items():
            members = None if sets[k] is None else np.asarray(sets[k])
            if members is not None and members.size and not name.startswith("gmsh:"):
                groups[name] = np.flatnonzero(members) if members.dtype == bool else members.astype(np.int64)
        blocks.append(RawBlock(block.type, cells, groups))
    node_sets = {
        name: np.flatnonzero(values)
        for name, values in mesh.point_data.items()
        if np.ndim(values) == 1 and np.asarray(values).dtype.kind in "iub" and set(np.unique(values)) == {0, 1}
    }
    node_sets |= {name: np.asarray(members, dtype=np.int64) for name, members in mesh.point_sets.items()}
    return RawMesh(nodes, tuple(blocks), node_sets)


def upright_wedges(kind: str, nodes: Array, cells: IntArray) -> IntArray:
    """Return the cells; linear wedges that are inside out in VTK's own definition are turned."""
    inside = cells.size and cells.min() >= 0 and cells.max() < len(nodes)
    if kind == "wedge" and inside and np.isfinite(nodes).all() and mirrored_cells("wedge", nodes, cells):
        return np.asarray(cells[:, mirrored_order("wedge")])
    return cells


def groups_of_values(name: str, values: np.ndarray) -> dict[str, IntArray]:
    """Return group -> rows for whole-number data, one group for each value."""
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
