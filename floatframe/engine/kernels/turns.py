"""Angles that are counted through full turns from step to step.

An angle is the rotation of the direction y of one body about the axis x × z of another body (the holder), from its
direction z towards -x, as in a TWIST row. With E = R_h x and Z = R_h z of the holder, D = R_o y of the other body, and
omega = omega_o - omega_h, all in ground axes,

    th = atan2(S, C),  S = -E·D,  C = Z·D;      th_dot = (C S_dot - S C_dot)/(S² + C²),
    S_dot = -E·(omega × D),  C_dot = Z·(omega × D),

The counted angle is the one of all th + 2 pi n that is nearest to the prediction: the previous angle plus the step size
times the mean rate of the step. Bodies are taken as undeformed, because elasticity adds less than half a turn.

Three consecutive angles may instead be the rotation vector of A_hᵀ A_o, the axes of o relative to the axes x, z × x, z
of h. Then the one of all theta + 2 pi n theta/|theta| is taken that is nearest to the prediction by the mean of omega
in axes of h.
"""

import math

from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.connections.bushing import continued, rotation_vector
from floatframe.engine.kernels.vector import add, cross, dot, put, scaled, sub, transposed, turned, turned_back, vector

__all__ = ["count_turns"]


@inner
def in_ground(state, i, x):
    """Return a direction fixed in body i (-1: ground) in ground axes."""
    return vector(x) if i < 0 else turned(state.R[i], vector(x))


@inner
def spin(bodies, state, i):
    """Return the angular velocity of body i (-1: ground) in ground axes."""
    if i < 0:
        return 0.0, 0.0, 0.0
    return turned(state.R[i], vector(state.u[bodies.u0[i] + 3 :]))


@inner
def angle_and_rate(angles, bodies, state, k):
    """Return angle k, between -pi and pi, and its rate."""
    holder, other = angles.holder[k], angles.other[k]
    E, Z = in_ground(state, holder, angles.x[k]), in_ground(state, holder, angles.z[k])
    D = in_ground(state, other, angles.y[k])
    D_dot = cross(sub(spin(bodies, state, other), spin(bodies, state, holder)), D)
    S, C = -dot(E, D), dot(Z, D)
    S_dot, C_dot = -dot(E, D_dot), dot(Z, D_dot)
    square = S * S + C * C
    rate = (C * S_dot - S * C_dot) / square if square > 0.0 else 0.0
    return math.atan2(S, C), rate


@inner
def count_rotation(angles, bodies, state, memory, k, h):
    """Store in the memory the rotation vector whose first component is angle k."""
    holder, other = angles.holder[k], angles.other[k]
    x, z = in_ground(state, holder, angles.x[k]), in_ground(state, holder, angles.z[k])
    A = transposed((x, cross(z, x), z))
    rows = (
        in_ground(state, other, angles.y[k]),
        in_ground(state, other, angles.y[k + 1]),
        in_ground(state, other, angles.y[k + 2]),
    )
    rate = turned_back(A, sub(spin(bodies, state, other), spin(bodies, state, holder)))
    mean = add(vector(memory.angle_rate[k:]), rate)
    theta = continued(rotation_vector(A, transposed(rows)), add(vector(memory.angle[k:]), scaled(0.5 * h, mean)))
    put(memory.angle, k, theta)
    put(memory.angle_rate, k, rate)


@inner
def count_turns(model, work, memory, h):
    """Store in the memory the angles of the iterate, a step of size h after the stored ones."""
    for k in range(memory.angle.shape[0]):
        if model.angles.part[k] == 0:
            count_rotation(model.angles, model.bodies, work.state, memory, k, h)
        if model.angles.part[k] >= 0:
            continue
        angle, rate = angle_and_rate(model.angles, model.bodies, work.state, k)
        sign = model.angles.sign[k]
        angle, rate = sign * angle, sign * rate
        expected = memory.angle[k] + 0.5 * h * (memory.angle_rate[k] + rate)
        memory.angle[k] = angle + 2 * math.pi * math.floor((expected - angle) / (2 * math.pi) + 0.5)
        memory.angle_rate[k] = rate
