"""What force elements with memory do at the beginning of a step."""

from floatframe.kernels.compilation import inner
from floatframe.kernels.port import predict_port

__all__ = ["begin_step"]


@inner
def begin_step(model, work, memory, h):
    """Take the unknowns of the last step as known, and move the coordinates of couplers by their rates."""
    for k in range(memory.w.shape[0]):
        work.w_start[k] = memory.w[k]
        work.w[k] = memory.w[k]
    for p in range(model.p_a.shape[0]):
        predict_port(model, work, p, h)
