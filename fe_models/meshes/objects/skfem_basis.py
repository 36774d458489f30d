"""Nodes of a vector basis of scikit-fem: node and component of each dof."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from fe_models.errors import MeshError
from fe_models.foundation.arrays import Array, IntArray
from fe_models.meshes.cells.raw_mesh import RawMesh
from fe_models.meshes.objects.skfem_mesh import SOLID_KINDS, raw_from_cells

__all__ = ["BasisNodes", "nodes_of_basis", "raw_from_basis"]

COMPARED = 8  #: number of cells in which shape functions are compared
SAME = 1e-12  #: largest difference between equal shape functions, and of exact sums


@dataclass(frozen=True, eq=False)
class BasisNodes:
    """Nodes and dofs of a basis in which each dof is the value of one component at a point."""

    nodes: Array  #: node positions, (n_nodes, 3)
    dofs: IntArray  #: node and component of each dof of the basis, (N, 2)
    cells: IntArray  #: nodes of each cell in the order of the scalar element, (n_cells, n)


def nodes_of_basis(basis: Any) -> BasisNodes:
    """Return the nodes of a basis, which its shape functions determine, for any name of the element.

    (1) each shape function must have one component that is not zero, the same in all cells;
    (2) the three functions with equal values belong to one node;
    (3) Σ phi_s = 1 and Σ phi_s x_s = x at every quadrature point, with the positions x_s of the dofs; the coefficients
        of a rigid motion are then its displacements at the nodes, as `FEBody` assumes.

    Raises
    ------
    MeshError
        If the basis does not have three dimensions and components, or a condition (1) to (3) does not hold (bubbles,
        edge elements, Hermite elements).
    """
    where = f"scikit-fem basis of {type(basis.elem).__name__}"
    advice = "expected ElementVector of an element whose dofs are values at points, such as ElementTetP2()"
    if basis.mesh.dim() != 3:
        raise MeshError(f"{where}: expected a mesh in space, got {basis.mesh.dim()} dimensions")
    if getattr(basis, "tind", None) is not None and len(basis.tind) != basis.mesh.t.shape[1]:
        raise MeshError(f"{where}: it has {len(basis.tind)} of {basis.mesh.t.shape[1]} cells; pass the basis of all")
    values = [np.asarray(fields[0]) for fields in basis.basis]
    if any(value.ndim != 3 or value.shape[0] != 3 for value in values):
        raise MeshError(f"{where}: {advice}")
    sizes = np.array([np.abs(value).max(axis=(1, 2)) for value in values])
    component = sizes.argmax(axis=1)
    if ((sizes > SAME).sum(axis=1) != 1).any():  # (1)
        raise MeshError(f"{where}: shape functions with several components; {advice}")
    scalars = [value[c] for value, c in zip(values, component, strict=True)]
    groups: list[list[int]] = []
    for k, scalar in enumerate(scalars):  # (2)
        for group in groups:
            if len(group) < 3 and np.abs(scalars[group[0]][:COMPARED] - scalar[:COMPARED]).max() <= SAME:
                group.append(k)
                break
        else:
            groups.append([k])
    if any(sorted(component[group]) != [0, 1, 2] for group in groups):
        raise MeshError(f"{where}: its shape functions do not come in threes, one for each component; {advice}")
    of_component = np.array([sorted(group, key=lambda k: int(component[k])) for group in groups])
    element_dofs = np.asarray(basis.element_dofs, dtype=np.int64)
    locations = np.asarray(basis.doflocs, dtype=float).T
    first = element_dofs[of_component[:, 0]]  # dof of the first component of each node of each cell
    _require_nodal(f"{where}: {advice}", basis, scalars, of_component, locations[first])
    numbers, cells = np.unique(first, return_inverse=True)
    cells = cells.reshape(first.shape)
    dofs = np.full((int(basis.N), 2), -1, dtype=np.int64)
    for c in range(3):
        rows = element_dofs[of_component[:, c]]
        dofs[rows, 0], dofs[rows, 1] = cells, c
    if (dofs < 0).any():
        raise MeshError(f"{where}: {int((dofs[:, 0] < 0).sum())} of {basis.N} dofs belong to no cell")
    return BasisNodes(locations[numbers], dofs, cells.T)


def _require_nodal(where: str, basis: Any, scalars: list[Array], of_component: IntArray, places: Array) -> None:
    """Step (3): check the nodal basis; places: positions of the nodes of each cell, (n, n_cells, 3)."""
    phi = np.array([scalars[k] for k in of_component[:, 0]])
    x = np.asarray(basis.global_coordinates())
    size = float(np.ptp(x.reshape(3, -1), axis=1).max())
    unity = np.abs(phi.sum(axis=0) - 1).max()
    if not np.isfinite(places).all() or unity > 1e3 * SAME:
        raise MeshError(f"{where}; the sum of its shape functions is off one by {unity:.2g}")
    linear = np.abs(np.einsum("neq,nec->ceq", phi, places) - x).max()
    if linear > 1e3 * SAME * max(size, float(np.abs(x).max())):
        raise MeshError(
            f"{where}; rigid motions are not the values at the places of its dofs (off by {linear:.2g} of a body "
            f"{size:.2g} large): the element has to be as curved as the mesh"
        )


def raw_from_basis(basis: Any) -> RawMesh:
    """Return the raw mesh whose nodes are those of the basis, for selections and interfaces.

    Raises
    ------
    MeshError
        As for `nodes_of_basis`, and if no cell type here has the nodes of the element.
    """
    found = nodes_of_basis(basis)
    element = type(getattr(basis.elem, "elem", basis.elem)).__name__
    if element not in SOLID_KINDS:
        raise MeshError(
            f"scikit-fem basis of {element}: no cell type here has its nodes (known: {', '.join(SOLID_KINDS)}); "
            "select interfaces on fe_models.meshes.NodeCloud(nodes)"
        )
    positions = np.asarray(basis.mesh.doflocs, dtype=float).T
    vertices = np.unique(basis.mesh.t)
    of_vertex = np.full(len(positions), -1)
    t = np.asarray(basis.mesh.t, dtype=np.int64)
    of_vertex[t] = found.cells.T[: len(t)]  # dofs of vertices come first in every element of scikit-fem
    slack = 1e-9 * float(np.ptp(positions))
    if np.abs(found.nodes[of_vertex[vertices]] - positions[vertices]).max() > slack:
        raise MeshError(f"scikit-fem basis of {element}: its first dofs are not at the vertices of the mesh")
    return raw_from_cells(basis.mesh, element, found.nodes, found.cells, of_vertex)
