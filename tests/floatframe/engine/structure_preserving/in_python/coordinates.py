"""Coordinates over a step: their values at its ends, their changes, and forces along them with exact work.

Formulas: `floatframe.engine.structure_preserving.kernels.coordinates`.
"""

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.kernels.model import Model
from floatframe.model.joints.rows import PUSH, SPAN, TWIST_B, kind_of
from floatframe.model.rotations import dot
from tests.floatframe.engine.structure_preserving.in_python.constraints import (
    Loads,
    Pair,
    angle_change,
    angle_loads,
    end_angle,
    slip_change,
)
from tests.floatframe.engine.structure_preserving.in_python.markers import MarkerStep


def add_pair(pair: Pair, loads: Loads, F: Array) -> None:
    """Add a force on B and its opposite on A."""
    pair[1].add_force(loads[1], F)
    pair[0].add_force(loads[0], -F)


def has_two_ends(pair: Pair) -> bool:
    """Whether the two ends of the step are two configurations."""
    return any(m.step is not None and m.step.R_0 is not m.step.R_1 for m in pair)


def span_parts(pair: Pair) -> tuple[Array, Array, Array]:
    """Return the mean vector from A to B, and the distances at both ends."""
    a, b = pair
    d_0, d_1 = b.x_0 - a.x_0, b.x_1 - a.x_1
    return 0.5 * (d_0 + d_1), np.sqrt(dot(d_0, d_0)), np.sqrt(dot(d_1, d_1))


def coordinate_change(model: Model, k: int, pair: Pair) -> Array:
    """Return the change of the coordinate of row k over the step."""
    kind = int(model.rows.kind[k])
    if kind == PUSH:
        return slip_change(model, k, pair)[0]
    if kind == SPAN:
        d, l_0, l_1 = span_parts(pair)
        return 2 * dot(d, pair[1].dx - pair[0].dx) / (l_0 + l_1)
    if kind == TWIST_B:
        return -angle_change(model, k, (pair[1], pair[0]))
    return angle_change(model, k, pair)


def coordinate_ends(model: Model, k: int, pair: Pair) -> tuple[Array, Array]:
    """Return the coordinate of row k at the start and end of the force interval; the final angle between -pi and pi."""
    kind, (a, b) = int(model.rows.kind[k]), pair
    if kind == PUSH:
        E_0, E_1 = a.ends(model.rows.x[k])
        return dot(E_0, b.x_0 - a.x_0), dot(E_1, b.x_1 - a.x_1)
    if kind == SPAN:
        _, l_0, l_1 = span_parts(pair)
        return l_0, l_1
    end = -end_angle(model, k, (b, a)) if kind == TWIST_B else end_angle(model, k, pair)
    return end - coordinate_change(model, k, pair) if has_two_ends(pair) else end, end


def counted(model: Model, k: int, x: Array, known: float) -> Array:
    """Return the value of the coordinate of row k; for angles the value nearest to the previous one."""
    if not kind_of(model.rows.kind[k]).is_angle:
        return x
    return x + 2 * np.pi * np.floor((known - np.real(x)) / (2 * np.pi) + 0.5)


def add_coordinate_force(model: Model, k: int, pair: Pair, loads: Loads, Q: Array) -> None:
    """Add the loads of a force or torque Q, (...,), along the coordinate of row k."""
    kind = int(model.rows.kind[k])
    if kind == PUSH:
        _, E, d = slip_change(model, k, pair)
        add_pair(pair, loads, Q[..., None] * E)
        pair[0].add_direction(loads[0], model.rows.x[k], Q[..., None] * d)
    elif kind == SPAN:
        d, l_0, l_1 = span_parts(pair)
        add_pair(pair, loads, (2 * Q / (l_0 + l_1))[..., None] * d)
    elif kind == TWIST_B:
        angle_loads(model, k, (pair[1], pair[0]), (loads[1], loads[0]), -Q)
    else:
        angle_loads(model, k, pair, loads, Q)


def angle_axis(model: Model, k: int, holder: MarkerStep) -> Array:
    """Return the unit axis of the angle of row k, fixed in the marker with the axis: the mean of its directions."""
    E_0, E_1 = holder.ends(np.cross(model.rows.x[k], model.rows.z[k]))
    axis = 0.5 * (E_0 + E_1)
    return np.asarray(axis / np.sqrt(dot(axis, axis))[..., None])


def coordinate_rate(model: Model, k: int, pair: Pair, h: float) -> Array:
    """Return the mean rate of the coordinate of row k; for an angle that of the angular velocities about its axis."""
    kind, (a, b) = int(model.rows.kind[k]), pair
    if kind in (PUSH, SPAN):
        return coordinate_change(model, k, pair) / h
    axis = angle_axis(model, k, b if kind == TWIST_B else a)
    return dot(axis, b.turning() - a.turning()) / h


def add_impulsive_force(model: Model, k: int, pair: Pair, loads: Loads, Q: Array) -> None:
    """Add the loads of Q, (...,), along the coordinate of row k, with impulse h Q and work h Q times its rate."""
    kind, (a, b) = int(model.rows.kind[k]), pair
    if kind in (PUSH, SPAN):
        add_coordinate_force(model, k, pair, loads, Q)
        return
    T = Q[..., None] * angle_axis(model, k, b if kind == TWIST_B else a)
    b.add_moment(loads[1], T)
    a.add_moment(loads[0], -T)
