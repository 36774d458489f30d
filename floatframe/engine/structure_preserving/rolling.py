"""A disc that rolls without slip over a step, see kernels/joints/rolling.py for N, n, c, s and rho.

RIM_HEIGHT, N · d - R s with s = sqrt(1 - c²), changes by the product rule with means, ds = -(c_0 + c_1)/(s_0 + s_1) dc.
ROLL holds the displacement of the rim over the step along t, all directions and places at their means:

    t · (dx_B - dx_A + phi_B × rho - phi_A × (d + rho)) = 0

by a force along t at the rim, whose work it is: none. Forces and moments on A and B balance about any point.
"""

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.kernels.model import Model
from floatframe.engine.structure_preserving.constraints import Loads, Pair
from floatframe.engine.structure_preserving.coordinates import add_pair
from floatframe.model.rotations import cross, dot

__all__ = ["add_height_reaction", "add_roll_reaction", "height_value", "roll_value"]


def leanings(model: Model, k: int, pair: Pair) -> tuple[Array, ...]:
    """Return means of N and n, and c and s at both ends."""
    (N_0, N_1), (n_0, n_1) = pair[0].ends(model.rows.z[k]), pair[1].ends(model.rows.y[k])
    c_0, c_1 = dot(N_0, n_0), dot(N_1, n_1)
    return 0.5 * (N_0 + N_1), 0.5 * (n_0 + n_1), c_0, c_1, np.sqrt(1 - c_0 * c_0), np.sqrt(1 - c_1 * c_1)


def height_value(model: Model, k: int, pair: Pair) -> Array:
    """Return the height of the rim above the plane at the end of the step."""
    N_1, n_1 = pair[0].ends(model.rows.z[k])[1], pair[1].ends(model.rows.y[k])[1]
    c = dot(N_1, n_1)
    return dot(N_1, pair[1].x_1 - pair[0].x_1) - model.rows.c[k] * np.sqrt(1 - c * c)


def add_height_reaction(model: Model, k: int, pair: Pair, loads: Loads, f: Array) -> None:
    """Add the loads of the height with multiplier f, (...,)."""
    (a, b), z = pair, model.rows.z[k]
    N, n, c_0, c_1, s_0, s_1 = leanings(model, k, pair)
    g = f * model.rows.c[k] * (c_0 + c_1) / (s_0 + s_1)
    add_pair(pair, loads, f[..., None] * N)
    a.add_direction(loads[0], z, f[..., None] * (b.x_mean - a.x_mean) + g[..., None] * n)
    b.add_direction(loads[1], model.rows.y[k], g[..., None] * N)


def rim(model: Model, k: int, pair: Pair) -> tuple[Array, Array]:
    """Return the direction t and rho in the middle of the step."""
    N, n, *_ = leanings(model, k, pair)
    n = n / np.sqrt(dot(n, n))[..., None]
    u = N - dot(N, n)[..., None] * n
    t_0, t_1 = pair[0].ends(model.rows.x[k])
    return 0.5 * (t_0 + t_1), -model.rows.c[k] * u / np.sqrt(dot(u, u))[..., None]


def roll_value(model: Model, k: int, pair: Pair) -> Array:
    """Return the displacement of the rim along t over the step."""
    (a, b), (t, rho) = pair, rim(model, k, pair)
    d = b.x_mean - a.x_mean
    return dot(t, b.dx - a.dx + cross(b.turning(), rho) - cross(a.turning(), d + rho))


def add_roll_reaction(model: Model, k: int, pair: Pair, loads: Loads, f: Array) -> None:
    """Add the loads of a force f, (...,), along t at the rim."""
    (a, b), (t, rho) = pair, rim(model, k, pair)
    F = f[..., None] * t
    add_pair(pair, loads, F)
    b.add_moment(loads[1], cross(rho, F))
    a.add_moment(loads[0], -cross(b.x_mean - a.x_mean + rho, F))
