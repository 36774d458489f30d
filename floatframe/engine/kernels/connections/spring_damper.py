"""Spring-dampers between two markers.

F = s d,   s = k (l - l_0) + c l_dot + preload,   d = (r_B - r_A)/l
dF = (ds - s/l dl) d + s/l dd,   ds = k dl + c dl_dot,   dl = d · dd,   dl_dot = d · dv + (dd · v - l_dot dl)/l

At length zero the direction d is undefined; only a spring of free length zero has a force there, F = k (r_B - r_A).

Described in `floatframe.model.forces.springs`.
"""

from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.time_function import time_function
from floatframe.engine.kernels.vector import add, dot, norm, put, scaled, vector

__all__ = ["spring_power", "spring_state", "spring_variation"]


@inner
def spring_state(model, work, c):
    """Write the quantities of spring c into work.spring, and F into work.pair."""
    i, springs, s, x = model.connections.item[c], model.springs, work.spring, vector(work.pair.d)
    s.length, s.rate, s.stiffness, s.given = norm(x), 0.0, springs.stiffness[i], 0.0
    s.tension_by_length = s.stiffness
    if s.length > 0.0:
        s.rate, stretch = dot(x, work.pair.v) / s.length, s.length - springs.free_length[i]
        tension = s.stiffness * stretch + springs.damping[i] * s.rate + springs.preload[i]
        if springs.table[i] >= 0:
            value, slope, _ = time_function(model.functions, springs.table[i], stretch)
            tension += value
            s.stiffness += slope
            s.given = -value * s.rate
        s.tension_by_length = tension / s.length
    put(work.pair.F, 0, scaled(s.tension_by_length, x))


@inner
def spring_variation(model, work, c):
    """Write the change of F for the variation of the motion in work.pair."""
    s, pair, by_direction = work.spring, work.pair, 0.0
    x, dd = vector(pair.d), vector(pair.motion)
    if s.length > 0.0:
        way = dot(x, dd) / s.length
        rate = (dot(dd, pair.v) + dot(x, pair.motion[6:]) - s.rate * way) / s.length
        change = s.stiffness * way + model.springs.damping[model.connections.item[c]] * rate
        by_direction = (change - s.tension_by_length * way) / s.length
    put(pair.F_change, 0, add(scaled(by_direction, x), scaled(s.tension_by_length, dd)))


@inner
def spring_power(model, work, c):
    """Return k (l - l_0)²/2 + preload l, the power supplied by the table, and the power dissipated by damping."""
    i, springs, s = model.connections.item[c], model.springs, work.spring
    stretch = s.length - springs.free_length[i]
    stored = 0.5 * springs.stiffness[i] * stretch**2 + springs.preload[i] * s.length
    return stored, s.given, springs.damping[i] * s.rate * s.rate
