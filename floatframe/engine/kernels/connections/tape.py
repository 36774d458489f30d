"""Expressions in the kernels: a tape of operations on numbers, and its exact gradient; see `functions.expressions`.

Operation k of a tape works on the results of earlier ones, a and b, counted from the beginning of the tape. The
gradient comes from one pass backwards (reverse accumulation): bar_a += bar_k d(k)/d(a).
"""

import math

from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.time_function import time_function
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
def tape_value(tapes, functions, f, inputs, registers):
    """Return the value of tape f at the inputs; what its operations yield stays in the registers."""
    results = registers.results
    first, last = tapes.operation0[f], tapes.operation0[f + 1]
    for k in range(first, last):
        op, a, b = tapes.op[k], tapes.a[k], tapes.b[k]
        value = 0.0
        if op == CONSTANT:
            value = tapes.c[k]
        elif op == INPUT:
            value = inputs[a]
        elif op == CALL:
            value, _, _ = time_function(functions, b, results[a])
        elif op == SELECT:  # the operation before holds the condition
            value = results[a] if results[k - first - 1] != 0.0 else results[b]
        elif op < ADD:
            value, _ = unary(op, results[a])
        else:
            value, _, _ = binary(op, results[a], results[b])
        results[k - first] = value
    return results[last - first - 1]


@inner
def tape_gradient(tapes, functions, f, inputs, registers, gradient):
    """Write the derivatives of tape f by all inputs; return its value."""
    value = tape_value(tapes, functions, f, inputs, registers)
    first, n = tapes.operation0[f], tapes.operation0[f + 1] - tapes.operation0[f]
    results, bar = registers.results, registers.bars
    for k in range(gradient.shape[0]):
        gradient[k] = 0.0
    for k in range(n):
        bar[k] = 0.0
    bar[n - 1] = 1.0
    for k in range(n - 1, -1, -1):
        op, a, b, s = tapes.op[first + k], tapes.a[first + k], tapes.b[first + k], bar[k]
        if s == 0.0 or op == CONSTANT:
            continue
        if op == INPUT:
            gradient[a] += s
        elif op == CALL:
            _, slope, _ = time_function(functions, b, results[a])
            bar[a] += s * slope
        elif op == SELECT:
            if results[k - 1] != 0.0:
                bar[a] += s
            else:
                bar[b] += s
        elif op < ADD:
            _, slope = unary(op, results[a])
            bar[a] += s * slope
        else:
            _, by_a, by_b = binary(op, results[a], results[b])
            bar[a] += s * by_a
            bar[b] += s * by_b
    return value
