"""Expressions in the kernels: a tape of operations on numbers, and its exact gradient; see `functions.expressions`.

Operation k of a tape works on the results of earlier ones, a and b, counted from the beginning of the tape. The
gradient comes from one pass backwards (reverse accumulation): bar_a += bar_k d(k)/d(a).
"""

import math

from floatframe.functions.expressions import (
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
)
from floatframe.kernels.compiler.compilation import inner
from floatframe.kernels.time_function import time_function

__all__ = ["tape_gradient", "tape_value"]


@inner
def unary(op, x):
    """Return value and derivative of a function of one number."""
    if op == NEGATIVE:
        return -x, -1.0
    if op == SIN:
        return math.sin(x), math.cos(x)
    if op == COS:
        return math.cos(x), -math.sin(x)
    if op == TAN:
        value = math.tan(x)
        return value, 1.0 + value * value
    if op == ASIN:
        return math.asin(x), 1.0 / math.sqrt(1.0 - x * x)
    if op == ACOS:
        return math.acos(x), -1.0 / math.sqrt(1.0 - x * x)
    if op == ATAN:
        return math.atan(x), 1.0 / (1.0 + x * x)
    if op == SINH:
        return math.sinh(x), math.cosh(x)
    if op == COSH:
        return math.cosh(x), math.sinh(x)
    if op == TANH:
        value = math.tanh(x)
        return value, 1.0 - value * value
    if op == EXP:
        value = math.exp(x)
        return value, value
    if op == LOG:
        return math.log(x), 1.0 / x
    if op == SQRT:
        value = math.sqrt(x)
        return value, 0.5 / value
    if op == ABS:
        return abs(x), -1.0 if x < 0.0 else 1.0
    sign = 0.0  # SIGN
    if x > 0.0:
        sign = 1.0
    elif x < 0.0:
        sign = -1.0
    return sign, 0.0


@inner
def binary(op, x, y):
    """Return value and both derivatives of a function of two numbers."""
    if op == ADD:
        return x + y, 1.0, 1.0
    if op == SUBTRACT:
        return x - y, 1.0, -1.0
    if op == MULTIPLY:
        return x * y, y, x
    if op == DIVIDE:
        return x / y, 1.0 / y, -x / (y * y)
    if op == POWER:
        value = x**y
        by_x = y * x ** (y - 1.0) if y != 0.0 else 0.0
        return value, by_x, value * math.log(x) if x > 0.0 else 0.0
    if op == ATAN2:
        square = x * x + y * y
        return math.atan2(x, y), y / square, -x / square
    if op == LESS:
        return 1.0 if x < y else 0.0, 0.0, 0.0
    if op == MIN:
        return (x, 1.0, 0.0) if x <= y else (y, 0.0, 1.0)
    return (x, 1.0, 0.0) if x >= y else (y, 0.0, 1.0)  # MAX


@inner
def tape_value(model, work, f):
    """Return the value of tape f at the inputs in `work`; results of all operations stay in work.tapes.results."""
    first, last = model.tapes.operation0[f], model.tapes.operation0[f + 1]
    for k in range(first, last):
        op, a, b = model.tapes.op[k], model.tapes.a[k], model.tapes.b[k]
        value = 0.0
        if op == CONSTANT:
            value = model.tapes.c[k]
        elif op == INPUT:
            value = work.users.inputs[a]
        elif op == CALL:
            value, _, _ = time_function(model, b, work.tapes.results[a])
        elif op == SELECT:  # the operation before holds the condition
            value = work.tapes.results[a] if work.tapes.results[k - first - 1] != 0.0 else work.tapes.results[b]
        elif op < ADD:
            value, _ = unary(op, work.tapes.results[a])
        else:
            value, _, _ = binary(op, work.tapes.results[a], work.tapes.results[b])
        work.tapes.results[k - first] = value
    return work.tapes.results[last - first - 1]


@inner
def tape_gradient(model, work, f, gradient):
    """Write the derivatives of tape f by all inputs; return its value."""
    value = tape_value(model, work, f)
    first, n = model.tapes.operation0[f], model.tapes.operation0[f + 1] - model.tapes.operation0[f]
    bar = work.tapes.bars
    for k in range(gradient.shape[0]):
        gradient[k] = 0.0
    for k in range(n):
        bar[k] = 0.0
    bar[n - 1] = 1.0
    for k in range(n - 1, -1, -1):
        op, a, b, s = model.tapes.op[first + k], model.tapes.a[first + k], model.tapes.b[first + k], bar[k]
        if s == 0.0 or op == CONSTANT:
            continue
        if op == INPUT:
            gradient[a] += s
        elif op == CALL:
            _, slope, _ = time_function(model, b, work.tapes.results[a])
            bar[a] += s * slope
        elif op == SELECT:
            if work.tapes.results[k - 1] != 0.0:
                bar[a] += s
            else:
                bar[b] += s
        elif op < ADD:
            _, slope = unary(op, work.tapes.results[a])
            bar[a] += s * slope
        else:
            _, by_a, by_b = binary(op, work.tapes.results[a], work.tapes.results[b])
            bar[a] += s * by_a
            bar[b] += s * by_b
    return value
