"""The memories after each step of a call, from which any step can be repeated."""

from floatframe.engine.kernels.compiler.compilation import inner

__all__ = ["keep_past"]


@inner
def keep_row(source, target, k):
    """Copy numbers into row k."""
    for j in range(source.shape[0]):
        target[k, j] = source[j]


@inner
def keep_past(past, memory, a, h, n_iterations):
    """Store the memory after a step of size h, for which the method has the accelerations a, if space is left."""
    k = past.n
    if k >= past.h.shape[0]:
        return
    for i in range(memory.r.shape[0]):
        keep_row(memory.r[i], past.r[k], i)
        keep_row(memory.p[i], past.p[k], i)
    keep_row(memory.q, past.q, k)
    keep_row(memory.u, past.u, k)
    keep_row(memory.u_dot, past.u_dot, k)
    keep_row(a, past.a, k)
    keep_row(memory.w, past.w, k)
    past.work[k, 0], past.work[k, 1] = memory.work_given, memory.work_taken
    past.power[k, 0], past.power[k, 1] = memory.power_given, memory.power_taken
    past.h[k], past.h_wanted[k] = h, memory.h_wanted
    keep_row(memory.angle, past.angle, k)
    keep_row(memory.angle_rate, past.angle_rate, k)
    past.counts[k, 0], past.counts[k, 1] = memory.n_accepted, memory.n_rejected
    past.counts[k, 2] = n_iterations
    past.n = k + 1
