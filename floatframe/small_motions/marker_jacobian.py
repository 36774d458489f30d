"""Motion of a marker by the small motions of its body."""

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.compiling.markers import MarkerData
from floatframe.compiling.system import CompiledSystem
from floatframe.kernels.work import Work

__all__ = ["marker_jacobian"]


def marker_jacobian(compiled: CompiledSystem, work: Work, data: MarkerData) -> Array:
    """Return translation and rotation (ground axes) of a marker by the motion of its body (body axes), (6, 6 + n)."""
    model, i = compiled.model, data.body
    q = work.state.q[int(model.bodies.q0[i]) : int(model.bodies.q0[i + 1])]
    return np.kron(np.eye(2), work.state.R[i]) @ data.shape.jacobian(q)
