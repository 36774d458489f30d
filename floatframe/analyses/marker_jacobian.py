"""Motion of a marker by the small motions of its body."""

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.compiling.markers import MarkerData
from floatframe.compiling.system import CompiledSystem
from floatframe.kernels.model import Work
from floatframe.rotations import right_jacobian, tilde

__all__ = ["marker_jacobian"]


def marker_jacobian(compiled: CompiledSystem, work: Work, data: MarkerData) -> Array:
    """Return translation and rotation (ground axes) of a marker by the motion of its body (body axes), (6, 6 + n)."""
    model, i = compiled.model, data.body
    n = int(model.n_q[i])
    q = work.q[int(model.q0[i]) : int(model.q0[i + 1])]
    R = work.R[i]
    if data.psi is None:
        rho, psi, angle = data.position, None, np.zeros(3)
    else:
        psi = data.psi if data.bend is None else data.psi - data.bend @ q
        d = 0.5 * (data.psi + psi) @ q
        rho, angle = data.position + d[:3], d[3:]
    J = np.zeros((6, 6 + n))
    J[:3, :3] = J[3:, 3:6] = np.eye(3)
    J[:3, 3:6] = -tilde(rho)
    if psi is not None:
        J[:3, 6:] = psi[:3]
        J[3:, 6:] = right_jacobian(angle).T @ psi[3:]  # rotation of E in body axes before E
    return np.kron(np.eye(2), R) @ J
