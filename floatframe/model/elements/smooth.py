"""Functions for laws with complex-step derivatives, valid for real and for complex numbers.

A step along the imaginary axis gives derivatives without rounding errors, if a law consists of smooth functions of
complex numbers. These include sqrt, exp, log, sin, cos, tan, arctan, sinh, cosh and tanh of NumPy. Comparisons use the
real part, as do the functions here. Compiled powers of complex numbers lose the step if the base is negative; use
products instead.
"""

import math

import numpy as np
from numba.extending import register_jitable

__all__ = ["absolute", "atan2", "larger", "smaller", "square"]


@register_jitable
def absolute(x):
    """Return x or -x, whichever has a non-negative real part."""
    return x if x.real >= 0.0 else -x


@register_jitable
def larger(x, y):
    """Return the argument with the larger real part."""
    return x if x.real >= y.real else y


@register_jitable
def smaller(x, y):
    """Return the argument with the smaller real part."""
    return x if x.real <= y.real else y


@register_jitable
def square(x):
    """Return x x."""
    return x * x


@register_jitable
def atan2(y, x):
    """Return the angle of (x, y), between -pi and pi."""
    if abs(x.real) > abs(y.real):
        angle = np.arctan(y / x)
        if x.real > 0.0:
            return angle
        return angle + math.pi if y.real >= 0.0 else angle - math.pi
    angle = -np.arctan(x / y)
    return angle + 0.5 * math.pi if y.real >= 0.0 else angle - 0.5 * math.pi
