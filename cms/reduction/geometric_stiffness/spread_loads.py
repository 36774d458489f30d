"""Six loads distributed over the nodes of a body by weight, and their work when they are rotated (theory.md §7)."""

import numpy as np

from cms.body.reduced_body import BodyFrame
from cms.errors import BodyError
from cms.modes.families.rigid_modes import geometric_rigid_modes
from cms.reduction.basis.node_weights import node_weights, weighted_rigid_modes
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array

__all__ = ["spread_forces", "turned_rigid_work"]


def spread_forces(body: FEBody, frame: BodyFrame) -> Array | None:
    """Return the loads (w_i/w) e_a and (w_i/w) e_a × c_i, axes and origin of B, over the dofs, (n_dof, 6).

    None if there is no Buckens frame, because nodes are collinear or have no translations.
    """
    weights = node_weights(body)
    if not weights.any():
        return None
    try:
        W_Psi_R = weighted_rigid_modes(body, frame.origin)
    except BodyError:
        return None
    return np.asarray(W_Psi_R @ np.kron(np.eye(2), frame.axes) / weights.sum())


def turned_rigid_work(body: FEBody, forces: Array, frame: BodyFrame) -> Array:
    """Return the work of loads, rotated about the axes of B, on the rotations about its axes and origin, (k, 3, 3).

    At a node, e_x × f does work on the translation, and ½ e_x × m on the rotation.

    Parameters
    ----------
    forces
        Loads over the dofs of the body, (n_dof, k) [N, N m].
    """
    node, component = body.dofs.T
    own = np.flatnonzero(component >= 0)
    by_node = np.zeros((len(body.nodes), 2, 3, forces.shape[1]))
    by_node[node[own], component[own] // 3, component[own] % 3] = forces[own]
    by_node[:, 1] /= 2
    rotations = geometric_rigid_modes(body, origin=frame.origin)[own, 3:] @ frame.axes
    work = np.empty((forces.shape[1], 3, 3))
    for x, axis in enumerate(frame.axes.T):
        turned = np.cross(axis[:, None], by_node, axisa=0, axisb=2, axisc=2)
        work[:, x] = turned[node[own], component[own] // 3, component[own] % 3].T @ rotations
    return work
