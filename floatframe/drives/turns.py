"""An angle with all its turns, as a state of a drive."""

import math

from numba.extending import register_jitable

from floatframe.elements.pairs import angle_about

__all__ = ["turned_angle"]


@register_jitable
def turned_angle(x, data, at, speed, z, z_dot, state):
    """Return the angle about the axis in `data`, all its turns counted; write the rate of the state that counts them.

    The state z follows the angle, z_dot = omega + (angle - z)/(1 s); of the angles that the axes of the markers show,
    which differ by whole turns, that nearest to z is the angle. data: `shaft.shaft_numbers` from `at` on.
    """
    angle = angle_about(x, 0, 1, data, at)
    turns = math.floor((z[state].real - angle.real) / (2.0 * math.pi) + 0.5)
    angle = angle + 2.0 * math.pi * turns
    z_dot[state] = speed + data[at + 9] * (angle - z[state])
    return angle
