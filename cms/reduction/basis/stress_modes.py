"""Stress modes: stress of each mode at kept nodes and at named points, in the axes of the body frame."""

import numpy as np

from cms.body.reduced_body import BodyFrame
from cms.body.stress import PointStress
from fe_models.body.fe_body import FEBody, StressPointModel
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.tall.columns import elsewhere, in_memory
from fe_models.foundation.tall.on_disk import is_on_disk, release, zeros_like

__all__ = ["nodal_stress_modes", "point_stress_modes", "turned_stress"]

FEWEST = 16  #: smallest number of columns processed at a time
FEWEST_OF_RANKS = 4  #: smallest number of distributed columns processed at a time; they belong to large bodies
BYTES_AT_ONCE = 512e6  #: memory for the stress at all nodes, before the kept nodes are selected
BYTES_FROM_DISK = (
    64e6  #: memory limit if columns are on disk or distributed; columns and stress together take five times as much
)


def nodal_stress_modes(body: FEBody, Phi: Array, nodes: IntArray, axes: Array) -> Array | None:
    """Return the stress of the shapes at given nodes in axes of B, (n, 6, n_q) [Pa per unit]; None if unknown.

    Parameters
    ----------
    body
        Body, coupled or not.
    Phi
        Shapes over the dofs of the body, (n_dof, n_q).
    nodes
        Indices into `FEBody.nodes`, (n,). Reference nodes are not in the mesh; their stress is zero.
    axes
        Axes of B as columns, in mesh axes, (3, 3).
    """
    model = body.element_model
    if model is None or not model.has_nodal_stress:
        return None
    modes = zeros_like(Phi, (len(nodes), 6, Phi.shape[1]))
    is_on_ranks = elsewhere(Phi) is not None
    room = BYTES_FROM_DISK if is_on_ranks or is_on_disk(Phi) else BYTES_AT_ONCE
    fewest = FEWEST_OF_RANKS if is_on_ranks else FEWEST
    # wide blocks, because the geometry is computed once per block
    width = max(fewest, int(room / (48 * len(body.nodes))))
    for begin in range(0, Phi.shape[1], width):
        columns = slice(begin, begin + width)
        everywhere = model.nodal_stress(body.mesh_displacement(in_memory(Phi[:, columns])), nodes=nodes)
        on_mesh = nodes < len(everywhere)
        modes[on_mesh, :, columns] = turned_stress(everywhere[nodes[on_mesh]], axes)
        release(modes)
    return modes


def point_stress_modes(body: FEBody, points: StressPointModel, Phi: Array, frame: BodyFrame) -> PointStress:
    """Return the stress of the shapes at the stress points of the body, in axes of B."""
    modes = points.stress(body.mesh_displacement(in_memory(Phi)))
    positions = (np.asarray(points.positions) - frame.origin) @ frame.axes
    return PointStress(points.names, positions, turned_stress(modes, frame.axes))


def turned_stress(stress: Array, axes: Array) -> Array:
    """Return stress components in rotated axes: Rᵀ sigma R, (n, 6, k), where R = axes has the new axes as columns."""
    if np.array_equal(axes, np.eye(3)):
        return np.asarray(stress)
    tensor = np.asarray(stress)[:, [[0, 5, 4], [5, 1, 3], [4, 3, 2]]]
    turned = np.einsum("ia,nijk,jb->nabk", axes, tensor, axes, optimize=True)
    return np.stack([turned[:, a, b] for a, b in ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))], axis=1)
