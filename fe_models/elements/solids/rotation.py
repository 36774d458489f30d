"""Rotation at nodes of a solid mesh, which have only translational dofs: half the curl of the displacement.

(1) in a cell, H_ij = ∂u_i/∂x_j at its node, from its shape functions. This is exact for fields linear in x, hence for
    rigid rotations and constant strain on any mesh, and for quadratic fields in straight-edged quadratic cells
(2) theta = ½ (H_32 - H_23, H_13 - H_31, H_21 - H_12): the mean rotation of all fibres through the point. In a sheared
    beam it lies midway between the slope of the axis and the rotation of the section
(3) at a node, average over its cells
"""

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.errors import BodyError
from fe_models.meshes.cell_shapes import CELL_SHAPES, shape_values
from fe_models.meshes.mesh import Mesh

__all__ = ["nodal_rotation"]

FLAT = 1e-9  #: det J divided by the cube of its largest entry, up to which a cell has no gradient at its node


def nodal_rotation(mesh: Mesh, u: Array, nodes: IntArray) -> Array:
    """Return rotation vectors at some nodes, (n, 3, k), of displacement columns u, (3 n_nodes, k), mesh axes.

    Raises
    ------
    BodyError
        If no cell at a node has a gradient there, because the cells are collapsed.
    """
    fields = np.asarray(u).reshape(len(mesh.nodes), 3, -1)
    place = np.full(len(mesh.nodes), -1)
    place[nodes] = np.arange(len(nodes))
    total, count = np.zeros((len(nodes), 3, fields.shape[2])), np.zeros(len(nodes))
    for kind, cells in mesh.cells.items():
        _, dN = shape_values(kind, CELL_SHAPES[kind].nodes)  # (node, shape, axis)
        row, local = np.nonzero(place[cells] >= 0)
        X, at = mesh.nodes[cells[row]], place[cells[row, local]]
        J = np.einsum("nai,nak->nik", X, dN[local])
        size = np.abs(J).max(axis=(1, 2), initial=0.0) ** 3
        good = np.linalg.det(J) > FLAT * size
        row, local, J, at = row[good], local[good], J[good], at[good]
        grad = np.einsum("nak,nki->nai", dN[local], np.linalg.inv(J))  # (1)
        U = fields[cells[row]]  # (n, shape, component, k)
        for a, (i, j) in enumerate(((2, 1), (0, 2), (1, 0))):  # (2)
            curl = np.einsum("nb,nbk->nk", grad[:, :, j], U[:, :, i]) - np.einsum(
                "nb,nbk->nk", grad[:, :, i], U[:, :, j]
            )
            np.add.at(total[:, a], at, curl / 2)
        np.add.at(count, at, 1.0)
    if not count.all():
        raise BodyError(f"rotation at node index {nodes[int(np.argmin(count))]}: no cell there has a gradient")
    return total / count[:, None, None]  # (3)
