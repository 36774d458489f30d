"""Functions of time or of a coordinate in a compiled model, evaluated in Python."""

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.kernels.model import Model


def value_of(model: Model, f: int, t: float) -> tuple[float, float]:
    """Return function f at t and its rate: a polynomial of degree five and a sine on each piece."""
    first, last = int(model.functions.piece0[f]), int(model.functions.piece0[f + 1])
    k = first + max(int(np.searchsorted(model.functions.begin[first:last], t, side="right")) - 1, 0)
    x, c = t - model.functions.begin[k], model.functions.piece[k]
    value, rate = 0.0, 0.0
    for a in c[5::-1]:
        rate = rate * x + value
        value = value * x + a
    phase = c[7] * x + c[8]
    return float(value + c[6] * np.sin(phase)), float(rate + c[6] * c[7] * np.cos(phase))


def along_imaginary(model: Model, f: int, x: Array) -> Array:
    """Return function f of a stack of coordinates, with its first derivative along an imaginary part."""
    flat = np.atleast_1d(x).ravel()
    pairs = [value_of(model, f, float(np.real(value))) for value in flat]
    result = np.array([value for value, _ in pairs], dtype=flat.dtype)
    if np.iscomplexobj(flat):
        result += 1j * np.imag(flat) * np.array([rate for _, rate in pairs])
    return np.asarray(result.reshape(np.shape(x)))
