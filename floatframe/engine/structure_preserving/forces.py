"""Forces over a step: loads whose work is the change of their potential, and what they give and take.

Springs act by the discrete derivative of their potential (Gonzalez 1996), here in closed form: with the lengths l_0,
l_1 at both ends, |d_1|² - |d_0|² = 2 d_mean·(d_1 - d_0), so that the tension k ((l_0 + l_1)/2 - l_free) along
2 d_mean/(l_0 + l_1) does the work of the change of k (l - l_free)²/2 exactly. Rates are changes over the step.
"""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.kernels.model import Model
from floatframe.engine.structure_preserving.bodies import BodyStep, CentralBody
from floatframe.engine.structure_preserving.constraints import Loads, Pair, Span
from floatframe.engine.structure_preserving.coordinates import (
    add_coordinate_force,
    add_impulsive_force,
    add_pair,
    coordinate_ends,
    coordinate_rate,
)
from floatframe.engine.structure_preserving.functions import along_imaginary, value_of
from floatframe.engine.structure_preserving.markers import Load, MarkerStep
from floatframe.model.joints.rows import kind_of
from floatframe.model.rotations import cross, dot, turned

__all__ = ["Given", "body_load", "coordinate_load", "point_load", "spring_load"]


@dataclass(frozen=True, eq=False)
class Given:
    """Work of a force over a step."""

    given: Array | float = 0.0  #: that enters the system
    taken: Array | float = 0.0  #: that a damper or friction takes


def spring_load(model: Model, c: int, pair: Pair, loads: Loads, span: Span) -> Given:
    """Add the loads of spring-damper c."""
    a, b = pair
    s = int(model.connections.item[c])
    springs = model.springs
    k, damping, free, preload = springs.stiffness[s], springs.damping[s], springs.free_length[s], springs.preload[s]
    d_0, d_1, dd = b.x_0 - a.x_0, b.x_1 - a.x_1, b.dx - a.dx
    d = 0.5 * (d_0 + d_1)
    if k != 0 and free == 0 and damping == 0 and preload == 0 and model.springs.table[s] < 0:
        add_pair(pair, loads, -k * d)  # through length zero
        return Given()
    both = np.sqrt(dot(d_0, d_0)) + np.sqrt(dot(d_1, d_1))
    change = 2 * dot(d, dd) / both
    tension = k * (0.5 * both - free) + preload + damping * change / span.h
    given = np.zeros(np.shape(change), change.dtype)
    if model.springs.table[s] >= 0:
        by_table = along_imaginary(model, int(model.springs.table[s]), 0.5 * both - free)
        tension = tension + by_table
        given = -by_table * change
    add_pair(pair, loads, -(2 * tension / both)[..., None] * d)
    return Given(given, damping * change**2 / span.h)


def point_load(model: Model, k: int, marker: MarkerStep, load: Load | None, span: Span) -> Given:
    """Add load k, fixed in space or in its marker."""
    factor = value_of(model, int(model.loads.factor[k]), span.t_force)[0] if model.loads.factor[k] >= 0 else 1.0
    work: Array | float = 0.0
    for part, is_force in ((model.loads.force[k], True), (model.loads.torque[k], False)):
        if not np.any(part):
            continue
        if model.markers.is_follower[model.loads.marker[k]]:
            V_0, V_1 = marker.ends(part)
            V = factor * 0.5 * (V_0 + V_1)
        else:
            V = factor * part
        if is_force:
            marker.add_force(load, V)
            work = work + dot(V, marker.dx)
        else:
            marker.add_moment(load, V)
            work = work + dot(V, marker.turning())
    return Given(work)


def body_load(model: Model, k: int, body: CentralBody, step: BodyStep, load: Load, span: Span) -> Given:
    """Add load case k of a body: force and torque about its frame origin in its axes, and modal forces."""
    factor = value_of(model, int(model.body_loads.factor[k]), span.t_force)[0]
    first = int(model.body_loads.value0[k])
    f, tau, modal = np.split(factor * model.body_loads.values[first : first + 6 + body.n], [3, 6])
    q = 0.5 * (step.q_0 + step.q_1)
    s = body.center(q)
    R = 0.5 * (step.R_0 + step.R_1)
    F, T = turned(R, f), turned(R, tau - cross(s, np.broadcast_to(f, s.shape)))
    h = modal - turned(np.swapaxes(body.shapes(q), -1, -2), f)
    load.force += F
    load.torque += T
    load.modal += h
    return Given(dot(F, step.d) + dot(T, step.theta_G) + dot(h, step.dq))


def coordinate_load(model: Model, k: int, pair: Pair, loads: Loads, span: Span, normal: Array) -> Given:
    """Add the forces along the coordinate of row k (PUSH, TWIST, TWIST_B); normal: force in the joint across it."""
    is_angle = kind_of(model.rows.kind[k]).is_angle
    begin, end = coordinate_ends(model, k, pair)
    rate = coordinate_rate(model, k, pair, span.h)
    Q, spring, given, taken = 0.0 * rate, 0.0 * rate, 0.0 * rate, 0.0 * rate
    for i in range(int(model.rows.force0[k]), int(model.rows.force1[k])):
        f = model.joint_forces
        mean = 0.5 * (begin + end) - f.free[i]
        if is_angle:
            mean = mean - 2 * np.pi * np.floor(np.real(mean) / (2 * np.pi) + 0.5)
        entering = f.preload[i] + 0.0 * rate
        if model.joint_forces.motor[i] >= 0:
            entering = entering + value_of(model, int(model.joint_forces.motor[i]), span.t_force)[0]
        if model.joint_forces.table[i] >= 0:
            entering = entering + along_imaginary(model, int(model.joint_forces.table[i]), mean)
        resisting = f.damping[i] * rate
        if f.friction[i] > 0 or f.coefficient[i] > 0:
            resisting = resisting + (f.friction[i] + f.coefficient[i] * normal) * np.tanh(rate / f.speed[i])
        Q = Q + entering - resisting
        spring = spring - f.stiffness[i] * mean
        given = given + entering * rate * span.h
        taken = taken + resisting * rate * span.h
    add_impulsive_force(model, k, pair, loads, Q)
    add_coordinate_force(model, k, pair, loads, spring)
    return Given(given, taken)
