"""Conversion of mesh objects of other Python libraries, recognised by class without importing the libraries."""

from pathlib import Path
from typing import Any

import numpy as np

from fe_models.errors import MeshError
from fe_models.foundation.arrays import IntArray
from fe_models.meshes.cells.line_cells import line_mesh_from_raw
from fe_models.meshes.cells.raw_mesh import RawBlock, RawMesh, mesh_from_raw
from fe_models.meshes.cells.shell_cells import shell_mesh_from_raw
from fe_models.meshes.line_mesh import LineMesh
from fe_models.meshes.mesh import Mesh
from fe_models.meshes.node_cloud import NodeCloud
from fe_models.meshes.objects.meshio_mesh import (
    CELL_NUMBERS,
    NODE_NUMBERS,
    groups_of_values,
    numbers_among,
    raw_from_meshio,
    upright_wedges,
)
from fe_models.meshes.objects.skfem_basis import raw_from_basis
from fe_models.meshes.objects.skfem_mesh import raw_from_skfem
from fe_models.meshes.shell_mesh import ShellMesh

__all__ = ["as_line_mesh", "as_mesh", "as_shell_mesh", "raw_from_pyvista", "selectable"]


# content of a `pyvista.UnstructuredGrid`: its cells, and whole-number data as groups ----------------------------------


VTK_TYPES = {
    1: "vertex", 3: "line", 5: "triangle", 9: "quad", 10: "tetra", 12: "hexahedron", 13: "wedge", 14: "pyramid",
    21: "line3", 22: "triangle6", 23: "quad8", 24: "tetra10", 25: "hexahedron20", 26: "wedge15", 27: "pyramid13",
    28: "quad9", 29: "hexahedron27", 32: "wedge18",
}  # fmt: skip
#: number of a cell type in VTK -> name in meshio


def raw_from_pyvista(grid: Any) -> RawMesh:
    """Return nodes, cells and groups of an unstructured grid.

    Every value of whole-number cell data is a group `<array>_<value>`; point data with only 0 and 1 are node sets.
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


# as mesh --------------------------------------------------------------------------------------------------------------


KNOWN = {
    ("meshio", "Mesh"): raw_from_meshio,
    ("pyvista", "UnstructuredGrid"): raw_from_pyvista,
    ("skfem", "AbstractBasis"): raw_from_basis,
    ("skfem", "Mesh"): raw_from_skfem,
}  #: reader of each class or base class, by library and class name


def as_mesh(mesh_like: Any) -> Mesh:
    """Return a solid mesh from an object: a `Mesh` unchanged, or one of meshio, pyvista or scikit-fem converted.

    Parameters
    ----------
    mesh_like
        A `fe_models.Mesh`, `meshio.Mesh`, `pyvista.UnstructuredGrid`, a mesh of scikit-fem (`MeshTet1`, `MeshTet2`,
        `MeshHex1`, `MeshHex2`, `MeshWedge1`), or a vector basis on one, whose nodes are those of its element.

    Raises
    ------
    MeshError
        If it is none of these, has no solid cells, or cells of an unknown kind.
    """
    if isinstance(mesh_like, Mesh):
        return mesh_like
    return mesh_from_raw(*_said(mesh_like))


def selectable(mesh_like: Any) -> Mesh | ShellMesh | LineMesh | NodeCloud:
    """Return a mesh or nodes for selections: objects of this package unchanged, others as their solid mesh."""
    return mesh_like if isinstance(mesh_like, Mesh | ShellMesh | LineMesh | NodeCloud) else as_mesh(mesh_like)


def as_shell_mesh(mesh_like: Any) -> ShellMesh:
    """Return the mesh of all triangles and quads of an object; `MeshTri1`, `MeshQuad1` are at z = 0.

    Parameters
    ----------
    mesh_like
        A `ShellMesh`, or an object of another library as for `as_mesh`, with at least one triangle or quad.
    """
    if isinstance(mesh_like, ShellMesh):
        return mesh_like
    return shell_mesh_from_raw(*_said(mesh_like), None, ())


def as_line_mesh(mesh_like: Any) -> LineMesh:
    """Return the mesh of all lines of an object.

    Parameters
    ----------
    mesh_like
        A `LineMesh`, or an object of another library as for `as_mesh`, with at least one line.
    """
    if isinstance(mesh_like, LineMesh):
        return mesh_like
    return line_mesh_from_raw(*_said(mesh_like), None)


def _said(mesh_like: Any) -> tuple[RawMesh, Path, str]:
    """Return the raw mesh of an object, a name for messages, and no digest."""
    bases = [(base.__module__.partition(".")[0], base.__name__) for base in type(mesh_like).__mro__]
    for base in bases:
        if base in KNOWN:
            return KNOWN[base](mesh_like), Path(".".join(bases[0])), ""
    known = ", ".join(".".join(name) for name in KNOWN)
    raise MeshError(f"mesh: expected a mesh of fe_models, or one of {known}; got {'.'.join(bases[0])}")
