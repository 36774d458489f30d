"""Joint constraints over a step: values at its end, and reactions that do no work while joints stay closed.

A constraint is a sum of products of marker positions and directions. The product rule with mean values,
a_1·b_1 - a_0·b_0 = (a_1 - a_0)·b_mean + a_mean·(b_1 - b_0), gives discrete derivatives: multiplied by the changes of
positions and directions, they add up to the change of the constraint, and they are objective under rotations of the
ground axes. So its reaction does no work between two configurations that fulfil the constraint, and adds no linear or
angular momentum.
"""

import math

from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.joints.held_rows import directions
from floatframe.engine.kernels.joints.relative_motion import distance, prescribed_at
from floatframe.engine.kernels.joints.row_formulas import HELD, by_code
from floatframe.engine.kernels.vector import add, cross, dot, scaled, turned, vector
from floatframe.engine.structure_preserving.kernels.markers import (
    add_direction,
    add_pair,
    distances,
    ends,
    mean_direction,
)
from floatframe.model.joints.rows.kinds import (
    DISTANCE,
    DOT,
    EQUAL_TURN,
    POINT,
    RIM_HEIGHT,
    SCREW,
    SLIDE,
    TURN,
    TURN_B,
)

__all__ = ["add_reaction", "add_slide", "angle_loads", "force_of_row", "held", "mean_distance",
           "row_rate", "row_value"]  # fmt: skip


#: the value function of rows that depend only on positions and time, shared with all other formulations
value_of_places = by_code(
    "value_of_places",
    {code: HELD[code].value for code in (DOT, TURN, TURN_B, SLIDE, DISTANCE, SCREW, RIM_HEIGHT, EQUAL_TURN)},
    "model, work, k, a, b",
)


@inner
def held(model, k, t):
    """Return the value that row k prescribes at time t, and its rate."""
    value, rate, _ = prescribed_at(model, k, t)
    return value, rate


@inner
def slide_axis(model, k):
    """Return the axis in A along which row k measures its distance."""
    x = vector(model.rows.x[k])
    return cross(x, vector(model.rows.z[k])) if model.rows.kind[k] == SCREW else x


@inner
def point_axis(model, step, k, a, b):
    """Return the ground direction of a POINT row, fixed at the start of the step in the body of A, or of B."""
    i = model.markers.body[a]
    if i < 0:
        i = model.markers.body[b]
    return turned(step.R_0[i], vector(model.rows.x[k]))


@inner
def mean_distance(step, a, b):
    """Return the mean of the vector from A to B over the step."""
    d_0, d_1 = distances(step, a, b)
    return scaled(0.5, add(d_0, d_1))


@inner
def row_value(model, step, k, a, b):
    """Return the value of row k at the end of the step."""
    if model.rows.kind[k] == POINT:
        d = distance(step.end.markers, a, b)
        return dot(d, point_axis(model, step, k, a, b))
    value, _, _, _ = value_of_places(model.rows.kind[k], model, step.end, k, a, b)
    return value


@inner
def force_of_row(model, step, k, a, b):
    """Return the force on B for a unit multiplier of a distance row k."""
    kind = model.rows.kind[k]
    if kind == POINT:
        return point_axis(model, step, k, a, b)
    if kind == DISTANCE:
        value, _ = held(model, k, step.t_force)
        return scaled(1.0 / value, mean_distance(step, a, b))
    return mean_direction(step, a, slide_axis(model, k))


@inner
def add_reaction(model, discrete, step, k, a, b, f):
    """Add the loads of row k with multiplier f, whose work is f times the change of the row."""
    kind = model.rows.kind[k]
    if kind == SLIDE or kind == SCREW:
        add_slide(model, discrete, step, a, b, slide_axis(model, k), f)
        if kind == SCREW:
            angle_loads(model, discrete, step, k, a, b, -model.rows.c[k] * f)
        return
    if model.rows.is_length[k]:
        add_pair(step, a, b, scaled(f, force_of_row(model, step, k, a, b)))
        return
    e, y = directions(model, k, step.t_force)
    add_product(model, discrete, step, a, e[0], b, y[0], f)
    if kind == EQUAL_TURN:
        add_product(model, discrete, step, a, vector(model.rows.z[k]), b, vector(model.rows.y[k]), -f)


@inner
def add_product(model, discrete, step, a, e, b, y, f):
    """Add the loads of f times the product of direction e of marker a and y of marker b."""
    E, D = mean_direction(step, a, e), mean_direction(step, b, y)
    add_direction(model, discrete, step, a, e, scaled(f, D))
    add_direction(model, discrete, step, b, y, scaled(f, E))


@inner
def row_rate(model, step, k, a, b, t):
    """Return the explicit time derivative of row k at the beginning of a step, due to its prescribed motion."""
    kind = model.rows.kind[k]
    if model.rows.motion[k] < 0:
        return 0.0
    value, rate = held(model, k, t)
    if kind == SLIDE:
        return -rate
    if kind == DISTANCE:
        d, _ = distances(step, a, b)
        return -0.5 * rate * (dot(d, d) / (value * value) + 1.0)
    e, y = directions(model, k, t)
    A_a, A_b = step.A_0[a], step.A_0[b]
    return dot(turned(A_a, e[1]), turned(A_b, y[0])) + dot(turned(A_a, e[0]), turned(A_b, y[1]))


@inner
def angle_parts(model, step, k, a, b):
    """Return E, Z, D (means), S and C (means) and kappa of the angle of row k."""
    E_0, E_1 = ends(step, a, vector(model.rows.x[k]))
    Z_0, Z_1 = ends(step, a, vector(model.rows.z[k]))
    D_0, D_1 = ends(step, b, vector(model.rows.y[k]))
    S_0, S_1, C_0, C_1 = -dot(E_0, D_0), -dot(E_1, D_1), dot(Z_0, D_0), dot(Z_1, D_1)
    sine, cosine = C_0 * S_1 - S_0 * C_1, C_0 * C_1 + S_0 * S_1
    kappa = 1.0
    if abs(sine) >= 1e-9:
        kappa = math.atan2(sine, cosine) / sine
    E, Z, D = scaled(0.5, add(E_0, E_1)), scaled(0.5, add(Z_0, Z_1)), scaled(0.5, add(D_0, D_1))
    return E, Z, D, 0.5 * (S_0 + S_1), 0.5 * (C_0 + C_1), kappa


@inner
def angle_loads(model, discrete, step, k, a, b, f):
    """Add the loads of torque f along the angle of row k, whose work is f times the angle's change."""
    E, Z, D, S, C, kappa = angle_parts(model, step, k, a, b)
    f *= kappa
    add_direction(model, discrete, step, a, vector(model.rows.x[k]), scaled(-f * C, D))
    add_direction(model, discrete, step, a, vector(model.rows.z[k]), scaled(-f * S, D))
    both = add(scaled(C, E), scaled(S, Z))
    add_direction(model, discrete, step, b, vector(model.rows.y[k]), scaled(-f, both))


@inner
def add_slide(model, discrete, step, a, b, x, f):
    """Add the loads of force f along axis x of A, whose work is f times the change of distance along x."""
    E, d = mean_direction(step, a, x), mean_distance(step, a, b)
    add_pair(step, a, b, scaled(f, E))
    add_direction(model, discrete, step, a, x, scaled(f, d))
