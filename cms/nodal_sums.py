"""Sums over the nodes of a body, weighted by the volume each stands for: the norm of a Buckens frame (THEORY §4)."""

from dataclasses import dataclass

import numpy as np

from cms.arrays import Array, IntArray, frozen, require_finite, require_shape
from cms.errors import BodyError
from cms.fe_body import FEBody
from cms.rigid_modes import rigid_motion_of_points

__all__ = ["NodalSums", "node_weights", "weighted_rigid_modes"]


@dataclass(frozen=True, eq=False)
class NodalSums:
    """Weighted sums over all nodes about the origin of a frame B, w: weight of a node, translations only.

    Together they are [1, c]ᵀ W [1, c, Phi] as far as a frame needs them: C of W-least deformation follows from them.
    """

    w: float  #: sum of the weights [m³, or 1 where the nodes count equally]
    S: Array  #: Σ w c, (3,) [· m]
    R: Array  #: Σ w c_a c_b, (3, 3) [· m²]
    U1: Array  #: Σ w phi_k, (3, n_q)
    U2: Array  #: Σ w c × phi_k, (3, n_q) [· m]
    is_volume: bool = True  #: False: every node counts 1

    def __post_init__(self) -> None:
        object.__setattr__(self, "w", float(self.w))
        n = np.asarray(self.U1).shape[-1]
        for name, shape in {"S": (3,), "R": (3, 3), "U1": (3, n), "U2": (3, n)}.items():
            array = frozen(getattr(self, name))
            require_shape(f"nodal sums: {name}", array, shape)
            require_finite(f"nodal sums: {name}", array)
            object.__setattr__(self, name, array)


def node_weights(body: FEBody) -> Array:
    """Return the weight of each node, (n_nodes,): its volume, or 1; 0 where it lacks a translation of its own.

    Reference nodes of couplings have none: they stand for no material.
    """
    dofs = mesh_dofs(body)
    has = np.zeros((len(body.nodes), 3), dtype=bool)
    translation = dofs[(dofs[:, 1] >= 0) & (dofs[:, 1] < 3)]
    has[translation[:, 0], translation[:, 1]] = True
    weights = np.ones(len(body.nodes)) if body.node_volumes is None else np.asarray(body.node_volumes)
    return np.where(has.all(axis=1), weights, 0.0)


def mesh_dofs(body: FEBody) -> IntArray:
    """Return (node, component) of the dofs of the mesh, (n_mesh_dof, 2)."""
    return body.dofs if body.recovery is None else body.recovery.dofs


def weighted_rigid_modes(body: FEBody, origin: Array) -> Array:
    """Return W Psi_R over the dofs of the body, (n_dof, 6): its product with columns gives their weighted sums.

    Raises
    ------
    BodyError
        If no node has three translations, or all of those are on one line.
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
