"""Joint constraints over a step: values at its end, and reactions that do no work while joints stay closed.

A constraint is a sum of products of marker positions and directions. The product rule with mean values,
a_1·b_1 - a_0·b_0 = (a_1 - a_0)·b_mean + a_mean·(b_1 - b_0), gives discrete derivatives: multiplied by the changes of
positions and directions, they add up to the change of the constraint, and they are objective under rotations of the
ground axes. So its reaction does no work between two configurations that fulfil the constraint, and adds no linear or
angular momentum.
"""

import math

from floatframe.engine.kernels.compiler.compilation import inner, small
from floatframe.engine.kernels.joints.constant_velocity import equal_turn_products
from floatframe.engine.kernels.joints.held_rows import (
    A_TO_B,
    OF_A,
    OF_BOTH,
    OF_GROUND,
    ZERO,
    Product,
    Side,
    gap_of,
    of_a,
    point,
    rate_in_time,
)
from floatframe.engine.kernels.joints.relative_motion import prescribed_at
from floatframe.engine.kernels.joints.row_formulas import HELD, PRODUCTS, by_code, own_name, row_product
from floatframe.engine.kernels.vector import add, cross, dot, scaled, turned, vector
from floatframe.engine.structure_preserving.kernels.markers import (
    add_direction,
    add_pair,
    distances,
    ends,
    mean_direction,
)
from floatframe.engine.structure_preserving.kernels.records import MarkerPlaces
from floatframe.model.joints.rows.kinds import EQUAL_TURN, POINT, RIM_HEIGHT, SCREW

__all__ = ["add_product", "add_reaction", "angle_loads", "held", "mean_distance", "row_rate", "row_value"]


@inner
def held(model, k, t):
    """Return the value that row k prescribes at time t, and its rate."""
    value, rate, _ = prescribed_at(model, k, t)
    return value, rate


# products of two vectors ----------------------------------------------------------------------------------------------


@small
def mean_distance(step, a, b):
    """Return the mean of the vector from A to B over the step."""
    d_0, d_1 = distances(step, a, b)
    return scaled(0.5, add(d_0, d_1))


@small
def mean_vector(step, a, b, side):
    """Return the mean of a vector of a product over the step."""
    if side.of == OF_BOTH:
        return mean_distance(step, a, b)
    if side.of == OF_GROUND:
        return side.e
    return mean_direction(step, a if side.of == OF_A else b, side.e)


@small
def add_vector(model, discrete, step, a, b, side, G):
    """Add a load on a vector P of a product, with the work G · dP."""
    if side.of == OF_BOTH:
        add_pair(step, a, b, G)
    elif side.of != OF_GROUND:
        add_direction(model, discrete, step, a if side.of == OF_A else b, side.e, G)


@small
def add_product(model, discrete, step, a, b, P, Q, f):
    """Add the loads of f times P · Q, whose work is f times the change of P · Q."""
    P_mean, Q_mean = mean_vector(step, a, b, P), mean_vector(step, a, b, Q)
    add_vector(model, discrete, step, a, b, P, scaled(f, Q_mean))
    add_vector(model, discrete, step, a, b, Q, scaled(f, P_mean))


@small
def started(model, step, one, a, b):
    """Return a product whose ground direction is fixed at the start of the step in the body of A, or of B.

    So the matrix of Newton's method does not rotate with the body.
    """
    if one.P.of != OF_GROUND:
        return one
    i = model.markers.body[a]
    if i < 0:
        i = model.markers.body[b]
    return Product(Side(OF_GROUND, turned(step.R_0[i], one.P.e), ZERO, ZERO), one.Q, one.c, one.o)


# rows -----------------------------------------------------------------------------------------------------------------


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


def reaction_of(product):
    """Return the function of the reaction of a kind that is a product."""

    def reaction(model, discrete, step, k, a, b, f):
        one = started(model, step, product(model, k, step.t_force), a, b)
        add_product(model, discrete, step, a, b, one.P, one.Q, one.c[0] * f)

    return own_name(reaction, f"{product.py_func.__name__}_reaction")


@inner
def add_screw_reaction(model, discrete, step, k, a, b, f):
    """Add the loads of a SCREW row."""
    axis = cross(vector(model.rows.x[k]), vector(model.rows.z[k]))
    add_product(model, discrete, step, a, b, of_a(axis), A_TO_B, f)
    angle_loads(model, discrete, step, k, a, b, -model.rows.c[k] * f)


@inner
def add_equal_turn_reaction(model, discrete, step, k, a, b, f):
    """Add the loads of an EQUAL_TURN row."""
    first, second = equal_turn_products(model.rows, k)
    add_product(model, discrete, step, a, b, first.P, first.Q, f)
    add_product(model, discrete, step, a, b, second.P, second.Q, -f)


#: the value of rows that depend only on positions and time, shared with all other formulations
gap_of_places = by_code(
    "gap_of_places",
    {code: HELD[code].gap for code in (*PRODUCTS, SCREW, RIM_HEIGHT, EQUAL_TURN) if code != POINT},
    "model, work, k, a, b",
)
#: adds the loads of row k with multiplier f, whose work is f times the change of the row
add_reaction = by_code(
    "add_reaction",
    {code: reaction_of(product) for code, product in PRODUCTS.items()}
    | {SCREW: add_screw_reaction, EQUAL_TURN: add_equal_turn_reaction},
    "model, discrete, step, k, a, b, f",
)


@inner
def row_value(model, step, k, a, b):
    """Return the value of row k at the end of the step."""
    kind = model.rows.kind[k]
    if kind == POINT:
        return gap_of(started(model, step, point(model, k, 0.0), a, b), step.end.markers, a, b)
    return gap_of_places(kind, model, step.end, k, a, b)


@inner
def row_rate(model, step, k, a, b, t):
    """Return the explicit time derivative of row k at the beginning of a step, due to its prescribed motion."""
    if model.rows.motion[k] < 0:
        return 0.0
    return rate_in_time(row_product(model.rows.kind[k], model, k, t), MarkerPlaces(step.x_0, step.A_0), a, b)
