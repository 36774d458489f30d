"""An element defined by expressions in a system file: forces and moments between markers, states and outputs.

Quantities of each marker except the first, in the axes of the first; for a marker b:

    b_x, b_y, b_z       relative position               b_vx, b_vy, b_vz    relative velocity
    b_rx, b_ry, b_rz    relative rotation vector        b_wx, b_wy, b_wz    relative angular velocity

Further names in expressions are the time t, states, parameters, functions of one variable, and terms (named expressions
of all these and of earlier terms). Forces b_Fx, b_Fy, b_Fz act at b and moments b_Mx, b_My, b_Mz on it. The opposite
loads act on the first marker, including the moment of the lever arm.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numba import njit
from numba.extending import register_jitable

from fe_models.foundation.records import checked_fields, frozen_copies
from fe_models.foundation.words import nearest, quoted
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker
from floatframe.model.checked_values import number
from floatframe.model.elements.curves import function_at, function_numbers
from floatframe.model.elements.element import Element, ElementLaw, Placed
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
    CONSTANTS,
    COS,
    COSH,
    DIVIDE,
    EXP,
    FUNCTIONS,
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
    compile_expression,
)
from floatframe.model.functions.time_functions import NOT_OF_TIME, TimeFunction
from floatframe.model.functions.time_switches import OfTime, TimeParts, time_parts

__all__ = ["ExpressionElement", "tape_at", "tape_numbers"]


# tapes ----------------------------------------------------------------------------------------------------------------
# Expressions in laws of elements: the tape of an expression in `data`, evaluated for real and complex numbers.


WHOLE = 16  #: largest exponent for which a power is computed by multiplication


def tape_numbers(tape: Tape, functions_at: Sequence[int]) -> list[float]:
    """Return the number of operations and four numbers for each; `functions_at`: indices of functions in `data`."""
    numbers = [float(len(tape.op))]
    for op, a, b, c in zip(tape.op, tape.a, tape.b, tape.c, strict=True):
        numbers += [float(op), float(a), float(functions_at[b]) if op == CALL else float(b), c]
    return numbers


@register_jitable
def power(x, y):
    """Return x to the power y; integer exponents by multiplication, so that complex steps are exact for all x."""
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
    """Return the value of the tape stored from data[at] on; results of its operations are written to `results`."""
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


# expressions ----------------------------------------------------------------------------------------------------------


#: quantities of a marker that expressions may use
SEEN = ("x", "y", "z", "rx", "ry", "rz", "vx", "vy", "vz", "wx", "wy", "wz")
GIVEN = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")  #: loads on a marker that expressions may give
SMALL = 1e-4  #: squared sine of an angle below which a series is used


@register_jitable
def in_axes_of_first(x, v):
    """Return the components of a vector in the axes of the first marker."""
    return (
        x[0, 3] * v[0] + x[0, 6] * v[1] + x[0, 9] * v[2],
        x[0, 4] * v[0] + x[0, 7] * v[1] + x[0, 10] * v[2],
        x[0, 5] * v[0] + x[0, 8] * v[1] + x[0, 11] * v[2],
    )


@register_jitable
def write_rotation(x, m, out, o):
    """Write the rotation vector, shorter than pi, of marker m relative to the first marker; same in axes of both."""
    c0 = in_axes_of_first(x, (x[m, 3], x[m, 6], x[m, 9]))
    c1 = in_axes_of_first(x, (x[m, 4], x[m, 7], x[m, 10]))
    c2 = in_axes_of_first(x, (x[m, 5], x[m, 8], x[m, 11]))
    s0, s1, s2 = 0.5 * (c1[2] - c2[1]), 0.5 * (c2[0] - c0[2]), 0.5 * (c0[1] - c1[0])  # sin n
    cos = 0.5 * (c0[0] + c1[1] + c2[2] - 1.0)
    square = s0 * s0 + s1 * s1 + s2 * s2
    if square.real < SMALL and cos.real > 0.0:  # angle from its sine
        by_sine = 1.0 + square * (1 / 6 + square * (3 / 40 + square * (15 / 336 + square * 105 / 3456)))
    else:
        sine = np.sqrt(square)
        by_sine = atan2(sine, cos) / sine
    out[o], out[o + 1], out[o + 2] = by_sine * s0, by_sine * s1, by_sine * s2


@register_jitable
def write_quantities(x, m, out, o):
    """Write the twelve motion quantities of marker m."""
    d = (x[m, 0] - x[0, 0], x[m, 1] - x[0, 1], x[m, 2] - x[0, 2])
    w = (x[0, 15], x[0, 16], x[0, 17])
    v = (
        x[m, 12] - x[0, 12] - (w[1] * d[2] - w[2] * d[1]),
        x[m, 13] - x[0, 13] - (w[2] * d[0] - w[0] * d[2]),
        x[m, 14] - x[0, 14] - (w[0] * d[1] - w[1] * d[0]),
    )
    out[o], out[o + 1], out[o + 2] = in_axes_of_first(x, d)
    write_rotation(x, m, out, o + 3)
    out[o + 6], out[o + 7], out[o + 8] = in_axes_of_first(x, v)
    out[o + 9], out[o + 10], out[o + 11] = in_axes_of_first(x, (x[m, 15] - w[0], x[m, 16] - w[1], x[m, 17] - w[2]))


@njit
def expression_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Evaluate all expressions; data: largest number of operations, number of terms, tape indices (or -1), tapes."""
    n, n_z, n_terms = x.shape[0], z.shape[0], int(data[1])
    n_inputs = 1 + 12 * (n - 1) + n_z
    inputs = np.empty(n_inputs + n_terms, x.dtype)
    results = np.empty(int(data[0]), x.dtype)
    inputs[0] = t
    for m in range(1, n):
        write_quantities(x, m, inputs, 1 + 12 * (m - 1))
    for k in range(n_z):
        inputs[1 + 12 * (n - 1) + k] = z[k]
    for k in range(n_terms):
        inputs[n_inputs + k] = tape_at(data, int(data[2 + k]), inputs, results)
    at = 2 + n_terms
    for m in range(1, n):
        f = np.zeros(6, x.dtype)
        for k in range(6):
            if data[at + k] >= 0.0:
                f[k] = tape_at(data, int(data[at + k]), inputs, results)
        at += 6
        for k in range(3):  # to ground axes
            row = 3 + 3 * k
            for part in range(0, 6, 3):
                value = x[0, row] * f[part] + x[0, row + 1] * f[part + 1] + x[0, row + 2] * f[part + 2]
                wrench[m, part + k] = value
                wrench[0, part + k] -= value
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            arm = (x[m, i] - x[0, i]) * wrench[m, j] - (x[m, j] - x[0, j]) * wrench[m, i]
            wrench[0, 3 + k] -= arm
    for k in range(n_z):
        z_dot[k] = tape_at(data, int(data[at + k]), inputs, results)
    for k in range(outputs.shape[0]):
        outputs[k] = tape_at(data, int(data[at + n_z + k]), inputs, results)


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class ExpressionElement(Element):
    """Forces, states and outputs as expressions of marker motion relative to the first marker; see the module."""

    name: str
    places: Mapping[str, Marker]  #: markers by their names in expressions
    forces: Mapping[str, str] = field(default_factory=dict)  #: expressions for the loads b_Fx, ..., b_Mz
    states: Mapping[str, float] = field(default_factory=dict)  #: initial values of the states
    rates: Mapping[str, str] = field(default_factory=dict)  #: expressions for the rates of the states
    #: named expressions that all others, and later terms, may use
    terms: Mapping[str, str] = field(default_factory=dict)
    outputs: Mapping[str, str] = field(default_factory=dict)  #: expressions for the outputs
    output_units: Mapping[str, str] = field(default_factory=dict)
    parameters: Mapping[str, float] = field(default_factory=dict)
    #: functions of one variable by name
    functions: Mapping[str, TimeFunction] = field(default_factory=dict, metadata=NOT_OF_TIME)
    energy: str | None = None  #: name of the output that is the stored energy
    power_lost: str | None = None  #: name of the output that is the dissipated power

    def __post_init__(self) -> None:
        where = f"element {self.name!r}"
        if len(self.places) < 2:
            raise ModelError(f"{where}: places: expected two markers at least, by name, got {len(self.places)}")
        names = [*self.inputs, *self.terms, *self.parameters, *self.functions]
        for k, each in enumerate(names):
            if not each.isidentifier() or each in names[:k] or each in CONSTANTS or each in FUNCTIONS:
                raise ModelError(f"{where}: expected names of letters, digits and _, used once, got {quoted(each)}")
        given = [f"{place}_{each}" for place in list(self.places)[1:] for each in GIVEN]
        for key in self.forces:
            if key not in given:
                raise ModelError(f"{where}: forces: no component {quoted(key)}{nearest(key, given)}")
        if set(self.rates) != set(self.states):
            raise ModelError(
                f"{where}: expected a rate and an initial value for each state, got rates of "
                f"{sorted(self.rates)} and states {sorted(self.states)}"
            )
        for part in ("states", "parameters"):
            values = {key: number(f"{where}: {part}: {key}", value) for key, value in getattr(self, part).items()}
            object.__setattr__(self, part, values)

    @property
    def markers(self) -> tuple[Marker, ...]:
        """Markers in order."""
        return tuple(self.places.values())

    @property
    def inputs(self) -> list[str]:
        """Names of the inputs of expressions in order."""
        seen = [f"{place}_{each}" for place in list(self.places)[1:] for each in SEEN]
        return ["t", *seen, *self.states]

    def parts_of_time(self) -> TimeParts:
        """Return the parts of the expressions that depend only on time; terms may be such functions."""
        parts = TimeParts()
        numbers, known = {key: k for k, key in enumerate(self.functions)}, self.inputs
        of_time: dict[int, OfTime] = {0: np.asarray}
        last = (*self.forces.values(), *self.rates.values())
        for key, text in (*self.terms.items(), *(("", each) for each in last)):
            where = f"element {self.name!r}"
            tape = compile_expression(where, text, known, parameters=self.parameters, functions=numbers)
            parts += time_parts(tape, of_time, list(self.functions.values()))
            if key:
                if parts.value is not None:
                    of_time[len(known)] = parts.value
                known = [*known, key]
        return parts

    def law(self, placed: Placed) -> ElementLaw:
        """Return the law, with tapes and functions in its data."""
        forces = [f"{place}_{each}" for place in list(self.places)[1:] for each in GIVEN]
        texts: list[tuple[str, str, str | None]] = [("terms", key, text) for key, text in self.terms.items()]
        texts += [("forces", key, self.forces.get(key)) for key in forces]
        texts += [("rates", key, self.rates[key]) for key in self.states]
        texts += [("outputs", key, text) for key, text in self.outputs.items()]
        data = [0.0, float(len(self.terms))] + [0.0] * len(texts)
        known = self.inputs
        functions_at = []
        for function in self.functions.values():
            functions_at.append(len(data))
            data += function_numbers(function)
        numbers = {key: k for k, key in enumerate(self.functions)}
        for k, (part, key, text) in enumerate(texts):
            if text is None:
                data[2 + k] = -1.0
                continue
            where = f"element {self.name!r}: {part}: {key}"
            tape = compile_expression(where, text, known, parameters=self.parameters, functions=numbers)
            data[2 + k] = float(len(data))
            data[0] = max(data[0], float(len(tape.op)))
            data += tape_numbers(tape, functions_at)
            if part == "terms":
                known = [*known, key]
        turned = {key[: -len("_Mx")] for key in self.forces if key[-2] == "M"}
        return ElementLaw(
            function=expression_law,
            tangent="complex",
            data=data,
            states=tuple(self.states),
            start=tuple(self.states.values()),
            outputs=tuple(self.outputs),
            output_units=tuple(self.output_units.get(key, "") for key in self.outputs),
            acts=("wrench", *("wrench" if place in turned else "force" for place in list(self.places)[1:])),
            energy=self.energy,
            power_lost=self.power_lost,
        )
