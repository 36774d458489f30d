"""Public elements: wrenches, rates of states and constraints, from functions that are called by address.

The law of an element with n markers, states z and multipliers lam gives, from the motion x of the markers,

    wrench (n, 6), z_dot = g(t, x, z, lam), h(t, x, z, lam) for each multiplier, and outputs for results alone.

The unknowns of its rows are, in this order: the parts of the wrenches that act, for each state its value, rate and
algorithmic rate (`user_force`), and the multipliers. The rows are

    w - wrench = 0;   z - b - kappa g' = 0,   g' - g = 0,   a - b' - rho g' = 0;   h = 0

A multiplier constrains a position (h depends on positions and time alone), a velocity, or nothing: then h = 0 is an
equation like those of wrenches. Two ends with opposite forces share one unknown, with the factor -1 at the second end.

One call gives all derivatives, d(wrench, g, h)/d(dr, dphi, dv, domega [, da, dalpha] of each marker, z, lam), row by
row. A law that depends on accelerations gets 24 numbers for each marker instead of 18.

Described in `floatframe.model.elements.element`.
"""

import math
from typing import NamedTuple

from fe_models.foundation.arrays import Array
from floatframe.engine.kernels.compiler.compilation import inner, view
from floatframe.engine.kernels.compiler.user_call import call_law
from floatframe.engine.kernels.connections.user_force import note_no_number, put_state_derivatives, state_rows
from floatframe.engine.kernels.dense import matrix_at
from floatframe.engine.kernels.marker_acceleration import marker_acceleration
from floatframe.engine.kernels.rotation import exp_matrix
from floatframe.engine.kernels.vector import (
    add,
    copy,
    dot,
    matrix,
    norm,
    product,
    put,
    put_matrix,
    put_sum,
    scaled,
    vector,
)
from floatframe.model.joints.rows.kinds import NOTHING, POSITION, VELOCITY

__all__ = [
    "FIRST", "law_derivatives", "law_power", "law_rates", "law_results", "law_rows", "law_values", "motion_inputs",
    "note_stops", "unknown_inputs",
]  # fmt: skip

#: time steps of difference quotients if the time scale of a law is unknown: number of trials, the first step
#: relative to `REACH`, and the ratio of successive steps
MOST_LEVELS, SHORTEST, LONGER = 22, 2.0**-20, 4.0
ROUNDING = 1e-15  #: relative step of positions in differences
REACH = 5e-3  #: displacement for the differences of rates, relative to the length over which the law changes
#: coefficients of sixth-order first differences at the points -3 to 3
FIRST = (-1 / 60, 9 / 60, -45 / 60, 0.0, 45 / 60, -9 / 60, 1 / 60)
FOURTH_FIRST = (0.0, 1 / 12, -8 / 12, 0.0, 8 / 12, -1 / 12, 0.0)  #: coefficients of fourth-order first differences
FOURTH_SECOND = (0.0, -1 / 12, 16 / 12, -30 / 12, 16 / 12, -1 / 12, 0.0)
SECOND = (2 / 180, -27 / 180, 270 / 180, -490 / 180, 270 / 180, -27 / 180, 2 / 180)


class MotionInputs(NamedTuple):
    """The motion of one marker in the inputs of a law."""

    r: Array  #: position, (3,)
    A: Array  #: axes, (3, 3)
    v: Array  #: velocity, (3,)
    omega: Array  #: angular velocity, (3,)
    accelerations: Array  #: acceleration and angular acceleration, (6,) if the law depends on them, else (0,)


class UnknownInputs(NamedTuple):
    """The unknowns of a law in its inputs."""

    states: Array  #: (n_z,)
    multipliers: Array  #: (n_lam,)


class LawResults(NamedTuple):
    """The results of a law."""

    wrench: Array  #: on each marker, (n, 6)
    rates: Array  #: of the states, (n_z,)
    equations: Array  #: of the multipliers, (n_lam,)
    outputs: Array  #: for results alone, (n_seen,)


@view
def motion_inputs(head, inputs, m):
    """Return the motion of marker m of a law in its inputs."""
    own = matrix_at(inputs, 1, head[0], head[1])[m]
    return MotionInputs(own[:3], own[3:12].reshape((3, 3)), own[12:15], own[15:18], own[18:])


@view
def unknown_inputs(head, inputs):
    """Return the unknowns of a law in its inputs."""
    own = inputs[1 + head[0] * head[1] :]
    return UnknownInputs(own[: head[2]], own[head[2] : head[2] + head[3]])


@view
def law_results(head, results):
    """Return the parts of the results of a law."""
    own = results[6 * head[0] :]
    end = head[2] + head[3]
    return LawResults(matrix_at(results, 0, head[0], 6), own[: head[2]], own[head[2] : end], own[end : end + head[4]])


@inner
def law_inputs(model, work, c):
    """Write t, the motion of the markers, states and multipliers into work.laws.inputs."""
    i, first, markers = model.connections.item[c], model.connections.a[c], work.markers
    head = model.laws.head[i]
    work.laws.inputs[0] = work.state.time
    for k in range(head[0]):
        m, x = first + k, motion_inputs(head, work.laws.inputs, k)
        put(x.r, 0, vector(markers.r[m]))
        put_matrix(x.A, markers.A[m])
        put(x.v, 0, vector(markers.v[m]))
        put(x.omega, 0, vector(markers.omega[m]))
        a = model.markers.accelerated[m]
        if a >= 0:
            marker_acceleration(model, work, m, markers.acceleration[a])
            copy(markers.acceleration[a], x.accelerations)
    own = work.state.w[model.connections.w0[c] : model.connections.w0[c + 1]]
    w = by_unknowns(own, model.laws.row0[i + 1] - model.laws.row0[i], head[2])
    unknowns = unknown_inputs(head, work.laws.inputs)
    for s in range(head[2]):
        unknowns.states[s] = w.states[s, 0]
    for j in range(head[3]):
        unknowns.multipliers[j] = w.multipliers[j]


@inner
def law_call(model, work, i, outputs):
    """Evaluate law i for the inputs in `work` and write its results to `outputs`."""
    data = model.laws.data[model.laws.data0[i] : model.laws.data0[i + 1]]
    call_law(model.laws.address[i], model.laws.head[i], work.laws.inputs, data, outputs)


@inner
def n_results(head):
    """Return the number of wrench components, rates of states and constraints; the outputs follow them."""
    return 6 * head[0] + head[2] + head[3]


@inner
def note_stops(model, work, i):
    """Record the first output of law i that ends the run."""
    own = law_results(model.laws.head[i], work.laws.outputs)
    for k in range(model.laws.stop0[i], model.laws.stop0[i + 1]):
        if own.outputs[model.laws.stop[k]] > 0.0 and work.counted.stopped == 0:
            work.counted.stopped = k + 1


@inner
def law_values(model, work, c):
    """Write the results of element c at the iterate into work.laws.outputs."""
    law_inputs(model, work, c)
    law_call(model, work, model.connections.item[c], work.laws.outputs)


@inner
def law_rows(model, work, c, c_k):
    """Write the residual of element c, and its wrenches."""
    i, k = model.connections.item[c], model.connections.w0[c]
    laws, w, g = model.laws, work.state.w, work.connections.g
    for m in range(model.connections.a[c], model.connections.a[c] + laws.head[i, 0]):
        for part in range(0, 6, 3):
            place = model.markers.force[m] if part == 0 else model.markers.moment[m]
            if place >= 0:
                put_sum(work.markers.wrench[m], part, scaled(model.markers.sign[m], vector(w[k + place :])))
    law_values(model, work, c)
    total = 0.0
    for j in range(laws.row0[i], laws.row0[i + 1]):
        g[k] = c_k * (w[k] - laws.factor[j] * work.laws.outputs[laws.source[j]])
        total += g[k]
        k += 1
    found = law_results(laws.head[i], work.laws.outputs)
    for s in range(found.rates.shape[0]):
        state_rows(work, laws.state0[i] + s, k, found.rates[s], c_k)
        total += g[k + 1]
        k += 3
    for j in range(found.equations.shape[0]):
        g[k] = found.equations[j] * (c_k if model.rows.holds[k] == NOTHING else 1.0)
        total += g[k]
        k += 1
    if not math.isfinite(total):
        note_what_is_no_number(model, work, c)


@inner
def note_what_is_no_number(model, work, c):
    """Record element c if its law is not finite although the motion is finite."""
    head, laws = model.laws.head[model.connections.item[c]], work.laws
    n_in = 1 + head[0] * head[1] + head[2] + head[3]
    note_no_number(work, c, laws.outputs, n_results(head), laws.inputs, n_in)


@inner
def law_derivatives(model, work, c, c_k):
    """Write the derivatives of element c: P by the motion of its markers, V by its own wrench.

    For c_k = 0 rows serve to find velocities or accelerations; P of a velocity constraint then has its derivatives by
    velocities in the columns of positions.
    """
    i, a, w0 = model.connections.item[c], model.connections.a[c], model.connections.w0[c]
    size = model.connections.size[c]
    laws, V, slopes = model.laws, work.connections.V[c], work.laws.slopes
    n, n_z, n_lam = laws.head[i, 0], laws.head[i, 2], laws.head[i, 3]
    for r in range(size):
        for j in range(size):
            V[r, j] = 0.0
    law_inputs(model, work, c)
    data = laws.data[laws.data0[i] : laws.data0[i + 1]]
    call_law(laws.tangent[i], laws.head[i], work.laws.inputs, data, slopes)
    for m in range(a, a + n):
        if model.markers.accelerated[m] >= 0:
            for r in range(size):
                for j in range(6):
                    work.connections.P_a[model.markers.accelerated[m], r, j] = 0.0
    r, states = 0, laws.row0[i + 1] - laws.row0[i]
    for j in range(laws.row0[i], laws.row0[i + 1]):
        V[r, r] = 1.0
        own = output_slopes(laws.head[i], slopes, laws.source[j])
        add_slopes(model, work, a, r, by_unknowns(V[r], states, n_z), -c_k * laws.factor[j], -laws.factor[j], own)
        r += 1
    o = 6 * n
    for s in range(laws.state0[i], laws.state0[i] + n_z):
        put_state_derivatives(work, V, s, r)
        own = output_slopes(laws.head[i], slopes, o)
        add_slopes(model, work, a, r + 1, by_unknowns(V[r + 1], states, n_z), -c_k, -1.0, own)
        for m in range(a, a + n):
            for j in range(12):
                work.connections.P[m, r, j], work.connections.P[m, r + 2, j] = 0.0, 0.0
        o, r = o + 1, r + 3
    for _ in range(n_lam):
        own, unknowns = output_slopes(laws.head[i], slopes, o), by_unknowns(V[r], states, n_z)
        holds = model.rows.holds[w0 + r]
        if holds == NOTHING:
            add_slopes(model, work, a, r, unknowns, c_k, 1.0, own)
        else:
            held_slopes(work, a, r, unknowns, holds, c_k, own)
        o, r = o + 1, r + 1


class Slopes(NamedTuple):
    """Derivatives of one output of a law."""

    motion: Array  #: by the motion of each marker, (n, 12), or (n, 18) with accelerations
    states: Array  #: (n_z,)
    multipliers: Array  #: (n_lam,)


class ByUnknowns(NamedTuple):
    """The part of a row of V for the unknowns of a law."""

    states: Array  #: by value, rate and algorithmic rate of each state, (n_z, 3)
    multipliers: Array  #: (n_lam,)


@view
def output_slopes(head, slopes, o):
    """Return the derivatives of output o from those of all outputs of a law."""
    n, columns, n_z, n_lam = head[0], head[1] - 6, head[2], head[3]
    end = columns * n
    own = matrix_at(slopes, 0, n_results(head), end + n_z + n_lam)[o]
    return Slopes(own[:end].reshape((n, columns)), own[end : end + n_z], own[end + n_z :])


@view
def by_unknowns(V, first, n_z):
    """Return the derivatives of a row, (size,), by n_z states and by the multipliers; first: column of the states."""
    end = first + 3 * n_z
    return ByUnknowns(V[first:end].reshape((n_z, 3)), V[end:])


@inner
def add_slopes(model, work, a, r, V, by_motion, by_unknown, own):
    """Add the scaled derivatives of one output to row r of P, P_a and V; a: first marker."""
    for m in range(own.motion.shape[0]):
        for j in range(12):
            work.connections.P[a + m, r, j] = by_motion * own.motion[m, j]
        accelerated = model.markers.accelerated[a + m]
        if accelerated >= 0:
            for j in range(6):
                work.connections.P_a[accelerated, r, j] = by_unknown * own.motion[m, 12 + j]
    for s in range(own.states.shape[0]):
        V.states[s, 0] += by_unknown * own.states[s]
    for j in range(own.multipliers.shape[0]):
        V.multipliers[j] += by_unknown * own.multipliers[j]


@inner
def held_slopes(work, a, r, V, holds, c_k, own):
    """Write the derivatives of the constrained quantities into row r of P and V; a: first marker."""
    for m in range(own.motion.shape[0]):
        for j in range(12):
            if holds == POSITION:
                slope = own.motion[m, j] if j < 6 else 0.0
            elif c_k > 0.0:
                slope = own.motion[m, j]
            else:
                slope = own.motion[m, 6 + j] if j < 6 else 0.0
            work.connections.P[a + m, r, j] = slope
    if c_k > 0.0:
        for s in range(own.states.shape[0]):
            V.states[s, 0] = own.states[s] / c_k
        for j in range(own.multipliers.shape[0]):
            V.multipliers[j] = own.multipliers[j] / c_k


@inner
def law_rates(model, work, c, rate, bias):
    """Write the rates of the constraints of element c and their second rates at zero u_dot, for multiplier rows.

    They are differences of sixth order of the values along the motion with the accelerations of `work.markers.bias`,
    with steps in which neither the motion nor the time changes the law much. If the time over which the law changes is
    unknown, the step grows from a short one until the sum of roundoff and discretisation errors is smallest.
    """
    i, a, w0 = model.connections.item[c], model.connections.a[c], model.connections.w0[c]
    size = model.connections.size[c]
    laws = model.laws
    n, n_lam = laws.head[i, 0], laws.head[i, 3]
    is_held = False
    for k in range(w0 + size - n_lam, w0 + size):
        rate[k], bias[k] = 0.0, 0.0
        is_held = is_held or model.rows.holds[k] != NOTHING
    if not is_held:
        return
    fastest = 0.0
    for m in range(a, a + n):
        b = work.markers.bias[m]
        fastest = max(fastest, norm(vector(work.markers.v[m])) / laws.length[i], norm(vector(work.markers.omega[m])))
        fastest = max(fastest, (norm(vector(b)) / laws.length[i]) ** 0.5, norm(vector(b[3:])) ** 0.5)
    if laws.time[i] > 0.0:
        fastest = max(fastest, 1.0 / laws.time[i])
        rates_by_steps(model, work, c, REACH / (fastest if fastest > 0.0 else 1.0), rate, bias)
        return
    far = laws.length[i]
    for m in range(a, a + n):
        far = max(far, norm(vector(work.markers.r[m])))
    h = SHORTEST * REACH / max(fastest, 1.0)
    best, h_best = math.inf, h
    for _ in range(MOST_LEVELS):
        if h * fastest > REACH:
            break
        error = rates_by_steps(model, work, c, h, rate, bias) + ROUNDING * far / (h * h)
        if error > best:
            break
        best, h_best = error, h
        h *= LONGER
    rates_by_steps(model, work, c, h_best, rate, bias)


@inner
def rates_by_steps(model, work, c, h, rate, bias):
    """Write the differences of `law_rates` with step h; return their deviation from fourth-order differences [g/s²]."""
    i, a, w0 = model.connections.item[c], model.connections.a[c], model.connections.w0[c]
    size = model.connections.size[c]
    head = model.laws.head[i]
    n_z, n_lam = head[2], head[3]
    fourth = matrix_at(work.laws.slopes, 0, n_lam, 2)  # space that is free here; the derivatives overwrite it
    for j in range(n_lam):
        rate[w0 + size - n_lam + j], bias[w0 + size - n_lam + j] = 0.0, 0.0
        fourth[j, 0], fourth[j, 1] = 0.0, 0.0
    law_values(model, work, c)
    here, trial = law_results(head, work.laws.outputs), law_results(head, work.laws.trial)
    unknowns = unknown_inputs(head, work.laws.inputs)
    for p in range(7):
        e = (p - 3) * h
        law_inputs(model, work, c)
        work.laws.inputs[0] += e
        for k in range(head[0]):
            m, x = a + k, motion_inputs(head, work.laws.inputs, k)
            b = work.markers.bias[m]
            v, omega = vector(work.markers.v[m]), vector(work.markers.omega[m])
            put_sum(x.r, 0, add(scaled(e, v), scaled(0.5 * e * e, vector(b))))
            turn = exp_matrix(add(scaled(e, omega), scaled(0.5 * e * e, vector(b[3:]))))
            put_matrix(x.A, product(turn, matrix(work.markers.A[m])))
            put_sum(x.v, 0, scaled(e, vector(b)))
            put_sum(x.omega, 0, scaled(e, vector(b[3:])))
        for s in range(n_z):
            unknowns.states[s] += e * here.rates[s]
        law_call(model, work, i, work.laws.trial)
        for j in range(n_lam):
            k, value = w0 + size - n_lam + j, trial.equations[j]
            fourth[j, 0] += FOURTH_FIRST[p] * value / h
            if model.rows.holds[k] == POSITION:
                rate[k] += FIRST[p] * value / h
                bias[k] += SECOND[p] * value / (h * h)
                fourth[j, 1] += FOURTH_SECOND[p] * value / (h * h)
            elif model.rows.holds[k] == VELOCITY:
                bias[k] += FIRST[p] * value / h
                if p == 3:
                    rate[k] = value
    error = 0.0
    for j in range(n_lam):
        k = w0 + size - n_lam + j
        if model.rows.holds[k] == POSITION:
            error = max(error, abs(fourth[j, 0] - rate[k]) / h, abs(fourth[j, 1] - bias[k]))
        elif model.rows.holds[k] == VELOCITY:
            error = max(error, abs(fourth[j, 0] - bias[k]))
    return error


@inner
def power_on_bodies(model, work, c):
    """Return the power of the wrenches of element c on the bodies."""
    first, last = model.connections.a[c], model.connections.a[c] + model.laws.head[model.connections.item[c], 0]
    w = work.state.w[model.connections.w0[c] :]
    total = 0.0
    for m in range(first, last):
        force, moment, sign = model.markers.force[m], model.markers.moment[m], model.markers.sign[m]
        if force >= 0:
            total += sign * dot(w[force:], work.markers.v[m])
        if moment >= 0:
            total += sign * dot(w[moment:], work.markers.omega[m])
    return total


@inner
def law_power(model, work, c):
    """Return energy, supplied power and dissipated power of element c at the iterate.

    Also record an output that ends the run.

    The power on the bodies is P_b = given - lost - d(energy)/dt. An element that declares no energy stores none;
    supplied or dissipated power that it does not declare then follows from P_b.
    """
    i, laws = model.connections.item[c], model.laws
    energy, given, lost = laws.energy[i], laws.given[i], laws.lost[i]
    if energy < 0 and given < 0 and lost < 0 and laws.stop0[i] == laws.stop0[i + 1]:
        return 0.0, power_on_bodies(model, work, c), 0.0
    law_values(model, work, c)
    note_stops(model, work, i)
    seen = law_results(laws.head[i], work.laws.outputs).outputs
    P_given = seen[given] if given >= 0 else 0.0
    P_lost = seen[lost] if lost >= 0 else 0.0
    if energy >= 0:
        return seen[energy], P_given, P_lost
    on_bodies = power_on_bodies(model, work, c)
    if given < 0:
        return 0.0, on_bodies + P_lost, P_lost
    if lost < 0:
        return 0.0, P_given, P_given - on_bodies
    return 0.0, P_given, P_lost
