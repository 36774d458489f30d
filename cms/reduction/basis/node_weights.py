"""Sums over the nodes of a body, weighted with nodal volume: the norm of a Buckens frame (theory.md §4)."""

import numpy as np

from cms.errors import BodyError
from fe_models.body.fe_body import FEBody
from fe_models.body.rigid_motion import rigid_motion_of_points
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["node_weights", "weighted_rigid_modes"]


def node_weights(body: FEBody) -> Array:
    """Return the weight of each node, (n_nodes,): its volume, or 1; 0 if it lacks a translation of its own.

    Reference nodes of couplings have weight 0, because they represent no material.
    """
    dofs = mesh_dofs(body)
    has = np.zeros((len(body.nodes), 3), dtype=bool)
    translation = dofs[(dofs[:, 1] >= 0) & (dofs[:, 1] < 3)]
    has[translation[:, 0], translation[:, 1]] = True
    weights = np.ones(len(body.nodes)) if body.node_volumes is None else np.asarray(body.node_volumes)
    return np.where(has.all(axis=1), weights, 0.0)


def mesh_dofs(body: FEBody) -> IntArray:
    """Return (node, component) of the mesh dofs, (n_mesh_dof, 2)."""
    return body.dofs if body.recovery is None else body.recovery.dofs


def weighted_rigid_modes(body: FEBody, origin: Array) -> Array:
    """Return W Psi_R over the dofs of the body, (n_dof, 6); its product with columns gives their weighted sums.

    Raises
    ------
    BodyError
        If no node has three translations, or all such nodes are collinear.
    """
    weights, dofs = node_weights(body), mesh_dofs(body)
    used = weights > 0
    points = body.nodes[used]
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False) if used.sum() > 2 else np.zeros(3)
    if spread[1] <= 1e-8 * spread[0]:
        raise BodyError(
            f"body {body.name!r}: a Buckens frame needs at least three nodes with translations that are not on one "
            "line; take a Tisserand or a nodal frame"
        )
    motion = rigid_motion_of_points(body.nodes, origin)
    node, component = dofs.T
    rows = np.flatnonzero((component >= 0) & (component < 3))
    on_mesh = np.zeros((len(dofs), 6))
    on_mesh[rows] = weights[node[rows], None] * motion[node[rows], component[rows]]
    return on_mesh if body.recovery is None else np.asarray(body.recovery.matrix.T @ on_mesh)
