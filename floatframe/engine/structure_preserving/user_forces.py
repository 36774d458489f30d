"""User forces over a step: Q = f(t, x, v, z) along coordinates, z_1 - z_0 = h g(t, x, v, z).

Forces act at the middle of the step, with the mean coordinates and the rates v of their changes, or at one
configuration of a variational step; their work Q dx counts as given. States follow the midpoint rule in all schemes.
"""

import ctypes
import math
from collections.abc import Callable

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.callbacks.user_forces import C_FUNCTION
from floatframe.engine.kernels.model import Model
from floatframe.engine.structure_preserving.constraints import Loads, Pair, Span
from floatframe.engine.structure_preserving.coordinates import (
    add_impulsive_force,
    coordinate_change,
    coordinate_ends,
    coordinate_rate,
    counted,
)
from floatframe.engine.structure_preserving.couplers import coordinates_of
from floatframe.engine.structure_preserving.functions import value_of
from floatframe.model.functions import expressions as ex

__all__ = ["element_of", "state_rows", "user_force_load", "user_state_rates"]

UNARY: dict[int, Callable[[float], float]] = {
    ex.NEGATIVE: lambda x: -x, ex.SIN: math.sin, ex.COS: math.cos, ex.TAN: math.tan, ex.ASIN: math.asin,
    ex.ACOS: math.acos, ex.ATAN: math.atan, ex.SINH: math.sinh, ex.COSH: math.cosh, ex.TANH: math.tanh,
    ex.EXP: math.exp, ex.LOG: math.log, ex.SQRT: math.sqrt, ex.ABS: abs, ex.SIGN: lambda x: float(np.sign(x)),
}  # fmt: skip
BINARY: dict[int, Callable[[float, float], float]] = {
    ex.ADD: lambda x, y: x + y, ex.SUBTRACT: lambda x, y: x - y, ex.MULTIPLY: lambda x, y: x * y,
    ex.DIVIDE: lambda x, y: x / y, ex.POWER: lambda x, y: x**y, ex.ATAN2: math.atan2,
    ex.LESS: lambda x, y: float(x < y), ex.MIN: min, ex.MAX: max,
}  # fmt: skip
STEP = 1e-5  #: of the differences by which derivatives are taken, by the sizes of the inputs


def tape_at(model: Model, f: int, inputs: Array) -> float:
    """Return the value of tape f at inputs, (n_in,)."""
    first, last = int(model.tapes.operation0[f]), int(model.tapes.operation0[f + 1])
    results: list[float] = []
    for k in range(first, last):
        op, a, b = int(model.tapes.op[k]), int(model.tapes.a[k]), int(model.tapes.b[k])
        if op == ex.CONSTANT:
            results.append(float(model.tapes.c[k]))
        elif op == ex.INPUT:
            results.append(float(inputs[a]))
        elif op == ex.CALL:
            results.append(value_of(model, b, results[a])[0])
        elif op == ex.SELECT:
            results.append(results[a] if results[-1] != 0 else results[b])
        elif op in UNARY:
            results.append(float(UNARY[op](results[a])))
        else:
            results.append(float(BINARY[op](results[a], results[b])))
    return results[-1]


def values_at(model: Model, u: int, inputs: Array) -> Array:
    """Return forces and rates of states of user force u at inputs, (n_in,)."""
    n_out = int(model.users.n_forces[u] + model.users.n_states[u])
    if model.users.address[u] == 0:
        return np.array([tape_at(model, int(model.users.tape0[u]) + j, inputs) for j in range(n_out)])
    x, y = np.ascontiguousarray(inputs, float), np.zeros(n_out)
    number = ctypes.POINTER(ctypes.c_double)
    C_FUNCTION(int(model.users.address[u]))(x.ctypes.data_as(number), y.ctypes.data_as(number))
    return y


def user_values(model: Model, u: int, inputs: Array) -> Array:
    """Return forces and rates of states, (..., n_out), with their derivatives along imaginary parts."""
    flat, sizes = inputs.reshape(-1, inputs.shape[-1]), sizes_of_inputs(model, u)
    out = []
    for x in flat:
        value = values_at(model, u, np.real(x))
        size = np.abs(np.imag(x) / sizes).max(initial=0.0)
        if size > 0:
            way = STEP * np.imag(x) / size
            change = values_at(model, u, np.real(x) + way) - values_at(model, u, np.real(x) - way)
            value = value + 1j * change * (0.5 * size / STEP)
        out.append(value)
    return np.array(out).reshape(*inputs.shape[:-1], -1)


def sizes_of_inputs(model: Model, u: int) -> Array:
    """Return sizes of t, x, v, z of user force u, (n_in,), by which differences are taken; nothing takes those by t."""
    i = u + len(model.elements.core) - len(model.users.n_states)
    x = slice(int(model.elements.coordinate0[i]), int(model.elements.coordinate0[i + 1]))
    z = model.states.size[model.users.state0[u] : model.users.state0[u + 1]]
    return np.concatenate([[1.0], model.coordinates.size[x], model.coordinates.speed[x], z])


def state_rows(model: Model, c: int) -> tuple[int, ...]:
    """Return the rows of the states of user force c."""
    u = int(model.connections.item[c])
    return tuple(int(k) for k in model.states.row[model.users.state0[u] : model.users.state0[u + 1]])


def element_of(model: Model, c: int) -> int:
    """Return the number of user force c among all elements (couplers come first)."""
    return int(model.connections.item[c]) + len(model.elements.core) - len(model.users.n_states)


def inputs_of(
    model: Model, c: int, pairs: list[Pair], t: float, span: Span, z: Array, *, is_middle: bool
) -> tuple[Array, list[Array]]:
    """Return t, x, v, z, (..., n_in), and the changes of the coordinates; x where forces end to act, or their mean."""
    x, v, changes = [], [], []
    for p, pair in zip(coordinates_of(model, c, element_of(model, c)), pairs, strict=True):
        k = int(model.coordinates.row[p])
        rate = coordinate_rate(model, k, pair, span.h)
        begin, end = coordinate_ends(model, k, pair)
        value = counted(model, k, end, span.w[k])
        x.append(value - 0.5 * (end - begin) if is_middle else value)
        v.append(rate)
        changes.append(rate * span.h)
    states = [z[..., s] for s in range(z.shape[-1])]
    return np.stack(np.broadcast_arrays(t, *x, *v, *states), axis=-1), changes


def user_force_load(
    model: Model, c: int, pairs: list[Pair], loads: list[Loads], span: Span, dz: Array, *, is_middle: bool
) -> Array:
    """Add the loads of user force c; return the work they give. dz: changes of the states, (..., n_states)."""
    z = span.w[list(state_rows(model, c))] + (0.5 * dz if is_middle else 0.0 * dz)
    inputs, changes = inputs_of(model, c, pairs, span.t_force, span, z, is_middle=is_middle)
    values = user_values(model, int(model.connections.item[c]), inputs)
    given = np.zeros(values.shape[:-1], values.dtype)
    i = element_of(model, c)
    for p, pair, load, change in zip(coordinates_of(model, c, i), pairs, loads, changes, strict=True):
        if model.coordinates.force[p] >= 0:
            Q = values[..., int(model.coordinates.core[p] - model.elements.core[i])]
            add_impulsive_force(model, int(model.coordinates.row[p]), pair, load, Q)
            given = given + Q * change
    return given


def user_state_rates(model: Model, c: int, pairs: list[Pair], span: Span, dz: Array, *, is_along: bool) -> Array:
    """Return the rates of the states of user force c in the middle of the step, (..., n_states)."""
    z = span.w[list(state_rows(model, c))] + 0.5 * dz
    inputs, _ = inputs_of(model, c, pairs, 0.5 * (span.t_0 + span.t_1), span, z, is_middle=True)
    if not is_along:
        for p, pair in enumerate(pairs):
            k = int(model.coordinates.row[model.elements.coordinate0[element_of(model, c)] + p])
            inputs[..., 1 + len(pairs) + p] = coordinate_change(model, k, pair) / span.h
    u = int(model.connections.item[c])
    return user_values(model, u, inputs)[..., int(model.users.n_forces[u]) :]
