"""What force elements with memory do at the beginning of a step."""

from floatframe.kernels.compiler.compilation import inner
from floatframe.kernels.connections.element_coordinate import predict_port
from floatframe.kernels.connections.user_force import begin_states

__all__ = ["begin_step"]


@inner
def begin_step(model, work, memory, h, alpha_f):
    """Take the unknowns of the last step as known, move coordinates of ports by their rates, and prepare states."""
    for k in range(memory.w.shape[0]):
        work.state.w_start[k] = memory.w[k]
        work.state.w[k] = memory.w[k]
    for p in range(model.ports.a.shape[0]):
        predict_port(model, work, p, h)
    begin_states(model, work, memory, h, alpha_f)
