"""Content of a scikit-fem mesh, or of a basis on it: cells, named subdomains and boundaries."""

from typing import Any

import numpy as np

from fe_models.errors import MeshError
from fe_models.foundation.arrays import Array, IntArray
from fe_models.meshes.cell_shapes import SKFEM_ELEMENTS, skfem_node_order
from fe_models.meshes.cells.raw_mesh import RawBlock, RawMesh, turned_upright

__all__ = ["raw_from_cells", "raw_from_skfem"]

SOLID_KINDS = {element: kind for kind, element in SKFEM_ELEMENTS.items()}
FLAT_KINDS = {"ElementTriP1": "triangle", "ElementQuad1": "quad"}


def raw_from_skfem(mesh: Any) -> RawMesh:
    """Return nodes, cells and groups of a mesh of scikit-fem.

    Subdomains become groups of cells, boundaries become groups of faces; a plane mesh is placed at z = 0.

    Raises
    ------
    MeshError
        If there is no element for its cell type.
    """
    name = mesh.elem.__name__
    if name not in SOLID_KINDS | FLAT_KINDS:
        known = ", ".join([*SOLID_KINDS, *FLAT_KINDS])
        raise MeshError(
            f"{_description(mesh)}: expected cells of {known}, got {name}; convert the mesh, or pass the basis"
        )
    nodes = np.asarray(mesh.doflocs, dtype=float).T
    if nodes.shape[1] < 3:
        nodes = np.hstack([nodes, np.zeros((len(nodes), 3 - nodes.shape[1]))])
    cells = np.asarray(mesh.dofs.element_dofs, dtype=np.int64).T
    return raw_from_cells(mesh, name, nodes, cells, np.arange(len(nodes)))


def raw_from_cells(mesh: Any, element: str, nodes: Array, cells: IntArray, of_vertex: IntArray) -> RawMesh:
    """Return the raw mesh of cells in scikit-fem's order, with the groups of a mesh.

    Parameters
    ----------
    mesh
        Mesh with subdomains and boundaries.
    element
        Name of the scalar element of scikit-fem whose nodes the cells have.
    nodes
        Node positions, (n_nodes, 3).
    cells
        Nodes of each cell in the order of the element, (n_cells, n).
    of_vertex
        Node at each vertex of the mesh, (n_vertices,).
    """
    if element in FLAT_KINDS:
        kind = FLAT_KINDS[element]
    else:
        kind = SOLID_KINDS[element]
        cells = turned_upright(kind, nodes, cells[:, skfem_node_order(kind)])  # scikit-fem allows any sign of det J
    subdomains = {name: np.asarray(rows, dtype=np.int64) for name, rows in (mesh.subdomains or {}).items()}
    blocks = [RawBlock(kind, cells, {name: rows for name, rows in subdomains.items() if len(rows)})]
    node_sets: dict[str, IntArray] = {}
    for name, members in (mesh.boundaries or {}).items():
        facets = of_vertex[np.asarray(mesh.facets, dtype=np.int64)[:, np.asarray(members, dtype=np.int64)]].T
        if not len(facets):
            continue
        if kind in FLAT_KINDS.values():
            node_sets[name] = np.unique(facets)
            continue
        for face_kind, rows in _faces(nodes, facets).items():
            blocks.append(RawBlock(face_kind, rows, {name: np.arange(len(rows))}))
    return RawMesh(nodes, tuple(blocks), node_sets)


def _faces(nodes: Array, facets: IntArray) -> dict[str, IntArray]:
    """Return triangles and quads, with quad corners in sequence; triangles in four columns repeat a node or have -1."""
    if facets.shape[1] == 3:
        return {"triangle": facets}
    ordered = np.sort(facets, axis=1)
    is_triangle = (ordered[:, 1:] == ordered[:, :-1]).any(axis=1) | (facets < 0).any(axis=1)
    found: dict[str, IntArray] = {}
    if is_triangle.any():
        found["triangle"] = np.array([np.unique(row[row >= 0]) for row in facets[is_triangle]])
    quads = facets[~is_triangle]
    if len(quads):
        turns = np.array([[0, 1, 2, 3], [0, 1, 3, 2], [0, 2, 1, 3]])
        X = nodes[quads[:, turns]]  # of the three cyclic orders of four corners, the correct one has the largest area
        area = np.linalg.norm(np.cross(X[:, :, 2] - X[:, :, 0], X[:, :, 3] - X[:, :, 1]), axis=2)
        found["quad"] = np.take_along_axis(quads, turns[area.argmax(axis=1)], axis=1)
    return found


def _description(mesh: Any) -> str:
    return f"scikit-fem mesh {type(mesh).__name__}"
