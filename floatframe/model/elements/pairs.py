"""Relative motion of two markers, and opposite forces between them, for laws of elements.

x is the motion of all markers as passed to laws, a and b are indices of markers, and e is a unit vector in ground axes.
The functions accept real and complex numbers, and can be called from compiled functions and from Python.
"""

import math

import numpy as np
from numba.extending import register_jitable

from fe_models.foundation.arrays import Array
from floatframe.model.checked_values import unit_vector

__all__ = [
    "add_axial_force",
    "add_torque",
    "angle_about",
    "angle_numbers",
    "axial_motion",
    "direction_of",
    "line_between",
    "turning_speed",
]


@register_jitable
def direction_of(x, a, data, at):
    """Return a direction in ground axes, given in marker a's axes by three numbers from data[at] on."""
    c0, c1, c2 = data[at], data[at + 1], data[at + 2]
    return (
        x[a, 3] * c0 + x[a, 4] * c1 + x[a, 5] * c2,
        x[a, 6] * c0 + x[a, 7] * c1 + x[a, 8] * c2,
        x[a, 9] * c0 + x[a, 10] * c1 + x[a, 11] * c2,
    )


@register_jitable
def inner_product(a, b):
    """Return a · b for vectors of length 3."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@register_jitable
def vector_product(a, b):
    """Return a x b for vectors of length 3."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@register_jitable
def turning_speed(x, a, b, e):
    """Return the angular velocity of marker b relative to marker a about e [rad/s]."""
    return e[0] * (x[b, 15] - x[a, 15]) + e[1] * (x[b, 16] - x[a, 16]) + e[2] * (x[b, 17] - x[a, 17])


@register_jitable
def add_torque(wrench, a, b, torque, e):
    """Add a torque about e on marker b, and the opposite torque on marker a."""
    for k in range(3):
        wrench[b, 3 + k] += torque * e[k]
        wrench[a, 3 + k] -= torque * e[k]


@register_jitable
def line_between(x, a, b):
    """Return the distance from marker a to marker b, its rate and its direction."""
    d = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
    length = np.sqrt(inner_product(d, d))
    e = d[0] / length, d[1] / length, d[2] / length
    return length, e[0] * (x[b, 12] - x[a, 12]) + e[1] * (x[b, 13] - x[a, 13]) + e[2] * (x[b, 14] - x[a, 14]), e


@register_jitable
def axial_motion(x, a, b, e):
    """Return the distance of marker b from marker a along e, and its rate; e rotates with marker a."""
    d = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
    v = x[b, 12] - x[a, 12], x[b, 13] - x[a, 13], x[b, 14] - x[a, 14]
    turned = vector_product((x[a, 15], x[a, 16], x[a, 17]), e)
    return inner_product(d, e), inner_product(v, e) + inner_product(d, turned)


@register_jitable
def add_axial_force(wrench, x, a, b, force, e):
    """Add a force along e at the point of marker b to body b, and the opposite force at the same point to body a."""
    f = force * e[0], force * e[1], force * e[2]
    m = vector_product((x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]), f)
    for k in range(3):
        wrench[b, k] += f[k]
        wrench[a, k] -= f[k]
        wrench[a, 3 + k] -= m[k]


def angle_numbers(axis: Array, A_a: Array, A_b: Array) -> list[float]:
    """Return data for `angle_about`: the axis and a normal in axes of marker a, and the same normal in axes of b.

    axis: in the axes of marker a; A_a, A_b: axes of the assembled markers, (3, 3), at which the angle is zero.
    """
    e = unit_vector("axis", axis)
    normal = np.cross(e, np.eye(3)[int(np.argmin(np.abs(e)))])
    normal /= np.linalg.norm(normal)
    return [*e.tolist(), *normal.tolist(), *(A_b.T @ A_a @ normal).tolist()]


@register_jitable
def angle_about(x, a, b, data, at):
    """Return the angle of b relative to a about the axis in `data`, in -pi .. pi, zero when assembled."""
    e, u = direction_of(x, a, data, at), direction_of(x, a, data, at + 3)
    d = direction_of(x, b, data, at + 6)
    c, s = inner_product(u, d), inner_product(vector_product(e, u), d)
    c0, s0 = c.real, s.real
    return math.atan2(s0, c0) + (c0 * (s - s0) - s0 * (c - c0)) / (c0 * c0 + s0 * s0)
