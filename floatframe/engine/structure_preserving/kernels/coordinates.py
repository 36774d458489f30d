"""Coordinates over a step: values at both ends, their change, and forces along them that do exact work.

A distance along an axis of A is a sum of products of a direction and a position, a distance of points is the root of
such a sum, and angles are those of kernels/rows.py. Each has a discrete derivative, so that a force Q along a
coordinate does the work Q times its change. TWIST_B is an angle about an axis of B, measured as the angle of A seen
from B with the opposite sign.

In a step a body turns by 2 atan(|theta|/2), while its mean angular velocity is theta/h. A torque applied by the
discrete derivative of the angle is smaller by this ratio, which conserves the energy of springs and reactions. Motors,
dampers, friction and user forces apply the whole torque about the mean axis, with the rate from the mean angular
velocities: their impulse is exactly h Q, and their work h Q times the rate.
"""

import math

from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.joints.held_rows import A_TO_B, of_a
from floatframe.engine.kernels.joints.relative_motion import coordinate_at
from floatframe.engine.kernels.vector import add, cross, dot, norm, scaled, sub, vector
from floatframe.engine.structure_preserving.kernels.markers import (
    add_moment,
    add_pair,
    begin_unit_load,
    distances,
    end_unit_load,
    mean_direction,
    turning,
)
from floatframe.engine.structure_preserving.kernels.rows import add_product, angle_loads
from floatframe.model.joints.rows.kinds import PUSH, SPAN, TWIST_B

__all__ = ["add_coordinate_force", "add_impulsive_force", "coordinate_change", "coordinate_ends",
           "coordinate_rate", "counted", "ends_of_step", "span"]  # fmt: skip


@inner
def span(step, a, b):
    """Return the mean distance of two points over the force interval, and its derivative by the mean r_B - r_A."""
    d_0, d_1 = distances(step, a, b)
    mean = 0.5 * (norm(d_0) + norm(d_1))
    return mean, scaled(0.5 / mean, add(d_0, d_1))


@inner
def coordinate_change(model, discrete, step, k, a, b):
    """Return the change of row k's coordinate over the step, which is the work of a unit force along it."""
    begin_unit_load(step, a, b)
    add_coordinate_force(model, discrete, step, k, a, b, 1.0)
    return end_unit_load(model, step, a, b)


@inner
def coordinate_ends(model, step, k, a, b, change):
    """Return the coordinate of row k at both ends of the force interval; angles are not counted."""
    end = coordinate_at(model.rows, step.x_f, step.A_f, k, a, b)
    if step.is_still:
        return end, end
    return end - change, end


@inner
def counted(model, k, x, known):
    """Return the value of row k's coordinate; for angles the value nearest to the known one."""
    if not model.rows.is_angle[k]:
        return x
    return x + 2 * math.pi * math.floor((known - x) / (2 * math.pi) + 0.5)


@inner
def ends_of_step(model, step, k, a, b):
    """Return the counted coordinate of row k at both ends of the step."""
    begin = counted(model, k, coordinate_at(model.rows, step.x_0, step.A_0, k, a, b), step.known[k])
    return begin, counted(model, k, coordinate_at(model.rows, step.end.markers.r, step.end.markers.A, k, a, b), begin)


@inner
def add_coordinate_force(model, discrete, step, k, a, b, Q):
    """Add the loads of a force or torque Q along the coordinate of row k."""
    kind = model.rows.kind[k]
    if kind == PUSH:
        add_product(model, discrete, step, a, b, of_a(model.rows.x[k]), A_TO_B, Q)
    elif kind == SPAN:
        _, e = span(step, a, b)
        add_pair(step, a, b, scaled(Q, e))
    elif kind == TWIST_B:
        angle_loads(model, discrete, step, k, b, a, -Q)
    else:
        angle_loads(model, discrete, step, k, a, b, Q)


@inner
def angle_axis(model, step, k, a):
    """Return the unit axis, fixed in marker a, of row k's angle, from the mean of its directions."""
    axis = mean_direction(step, a, cross(vector(model.rows.x[k]), vector(model.rows.z[k])))
    length = norm(axis)
    return scaled(1.0 / length, axis) if length > 0.0 else axis


@inner
def coordinate_rate(model, discrete, step, k, a, b):
    """Return the mean rate of row k's coordinate; for an angle the mean angular velocity about its axis."""
    kind = model.rows.kind[k]
    if kind == PUSH or kind == SPAN:
        return coordinate_change(model, discrete, step, k, a, b) / step.h
    axis = angle_axis(model, step, k, b if kind == TWIST_B else a)
    return dot(axis, sub(turning(model, step, b), turning(model, step, a))) / step.h


@inner
def add_impulsive_force(model, discrete, step, k, a, b, Q):
    """Add the loads of an impulsive force or torque Q along row k's coordinate: impulse h Q, work h Q times rate."""
    kind = model.rows.kind[k]
    if kind == PUSH or kind == SPAN:
        add_coordinate_force(model, discrete, step, k, a, b, Q)
        return
    T = scaled(Q, angle_axis(model, step, k, b if kind == TWIST_B else a))
    add_moment(model, step, b, T)
    add_moment(model, step, a, scaled(-1.0, T))
