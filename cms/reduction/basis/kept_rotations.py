"""Rotations of the kept nodes, over the shapes."""

import numpy as np

from cms.body.kept_points import KeptPoints
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.tall.on_disk import in_memory

__all__ = ["kept_points"]


def kept_points(body: FEBody, Phi: Array, axes: Array, row_of: IntArray) -> KeptPoints | None:
    """Return the points that a body keeps with rotations; None if there are none.

    (1) if all three rotations of the node are dofs (beams, shells, leaders of rigid groups): these dofs
    (2) else, if the elements know the rotation: half the curl of the displacement
    (`fe_models.elements.solids.body`)
    (3) else the rotations that are dofs, and zero for the others, as in a plane model; without any, the rotation is
        unknown

    Parameters
    ----------
    body
        Coupled body.
    Phi
        Shapes over its dofs, (n_dof, n_q).
    axes
        Axes of B as columns, in mesh axes, (3, 3).
    row_of
        Row of every node among the kept nodes, (n_nodes,).
    """
    nodes = body.kept
    if not len(nodes):
        return None
    Phi = in_memory(Phi)
    u = body.mesh_displacement(Phi)
    rotation, has = rotations_of_dofs(body, Phi, u, nodes)
    source = np.where(has.any(axis=1), "dofs", "unknown").astype(object)
    ask = np.flatnonzero(~has.all(axis=1))
    if len(ask) and body.element_model is not None:
        own = body.element_model.nodal_rotation(u, nodes[ask])
        known = np.isfinite(own).all(axis=(1, 2))
        rotation[ask[known]], source[ask[known]] = own[known], "elements"
    order = np.argsort(row_of[nodes])
    in_body = np.einsum("ba,nbk->nak", axes, rotation)
    return KeptPoints(row_of[nodes][order], in_body[order], tuple(str(word) for word in source[order]))


def rotations_of_dofs(body: FEBody, Phi: Array, u: Array, nodes: IntArray) -> tuple[Array, np.ndarray]:
    """Return rotations that are dofs, (n, 3, n_q), zero for others, and which are dofs, (n, 3) bool.

    A recovery row without entries gives no motion: that rotation had no stiffness and was removed from the model.
    """
    place = np.full(len(body.nodes), -1)
    place[nodes] = np.arange(len(nodes))
    rotation, has = np.zeros((len(nodes), 3, Phi.shape[1])), np.zeros((len(nodes), 3), dtype=bool)
    tables = [(body.dofs, Phi, np.ones(len(body.dofs), dtype=bool))]
    if body.recovery is not None:
        is_motion = np.diff(body.recovery.matrix.tocsr().indptr) > 0
        tables.insert(0, (body.recovery.dofs, u, is_motion))
    for dofs, values, is_motion in tables:
        rows = np.flatnonzero((dofs[:, 1] >= 3) & (place[dofs[:, 0]] >= 0) & is_motion)
        at, component = place[dofs[rows, 0]], dofs[rows, 1] - 3
        rotation[at, component], has[at, component] = values[rows], True
    return rotation, has
