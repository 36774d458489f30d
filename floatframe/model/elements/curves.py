"""Functions of one variable and grids over two, stored in the data of a law and evaluated there.

An element writes them when it makes its law, and keeps the index where they begin:

    at = len(data)
    data += function_numbers(smooth_step(0.0, 1.0, 0.0, 5.0))

and the law evaluates `function_at(data, at, t)`. The functions accept real and complex numbers, and can be called from
compiled functions and from Python.
"""

from collections.abc import Sequence

import numpy as np
from numba.extending import register_jitable

from fe_models.foundation.arrays import Array
from floatframe.errors import ModelError
from floatframe.model.checked_values import array_of_shape
from floatframe.model.functions.time_functions import TimeFunction

__all__ = ["function_at", "function_integral_at", "function_numbers", "grid_at", "grid_numbers"]


def function_numbers(function: TimeFunction) -> list[float]:
    """Return n, the n starts of pieces, the n integrals up to these starts, and n rows of coefficients."""
    begins, pieces = function.begins, function.pieces
    lengths = np.diff(begins)
    parts = [piece_integral(c, length) for c, length in zip(pieces[:-1], lengths, strict=True)]
    sums = np.concatenate([[0.0], np.cumsum(parts)])
    return [float(len(begins)), *begins.tolist(), *sums.tolist(), *pieces.ravel().tolist()]


def piece_integral(c: Array, x: float) -> float:
    """Return the integral of a piece from its start to a distance x after the start."""
    value = sum(c[k] * x ** (k + 1) / (k + 1) for k in range(6))
    if c[6] != 0.0:
        omega, phase = c[7], c[8]
        value += c[6] * (x * np.sin(phase) if omega == 0 else (np.cos(phase) - np.cos(omega * x + phase)) / omega)
    return float(value)


@register_jitable
def piece_of(data, at, x):
    """Return the index of the piece for x: the last one that starts at or before x, else the first."""
    low, high = 0, int(data[at]) - 1
    while low < high:
        middle = (low + high + 1) // 2
        if data[at + 1 + middle] <= x.real:
            low = middle
        else:
            high = middle - 1
    return low


@register_jitable
def function_at(data, at, x):
    """Return the value at x of the function stored from data[at] on."""
    n, k = int(data[at]), piece_of(data, at, x)
    y, c = x - data[at + 1 + k], at + 1 + 2 * n + 9 * k
    value = 0.0 * y
    for j in range(5, -1, -1):  # Horner's scheme
        value = value * y + data[c + j]
    if data[c + 6] != 0.0:
        value = value + data[c + 6] * np.sin(data[c + 7] * y + data[c + 8])
    return value


@register_jitable
def function_integral_at(data, at, x):
    """Return the integral to x, from the start of the first piece, of the function stored from data[at] on."""
    n, k = int(data[at]), piece_of(data, at, x)
    y, c = x - data[at + 1 + k], at + 1 + 2 * n + 9 * k
    value = 0.0 * y
    for j in range(5, -1, -1):
        value = (value + data[c + j] / (j + 1)) * y
    if data[c + 6] != 0.0:
        omega, phase = data[c + 7], data[c + 8]
        if omega == 0.0:
            value = value + data[c + 6] * np.sin(phase) * y
        else:
            value = value + data[c + 6] * (np.cos(phase) - np.cos(omega * y + phase)) / omega
    return value + data[at + 1 + n + k]


def grid_numbers(where: str, x: Sequence[float], y: Sequence[float], values: Sequence[Sequence[float]]) -> list[float]:
    """Return n_x, n_y, x, y and values row by row; `ModelError` with `where` if they are inconsistent.

    Parameters
    ----------
    x, y
        Increasing coordinates, two or more of each.
            values
    Values, with one row for each x and one column for each y, (n_x, n_y).
    """
    axes = []
    for name, given in (("x", x), ("y", y)):
        line = array_of_shape(f"{where}: {name}", given, np.shape(given))
        if line.ndim != 1 or len(line) < 2 or (np.diff(line) <= 0).any():
            raise ModelError(f"{where}: {name}: expected two or more rising numbers, got {np.asarray(given).tolist()}")
        axes.append(line)
    table = array_of_shape(f"{where}: values", values, (len(axes[0]), len(axes[1])))
    return [float(len(axes[0])), float(len(axes[1])), *axes[0].tolist(), *axes[1].tolist(), *table.ravel().tolist()]


@register_jitable
def interval_of(data, at, n, x):
    """Return the index of the interval around x, or nearest to it, between n increasing numbers from data[at] on."""
    low, high = 0, n - 2
    while low < high:
        middle = (low + high + 1) // 2
        if data[at + middle] <= x.real:
            low = middle
        else:
            high = middle - 1
    return low


@register_jitable
def part_of(data, at, x):
    """Return the position of x between data[at] and data[at + 1] as a fraction, clamped to 0 .. 1."""
    part = (x - data[at]) / (data[at + 1] - data[at])
    if part.real < 0.0:
        return 0.0 * part
    if part.real > 1.0:
        return 0.0 * part + 1.0
    return part


@register_jitable
def grid_at(data, at, x, y):
    """Return the bilinear value at (x, y) of the grid stored from data[at] on; constant beyond its edges."""
    n_x, n_y = int(data[at]), int(data[at + 1])
    at_x, at_y = at + 2, at + 2 + n_x
    i, j = interval_of(data, at_x, n_x, x), interval_of(data, at_y, n_y, y)
    a, b = part_of(data, at_x + i, x), part_of(data, at_y + j, y)
    first = at_y + n_y + n_y * i + j
    low = (1.0 - b) * data[first] + b * data[first + 1]
    high = (1.0 - b) * data[first + n_y] + b * data[first + n_y + 1]
    return (1.0 - a) * low + a * high
