"""Angles counted through full turns, from step to step.

An angle is that by which the direction y of one body has turned about the axis x × z of another, from its direction z
towards -x (as a TWIST row has it). With E = R_h x, Z = R_h z of the holder of the axis, D = R_o y of the other body,
and omega = omega_o - omega_h, all in ground axes,

    th = atan2(S, C),  S = -E·D,  C = Z·D;      th_dot = (C S_dot - S C_dot)/(S² + C²),
    S_dot = -E·(omega × D),  C_dot = Z·(omega × D),

and of all th + 2 pi n the one is taken that is nearest to where the mean rate of the step leads from the angle before.
Bodies are taken undeformed: elasticity adds less than half a turn.
"""

import math

from floatframe.kernels.compiler.compilation import inner
from floatframe.kernels.vector import cross, dot, sub, turned, vector

__all__ = ["count_turns"]


@inner
def in_ground(state, i, x):
    """Return a direction of body i, -1 for the ground, in ground axes."""
    return vector(x) if i < 0 else turned(state.R[i], vector(x))


@inner
def spin(bodies, state, i):
    """Return the angular velocity of body i in ground axes."""
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
def count_turns(model, work, memory, h):
    """Take the angles of the iterate into the memory, a step of size h after those that are there."""
    for k in range(memory.angle.shape[0]):
        angle, rate = angle_and_rate(model.angles, model.bodies, work.state, k)
        sign = model.angles.sign[k]
        angle, rate = sign * angle, sign * rate
        expected = memory.angle[k] + 0.5 * h * (memory.angle_rate[k] + rate)
        memory.angle[k] = angle + 2 * math.pi * math.floor((expected - angle) / (2 * math.pi) + 0.5)
        memory.angle_rate[k] = rate
