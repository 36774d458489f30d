"""What a `pyvista.UnstructuredGrid` says: its cells, and whole-number data as groups."""

from typing import Any

import numpy as np

from fe_models.foundation.arrays import IntArray
from fe_models.meshes.cells.raw_mesh import RawBlock, RawMesh
from fe_models.meshes.objects.meshio_mesh import (
    CELL_NUMBERS,
    NODE_NUMBERS,
    groups_of_values,
    numbers_among,
    upright_wedges,
)

__all__ = ["raw_from_pyvista"]

VTK_TYPES = {
    1: "vertex", 3: "line", 5: "triangle", 9: "quad", 10: "tetra", 12: "hexahedron", 13: "wedge", 14: "pyramid",
    21: "line3", 22: "triangle6", 23: "quad8", 24: "tetra10", 25: "hexahedron20", 26: "wedge15", 27: "pyramid13",
    28: "quad9", 29: "hexahedron27", 32: "wedge18",
}  # fmt: skip
#: number of a cell type in VTK -> name in meshio


def raw_from_pyvista(grid: Any) -> RawMesh:
    """Return nodes, cells and groups of an unstructured grid.

    Every value of whole-number cell data is a group `<array>_<value>`; point data that hold only 0 and 1 are node sets.
    Arrays of VTK itself (`vtkOriginalCellIds`, `vtkGhostType`) are left out.
    """
    nodes = np.asarray(grid.points, dtype=float)
    types = np.asarray(grid.celltypes)
    groups: dict[str, IntArray] = {}
    numbers = numbers_among(grid.cell_data, CELL_NUMBERS, len(types))
    for name in grid.cell_data:
        if not name.startswith("vtk") and (numbers is None or name not in CELL_NUMBERS):
            groups |= groups_of_values(name, np.asarray(grid.cell_data[name]))
    blocks = []
    for number, connectivity in grid.cells_dict.items():
        kind = VTK_TYPES.get(int(number), f"VTK type {int(number)}")
        rows = np.flatnonzero(types == number)
        place = np.full(len(types), -1)
        place[rows] = np.arange(len(rows))
        mine = {name: place[members][place[members] >= 0] for name, members in groups.items()}
        cells = upright_wedges(kind, nodes, np.asarray(connectivity, dtype=np.int64))
        own = {name: members for name, members in mine.items() if members.size}
        blocks.append(RawBlock(kind, cells, own, None if numbers is None else numbers[rows]))
    node_sets = {}
    for name in grid.point_data:
        values = np.asarray(grid.point_data[name])
        if values.ndim == 1 and values.dtype.kind in "iub" and set(np.unique(values)) == {0, 1}:
            node_sets[name] = np.flatnonzero(values)
    return RawMesh(nodes, tuple(blocks), node_sets, numbers_among(grid.point_data, NODE_NUMBERS, len(nodes)))
