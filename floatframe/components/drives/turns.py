"""An angle counted through full turns, by a state of a drive."""

import math

from numba.extending import register_jitable

from floatframe.model.elements.pairs import angle_about

__all__ = ["turned_angle"]


@register_jitable
def turned_angle(x, data, at, speed, z, z_dot, state):
    """Return the angle about the axis in `data`, with all its turns; write the rate of the state that counts them.

    The state z follows the angle, z_dot = omega + (angle - z)/(1 s). The axes of the markers define the angle up to
    full turns; the value nearest to z is taken. data: `shaft.shaft_numbers`, from index `at` on.
    """
    angle = angle_about(x, 0, 1, data, at)
    turns = math.floor((z[state].real - angle.real) / (2.0 * math.pi) + 0.5)
    angle = angle + 2.0 * math.pi * turns
    z_dot[state] = speed + data[at + 9] * (angle - z[state])
    return angle
