"""Stress at the nodes of a solid mesh, from displacements."""

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np

from fe_models.body.material import AnyMaterial
from fe_models.elements.solids.elements import reference_element
from fe_models.elements.solids.incompatible import KIND, VOIGT, brick_chunks, brick_operators, gradient_stress
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.threads import n_threads
from fe_models.meshes.mesh import Mesh

__all__ = ["nodal_stress"]


def nodal_stress(
    mesh: Mesh,
    materials: tuple[AnyMaterial, ...],
    of_cell: Mapping[str, IntArray],
    of_node: IntArray,
    u: Array,
    *,
    nodes: IntArray | None = None,
    incompatible: bool = False,
) -> Array:
    """Return the stress at the nodes, (n_nodes, 6, k) [Pa], of displacement columns u, (3 n_nodes, k) [m].

    (1) compute sigma = C eps at the sampling points of each element; for isotropic materials lam tr(eps) 1 + 2 mu eps;
    (2) extrapolate to the element's nodes by the shape functions of its low-order relative (`ReferenceElement`);
    (3) average at each node over the elements of the node's material, weighted with element volume.
    The result is linear in u. The components are xx, yy, zz, yz, xz, xy.

    Parameters
    ----------
    mesh, materials
        Mesh with its solid cells, and the materials to which `of_cell` refers.
    of_cell
        Index of the material of each cell, (n_cells,), by cell type.
    of_node
        Index of the material whose stress is used at each node, (n_nodes,); see `SolidModel.of_node`.
    u
        Displacement columns, dof 3 i + c is component c of node i, (3 n_nodes, k).
    nodes
        Nodes whose stress is computed, from their elements only; it is zero at other nodes. None: all nodes.
    incompatible
        Whether eight-node bricks have incompatible modes.
    """
    from fe_models.elements.solids.stress_kernels import add_element_stress, volume_at_nodes

    tensors = np.array([material.stiffness for material in materials])
    volume = np.zeros(len(mesh.nodes))
    wanted = np.ones(len(mesh.nodes), dtype=bool)
    if nodes is not None:
        wanted[:] = False
        wanted[nodes[nodes < len(wanted)]] = True
    fields = np.ascontiguousarray(u).reshape(len(mesh.nodes), 3, -1)
    n_columns = fields.shape[2]
    stress = np.zeros((len(mesh.nodes), 6, n_columns))
    cuts = np.linspace(0, n_columns, min(n_threads(), n_columns) + 1).astype(int) if n_columns else np.zeros(1, int)
    with ThreadPoolExecutor(n_threads()) as pool:  # each thread writes only to its own columns
        for kind, all_cells in mesh.cells.items():
            is_wanted = np.ones(len(all_cells), bool) if nodes is None else wanted[all_cells].any(axis=1)
            cells, material = all_cells[is_wanted], of_cell[kind][is_wanted]
            if not len(cells):
                continue
            element = reference_element(kind)
            table = element.stress
            volume_at_nodes(mesh.nodes, cells, material, of_node, table.gradients, table.weights, volume)
            if incompatible and kind == KIND:
                add_brick_stress(mesh.nodes, cells, tensors[material], material[:, None] == of_node[cells], u, stress)
                continue
            futures = [
                pool.submit(
                    add_element_stress,
                    mesh.nodes,
                    cells,
                    material,
                    of_node,
                    tensors,
                    table.gradients,
                    table.weights,
                    element.extrapolation,
                    fields,
                    first,
                    last,
                    stress,
                )
                for first, last in pairwise(cuts.tolist())
            ]
            for future in futures:
                future.result()
    np.divide(stress, volume[:, None, None], out=stress, where=volume[:, None, None] > 0)
    stress[~wanted] = 0.0
    return stress


def add_brick_stress(nodes: Array, cells: IntArray, tensors: Array, shows: Array, u: Array, stress: Array) -> None:
    """Add volume times stress of bricks with incompatible modes to the nodes that have the stress of their material.

    Parameters
    ----------
    nodes, cells
        Positions, (n_nodes, 3), and the nodes of the bricks, (n_cells, 8).
    tensors
        Matrix of each cell that maps strain to stress, (n_cells, 6, 6).
    shows
        Whether the stress at each node of each cell is that of the cell's material, (n_cells, 8).
    u
        Displacement columns, (3 n_nodes, k).
    stress
        Sums at the nodes, (n_nodes, 6, k), to which the function adds.
    """
    to_nodes = reference_element(KIND).extrapolation
    for rows, dofs in brick_chunks(cells):
        B, volumes = brick_operators(nodes[cells[rows]], tensors[rows])
        sigma = gradient_stress(B @ u[dofs][:, None], tensors[rows])[:, :, VOIGT]
        at_nodes = np.einsum("ap,npsk,n->nask", to_nodes, sigma, volumes.sum(axis=1), optimize=True)
        np.add.at(stress, cells[rows][shows[rows]], at_nodes[shows[rows]])
