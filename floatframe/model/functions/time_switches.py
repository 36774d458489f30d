"""Times at which an expression jumps as a function of time: comparisons of time terms, and tables with jumps.

`10 if t < 0.3 else 0` jumps at 0.3, `f(2*t - 1)` where 2 t - 1 passes a jump of f, `sign(sin(50*t))` at every zero of
the sine, `min(5, tan(t))` at every pole of the tangent, `atan2(sin(t), cos(t))` once a turn. Each is a switch: a
function of time that is true or false. Its changes are bracketed between given times and found by bisection. A step may
also end where nothing jumps (atan2, if its second argument passes zero below the first axis), which does no harm. A
denominator that touches zero without passing it, as in `x/abs(x)`, is not found: write `sign(x)`. A comparison of
coordinates depends on the motion, and is not handled here.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fe_models.foundation.arrays import Array
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
    SIGN,
    SIN,
    SINH,
    SQRT,
    SUBTRACT,
    TAN,
    TANH,
    Tape,
)
from floatframe.model.functions.time_functions import TimeFunction

__all__ = ["OfTime", "Switch", "TimeParts", "switch_times", "time_parts"]

OfTime = Callable[[Array], Array]  #: function from times to values, (n_t,)
Switch = Callable[[Array], NDArray[np.bool_]]  #: function from times to truth values, (n_t,)

OPERATIONS: dict[int, Callable[..., Array]] = {
    NEGATIVE: np.negative, SIN: np.sin, COS: np.cos, TAN: np.tan, ASIN: np.arcsin, ACOS: np.arccos, ATAN: np.arctan,
    SINH: np.sinh, COSH: np.cosh, TANH: np.tanh, EXP: np.exp, LOG: np.log, SQRT: np.sqrt, ABS: np.abs, SIGN: np.sign,
    ADD: np.add, SUBTRACT: np.subtract, MULTIPLY: np.multiply, DIVIDE: np.divide, POWER: np.power, ATAN2: np.arctan2,
    LESS: np.less, MIN: np.minimum, MAX: np.maximum,
}  # fmt: skip
MOST_HALVINGS = 120


class TimeParts(NamedTuple):
    """Parts of an expression that depend only on time."""

    switches: tuple[Switch, ...] = ()
    phases: tuple[OfTime, ...] = ()  #: arguments of sines and cosines [rad]
    value: OfTime | None = None  #: value of the last expression; None if it does not depend only on time
    values: tuple[OfTime, ...] = ()  #: values of all expressions that depend only on time

    def __add__(self, other: "TimeParts") -> "TimeParts":  # type: ignore[override]
        """Return the parts of both expressions, with the value of the second."""
        return TimeParts(
            self.switches + other.switches, self.phases + other.phases, other.value, self.values + other.values
        )


def time_parts(tape: Tape, inputs: Mapping[int, OfTime], functions: Sequence[TimeFunction]) -> TimeParts:
    """Return the parts of an expression that depend only on time.

    Parameters
    ----------
    tape
        The expression; its calls refer to indices of `functions`.
    inputs
        Inputs that depend only on time, by index of the input.
    functions
        The tables that it calls.
    """
    switches: list[Switch] = []
    phases: list[OfTime] = []
    values: list[OfTime | None] = []
    for k, (op, a, b, c) in enumerate(zip(tape.op, tape.a, tape.b, tape.c, strict=True)):
        value: OfTime | None = None
        if op == CONSTANT:
            value = partial(constant_at, c)
        elif op == INPUT:
            value = inputs.get(a)
        elif op == CALL:
            x = values[a]
            if x is not None:
                value = partial(called, functions[b].at, x)
                switches += [partial(is_beyond, x, float(level)) for level in functions[b].jumps(0)[0]]
        elif op == SELECT:
            yes, no, test = values[a], values[b], values[k - 1]
            if yes is not None and no is not None and test is not None:
                value = partial(chosen, test, yes, no)
        else:
            operands = [values[each] for each in ((a,) if op < ADD else (a, b))]
            known = [each for each in operands if each is not None]
            if len(known) == len(operands):
                value = partial(applied, OPERATIONS[op], known)
                if op in (SIN, COS):
                    phases.append(known[0])
                elif op == LESS:
                    switches.append(partial(is_true, value))
                elif op == TAN:
                    switches.append(partial(is_positive, partial(applied, np.cos, known)))
                elif op == DIVIDE:
                    switches.append(partial(is_positive, known[1]))
                elif op == ATAN2:
                    switches.append(partial(is_behind, known[0], known[1]))
                elif op == SIGN:
                    switches += [partial(is_beyond, known[0], 0.0), partial(is_below, known[0])]
        values.append(value)
    last = values[-1]
    return TimeParts(tuple(switches), tuple(phases), last, () if last is None else (last,))


def constant_at(c: float, t: Array) -> Array:
    """Return a constant for each time."""
    return np.full(np.shape(t), c)


def called(function: OfTime, x: OfTime, t: Array) -> Array:
    """Return a table function of a function of time."""
    return function(x(t))


def chosen(test: OfTime, yes: OfTime, no: OfTime, t: Array) -> Array:
    """Return one of two functions of time, selected by a third function."""
    return np.where(test(t) != 0.0, yes(t), no(t))


def applied(operation: Callable[..., Array], operands: Sequence[OfTime], t: Array) -> Array:
    """Return an operation applied to functions of time."""
    with np.errstate(all="ignore"):
        return np.asarray(operation(*(each(t) for each in operands)), dtype=float)


def is_true(value: OfTime, t: Array) -> NDArray[np.bool_]:
    """Return whether a comparison is true at each time, (n_t,)."""
    return value(t) != 0.0


def is_beyond(value: OfTime, level: float, t: Array) -> NDArray[np.bool_]:
    """Return whether a function has reached a level at each time, (n_t,)."""
    return value(t) >= level


def is_positive(value: OfTime, t: Array) -> NDArray[np.bool_]:
    """Return whether a denominator is positive at each time, (n_t,); at a zero it has the sign from just before."""
    v = value(t)
    return np.where(v == 0.0, value(np.nextafter(t, -np.inf)), v) > 0.0


def is_behind(y: OfTime, x: OfTime, t: Array) -> NDArray[np.bool_]:
    """Return whether a point is in the third quadrant at each time, (n_t,), next to the branch cut of atan2."""
    return (y(t) < 0.0) & (x(t) < 0.0)


def is_below(value: OfTime, t: Array) -> NDArray[np.bool_]:
    """Return whether a function is zero or negative at each time, (n_t,)."""
    return value(t) <= 0.0


def switch_times(switches: Sequence[Switch], t: Array) -> list[float]:
    """Return, in ascending order, the first times after changes of switches, among times t, (n_t,)."""
    found: set[float] = set()
    for switch in switches:
        is_on = switch(t)
        for k in map(int, np.flatnonzero(is_on[1:] != is_on[:-1])):
            low, high = float(t[k]), float(t[k + 1])
            for _ in range(MOST_HALVINGS):
                middle = 0.5 * (low + high)
                if not low < middle < high:
                    break
                low, high = (middle, high) if switch(np.array([middle]))[0] == is_on[k] else (low, middle)
            found.add(high)
    return sorted(found)
