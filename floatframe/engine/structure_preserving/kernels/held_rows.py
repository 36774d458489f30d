"""Constraint rows of joints and couplers over a step, dispatched by kind."""

import math

from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.connections.coordinate import ends_and_row, indices_of
from floatframe.engine.kernels.joints.held_rows import A_TO_B, of_a, of_b
from floatframe.engine.kernels.vector import add, cross, dot, norm, scaled, sub, vector
from floatframe.engine.structure_preserving.kernels import deformed_lines, rows
from floatframe.engine.structure_preserving.kernels.coordinates import (
    add_coordinate_force,
    coordinate_change,
    ends_of_step,
)
from floatframe.engine.structure_preserving.kernels.markers import (
    add_moment,
    add_pair,
    begin_unit_load,
    end_unit_load,
    ends,
    mean_direction,
)
from floatframe.engine.structure_preserving.kernels.rows import add_product, held, mean_distance
from floatframe.model.joints.rows.kinds import COUPLE, LINE, LINE_TURN, RIM_HEIGHT, ROLL

__all__ = ["add_reaction", "row_change", "row_rate", "row_value"]


@inner
def row_value(model, discrete, step, c, k):
    """Return the value of row k of connection c at the end of the step; for ROLL the rim displacement in the step."""
    kind, a, b = model.rows.kind[k], model.connections.a[c], model.connections.b[c]
    if kind == COUPLE:
        return coupler_value(model, step, c)
    if kind == ROLL:
        return row_change(model, discrete, step, c, k)
    if kind == LINE or kind == LINE_TURN:
        return deformed_lines.line_value(model, step, k, a, b)
    return rows.row_value(model, step, k, a, b)


@inner
def add_reaction(model, discrete, step, c, k, f):
    """Add the loads of row k of connection c with multiplier f, whose work is f times the change of the row."""
    kind, a, b = model.rows.kind[k], model.connections.a[c], model.connections.b[c]
    if kind == COUPLE:
        add_coupler_reaction(model, discrete, step, c, f)
    elif kind == RIM_HEIGHT:
        add_height_reaction(model, discrete, step, k, a, b, f)
    elif kind == ROLL:
        add_roll_reaction(model, step, k, a, b, f)
    elif kind == LINE or kind == LINE_TURN:
        deformed_lines.add_line_reaction(model, discrete, step, k, a, b, f)
    else:
        rows.add_reaction(kind, model, discrete, step, k, a, b, f)


@inner
def row_change(model, discrete, step, c, k):
    """Return the change of row k over the step due to motion alone, which is the work of a unit multiplier."""
    if model.rows.kind[k] == COUPLE:
        return coupler_change(model, discrete, step, c)
    a, b = model.connections.a[c], model.connections.b[c]
    begin_unit_load(step, a, b)
    add_reaction(model, discrete, step, c, k, 1.0)
    return end_unit_load(model, step, a, b)


@inner
def row_rate(model, step, c, k, t):
    """Return the explicit time derivative of row k at the beginning of a step, due to its prescribed motion."""
    kind, a, b = model.rows.kind[k], model.connections.a[c], model.connections.b[c]
    if kind == COUPLE:
        return coupler_rate(model, c, t)
    if kind == LINE or kind == LINE_TURN:
        return deformed_lines.line_rate(model, step, k, a, b, t)
    return rows.row_rate(model, step, k, a, b, t)


# couplers -------------------------------------------------------------------------------------------------------------
# Forces a_p lam enforce Σ a_p x_p = c(t_1) at the end of a step. They act through the discrete derivatives of the
# coordinates (kernels/coordinates.py), so the work of the reaction is lam times the change of the sum: zero, or lam
# times the change of the prescribed c. The row is divided by its largest coefficient.


@inner
def coupler_value(model, step, c):
    """Return the value of coupler c's row at the end of the step."""
    i, first, last = indices_of(model, c)
    k = model.elements.core[i]
    constant, _ = held(model, k, step.end.state.time)
    total = -constant
    for p in range(first, last):
        a, b, row = ends_and_row(model, p)
        _, end = ends_of_step(model, step, row, a, b)
        total += model.coordinates.factor[p] * end
    return model.rows.x[k, 0] * total


@inner
def add_coupler_reaction(model, discrete, step, c, f):
    """Add the loads of coupler c with multiplier f, whose work is f times the change of its row."""
    i, first, last = indices_of(model, c)
    scale = model.rows.x[model.elements.core[i], 0]
    for p in range(first, last):
        a, b, row = ends_and_row(model, p)
        add_coordinate_force(model, discrete, step, row, a, b, scale * model.coordinates.factor[p] * f)


@inner
def coupler_change(model, discrete, step, c):
    """Return the change of coupler c's row over the step due to motion alone."""
    i, first, last = indices_of(model, c)
    total = 0.0
    for p in range(first, last):
        a, b, row = ends_and_row(model, p)
        total += model.coordinates.factor[p] * coordinate_change(model, discrete, step, row, a, b)
    return model.rows.x[model.elements.core[i], 0] * total


@inner
def coupler_rate(model, c, t):
    """Return the explicit time derivative of coupler c's row."""
    k = model.elements.core[model.connections.item[c]]
    _, rate = held(model, k, t)
    return -model.rows.x[k, 0] * rate


# a disc that rolls without slip; N, n, c, s and rho as in the engine kernels/joints/rolling.py -----------------------
# The change of RIM_HEIGHT, N · d - R s with s = sqrt(1 - c²), follows from the product rule with mean values and
# ds = -(c_0 + c_1)/(s_0 + s_1) dc. ROLL keeps the displacement of the rim over the step along t at zero, with the mean
# values of all directions and positions,
#
#     t · (dx_B - dx_A + phi_B × rho - phi_A × (d + rho)) = 0
#
# by a force along t at the rim, which therefore does no work. Forces and moments on A and B balance about any point.


@inner
def slope(model, step, k, a, b):
    """Return the discrete derivative -R ds/dc over the step."""
    N_0, N_1 = ends(step, a, vector(model.rows.z[k]))
    n_0, n_1 = ends(step, b, vector(model.rows.y[k]))
    c_0, c_1 = dot(N_0, n_0), dot(N_1, n_1)
    return model.rows.c[k] * (c_0 + c_1) / (math.sqrt(1.0 - c_0 * c_0) + math.sqrt(1.0 - c_1 * c_1))


@inner
def add_height_reaction(model, discrete, step, k, a, b, f):
    """Add the loads of the height constraint with multiplier f."""
    N = of_a(model.rows.z[k])
    add_product(model, discrete, step, a, b, N, A_TO_B, f)
    add_product(model, discrete, step, a, b, N, of_b(model.rows.y[k]), f * slope(model, step, k, a, b))


@inner
def rim(model, step, k, a, b):
    """Return the direction t and the vector rho to the rim at mid-step."""
    N, n = mean_direction(step, a, vector(model.rows.z[k])), mean_direction(step, b, vector(model.rows.y[k]))
    n = scaled(1.0 / norm(n), n)
    u = sub(N, scaled(dot(N, n), n))
    return mean_direction(step, a, vector(model.rows.x[k])), scaled(-model.rows.c[k] / norm(u), u)


@inner
def add_roll_reaction(model, step, k, a, b, f):
    """Add the loads of a force f along t at the rim."""
    t, rho = rim(model, step, k, a, b)
    F = scaled(f, t)
    add_pair(step, a, b, F)
    add_moment(model, step, b, cross(rho, F))
    add_moment(model, step, a, scaled(-1.0, cross(add(mean_distance(step, a, b), rho), F)))
