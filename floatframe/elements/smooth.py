"""Functions for laws with a complex tangent: the same for real and for complex numbers, by one formula.

A step along the imaginary axis takes derivatives without rounding where a law is made of smooth functions of complex
numbers. sqrt, exp, log, sin, cos, tan, arctan, sinh, cosh, tanh of NumPy are; comparisons look at the real part, and so
do these functions. Powers of compiled complex numbers lose the step where the base is negative: write products.
"""

import math

import numpy as np
from numba.extending import register_jitable

__all__ = ["absolute", "atan2", "larger", "smaller", "square"]


@register_jitable
def absolute(x):
    """Return x or -x, whichever is not negative in its real part."""
    return x if x.real >= 0.0 else -x


@register_jitable
def larger(x, y):
    """Return the one with the larger real part."""
    return x if x.real >= y.real else y


@register_jitable
def smaller(x, y):
    """Return the one with the smaller real part."""
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
