"""Motion of points and dofs of a rigid body, loads per unit mass in this motion, and the work of forces on it.

Weight and d'Alembert loads of rigid motion are linear in position (theory.md §7).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fe_models.foundation.arrays import Array, IntArray

__all__ = ["MassLoads", "rigid_motion_of_dofs", "rigid_motion_of_points", "rotation_work"]


def rigid_motion_of_points(points: Array, origin: ArrayLike) -> Array:
    """Return the translations of points in the six unit rigid-body motions about the origin, (n_points, 3, 6).

    u = d + theta × (c - origin), with columns d_x d_y d_z theta_x theta_y theta_z.
    """
    motion = np.zeros((len(points), 3, 6))
    motion[:, :, :3] = np.eye(3)
    x, y, z = (np.asarray(points) - np.asarray(origin)).T
    motion[:, 1, 3], motion[:, 2, 3] = -z, y
    motion[:, 0, 4], motion[:, 2, 4] = z, -x
    motion[:, 0, 5], motion[:, 1, 5] = -y, x
    return motion


def rigid_motion_of_dofs(nodes: Array, dofs: IntArray, origin: ArrayLike = (0.0, 0.0, 0.0)) -> Array:
    """Return the dofs in the six unit rigid-body motions about the origin, (n_dof, 6).

    The columns are d_x d_y d_z [-] and theta_x theta_y theta_z [m]. Rotational dofs take the rotation; multipliers are
    zero.

    Parameters
    ----------
    nodes
        (n_nodes, 3) [m].
    dofs
        (node, component) of every dof, (n_dof, 2); component 0-2 translation, 3-5 rotation, negative: multiplier.
    origin
        Reference point of the rotations, (3,) [m]; default: the origin of the mesh.
    """
    motion = rigid_motion_of_points(nodes, origin)
    node, component = dofs.T
    Psi_R = np.zeros((len(dofs), 6))
    is_translation = (component >= 0) & (component < 3)
    is_rotation = component >= 3
    Psi_R[is_translation] = motion[node[is_translation], component[is_translation]]
    Psi_R[is_rotation, component[is_rotation]] = 1.0
    return Psi_R


@dataclass(frozen=True, eq=False)
class MassLoads:
    """Set of k loads with the force per unit mass f = A c + b at the undeformed position c, mesh axes."""

    A: Array  #: gradient of each load, (k, 3, 3) [1/s² per unit of the load]
    b: Array  #: value of each load at the mesh origin, (k, 3) [m/s² per unit of the load]

    @classmethod
    def none(cls, k: int) -> "MassLoads":
        """Return k zero loads."""
        return cls(np.zeros((k, 3, 3)), np.zeros((k, 3)))

    @property
    def k(self) -> int:
        """Number of loads."""
        return len(self.b)

    def at(self, points: Array) -> Array:
        """Return the forces per unit mass, (..., 3, k), at points (..., 3)."""
        return np.einsum("jab,...b->...aj", self.A, points) + self.b.T

    def plus_rigid(self, motion: Array, origin: Array) -> "MassLoads":
        """Return the loads plus d + theta × (c - origin), where motion = [d; theta], (6, k)."""
        d, theta = motion[:3].T, motion[3:].T
        A = np.array(self.A)
        for a, (b, c) in enumerate(((1, 2), (2, 0), (0, 1))):  # theta~ has -theta_a in row b, column c
            A[:, b, c] -= theta[:, a]
            A[:, c, b] += theta[:, a]
        return MassLoads(A, self.b + d - np.cross(theta, origin))


def rotation_work(V: Array) -> Array:
    """Return W, (..., 3, 3): thetaᵀ W theta' is the work of forces on the second-order motion of a rigid rotation.

    A point at lever o moves by theta × o + ½ theta × (theta × o) if theta is a rotation vector. Forces f do work on the
    bilinear form ½ [theta × (theta' × o) + theta' × (theta × o)]. Hence W = sym(V) - tr(V) 1 with V = Σ f oᵀ.
    """
    V = np.asarray(V)
    trace = np.trace(V, axis1=-2, axis2=-1)[..., None, None]
    return np.asarray((V + np.swapaxes(V, -1, -2)) / 2 - trace * np.eye(3))
