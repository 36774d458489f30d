"""Functions of time in the kernels, see `floatframe.model.functions.time_functions`."""

import math

from floatframe.engine.kernels.compiler.compilation import inner

__all__ = ["time_function"]


@inner
def time_function(functions, f, t):
    """Return function f at t with its first and second rate; each piece is a polynomial of degree five plus a sine."""
    low, high = functions.piece0[f], functions.piece0[f + 1] - 1
    while low < high:  # the last piece that begins at or before t
        middle = (low + high + 1) // 2
        if functions.begin[middle] <= t:
            low = middle
        else:
            high = middle - 1
    x, c = t - functions.begin[low], functions.piece[low]
    value, rate, second = 0.0, 0.0, 0.0
    for k in range(5, -1, -1):  # Horner's scheme, with derivatives
        second = second * x + 2 * rate
        rate = rate * x + value
        value = value * x + c[k]
    s, w = c[6] * math.sin(c[7] * x + c[8]), c[7]
    return value + s, rate + c[6] * w * math.cos(c[7] * x + c[8]), second - w * w * s
