"""The memories after each step of a call, so that any step can be repeated."""

from floatframe.engine.kernels.compiler.compilation import inner

__all__ = ["keep_past"]


@inner
def keep_row(source, target, k):
    """Copy numbers into row k of an array."""
    for j in range(source.shape[0]):
        target[k, j] = source[j]


@inner
def keep_past(past, memory, a, h):
    """Store the memory after a step of size h with accelerations a, if there is space left."""
    k, target = past.n, past.memory
    if k >= target.h.shape[0]:
        return
    for i in range(memory.r.shape[0]):
        keep_row(memory.r[i], target.r[k], i)
        keep_row(memory.p[i], target.p[k], i)
    keep_row(memory.q, target.q, k)
    keep_row(memory.u, target.u, k)
    keep_row(memory.u_dot, target.u_dot, k)
    keep_row(a, target.a, k)
    keep_row(memory.w, target.w, k)
    keep_row(memory.work, target.work, k)
    keep_row(memory.power, target.power, k)
    keep_row(memory.angle, target.angle, k)
    keep_row(memory.angle_rate, target.angle_rate, k)
    target.h[k], target.h_next[k] = h, memory.h_next
    target.n_steps[k], target.n_rejected[k] = memory.n_steps, memory.n_rejected
    target.n_iterations[k] = memory.n_iterations
    past.n = k + 1
