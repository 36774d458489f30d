"""Expressions: what is accepted must have the value that Python itself gives to the text."""

import ast
import math
import operator
from pathlib import Path
from typing import Any

import numpy as np

from tests.campaign.verdict import ACCEPTED, REFUSED, TRACEBACK, UNCLEAR, WRONG, Verdict

__all__ = ["expression_case", "value_of_tape"]

WHOLE = (
    "-k*x - c*y + 3*z",
    "sin(x)*cos(y) - tan(x/3)",
    "x**2 + y^3 - (-z)",
    "2 if x < y else 3*z",
    "min(x, max(y, z))",
    "atan2(x, y) + abs(z)*sign(y)",
    "exp(-x)*log(y + 2)",
    "sqrt(y + 5)/(1 + x**2)",
    "(x <= y)*z + (1 if z >= x else 0)",
)
TOKENS = (
    "x",
    "y",
    "z",
    "k",
    "c",
    "pi",
    "+",
    "-",
    "*",
    "/",
    "**",
    "^",
    "(",
    ")",
    ",",
    " if ",
    " else ",
    "<",
    ">",
    "<=",
    "==",
    "sin(",
    "log(",
    "min(",
    "1",
    "2.5",
    "1e400",
    "0x1F",
    "1j",
    "'a'",
    "and",
    "not ",
    "lambda: ",
    "[",
    "]",
    "=",
    ":=",
    "\0",
    "é",
    "x.y",
    "__import__",
    "True",
    "1_0",
    "\n",
    "#",
    ";",
    "e",
    "9" * 400,
    "(" * 250,
    "-" * 2000,
    "x+" * 2000,
)
NAMES: dict[str, Any] = {
    "k": 2.5,
    "c": 0.3,
    "pi": math.pi,
    "sin": math.sin,
    "cos": math.cos,
    "tan": math.tan,
    "asin": math.asin,
    "acos": math.acos,
    "atan": math.atan,
    "sinh": math.sinh,
    "cosh": math.cosh,
    "tanh": math.tanh,
    "exp": math.exp,
    "log": math.log,
    "sqrt": math.sqrt,
    "abs": abs,
    "sign": lambda x: (x > 0) - (x < 0),
    "atan2": math.atan2,
    "min": min,
    "max": max,
}
PLACES = ((0.7, 1.3, 2.1), (1.9, 0.4, 0.6), (0.2, 0.2, 3.0))


def expression_case(seed: int, folder: Path) -> Verdict:
    """Compile a damaged expression, and compare its value at three places with Python's."""
    from floatframe.errors import ModelError
    from floatframe.model.functions.expressions import compile_expression

    rng = np.random.default_rng([6, seed])
    text = WHOLE[seed % len(WHOLE)]
    for _ in range(int(rng.integers(1, 4)) if seed >= len(WHOLE) else 0):
        at, kind = int(rng.integers(len(text) + 1)), int(rng.integers(3))
        token = TOKENS[int(rng.integers(len(TOKENS)))]
        text = text[:at] + (token if kind < 2 else "") + text[at + (kind > 0) * int(rng.integers(1, 4)) :]
    try:
        tape = compile_expression("force", text, ["x", "y", "z"], parameters={"k": 2.5, "c": 0.3})
    except ModelError as error:
        return Verdict(UNCLEAR if len(str(error)) > 600 else REFUSED, str(error)[:700])
    except Exception as error:
        return Verdict(TRACEBACK, f"{text!r:.200}: {error!r:.300}")
    code = compile(ast.parse(text.strip().replace("^", "**"), mode="eval"), "text", "eval")
    for place in PLACES:
        mine, theirs = value_of_tape(tape, place), by_python(code, place)
        if not np.isclose(mine, theirs, rtol=1e-12, atol=1e-300, equal_nan=True):
            return Verdict(WRONG, f"{text!r:.300} at {place}: {mine}, by Python {theirs}")
    return Verdict(ACCEPTED, "compared")


def by_python(code: Any, place: tuple[float, ...]) -> float:
    """Return the value of an expression, NaN where Python finds none."""
    try:
        value = eval(code, {"__builtins__": {}} | NAMES, dict(zip("xyz", place, strict=True)))
        return float(value) if not isinstance(value, complex) else math.nan
    except (ArithmeticError, ValueError):
        return math.nan


def value_of_tape(tape: Any, place: tuple[float, ...]) -> float:
    """Return the value of a tape by its documented meaning, operation by operation; NaN where there is none."""
    from floatframe.model.functions import expressions as codes

    of_code = {code: name for name, (code, _) in codes.FUNCTIONS.items()}
    arithmetic = {
        codes.ADD: operator.add,
        codes.SUBTRACT: operator.sub,
        codes.MULTIPLY: operator.mul,
        codes.DIVIDE: operator.truediv,
        codes.POWER: math.pow,
    }
    values: list[float] = []
    for op, a, b, c in zip(tape.op, tape.a, tape.b, tape.c, strict=True):
        try:
            if op == codes.CONSTANT:
                value = c
            elif op == codes.INPUT:
                value = place[a]
            elif op == codes.NEGATIVE:
                value = -values[a]
            elif op == codes.SELECT:
                value = values[a] if values[-1] else values[b]
            elif op == codes.LESS:
                value = float(values[a] < values[b])
            elif op in arithmetic:
                value = arithmetic[op](values[a], values[b])
            else:
                name = of_code[op]
                value = NAMES[name](*([values[a], values[b]] if codes.FUNCTIONS[name][1] == 2 else [values[a]]))
        except (ArithmeticError, ValueError):
            value = math.nan
        values.append(float(value))
    return values[-1]
