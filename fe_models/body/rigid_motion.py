"""Motion of points that follow a rigid body."""

import numpy as np

from fe_models.foundation.arrays import Array

__all__ = ["rigid_motion_of_points"]


def rigid_motion_of_points(points: Array, origin: Array) -> Array:
    """Translations of points under the six unit rigid-body motions about the origin, (n_points, 3, 6).

    u = d + theta × (c - origin); columns d_x d_y d_z theta_x theta_y theta_z.
    """
    motion = np.zeros((len(points), 3, 6))
    motion[:, :, :3] = np.eye(3)
    x, y, z = (np.asarray(points) - origin).T
    motion[:, 1, 3], motion[:, 2, 3] = -z, y
    motion[:, 0, 4], motion[:, 2, 4] = z, -x
    motion[:, 0, 5], motion[:, 1, 5] = -y, x
    return motion
