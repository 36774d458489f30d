"""Forces over a step: loads whose work is the change of their potential, and the work that they supply and dissipate.

Formulas: `floatframe.engine.structure_preserving.kernels.loads`.
"""

import ctypes
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.callbacks.user_forces import C_FUNCTION
from floatframe.engine.kernels.model import Model
from floatframe.engine.structure_preserving.system import coordinates_of, state_rows
from floatframe.model.functions import expressions as ex
from floatframe.model.joints.rows import kind_of
from floatframe.model.rotations import continued_rotation, cross, dot, rotated, rotation_exp, tilde
from tests.floatframe.engine.structure_preserving.in_python.bodies import Body, BodyStep
from tests.floatframe.engine.structure_preserving.in_python.constraints import Loads, Pair, Span, arctan2
from tests.floatframe.engine.structure_preserving.in_python.coordinates import (
    add_coordinate_force,
    add_impulsive_force,
    add_pair,
    coordinate_change,
    coordinate_ends,
    coordinate_rate,
    counted,
)
from tests.floatframe.engine.structure_preserving.in_python.functions import along_imaginary, value_of
from tests.floatframe.engine.structure_preserving.in_python.markers import Load, MarkerStep, mean_jacobian
from tests.floatframe.engine.structure_preserving.in_python.rotation import relative_cayley

# user forces over a step: Q = f(t, x, v, z) along coordinates, z_1 - z_0 = h g(t, x, v, z) ----------------------------


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
STEP = 1e-5  #: relative step of differences for derivatives, by the sizes of the inputs


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


def values_at(model: Model, i: int, inputs: Array) -> Array:
    """Return forces and rates of states of user force i at inputs, (n_in,)."""
    n_out = int(model.elements.n_forces[i] + model.elements.n_states[i])
    if model.elements.address[i] == 0:
        return np.array([tape_at(model, int(model.elements.tape0[i]) + j, inputs) for j in range(n_out)])
    x, y = np.ascontiguousarray(inputs, float), np.zeros(n_out)
    number = ctypes.POINTER(ctypes.c_double)
    C_FUNCTION(int(model.elements.address[i]))(x.ctypes.data_as(number), y.ctypes.data_as(number))
    return y


def user_values(model: Model, i: int, inputs: Array) -> Array:
    """Return forces and rates of states, (..., n_out), with their derivatives along imaginary parts."""
    flat, sizes = inputs.reshape(-1, inputs.shape[-1]), sizes_of_inputs(model, i)
    out = []
    for x in flat:
        value = values_at(model, i, np.real(x))
        size = np.abs(np.imag(x) / sizes).max(initial=0.0)
        if size > 0:
            way = STEP * np.imag(x) / size
            change = values_at(model, i, np.real(x) + way) - values_at(model, i, np.real(x) - way)
            value = value + 1j * change * (0.5 * size / STEP)
        out.append(value)
    return np.array(out).reshape(*inputs.shape[:-1], -1)


def sizes_of_inputs(model: Model, i: int) -> Array:
    """Return sizes of t, x, v, z of user force i, (n_in,), for differences; derivatives by t are not used."""
    x = slice(int(model.elements.coordinate0[i]), int(model.elements.coordinate0[i + 1]))
    z = model.states.size[model.elements.state0[i] : model.elements.state0[i + 1]]
    return np.concatenate([[1.0], model.coordinates.size[x], model.coordinates.speed[x], z])


def inputs_of(
    model: Model, c: int, pairs: list[Pair], t: float, span: Span, z: Array, *, is_middle: bool
) -> tuple[Array, list[Array]]:
    """Return t, x, v, z, (..., n_in), and the changes of the coordinates.

    With x at the end of the force interval, or its mean.
    """
    x, v, changes = [], [], []
    for p, pair in zip(coordinates_of(model, int(model.connections.item[c])), pairs, strict=True):
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
    """Add the loads of user force c, and return their work. dz: changes of the states, (..., n_states)."""
    z = span.w[list(state_rows(model, c))] + (0.5 * dz if is_middle else 0.0 * dz)
    inputs, changes = inputs_of(model, c, pairs, span.t_force, span, z, is_middle=is_middle)
    i = int(model.connections.item[c])
    values = user_values(model, i, inputs)
    given = np.zeros(values.shape[:-1], values.dtype)
    for p, pair, load, change in zip(coordinates_of(model, i), pairs, loads, changes, strict=True):
        if model.coordinates.force[p] >= 0:
            Q = values[..., int(model.coordinates.core[p] - model.elements.core[i])]
            add_impulsive_force(model, int(model.coordinates.row[p]), pair, load, Q)
            given = given + Q * change
    return given


def user_state_rates(model: Model, c: int, pairs: list[Pair], span: Span, dz: Array, *, is_along: bool) -> Array:
    """Return the rates of the states of user force c in the middle of the step, (..., n_states)."""
    i = int(model.connections.item[c])
    z = span.w[list(state_rows(model, c))] + 0.5 * dz
    inputs, _ = inputs_of(model, c, pairs, 0.5 * (span.t_0 + span.t_1), span, z, is_middle=True)
    if not is_along:
        for p, pair in enumerate(pairs):
            k = int(model.coordinates.row[model.elements.coordinate0[i] + p])
            inputs[..., 1 + len(pairs) + p] = coordinate_change(model, k, pair) / span.h
    return user_values(model, i, inputs)[..., int(model.elements.n_forces[i]) :]


# bushings -------------------------------------------------------------------------------------------------------------


def transposed(A: Array) -> Array:
    """Return Aᵀ of stacks of matrices."""
    return np.swapaxes(A, -1, -2)


def solved(A: Array, x: Array) -> Array:
    """Return A⁻¹ x for stacks of matrices and vectors."""
    return np.asarray(np.linalg.solve(A, x[..., None])[..., 0], dtype=x.dtype)


def axial(A: Array) -> Array:
    """Return x with tilde(x) = (A - Aᵀ)/2, (..., 3)."""
    B = 0.5 * (A - transposed(A))
    return np.stack([B[..., 2, 1], B[..., 0, 2], B[..., 1, 0]], axis=-1)


def rotation_vector(R: Array) -> Array:
    """Return the rotation vector of R, shorter than pi, (..., 3); also for complex numbers."""
    x = axial(R)
    sine2 = dot(x, x)
    cosine = 0.5 * (R[..., 0, 0] + R[..., 1, 1] + R[..., 2, 2] - 1)
    is_small = np.abs(sine2) < 1e-8
    sine = np.sqrt(np.where(is_small, 1.0, sine2))
    factor = np.where(is_small, 1 + sine2 / 6 + 3 * sine2**2 / 40, arctan2(sine, cosine) / sine)
    return factor[..., None] * x


def axes(marker: MarkerStep) -> tuple[Array, Array]:
    """Return the axes of a marker at both ends, ground axes, (..., 3, 3)."""
    ends = [marker.ends(e) for e in np.eye(3)]
    return np.stack([e[0] for e in ends], axis=-1), np.stack([e[1] for e in ends], axis=-1)


def axes_change(marker: MarkerStep, mean: Array) -> Array:
    """Return the change of the axes of a marker, (..., 3, 3); mean: their mean."""
    return np.stack([marker.change(e, mean[..., i]) for i, e in enumerate(np.eye(3))], axis=-1)


def bushing_load(model: Model, c: int, pair: Pair, loads: Loads, span: Span) -> tuple[Array, Array]:
    """Add the loads of bushing c, and return the work supplied by its tables and dissipated by its damping."""
    (a, b), i = pair, int(model.connections.item[c])
    (A_0, A_1), (B_0, B_1) = axes(a), axes(b)
    A, B, d = 0.5 * (A_0 + A_1), 0.5 * (B_0 + B_1), b.x_mean - a.x_mean
    s_0, s_1 = rotated(transposed(A_0), b.x_0 - a.x_0), rotated(transposed(A_1), b.x_1 - a.x_1)
    R_0 = transposed(A_0) @ B_0
    share = float(model.bushings.share[i])
    th_0, th_1 = rotation_vector(R_0), rotation_vector(transposed(A_1) @ B_1)
    if model.bushings.angle[i] >= 0:
        expected = span.rotation(int(model.bushings.angle[i]))
        th_0, th_1 = continued_rotation(th_0, expected), continued_rotation(th_1, expected)
    Gamma, part = mean_jacobian(th_0, th_1), mean_jacobian(-share * th_0, -share * th_1)
    P = R_0 + 0.5 * tilde(relative_cayley(th_0, th_1)) @ R_0
    Q_0, Q_1 = rotation_exp(-share * th_0), rotation_exp(-share * th_1)
    Q, arm = 0.5 * (Q_0 + Q_1), rotated(0.5 * (Q_0 + Q_1), 0.5 * (s_0 + s_1))
    # change of the deformations due to the motion over the step
    dA, dB = axes_change(a, A), axes_change(b, B)
    psi = axial((transposed(dA) @ B + transposed(A) @ dB) @ transposed(P))
    dtheta = solved(Gamma, psi)
    ds = rotated(transposed(dA), d) + rotated(transposed(A), b.dx - a.dx)
    de = rotated(Q, ds) + cross(-share * rotated(part, dtheta), arm)
    change = np.concatenate(np.broadcast_arrays(de, dtheta), axis=-1)
    e_mean = 0.5 * (rotated(Q_0, s_0) + rotated(Q_1, s_1))
    mean = np.concatenate(np.broadcast_arrays(e_mean, 0.5 * (th_0 + th_1)), axis=-1)
    law = model.bushings
    damping = rotated(law.damping[i], change / span.h)
    force = rotated(law.stiffness[i], mean) + law.preload[i] + damping
    given = np.zeros(np.shape(change)[:-1], change.dtype)
    for r in range(6):
        if law.table[i, r] >= 0:
            value = along_imaginary(model, int(law.table[i, r]), mean[..., r])
            force = force + value[..., None] * np.eye(6)[r]
            given = given - value * change[..., r]
    f, m = force[..., :3], force[..., 3:]
    m = m - share * rotated(transposed(part), cross(arm, f))
    tau = solved(transposed(Gamma), m)
    G, g = -0.5 * tilde(tau) @ P, -rotated(transposed(Q), f)
    on_A, on_B = B @ transposed(G) + d[..., :, None] * g[..., None, :], A @ G
    for k, e in enumerate(np.eye(3)):
        a.add_direction(loads[0], e, on_A[..., k])
        b.add_direction(loads[1], e, on_B[..., k])
    F = rotated(A, g)
    a.add_force(loads[0], -F)
    b.add_force(loads[1], F)
    return given, dot(damping, change)


# forces ---------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Given:
    """Work of a force over a step."""

    given: Array | float = 0.0  #: that enters the system
    taken: Array | float = 0.0  #: work dissipated by a damper or friction


def spring_load(model: Model, c: int, pair: Pair, loads: Loads, span: Span) -> Given:
    """Add the loads of spring-damper c."""
    a, b = pair
    s = int(model.connections.item[c])
    springs = model.springs
    k, damping, free, preload = springs.stiffness[s], springs.damping[s], springs.free_length[s], springs.preload[s]
    d_0, d_1, dd = b.x_0 - a.x_0, b.x_1 - a.x_1, b.dx - a.dx
    d = 0.5 * (d_0 + d_1)
    if k != 0 and free == 0 and damping == 0 and preload == 0 and model.springs.table[s] < 0:
        add_pair(pair, loads, -k * d)  # through length zero
        return Given()
    both = np.sqrt(dot(d_0, d_0)) + np.sqrt(dot(d_1, d_1))
    change = 2 * dot(d, dd) / both
    tension = k * (0.5 * both - free) + preload + damping * change / span.h
    given = np.zeros(np.shape(change), change.dtype)
    if model.springs.table[s] >= 0:
        by_table = along_imaginary(model, int(model.springs.table[s]), 0.5 * both - free)
        tension = tension + by_table
        given = -by_table * change
    add_pair(pair, loads, -(2 * tension / both)[..., None] * d)
    return Given(given, damping * change**2 / span.h)


def point_load(model: Model, k: int, marker: MarkerStep, load: Load | None, span: Span) -> Given:
    """Add load k, fixed in space or in its marker."""
    factor = value_of(model, int(model.loads.factor[k]), span.t_force)[0] if model.loads.factor[k] >= 0 else 1.0
    work: Array | float = 0.0
    for part, is_force in ((model.loads.force[k], True), (model.loads.torque[k], False)):
        if not np.any(part):
            continue
        if model.markers.is_follower[model.loads.marker[k]]:
            V_0, V_1 = marker.ends(part)
            V = factor * 0.5 * (V_0 + V_1)
        else:
            V = factor * part
        if is_force:
            marker.add_force(load, V)
            work = work + dot(V, marker.dx)
        else:
            marker.add_moment(load, V)
            work = work + dot(V, marker.turning())
    return Given(work)


def body_load(model: Model, k: int, body: Body, step: BodyStep, load: Load, span: Span) -> Given:
    """Add load case k of a body: force and torque about its frame origin in its axes, and modal forces."""
    factor = value_of(model, int(model.body_loads.factor[k]), span.t_force)[0]
    first = int(model.body_loads.value0[k])
    f, tau, modal = np.split(factor * model.body_loads.values[first : first + 6 + body.n], [3, 6])
    q = 0.5 * (step.q_0 + step.q_1)
    s = body.center(q)
    R = 0.5 * (step.R_0 + step.R_1)
    F, T = rotated(R, f), rotated(R, tau - cross(s, np.broadcast_to(f, s.shape)))
    h = modal - rotated(np.swapaxes(body.shapes(q), -1, -2), f)
    load.force += F
    load.torque += T
    load.modal += h
    return Given(dot(F, step.d) + dot(T, step.theta_G) + dot(h, step.dq))


def coordinate_load(model: Model, k: int, pair: Pair, loads: Loads, span: Span, normal: Array) -> Given:
    """Add the forces along the coordinate of row k (PUSH, TWIST, TWIST_B); normal: force in the joint normal to it."""
    is_angle = kind_of(model.rows.kind[k]).is_angle
    begin, end = coordinate_ends(model, k, pair)
    rate = coordinate_rate(model, k, pair, span.h)
    Q, spring, given, taken = 0.0 * rate, 0.0 * rate, 0.0 * rate, 0.0 * rate
    for i in range(int(model.rows.force0[k]), int(model.rows.force1[k])):
        f = model.joint_forces
        mean = 0.5 * (begin + end) - f.free[i]
        if is_angle:
            mean = mean - 2 * np.pi * np.floor(np.real(mean) / (2 * np.pi) + 0.5)
        entering = f.preload[i] + 0.0 * rate
        if model.joint_forces.motor[i] >= 0:
            entering = entering + value_of(model, int(model.joint_forces.motor[i]), span.t_force)[0]
        if model.joint_forces.table[i] >= 0:
            entering = entering + along_imaginary(model, int(model.joint_forces.table[i]), mean)
        resisting = f.damping[i] * rate
        if f.friction[i] > 0 or f.coefficient[i] > 0:
            resisting = resisting + (f.friction[i] + f.coefficient[i] * normal) * np.tanh(rate / f.speed[i])
        Q = Q + entering - resisting
        spring = spring - f.stiffness[i] * mean
        given = given + entering * rate * span.h
        taken = taken + resisting * rate * span.h
    add_impulsive_force(model, k, pair, loads, Q)
    add_coordinate_force(model, k, pair, loads, spring)
    return Given(given, taken)
