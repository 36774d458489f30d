"""Motion of points and dofs that follow a rigid body."""

import numpy as np

from fe_models.foundation.arrays import Array, IntArray

__all__ = ["rigid_motion_of_dofs", "rigid_motion_of_points"]


def rigid_motion_of_points(points: Array, origin: Array) -> Array:
    """Return the translations of points under the six unit rigid-body motions about the origin, (n_points, 3, 6).

    u = d + theta × (c - origin), with columns d_x d_y d_z theta_x theta_y theta_z.
    """
    motion = np.zeros((len(points), 3, 6))
    motion[:, :, :3] = np.eye(3)
    x, y, z = (np.asarray(points) - origin).T
    motion[:, 1, 3], motion[:, 2, 3] = -z, y
    motion[:, 0, 4], motion[:, 2, 4] = z, -x
    motion[:, 0, 5], motion[:, 1, 5] = -y, x
    return motion


def rigid_motion_of_dofs(nodes: Array, dofs: IntArray, origin: Array) -> Array:
    """Return the values of dofs under the six unit rigid-body motions about the origin, (n_dof, 6).

    The columns are d_x d_y d_z [-] and theta_x theta_y theta_z [m]. Rotational dofs take the rotation; multipliers are
    zero.

    Parameters
    ----------
    nodes
        (n_nodes, 3) [m].
    dofs
        (node, component) of every dof, (n_dof, 2); component 0-2 translation, 3-5 rotation, negative: multiplier.
    """
    motion = rigid_motion_of_points(nodes, origin)
    node, component = dofs.T
    Psi_R = np.zeros((len(dofs), 6))
    is_translation = (component >= 0) & (component < 3)
    is_rotation = component >= 3
    Psi_R[is_translation] = motion[node[is_translation], component[is_translation]]
    Psi_R[is_rotation, component[is_rotation]] = 1.0
    return Psi_R
