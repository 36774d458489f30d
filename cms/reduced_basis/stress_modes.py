"""Stress modes: the stress of each mode at kept nodes and at named points, in the axes of the body frame."""

import numpy as np

from cms.reduced_body.stress import PointStress
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.ranks.spread_columns import SpreadColumns
from fe_models.foundation.tall.on_disk import in_memory, is_on_disk, release, zeros_like

__all__ = ["nodal_stress_modes", "point_stress_modes", "turned_stress"]

FEWEST = 16  #: columns at a time, however large the body
FEWEST_OF_RANKS = 4  #: the same of columns on many ranks, which are there because the body is large
BYTES_AT_ONCE = 512e6  #: of stress, which is known at all nodes before it is cut to the kept ones
BYTES_FROM_DISK = (
    64e6  #: the same where columns lie on disk or on many ranks: with the columns themselves it is five times as much
)


def nodal_stress_modes(body: FEBody, Phi: Array, nodes: IntArray, axes: Array) -> Array | None:
    """Return the stress of the shapes at some nodes in the axes of B, (n, 6, n_q) [Pa per unit]; None if unknown.

    Parameters
    ----------
    body
        Coupled or not.
    Phi
        Shapes over its dofs, (n_dof, n_q).
    nodes
        Indices into `FEBody.nodes`, (n,); reference nodes, which are not of the mesh, have no stress: zero.
    axes
        Columns: axes of B in mesh axes, (3, 3).
    """
    model = body.element_model
    if model is None or not model.has_nodal_stress:
        return None
    modes = zeros_like(Phi, (len(nodes), 6, Phi.shape[1]))
    is_elsewhere = is_on_disk(Phi) or isinstance(Phi, SpreadColumns)
    room = BYTES_FROM_DISK if is_elsewhere else BYTES_AT_ONCE
    fewest = FEWEST_OF_RANKS if isinstance(Phi, SpreadColumns) else FEWEST
    width = max(fewest, int(room / (48 * len(body.nodes))))  # wide: the geometry is worked out once for all
    for begin in range(0, Phi.shape[1], width):
        columns = slice(begin, begin + width)
        everywhere = model.nodal_stress(body.mesh_displacement(in_memory(Phi[:, columns])), nodes=nodes)
        on_mesh = nodes < len(everywhere)
        modes[on_mesh, :, columns] = turned_stress(everywhere[nodes[on_mesh]], axes)
        release(modes)
    return modes


def point_stress_modes(body: FEBody, Phi: Array, origin: Array, axes: Array) -> PointStress | None:
    """Return the stress of the shapes at the stress points of the body; None if it has none."""
    points = body.stress_points
    if points is None:
        return None
    modes = points.stress(body.mesh_displacement(in_memory(Phi)))
    return PointStress(points.names, (np.asarray(points.positions) - origin) @ axes, turned_stress(modes, axes))


def turned_stress(stress: Array, axes: Array) -> Array:
    """Return stress components in other axes: Rᵀ sigma R, (n, 6, k), R = axes with the new axes as columns."""
    if np.array_equal(axes, np.eye(3)):
        return np.asarray(stress)
    tensor = np.asarray(stress)[:, [[0, 5, 4], [5, 1, 3], [4, 3, 2]]]
    turned = np.einsum("ia,nijk,jb->nabk", axes, tensor, axes, optimize=True)
    return np.stack([turned[:, a, b] for a, b in ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))], axis=1)
