"""The plane of every cell: local axes, corners in the plane, and the map from nodal dofs to corner dofs."""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array, IntArray, frozen, tilde

__all__ = ["CellPlanes", "cell_planes"]


@dataclass(frozen=True, eq=False)
class CellPlanes:
    """The planes of n cells of one type with c corners.

    The corners of the plane are connected to the nodes by rigid arms: normal to the plane where four nodes are warped,
    and along the offset of the middle surface. u_corner = u_node + theta_node × lever, so rigid motion is always exact.
    """

    R: Array  #: local axes x, y, z (normal) as columns, mesh axes, (n, 3, 3)
    corners: Array  #: corners of the middle surface, mesh axes, (n, c, 3) [m]
    levers: Array  #: vectors from node to corner, mesh axes, (n, c, 3) [m]
    xy: Array  #: corners in local axes about their mean, (n, c, 2) [m]
    warp: Array  #: distance of the nodes of a quad from its plane, (n,) [m]

    @property
    def T(self) -> Array:
        """Map from nodal dofs to local corner dofs, u_x u_y u_z theta_x theta_y theta_z each, (n, 6c, 6c)."""
        n, c = self.levers.shape[:2]
        T = np.zeros((n, 6 * c, 6 * c))
        Rt = self.R.transpose(0, 2, 1)
        for k in range(c):
            at = slice(6 * k, 6 * k + 3), slice(6 * k + 3, 6 * k + 6)
            T[:, at[0], at[0]] = T[:, at[1], at[1]] = Rt
            T[:, at[0], at[1]] = -Rt @ tilde(self.levers[:, k])
        return T

    def __getitem__(self, rows: slice | IntArray) -> "CellPlanes":
        return CellPlanes(self.R[rows], self.corners[rows], self.levers[rows], self.xy[rows], self.warp[rows])


def cell_planes(nodes: Array, cells: IntArray, offset: Array, direction: Array) -> CellPlanes:
    """Return the planes of cells of three or four nodes.

    (1) z is normal to both diagonals of a quad, or to the sides of a triangle, right-handed in the order of the nodes
    (2) x is the direction projected onto the plane; without a direction it is the first side of a triangle, or for a
        quad d_13 - d_24, which lies between the diagonals
    (3) the plane passes through the mean of the nodes, moved by the offset along z

    Parameters
    ----------
    nodes
        Positions, (n_nodes, 3) [m].
    cells
        Nodes of the cells, (n, 3) or (n, 4).
    offset
        Distance of the middle surface from the nodes along z, (n,) [m].
    direction
        Direction in mesh axes, (n, 3); zero: none.
    """
    X = nodes[cells]
    if cells.shape[1] == 3:
        x, other = X[:, 1] - X[:, 0], X[:, 2] - X[:, 0]
        normal = np.cross(x, other)
    else:
        d_13, d_24 = X[:, 2] - X[:, 0], X[:, 3] - X[:, 1]
        normal = np.cross(d_13, d_24)  # (1)
        x = _unit(d_13) - _unit(d_24)  # (2)
    z = _unit(normal)
    along = direction - z * np.einsum("na,na->n", direction, z)[:, None]
    x = _unit(np.where((direction != 0).any(axis=1)[:, None], along, x))
    R = np.stack([x, np.cross(z, x), z], axis=2)
    middle = X.mean(axis=1, keepdims=True)
    local = (X - middle) @ R
    plane = local * np.array([1.0, 1.0, 0.0]) + offset[:, None, None] * np.array([0.0, 0.0, 1.0])  # (3)
    levers = (plane - local) @ R.transpose(0, 2, 1)
    warp = np.abs(local[:, :, 2]).max(axis=1)
    return CellPlanes(frozen(R), frozen(X + levers), frozen(levers), frozen(local[:, :, :2]), frozen(warp))


def _unit(v: Array) -> Array:
    length = np.linalg.norm(v, axis=1, keepdims=True)
    return v / np.where(length > 0, length, 1.0)
