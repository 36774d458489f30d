"""Coordinates over a step: their values at its ends, how they change, and forces along them whose work is exact.

A distance along an axis of A is a sum of products of a direction and a position, a distance of points the root of one,
an angle that of kernels/rows.py: each has a discrete derivative, so that a force Q along a coordinate does the
work Q times its change. TWIST_B is an angle about an axis of B: that of A seen from B, the other way.

In a step a body turns by 2 atan(|theta|/2) with the mean angular velocity theta/h. A torque by the discrete derivative
of the angle is so much weaker, which keeps the energy of springs and reactions. Motors, dampers, friction and user
forces act by the whole torque about the mean axis, with the rate of the mean angular velocities: their impulse is h Q,
their work h Q times the rate, exactly.
"""

import math

from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.vector import cross, dot, norm, scaled, sub, turned, vector
from floatframe.engine.structure_preserving.kernels.markers import add_direction, add_force, add_moment, turning
from floatframe.engine.structure_preserving.kernels.rows import (
    angle_change,
    angle_loads,
    angle_of,
    mean_direction,
    mean_distance,
    slip_change,
)
from floatframe.model.joints.rows.kinds import PUSH, SPAN, TWIST_B

__all__ = ["add_coordinate_force", "add_impulsive_force", "add_pair", "coordinate_at", "coordinate_change",
           "coordinate_ends", "coordinate_rate", "counted", "ends_of_step", "span_lengths"]  # fmt: skip


@inner
def add_pair(step, a, b, F):
    """Add a force on B and its opposite on A."""
    add_force(step, b, F)
    add_force(step, a, scaled(-1.0, F))


@inner
def span_lengths(step, a, b):
    """Return the distances of two points at the start and end of the force interval."""
    d_0 = sub(vector(step.x_0[b]), vector(step.x_0[a]))
    return norm(d_0), norm(sub(vector(step.x_f[b]), vector(step.x_f[a])))


@inner
def coordinate_change(model, discrete, step, k, a, b):
    """Return the change of the coordinate of row k over the step."""
    kind = model.rows.kind[k]
    if kind == PUSH:
        slip, _, _ = slip_change(model, discrete, step, vector(model.rows.x[k]), a, b)
        return slip
    if kind == SPAN:
        l_0, l_1 = span_lengths(step, a, b)
        return 2.0 * dot(mean_distance(step, a, b), sub(vector(step.dx[b]), vector(step.dx[a]))) / (l_0 + l_1)
    if kind == TWIST_B:
        return -angle_change(model, discrete, step, k, b, a)
    return angle_change(model, discrete, step, k, a, b)


@inner
def coordinate_at(model, x, A, k, a, b):
    """Return the coordinate of row k for places x and axes A of the markers; an angle between -pi and pi."""
    kind = model.rows.kind[k]
    if kind == TWIST_B:
        return -angle_of(model, A, k, b, a)
    d = sub(vector(x[b]), vector(x[a]))
    if kind == PUSH:
        return dot(turned(A[a], vector(model.rows.x[k])), d)
    if kind == SPAN:
        return norm(d)
    return angle_of(model, A, k, a, b)


@inner
def coordinate_ends(model, step, k, a, b, change):
    """Return the coordinate of row k at the start and end of the force interval; angles are not counted."""
    end = coordinate_at(model, step.x_f, step.A_f, k, a, b)
    if step.is_still:
        return end, end
    return end - change, end


@inner
def counted(model, k, x, known):
    """Return the value of the coordinate of row k; for angles the value nearest to the previous one."""
    if not model.rows.is_angle[k]:
        return x
    return x + 2 * math.pi * math.floor((known - x) / (2 * math.pi) + 0.5)


@inner
def ends_of_step(model, step, k, a, b):
    """Return the coordinate of row k, counted, at both ends of the step itself."""
    begin = counted(model, k, coordinate_at(model, step.x_0, step.A_0, k, a, b), step.known[k])
    return begin, counted(model, k, coordinate_at(model, step.end.markers.r, step.end.markers.A, k, a, b), begin)


@inner
def add_coordinate_force(model, discrete, step, k, a, b, Q):
    """Add the loads of a force or torque Q along the coordinate of row k."""
    kind = model.rows.kind[k]
    if kind == PUSH:
        x = vector(model.rows.x[k])
        _, E, d = slip_change(model, discrete, step, x, a, b)
        add_pair(step, a, b, scaled(Q, E))
        add_direction(model, discrete, step, a, x, scaled(Q, d))
    elif kind == SPAN:
        l_0, l_1 = span_lengths(step, a, b)
        add_pair(step, a, b, scaled(2.0 * Q / (l_0 + l_1), mean_distance(step, a, b)))
    elif kind == TWIST_B:
        angle_loads(model, discrete, step, k, b, a, -Q)
    else:
        angle_loads(model, discrete, step, k, a, b, Q)


@inner
def angle_axis(model, step, k, a):
    """Return the unit axis of the angle of row k, fixed in marker a, from the mean of its directions."""
    axis = mean_direction(step, a, cross(vector(model.rows.x[k]), vector(model.rows.z[k])))
    length = norm(axis)
    return scaled(1.0 / length, axis) if length > 0.0 else axis


@inner
def coordinate_rate(model, discrete, step, k, a, b):
    """Return the mean rate of the coordinate of row k; for an angle that of the angular velocities about its axis."""
    kind = model.rows.kind[k]
    if kind == PUSH or kind == SPAN:
        return coordinate_change(model, discrete, step, k, a, b) / step.h
    axis = angle_axis(model, step, k, b if kind == TWIST_B else a)
    return dot(axis, sub(turning(model, step, b), turning(model, step, a))) / step.h


@inner
def add_impulsive_force(model, discrete, step, k, a, b, Q):
    """Add the loads of a force or torque Q along the coordinate of row k: impulse h Q, work h Q times its rate."""
    kind = model.rows.kind[k]
    if kind == PUSH or kind == SPAN:
        add_coordinate_force(model, discrete, step, k, a, b, Q)
        return
    T = scaled(Q, angle_axis(model, step, k, b if kind == TWIST_B else a))
    add_moment(model, step, b, T)
    add_moment(model, step, a, scaled(-1.0, T))
