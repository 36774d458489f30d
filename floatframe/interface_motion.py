"""Where an interface of a flexible body is during a computed motion."""

import numpy as np
from scipy.spatial.transform import Rotation

from cms.arrays import Array
from cms.reduced_body import ReducedInterface
from floatframe.trajectory import BodyMotion

__all__ = ["elastic_displacement", "interface_path"]


def elastic_displacement(motion: BodyMotion, interface: ReducedInterface) -> Array:
    """Return the displacement of an interface in the body frame, u_B = Psi q, (n_t, 3) [m]."""
    return np.asarray(motion.q @ interface.Psi[:3].T)


def interface_path(motion: BodyMotion, interface: ReducedInterface) -> Array:
    """Return the position of an interface in ground axes, r + R_GB (position + Psi q), (n_t, 3) [m]."""
    R_GB = Rotation.from_quat(motion.p[:, [1, 2, 3, 0]]).as_matrix()
    local = interface.position + elastic_displacement(motion, interface)
    return np.asarray(motion.r + np.einsum("tab,tb->ta", R_GB, local))
