"""Forces over a step: loads whose work equals the change of their potential, with supplied and dissipated work.

Springs act by the discrete derivative of their potential (Gonzalez 1996), here in closed form: with the lengths l_0,
l_1 at both ends, |d_1|² - |d_0|² = 2 d_mean·(d_1 - d_0), so that the tension k ((l_0 + l_1)/2 - l_free) along
2 d_mean/(l_0 + l_1) does the work of the change of k (l - l_free)²/2 exactly. Rates are changes over the step.
"""

import math

from floatframe.engine.kernels.body import column
from floatframe.engine.kernels.compiler.compilation import inner, loops
from floatframe.engine.kernels.dense import rows_of
from floatframe.engine.kernels.joints.coordinate_force import excess, given_force
from floatframe.engine.kernels.joints.loaded_rows import normal_part
from floatframe.engine.kernels.time_function import time_function
from floatframe.engine.kernels.vector import (
    cross,
    dot,
    matrix,
    matrix_sum,
    put_sum,
    scaled,
    scaled_matrix,
    sub,
    turned,
    vector,
)
from floatframe.engine.structure_preserving.kernels.coordinates import (
    add_coordinate_force,
    add_impulsive_force,
    coordinate_change,
    coordinate_ends,
    coordinate_rate,
    span,
)
from floatframe.engine.structure_preserving.kernels.held_rows import add_reaction
from floatframe.engine.structure_preserving.kernels.markers import (
    add_force,
    add_moment,
    add_pair,
    begin_unit_load,
    end_unit_load,
    mean_direction,
    turning,
)
from floatframe.engine.structure_preserving.kernels.rows import mean_distance
from floatframe.model.joints.rows.kinds import PUSH

__all__ = ["body_load", "coordinate_load", "normal_force", "point_load", "spring_load"]


@inner
def spring_load(model, step, c):
    """Add the loads of spring-damper c."""
    a, b, s, springs = model.connections.a[c], model.connections.b[c], model.connections.item[c], model.springs
    k, damping, free, preload = springs.stiffness[s], springs.damping[s], springs.free_length[s], springs.preload[s]
    if k != 0.0 and free == 0.0 and damping == 0.0 and preload == 0.0 and springs.table[s] < 0:
        add_pair(step, a, b, scaled(-k, mean_distance(step, a, b)))  # through length zero
        return 0.0, 0.0
    length, e = span(step, a, b)
    change = dot(e, sub(vector(step.dx[b]), vector(step.dx[a])))
    tension = k * (length - free) + preload + damping * change / step.h
    given = 0.0
    if springs.table[s] >= 0:
        value, _, _ = time_function(model.functions, springs.table[s], length - free)
        tension += value
        given = -value * change
    add_pair(step, a, b, scaled(-tension, e))
    return given, damping * change * change / step.h


@inner
def point_load(model, step, k):
    """Add load k, with constant direction in ground or marker axes, and return the supplied work."""
    m, factor, work = model.loads.marker[k], 1.0, 0.0
    if model.loads.factor[k] >= 0:
        factor, _, _ = time_function(model.functions, model.loads.factor[k], step.t_force)
    F, T = scaled(factor, vector(model.loads.force[k])), scaled(factor, vector(model.loads.torque[k]))
    if model.markers.is_follower[m]:
        F, T = mean_direction(step, m, F), mean_direction(step, m, T)
    add_force(step, m, F)
    add_moment(model, step, m, T)
    work = dot(F, vector(step.dx[m])) + dot(T, turning(model, step, m))
    return work


@loops
def body_load(model, discrete, step, k):
    """Add load case k of a body, in its axes about its frame origin, and return the supplied work."""
    i, first = model.body_loads.body[k], model.body_loads.value0[k]
    n, u0, q0 = model.bodies.n_q[i], model.bodies.u0[i], model.bodies.q0[i]
    factor, _, _ = time_function(model.functions, model.body_loads.factor[k], step.t_force)
    values, C = model.body_loads.values[first : first + 6 + n], rows_of(step.C_mean, 3, q0, n)
    f, tau, s = scaled(factor, vector(values)), scaled(factor, vector(values[3:])), vector(step.s_mean[i])
    far = matrix(step.R_0[i]) if step.is_still else matrix(step.R_1[i])
    R = scaled_matrix(0.5, matrix_sum(matrix(step.R_0[i]), far))
    F, T = turned(R, f), turned(R, sub(tau, cross(s, f)))
    put_sum(step.load, u0, F)
    put_sum(step.load, u0 + 3, T)
    work = dot(F, vector(step.d[i])) + dot(T, vector(step.theta_G[i]))
    for j in range(n):
        h = factor * values[6 + j] - dot(column(C, j), f)
        step.load[u0 + 6 + j] += h
        work += h * step.dq[q0 + j]
    return work


@inner
def normal_force(model, discrete, step, c, k):
    """Return the size of the joint force in c normal to the axis of row k."""
    a, b = model.connections.a[c], model.connections.b[c]
    begin_unit_load(step, a, b)
    for j in range(discrete.first[c], discrete.first[c + 1]):
        add_reaction(model, discrete, step, c, discrete.row[j], step.f[j])
    F = vector(step.F[1, b])
    end_unit_load(model, step, a, b)
    x = vector(model.rows.x[k])
    axis = x if model.rows.kind[k] == PUSH else cross(x, vector(model.rows.z[k]))
    normal, _ = normal_part(F, mean_direction(step, a, axis))
    return normal


@inner
def coordinate_load(model, discrete, step, k, a, b, normal):
    """Add the forces along row k's coordinate (PUSH, TWIST, TWIST_B); normal: joint force normal to the coordinate.

    Springs do the work of the change of their potential; the impulse of all others is h times their force.
    """
    is_angle = model.rows.is_angle[k]
    change = coordinate_change(model, discrete, step, k, a, b)
    begin, end = coordinate_ends(model, step, k, a, b, change)
    rate, f = coordinate_rate(model, discrete, step, k, a, b), model.joint_forces
    Q, spring, given, taken = 0.0, 0.0, 0.0, 0.0
    for i in range(model.rows.force0[k], model.rows.force1[k]):
        mean = excess(f, i, is_angle, 0.5 * (begin + end))
        entering, _ = given_force(model, i, step.t_force, mean)
        resisting = f.damping[i] * rate
        if f.friction[i] > 0.0 or f.coefficient[i] > 0.0:
            resisting += (f.friction[i] + f.coefficient[i] * normal) * math.tanh(rate / f.speed[i])
        Q += entering - resisting
        spring -= f.stiffness[i] * mean
        given += entering * rate * step.h
        taken += resisting * rate * step.h
    add_impulsive_force(model, discrete, step, k, a, b, Q)
    if spring != 0.0:
        add_coordinate_force(model, discrete, step, k, a, b, spring)
    return given, taken
