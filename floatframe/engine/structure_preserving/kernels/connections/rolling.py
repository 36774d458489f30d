"""A disc that rolls without slip over a step; its formulas stand in `structure_preserving.public_elements`."""

import math

from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.vector import add, cross, dot, norm, scaled, sub, turned, vector
from floatframe.engine.structure_preserving.kernels.coordinates import add_pair
from floatframe.engine.structure_preserving.kernels.markers import add_direction, add_moment, ends, turning
from floatframe.engine.structure_preserving.kernels.rows import mean_direction, mean_distance

__all__ = ["add_height_reaction", "add_roll_reaction", "height_value", "roll_value"]


@inner
def height_value(model, step, k, a, b):
    """Return the height of the rim above the plane at the end of the step."""
    N, n = turned(step.A_1[a], vector(model.rows.z[k])), turned(step.A_1[b], vector(model.rows.y[k]))
    c = dot(N, n)
    height = dot(N, sub(vector(step.x_1[b]), vector(step.x_1[a])))
    return height - model.rows.c[k] * math.sqrt(1.0 - c * c)


@inner
def slope(model, step, k, a, b):
    """Return -R ds/dc over the step."""
    N_0, N_1 = ends(step, a, vector(model.rows.z[k]))
    n_0, n_1 = ends(step, b, vector(model.rows.y[k]))
    c_0, c_1 = dot(N_0, n_0), dot(N_1, n_1)
    return model.rows.c[k] * (c_0 + c_1) / (math.sqrt(1.0 - c_0 * c_0) + math.sqrt(1.0 - c_1 * c_1))


@inner
def add_height_reaction(model, discrete, step, k, a, b, f):
    """Add the loads of the height with multiplier f."""
    z, y = vector(model.rows.z[k]), vector(model.rows.y[k])
    N, n, g = mean_direction(step, a, z), mean_direction(step, b, y), f * slope(model, step, k, a, b)
    add_pair(step, a, b, scaled(f, N))
    add_direction(model, discrete, step, a, z, add(scaled(f, mean_distance(step, a, b)), scaled(g, n)))
    add_direction(model, discrete, step, b, y, scaled(g, N))


@inner
def rim(model, step, k, a, b):
    """Return the direction t and rho in the middle of the step."""
    N, n = mean_direction(step, a, vector(model.rows.z[k])), mean_direction(step, b, vector(model.rows.y[k]))
    n = scaled(1.0 / norm(n), n)
    u = sub(N, scaled(dot(N, n), n))
    return mean_direction(step, a, vector(model.rows.x[k])), scaled(-model.rows.c[k] / norm(u), u)


@inner
def roll_value(model, step, k, a, b):
    """Return the displacement of the rim along t over the step."""
    t, rho = rim(model, step, k, a, b)
    arm = add(mean_distance(step, a, b), rho)
    turned_by = sub(cross(turning(model, step, b), rho), cross(turning(model, step, a), arm))
    return dot(t, add(sub(vector(step.dx[b]), vector(step.dx[a])), turned_by))


@inner
def add_roll_reaction(model, step, k, a, b, f):
    """Add the loads of a force f along t at the rim."""
    t, rho = rim(model, step, k, a, b)
    F = scaled(f, t)
    add_pair(step, a, b, F)
    add_moment(model, step, b, cross(rho, F))
    add_moment(model, step, a, scaled(-1.0, cross(add(mean_distance(step, a, b), rho), F)))
