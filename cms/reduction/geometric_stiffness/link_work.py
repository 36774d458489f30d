"""Second-order motion of rigid links: a follower away from the axis of a rotation moves to second order (theory.md §7).

In a recovery u_mesh = T u, the rotation columns hold the lever of every follower: u_s = u + B theta with B = -a~. If
theta is a rotation vector, the follower also moves by ½ theta × (B theta). Forces on followers do work on this motion.
"""

import numpy as np
import scipy.sparse as sp

from fe_models.foundation.arrays import Array, IntArray

__all__ = ["followers", "link_work"]


def followers(T: sp.csr_array, row_dofs: IntArray, column_dofs: IntArray) -> IntArray:
    """Return the nodes whose translation follows a rotation, given (node, component) of the rows and columns of T."""
    entries = _levers(T, row_dofs, column_dofs)
    return np.unique(row_dofs[entries.row, 0]).astype(np.int64)


def link_work(T: sp.csr_array, row_dofs: IntArray, column_dofs: IntArray, forces: Array, Phi: Array) -> Array:
    """Return the work of forces on the second-order motion of links, forces·½ [theta_k × (B theta_l) + …], (k, n, n).

    Parameters
    ----------
    T
        Matrix from the dofs of the body to rows, such as the mesh dofs, (n_rows, n_dof).
    row_dofs, column_dofs
        (node, component) of rows and columns, (n_rows, 2) and (n_dof, 2).
    forces
        Forces on the rows, (n_rows, k) [N].
    Phi
        Displacement columns over the dofs of the body, (n_dof, n).
    """
    n_loads, n = forces.shape[1], Phi.shape[1]
    levers = _levers(T, row_dofs, column_dofs)
    components = np.zeros((len(row_dofs) and int(row_dofs[:, 0].max()) + 1, 3, n_loads))
    is_translation = (row_dofs[:, 1] >= 0) & (row_dofs[:, 1] < 3)
    components[row_dofs[is_translation, 0], row_dofs[is_translation, 1]] = forces[is_translation]
    at = components[row_dofs[levers.row, 0]]  # components of the complete node, (n_levers, 3, n_loads)
    is_loaded = at.any(axis=(1, 2))
    row, column, value, at = levers.row[is_loaded], levers.col[is_loaded], levers.data[is_loaded], at[is_loaded]
    masters, index = np.unique(column_dofs[column, 0], return_inverse=True)
    # f·(theta_k × B theta_l) = -theta_kᵀ f~ B theta_l; column c of f~ is f × e_c
    work = -value[:, None, None] * np.cross(at, np.eye(3)[row_dofs[row, 1]][:, :, None], axis=1)
    Q = np.zeros((len(masters), 3, 3, n_loads))
    for a in range(3):
        np.add.at(Q[:, a], (index, column_dofs[column, 1] - 3), work[:, a])
    theta = np.zeros((len(masters), 3, n))
    place = np.searchsorted(masters, column_dofs[:, 0])
    is_theta = (column_dofs[:, 1] >= 3) & np.isin(column_dofs[:, 0], masters)
    theta[place[is_theta], column_dofs[is_theta, 1] - 3] = Phi[is_theta]
    half = np.einsum("mak,mabj,mbl->jkl", theta, Q, theta, optimize=True)
    return np.asarray((half + half.transpose(0, 2, 1)) / 2)


def _levers(T: sp.csr_array, row_dofs: IntArray, column_dofs: IntArray) -> sp.coo_array:
    """Return the entries that move a translation by a rotation."""
    entries = sp.coo_array(T)
    row, column = row_dofs[entries.row, 1], column_dofs[entries.col, 1]
    chosen = (row >= 0) & (row < 3) & (column >= 3) & (entries.data != 0)
    return sp.coo_array((entries.data[chosen], (entries.row[chosen], entries.col[chosen])), shape=entries.shape)
