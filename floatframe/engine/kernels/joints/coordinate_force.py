"""Forces along joint coordinates: springs, dampers, friction, motors.

Described in `floatframe.model.forces.springs`.
"""

import math

from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.time_function import time_function

__all__ = ["coordinate_force", "coordinate_power", "coordinate_strain", "excess", "given_force"]


@inner
def excess(forces, i, is_angle, x):
    """Return a coordinate minus its force-free value; an angle is reduced to between -pi and pi."""
    x -= forces.free[i]
    return x - 2 * math.pi * math.floor(x / (2 * math.pi) + 0.5) if is_angle else x


@inner
def given_force(model, i, t, d):
    """Return preload, motor force and tabulated force of force i at the excess d, and the slope of the table."""
    f, functions, slope = model.joint_forces, model.functions, 0.0
    Q = f.preload[i]
    if f.motor[i] >= 0:
        value, _, _ = time_function(functions, f.motor[i], t)
        Q += value
    if f.table[i] >= 0:
        value, slope, _ = time_function(functions, f.table[i], d)
        Q += value
    return Q, slope


@inner
def coordinate_force(model, work, k, is_angle, x, v, normal):
    """Return the force along coordinate x of row k, and its derivatives by x, v and the normal force.

    -k x - c v + preload + motor(t) + characteristic(x) - (T + mu normal) tanh(v/v_0), summed over the row's forces.
    """
    Q, Q_x, Q_v, Q_n, f = 0.0, 0.0, 0.0, 0.0, model.joint_forces
    for i in range(model.rows.force0[k], model.rows.force1[k]):
        d = excess(f, i, is_angle, x)
        given, slope = given_force(model, i, work.state.time, d)
        Q += given - f.stiffness[i] * d - f.damping[i] * v
        Q_x += slope - f.stiffness[i]
        Q_v -= f.damping[i]
        if f.friction[i] > 0.0 or f.coefficient[i] > 0.0:
            ratio = math.tanh(v / f.speed[i])
            most = f.friction[i] + f.coefficient[i] * normal
            Q -= most * ratio
            Q_v -= most * (1.0 - ratio * ratio) / f.speed[i]
            Q_n -= f.coefficient[i] * ratio
    return Q, Q_x, Q_v, Q_n


@inner
def coordinate_strain(model, k, is_angle, x):
    """Return the energy in the linear springs of row k."""
    total = 0.0
    f = model.joint_forces
    for i in range(model.rows.force0[k], model.rows.force1[k]):
        total += 0.5 * f.stiffness[i] * excess(f, i, is_angle, x) ** 2
    return total


@inner
def coordinate_power(model, work, k, is_angle, x, v, Q):
    """Return the power supplied along row k, and the power dissipated by dampers and friction; Q: total force."""
    given, springs, f = 0.0, 0.0, model.joint_forces
    for i in range(model.rows.force0[k], model.rows.force1[k]):
        d = excess(f, i, is_angle, x)
        springs -= f.stiffness[i] * d
        own, _ = given_force(model, i, work.state.time, d)
        given += own
    return given * v, (given + springs - Q) * v
