"""Spring-dampers between two markers.

F - s d = 0,   s = k (l - l_0) + c l_dot + preload,   d = (r_B - r_A)/l
d(s d)/dr_B = (k - s/l) d dᵀ + (s/l) 1 + (c/l) d (v - l_dot d)ᵀ,   d(s d)/dv_B = c d dᵀ

Described in `floatframe.model.forces.springs`.
"""

from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.joints.relative_motion import distance, relative_velocity
from floatframe.engine.kernels.time_function import time_function
from floatframe.engine.kernels.vector import dot, norm, put, scaled, sub, vector

__all__ = ["spring_derivatives", "spring_rows", "spring_tension"]


@inner
def spring_tension(model, work, c):
    """Return tension over length, length and rate of length of spring c.

    At length zero the tension has a direction only if the free length is zero: then k remains.
    """
    markers = work.markers
    i, springs = model.connections.item[c], model.springs
    k, damping, free, preload = springs.stiffness[i], springs.damping[i], springs.free_length[i], springs.preload[i]
    a, b = model.connections.a[c], model.connections.b[c]
    x = distance(markers, a, b)
    length = norm(x)
    if length == 0.0:
        return k, length, 0.0
    rate = dot(x, relative_velocity(markers, a, b)) / length
    tension = k * (length - free) + damping * rate + preload
    if springs.table[i] >= 0:
        value, _, _ = time_function(model.functions, springs.table[i], length - free)
        tension += value
    return tension / length, length, rate


@inner
def spring_rows(model, work, c, c_k):
    """Write the residual of spring c."""
    w0 = model.connections.w0[c]
    tension, _, _ = spring_tension(model, work, c)
    x = distance(work.markers, model.connections.a[c], model.connections.b[c])
    put(work.connections.g, w0, scaled(c_k, sub(vector(work.state.w[w0:]), scaled(tension, x))))


@inner
def spring_derivatives(model, work, c, c_k):
    """Write P and V of spring c."""
    markers = work.markers
    a, b = model.connections.a[c], model.connections.b[c]
    P_a, P_b, V = work.connections.P[a], work.connections.P[b], work.connections.V[c]
    i, springs = model.connections.item[c], model.springs
    k, damping, free = springs.stiffness[i], springs.damping[i], springs.free_length[i]
    x, y = distance(markers, a, b), relative_velocity(markers, a, b)
    tension, length, rate = spring_tension(model, work, c)
    if springs.table[i] >= 0:
        _, slope, _ = time_function(model.functions, springs.table[i], length - free)
        k += slope
    for r in range(3):
        V[r, r] = 1.0
        for j in range(3):
            by_r = tension if r == j else 0.0
            by_v = 0.0
            if length > 0.0:
                d_r, d_j = x[r] / length, x[j] / length
                by_r += (k - tension) * d_r * d_j + damping / length * d_r * (y[j] - rate * d_j)
                by_v = damping * d_r * d_j
            P_a[r, j] = c_k * by_r
            P_b[r, j] = -c_k * by_r
            P_a[r, 6 + j] = c_k * by_v
            P_b[r, 6 + j] = -c_k * by_v
