"""Expressions in laws of elements: the tape of an expression in `data`, evaluated for real and complex numbers."""

from collections.abc import Sequence

import numpy as np
from numba.extending import register_jitable

from floatframe.model.elements.curves import function_at
from floatframe.model.elements.smooth import absolute, atan2, larger, smaller
from floatframe.model.functions.expressions import (
    ABS,
    ACOS,
    ADD,
    ASIN,
    ATAN,
    ATAN2,
    CALL,
    CONSTANT,
    COS,
    COSH,
    DIVIDE,
    EXP,
    INPUT,
    LESS,
    LOG,
    MAX,
    MIN,
    MULTIPLY,
    NEGATIVE,
    POWER,
    SELECT,
    SIN,
    SINH,
    SQRT,
    SUBTRACT,
    TAN,
    TANH,
    Tape,
)

__all__ = ["tape_at", "tape_numbers"]

WHOLE = 16  #: largest exponent for which a power is computed as a product


def tape_numbers(tape: Tape, functions_at: Sequence[int]) -> list[float]:
    """Return the number of operations and four numbers for each; `functions_at`: indices of functions in `data`."""
    numbers = [float(len(tape.op))]
    for op, a, b, c in zip(tape.op, tape.a, tape.b, tape.c, strict=True):
        numbers += [float(op), float(a), float(functions_at[b]) if op == CALL else float(b), c]
    return numbers


@register_jitable
def power(x, y):
    """Return x to the power y; whole exponents by products, so that a complex step is exact for all x."""
    n = int(abs(y.real) + 0.5)
    if abs(y.real) != n or n > WHOLE or y.imag != 0.0:
        return x**y
    value = 1.0 + 0.0 * x
    for _ in range(n):
        value = value * x
    return value if y.real >= 0.0 else 1.0 / value


@register_jitable
def of_one(op, x):
    """Return the result of an operation with one operand."""
    if op == NEGATIVE:
        return -x
    if op == SIN:
        return np.sin(x)
    if op == COS:
        return np.cos(x)
    if op == TAN:
        return np.tan(x)
    if op == ASIN:
        return np.arcsin(x)
    if op == ACOS:
        return np.arccos(x)
    if op == ATAN:
        return np.arctan(x)
    if op == SINH:
        return np.sinh(x)
    if op == COSH:
        return np.cosh(x)
    if op == TANH:
        return np.tanh(x)
    if op == EXP:
        return np.exp(x)
    if op == LOG:
        return np.log(x)
    if op == SQRT:
        return np.sqrt(x)
    if op == ABS:
        return absolute(x)
    zero = 0.0 * x  # SIGN
    if x.real > 0.0:
        return zero + 1.0
    return zero - 1.0 if x.real < 0.0 else zero


@register_jitable
def of_two(op, x, y):
    """Return the result of an operation with two operands."""
    if op == ADD:
        return x + y
    if op == SUBTRACT:
        return x - y
    if op == MULTIPLY:
        return x * y
    if op == DIVIDE:
        return x / y
    if op == POWER:
        return power(x, y)
    if op == ATAN2:
        return atan2(x, y)
    if op == LESS:
        return 0.0 * x + (1.0 if x.real < y.real else 0.0)
    if op == MIN:
        return smaller(x, y)
    if op == MAX:
        return larger(x, y)
    return x


@register_jitable
def tape_at(data, at, inputs, results):
    """Return the value of the tape that begins at data[at]; the results of its operations are written to `results`."""
    n = int(data[at])
    for k in range(n):
        o = at + 1 + 4 * k
        op, a, b = int(data[o]), int(data[o + 1]), int(data[o + 2])
        if op == CONSTANT:
            results[k] = data[o + 3]
        elif op == INPUT:
            results[k] = inputs[a]
        elif op == CALL:
            results[k] = function_at(data, b, results[a])
        elif op == SELECT:  # the previous operation holds the condition
            results[k] = results[a] if results[k - 1].real != 0.0 else results[b]
        elif op < ADD:
            results[k] = of_one(op, results[a])
        else:
            results[k] = of_two(op, results[a], results[b])
    return results[n - 1]
