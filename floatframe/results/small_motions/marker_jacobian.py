"""The motion of a marker as a linear function of its body's small motions."""

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.markers import MarkerData
from floatframe.engine.compiling.system import CompiledSystem
from floatframe.engine.kernels.work import Work

__all__ = ["marker_jacobian"]


def marker_jacobian(compiled: CompiledSystem, work: Work, data: MarkerData) -> Array:
    """Return the Jacobian, (6, 6 + n), from body motion (body axes) to the motion of a marker (ground axes)."""
    model, i = compiled.model, data.body
    q = work.state.q[int(model.bodies.q0[i]) : int(model.bodies.q0[i + 1])]
    return np.kron(np.eye(2), work.state.R[i]) @ data.shape.jacobian(q)
