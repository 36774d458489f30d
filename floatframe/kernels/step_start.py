"""What force elements with memory do at the beginning of a step."""

from floatframe.kernels.compiler.compilation import inner
from floatframe.kernels.connections.coordinate import predict_coordinate
from floatframe.kernels.connections.user_force import begin_states

__all__ = ["begin_step"]


@inner
def begin_step(model, work, memory, h, alpha_f):
    """Take the unknowns of the last step as known, move angles and coordinates by their rates, and prepare states."""
    for k in range(memory.w.shape[0]):
        work.state.w_start[k] = memory.w[k]
        work.state.w[k] = memory.w[k]
    for k in range(memory.angle.shape[0]):
        work.state.angle[k] = memory.angle[k] + h * memory.angle_rate[k]
    for p in range(model.coordinates.a.shape[0]):
        predict_coordinate(model.coordinates, work.state, p, h)
    begin_states(model.states.row, work.states, memory, h, alpha_f)
