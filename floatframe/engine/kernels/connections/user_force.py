"""User forces: Q = f(t, x, v, z) along coordinates, and states z with z_dot = g(t, x, v, z) integrated with the motion.

Rows after those of the coordinates: the forces, then for each state its value, its rate and an algorithmic rate a,

    Q - f = 0;   z - b - kappa g' = 0,   g' - g = 0,   a - b' - rho g' = 0        (g': the rate as an unknown)

with b, b', kappa and rho of the generalized-alpha method for first-order equations, see `begin_states`.

Described in `floatframe.model.forces.user_force`.
"""

import math

from floatframe.engine.kernels.compiler.compilation import inner, view
from floatframe.engine.kernels.compiler.user_call import call_user_function
from floatframe.engine.kernels.connections.coordinate import (
    coordinate_gradient,
    coordinate_motion,
    derivatives_along_coordinates,
    indices_of,
    rows_along_coordinates,
)
from floatframe.engine.kernels.dense import matrix_at
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

__all__ = [
    "begin_states",
    "input_parts",
    "note_no_number",
    "put_state_derivatives",
    "resize_states",
    "state_rows",
    "tape_gradient",
    "tape_value",
    "user_force_derivatives",
    "user_force_power",
    "user_force_rows",
    "user_outputs",
]


# tape -----------------------------------------------------------------------------------------------------------------
# Expressions in the kernels: a tape of operations on numbers, and its exact gradient; see `functions.expressions`.
#
# Operation k of a tape uses the results of earlier operations, with the numbers a and b in the tape. One backward pass
# gives the gradient (reverse accumulation): bar_a += bar_k d(k)/d(a).


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
    """Return the value of tape f for the inputs; all intermediate results stay in `registers`."""
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
        elif op == SELECT:  # the previous operation has the condition
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


# user force -----------------------------------------------------------------------------------------------------------


STEP = 1e-7  # step of differences of users' functions, relative to the sizes of coordinates and states
LEAST_STEP = 1e-9  # smallest step of states
ROUNDING = 2e-15  # fraction of a number below which a step is lost in roundoff


@inner
def counts_of(model, c):
    """Return the numbers of coordinates, inputs and outputs of user force c."""
    i, first, last = indices_of(model, c)
    n, n_states = last - first, model.elements.n_states[i]
    return n, 1 + 2 * n + n_states, model.elements.n_forces[i] + n_states


@view
def input_parts(inputs, n):
    """Return the parts x, v (n each) and z of the inputs t, x, v, z of a user force, or of a row of derivatives."""
    return inputs[1 : 1 + n], inputs[1 + n : 1 + 2 * n], inputs[1 + 2 * n :]


@inner
def user_values(model, work, c):
    """Write t, x, v, z into work.users.inputs, and forces and rates of states into work.users.outputs."""
    i, first, last = indices_of(model, c)
    work.users.inputs[0] = work.state.time
    x, v, z = input_parts(work.users.inputs, last - first)
    for p in range(first, last):
        x[p - first], v[p - first] = coordinate_motion(model, work, p)
    row = model.elements.core[i] + model.elements.n_forces[i]
    for s in range(model.elements.n_states[i]):
        z[s] = work.state.w[row + 3 * s]
    user_outputs(model, work, c)


@inner
def user_outputs(model, work, c):
    """Write forces and rates of states for the inputs into work.users.outputs."""
    i = model.connections.item[c]
    _, n_in, n_out = counts_of(model, c)
    if model.elements.address[i] != 0:
        call_user_function(model.elements.address[i], work.users.inputs, work.users.outputs)
    else:
        for j in range(n_out):
            f = model.elements.tape0[i] + j
            work.users.outputs[j] = tape_value(model.tapes, model.functions, f, work.users.inputs, work.tapes)
    note_no_number(work, c, work.users.outputs, n_out, work.users.inputs, n_in)


@inner
def note_no_number(work, c, outputs, n_out, inputs, n_in):
    """Record the first connection of a step that has finite inputs but outputs that are not finite."""
    if work.counted.no_number == 0 and not are_finite(outputs, n_out) and are_finite(inputs, n_in):
        work.counted.no_number = c + 1


@inner
def are_finite(values, n):
    """Return whether the first n values are finite."""
    for k in range(n):
        if not math.isfinite(values[k]):
            return False
    return True


@view
def gradients_of(model, work, c):
    """Return the derivatives of all outputs of user force c by all inputs, (n_out, n_in)."""
    _, n_in, n_out = counts_of(model, c)
    return matrix_at(work.users.gradients, 0, n_out, n_in)


@inner
def user_gradients(model, work, c):
    """Write the derivatives of all outputs by all inputs."""
    i, first, _ = indices_of(model, c)
    n, n_in, n_out = counts_of(model, c)
    gradients = gradients_of(model, work, c)
    user_values(model, work, c)
    if model.elements.address[i] == 0:
        for j in range(n_out):
            f = model.elements.tape0[i] + j
            tape_gradient(model.tapes, model.functions, f, work.users.inputs, work.tapes, gradients[j])
        return
    for k in range(1, n_in):  # derivatives by time are not used
        here = work.users.inputs[k]
        if k <= n:
            step = STEP * model.coordinates.size[first + k - 1]
        elif k <= 2 * n:
            step = STEP * model.coordinates.speed[first + k - 1 - n]
        else:
            step = max(STEP * abs(here), LEAST_STEP)
        step = max(step, ROUNDING * abs(here))
        above, below = here + step, here - step
        work.users.inputs[k] = above
        call_user_function(model.elements.address[i], work.users.inputs, work.users.trial)
        work.users.inputs[k] = below
        for j in range(n_out):
            gradients[j, k] = work.users.trial[j]
        call_user_function(model.elements.address[i], work.users.inputs, work.users.trial)
        work.users.inputs[k] = here
        for j in range(n_out):
            gradients[j, k] = (gradients[j, k] - work.users.trial[j]) / (above - below)


@inner
def user_force_rows(model, work, c, c_k):
    """Write the residual of user force c, and its wrenches."""
    i = model.connections.item[c]
    rows_along_coordinates(model, work, c, c_k)
    user_values(model, work, c)
    k = model.elements.core[i]
    for j in range(model.elements.n_forces[i]):
        work.connections.g[k + j] = c_k * (work.state.w[k + j] - work.users.outputs[j])
    n_forces = model.elements.n_forces[i]
    for s in range(model.elements.n_states[i]):
        output = work.users.outputs[n_forces + s]
        state_rows(work, model.elements.state0[i] + s, k + n_forces + 3 * s, output, c_k)


@inner
def state_rows(work, s, k, output, c_k):
    """Write the residual of state s in the rows from k; `output` is the rate that the law gives."""
    w, g, states = work.state.w, work.connections.g, work.states
    g[k] = c_k * (w[k] - states.base[s] - states.kappa[s] * w[k + 1])
    g[k + 1] = c_k * (w[k + 1] - output)
    g[k + 2] = c_k * (w[k + 2] - states.rate_base[s] - states.rho * w[k + 1])


@inner
def put_state_derivatives(work, V, s, r):
    """Write the derivatives of the rows of state s, from row r, into V, without the derivatives of its law."""
    V[r, r], V[r, r + 1] = 1.0, -work.states.kappa[s]
    V[r + 1, r + 1] = 1.0
    V[r + 2, r + 2], V[r + 2, r + 1] = 1.0, -work.states.rho


@inner
def user_force_derivatives(model, work, c, c_k):
    """Write the derivatives of user force c: P by the motion of its markers, V by its own wrench."""
    i, first, last = indices_of(model, c)
    V = work.connections.V[c]
    derivatives_along_coordinates(model, work, c, c_k)
    user_gradients(model, work, c)
    n, _, n_out = counts_of(model, c)
    gradients = gradients_of(model, work, c)
    n_forces, n_states = model.elements.n_forces[i], model.elements.n_states[i]
    core = model.elements.core[i] - model.connections.w0[c]
    for s in range(n_states):
        put_state_derivatives(work, V, model.elements.state0[i] + s, core + n_forces + 3 * s)
    for j in range(n_out):
        r = core + j if j < n_forces else core + n_forces + 3 * (j - n_forces) + 1
        V[r, r] = 1.0
        by_x, by_v, by_z = input_parts(gradients[j], n)
        for p in range(first, last):
            coordinate_gradient(model, work, p, r, -c_k * by_x[p - first], -c_k * by_v[p - first])
        for s in range(n_states):
            V[r, core + n_forces + 3 * s] -= by_z[s]


@inner
def user_force_power(model, work, c):
    """Return the power that user force c supplies to the bodies."""
    _, first, last = indices_of(model, c)
    total = 0.0
    for p in range(first, last):
        if model.coordinates.force[p] >= 0:
            _, v = coordinate_motion(model, work, p)
            total += work.state.w[model.coordinates.core[p]] * v
    return total


@inner
def begin_states(rows, states, memory, h, alpha_f):
    """Write the constants b, b', kappa, rho of the integration of states, with rho_inf = alpha_f/(1 - alpha_f).

    The row of a state in w contains its value; the next rows contain its rate and its algorithmic rate.

    z_new = z + h ((1 - th) a + th a_new),  (1 - d_m) a_new + d_m a = (1 - d_f) g_new + d_f g,  th = 1/2 + d_f - d_m,
    d_m = (3 rho_inf - 1)/(2 (rho_inf + 1)),  d_f = rho_inf/(rho_inf + 1):  second order, stable for all h.
    """
    rho_inf = alpha_f / (1.0 - alpha_f)
    d_m, d_f = (3.0 * rho_inf - 1.0) / (2.0 * (rho_inf + 1.0)), alpha_f
    th = 0.5 + d_f - d_m
    states.rho = (1.0 - d_f) / (1.0 - d_m)
    for s in range(rows.shape[0]):
        k = rows[s]
        z, g, a = memory.w[k], memory.w[k + 1], memory.w[k + 2]
        base = (d_f * g - d_m * a) / (1.0 - d_m)
        states.kappa[s] = h * th * states.rho
        states.base[s] = z + h * ((1.0 - th) * a + th * base)
        states.rate_base[s] = base


@inner
def resize_states(rows, memory, ratio):
    """Convert the algorithmic rates to a step size multiplied by `ratio`."""
    for s in range(rows.shape[0]):
        k = rows[s]
        memory.w[k + 2] = memory.w[k + 1] + ratio * (memory.w[k + 2] - memory.w[k + 1])
