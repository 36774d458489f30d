"""Supports taken out of a stiffness, where the rows of what they hold exist."""

import numpy as np
import scipy.sparse as sp

from fe_models.body.freedom import RigidForces, rigid_forces
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from fe_models.errors import MatrixError
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["without_supports"]


def without_supports(
    where: str, K: sp.csc_array, M: sp.csc_array, nodes: Array, dofs: IntArray
) -> tuple[sp.csc_array, str]:
    """Return the stiffness of the released body, and what was taken out.

    A support between a node and the ground adds to the block K_nn of that node and nowhere else. In a free body the
    rigid-body motions Psi about n, which are 1 on the dofs of n, meet no force, K_nn + K_n,rest Psi_rest = 0:

    (1) rows that answer translations, or all of their own stiffness: those of the supported nodes
    (2) K_nn = -K_n,rest Psi_rest: nothing is subtracted from K_nn, in which a penalty of 1e36 leaves no digits
    (3) the result is free in all six motions, of which turns were not used by (2) on nodes without rotations

    Parameters
    ----------
    where
        For messages.
    K, M
        (n_dof, n_dof).
    nodes
        (n_nodes, 3) [m].
    dofs
        (node, component), (n_dof, 2).

    Raises
    ------
    MatrixError
        If there are no supports, or the body is not free without them.
    """
    forces = rigid_forces(K, M, nodes, dofs)
    supported = supported_nodes(forces, dofs)  # (1)
    if not len(supported):
        raise MatrixError(f"{where}: there are no supports to remove: K answers no rigid-body motion")
    rows_of = sp.csr_array(K)
    blocks = []
    for node in supported:  # (2)
        rows = np.flatnonzero(dofs[:, 0] == node)
        Psi = rigid_motion_of_dofs(nodes, dofs, nodes[node])[:, dofs[rows, 1]]
        Psi[rows] = 0.0
        K_nn = -(rows_of[rows] @ Psi)
        blocks.append((rows, (K_nn + K_nn.T) / 2))
    entries = sp.coo_array(K)
    node_1, node_2 = dofs[entries.row, 0], dofs[entries.col, 0]
    kept = (node_1 != node_2) | ~np.isin(node_1, supported)
    values = np.concatenate([entries.data[kept], *(block.ravel() for _, block in blocks)])
    row = np.concatenate([entries.row[kept], *(np.repeat(rows, len(rows)) for rows, _ in blocks)])
    column = np.concatenate([entries.col[kept], *(np.tile(rows, len(rows)) for rows, _ in blocks)])
    released = sp.csc_array((values, (row, column)), shape=K.shape)
    left = rigid_forces(released, M, nodes, dofs)
    if not left.is_free:  # (3)
        raise MatrixError(
            f"{where}: without what holds {len(supported)} nodes to the ground the body is still not free (up to "
            f"{left.largest.max():.1e} of its stiffest entry): rows were taken out, or it is held by more than its "
            "diagonal; write the matrices without supports"
        )
    return released, f"supports of {len(supported)} nodes were removed"


def supported_nodes(forces: RigidForces, dofs: IntArray) -> IntArray:
    """Return the nodes whose rows answer rigid-body motion, ascending."""
    return np.unique(dofs[forces.rows, 0])
