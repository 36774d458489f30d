"""Public elements over a step: their law at mid-step, corrected so that the work equals the change of potential.

Marker m moves from r_0, A_0 to r_1, A_1 = cay(c) A_0. The law is evaluated once, at the middle of the positions and
rotations, with the mean rates of the step, and its wrench acts over the step,

    r = (r_0 + r_1)/2,   A = cay(c') A_0,  c' = c/(1 + sqrt(1 + |c|²/4)),   v = dr/h,   omega = c/h
    work = Σ F·dr + M·c

A moment M acts by loads G_j = M' × E_j/2 on the mean axes E_j, where (tr S - S) M'/2 = M with S = Σ E_j E_jᵀ. So the
torque on the body is M, and its work belongs to the rotation of the marker, including the elastic rotation.
States follow z_1 - z_0 = h z_dot; the multipliers lam are constant in the step. If g depends on positions, the element
satisfies g(t_1, r_1, A_1) = 0 at the end of the step; if on velocities, h g = 0 in the middle; an equation g = 0 is
satisfied in the middle too.

The law declares its energy E, and its reactions are lam times the gradient of g. Together they have the potential
U = E - Σ lam_j g_j, a function of positions alone at constant t, v, z and lam. The work of the law's wrench differs
from the change of this potential over the step. The missing work

    delta = (dr, c)·grad U - (U_1 - U_0)

is done by an additional wrench along the motion (Gonzalez 1996, discrete gradient), so that E and lam·dg are exact;
delta is of third order, the wrench of second. If the wrenches of an element balance, this wrench acts along the motion
of the markers relative to each other,

    F_k = lambda rho_k,  rho_k = dr_k - dr_r - c_r × (r_k - r_r),   M_k = lambda L² (c_k - c_r)

with the opposite wrench on marker r, the first one that takes all kinds of loads; between markers that take only forces
it acts along the lines between them. If the wrenches do not balance or there is no marker r, it acts along the motion
of each marker. The factor is lambda = delta/(|motion|² + (1e-6 L)²), so that the remaining error is of the size of
roundoff.
"""

import math

from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.connections.element_law import (
    FIRST,
    law_call,
    law_results,
    motion_inputs,
    note_stops,
    note_what_is_no_number,
    unknown_inputs,
)
from floatframe.engine.kernels.rotation import exp_matrix
from floatframe.engine.kernels.vector import (
    add,
    axial,
    cross,
    dot,
    matrix,
    matrix_sum,
    norm,
    product,
    put,
    put_matrix,
    put_sum,
    scaled,
    scaled_matrix,
    sub,
    transposed,
    turned_back,
    vector,
)
from floatframe.engine.structure_preserving.kernels.bodies import cayley
from floatframe.engine.structure_preserving.kernels.markers import add_force, add_moment, turning
from floatframe.model.joints.rows.kinds import POSITION, VELOCITY

__all__ = ["element_gap", "element_load", "element_residual", "first_row_of_multipliers"]

WAY = 1.0 / 64.0  # fraction of the step over which the gradient of the potential is taken
LEAST = 1e-6  # motion relative to the length of the law, below which it counts as zero
BALANCED = 1e-9  # sum of wrenches relative to the sum of their norms, below which they balance
ALONG, BEGIN, END = range(3)


@inner
def begin_motion(model, discrete, step, c):
    """Write positions, axes and rotations of element c's markers at the middle or at the start of the step."""
    a = model.connections.a[c]
    for m in range(a, a + model.laws.head[model.connections.item[c], 0]):
        put(step.d_law[m], 0, vector(step.dx[m]))
        if step.is_still or model.markers.body[m] < 0:
            put(step.r_law[m], 0, vector(step.x_0[m]))
            put_matrix(step.A_law[m], matrix(step.A_0[m]))
            put(step.turn[m], 0, turning(model, step, m))
            continue
        turn = vector(step.theta_G[model.markers.body[m]])
        if discrete.turns[m]:
            turn = way_turned(product(matrix(step.A_f[m]), transposed(matrix(step.A_0[m]))))
        put_middle(step, m, turn, vector(step.x_f[m]))


@inner
def put_middle(step, m, turn, end):
    """Write the mid-step pose of marker m, which rotates by the Cayley vector `turn` and moves to `end`."""
    half = scaled(1.0 / (1.0 + math.sqrt(1.0 + 0.25 * dot(turn, turn))), turn)
    put(step.turn[m], 0, turn)
    put(step.r_law[m], 0, scaled(0.5, add(vector(step.x_0[m]), end)))
    put_matrix(step.A_law[m], product(cayley(half), matrix(step.A_0[m])))


@inner
def way_turned(Q):
    """Return the Cayley vector of a rotation matrix."""
    trace = Q[0][0] + Q[1][1] + Q[2][2]
    return scaled(2.0 / (1.0 + trace), axial(Q))


@inner
def put_inputs(model, work, discrete, step, c, t, where, s, part):
    """Write the inputs of the law of element c for markers at fraction s ALONG the step, or at its BEGIN or END.

    part: fraction of the changes of its states.
    """
    i, a = model.connections.item[c], model.connections.a[c]
    head = model.laws.head[i]
    work.laws.inputs[0] = t
    for k in range(head[0]):
        m, x = a + k, motion_inputs(head, work.laws.inputs, k)
        turn = vector(step.turn[m])
        if where == ALONG:
            A = matrix(step.A_law[m]) if s == 0.0 else product(exp_matrix(scaled(s, turn)), matrix(step.A_law[m]))
            r = add(vector(step.r_law[m]), scaled(s, vector(step.d_law[m])))
        elif where == BEGIN:
            r, A = vector(step.x_0[m]), matrix(step.A_0[m])
        else:
            r, A = vector(step.end.markers.r[m]), matrix(step.end.markers.A[m])
        put(x.r, 0, r)
        put_matrix(x.A, A)
        put(x.v, 0, scaled(1.0 / step.h, vector(step.d_law[m])))
        put(x.omega, 0, scaled(1.0 / step.h, turn))
    own = unknown_inputs(head, work.laws.inputs)
    change0 = step.load.shape[0] + step.f.shape[0] + model.laws.state0[i]
    for s in range(head[2]):
        own.states[s] = step.known[model.states.row[model.laws.state0[i] + s]] + part * step.z[change0 + s]
    for j in range(head[3]):
        own.multipliers[j] = step.f[discrete.first[c] + j]


@inner
def element_gap(model, work, discrete, step, g):
    """Return gap g of an element at the end of the step."""
    c = model.gaps.connection[g]
    i = model.connections.item[c]
    begin_motion(model, discrete, step, c)
    put_inputs(model, work, discrete, step, c, step.end.state.time, END, 0.0, 1.0)
    law_call(model, work, i, work.laws.trial)
    return law_results(model.laws.head[i], work.laws.trial).outputs[model.gaps.output[g]]


@inner
def first_row_of_multipliers(model, c):
    """Return the first multiplier row of element c; the multiplier rows are its last rows."""
    return model.connections.w0[c + 1] - model.laws.head[model.connections.item[c], 3]


@inner
def potential(model, discrete, step, c, outputs):
    """Return the declared energy of element c minus the work of its reactions on the constrained positions."""
    i, total = model.connections.item[c], 0.0
    found = law_results(model.laws.head[i], outputs)
    if model.laws.energy[i] >= 0:
        total += found.outputs[model.laws.energy[i]]
    row = first_row_of_multipliers(model, c)
    for j in range(model.laws.head[i, 3]):
        if model.rows.holds[row + j] == POSITION:
            total -= step.f[discrete.first[c] + j] * found.equations[j]
    return total


@inner
def has_potential(model, c):
    """Whether element c declares an energy or constrains positions."""
    for row in range(first_row_of_multipliers(model, c), model.connections.w0[c + 1]):
        if model.rows.holds[row] == POSITION:
            return True
    return model.laws.energy[model.connections.item[c]] >= 0


@inner
def is_balanced(head, inputs, outputs):
    """Whether the wrenches that a law gives are in equilibrium at the marker positions in its inputs."""
    found = law_results(head, outputs)
    force, moment, of_forces, of_moments = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0, 0.0
    r_0 = vector(motion_inputs(head, inputs, 0).r)
    for m in range(head[0]):
        F, M = vector(found.wrench[m]), vector(found.wrench[m, 3:])
        arm = sub(vector(motion_inputs(head, inputs, m).r), r_0)
        force, moment = add(force, F), add(moment, add(cross(arm, F), M))
        of_forces += norm(F)
        of_moments += norm(arm) * norm(F) + norm(M)
    return norm(force) <= BALANCED * of_forces and norm(moment) <= BALANCED * of_moments


@inner
def potential_at(model, work, discrete, step, c, where, s):
    """Return the potential of element c at a point of the path, and whether its wrenches are in equilibrium there."""
    i = model.connections.item[c]
    put_inputs(model, work, discrete, step, c, step.t_force, where, s, 0.5)
    law_call(model, work, i, work.laws.trial)
    balances = is_balanced(model.laws.head[i], work.laws.inputs, work.laws.trial)
    return potential(model, discrete, step, c, work.laws.trial), balances


@inner
def marker_of_whole(model, c):
    """Return the first marker at which element c applies all kinds of its loads, and whether it applies moments.

    The marker is -1 if there is none, if the element has only one marker, or if one of its markers is on the ground.
    """
    a = model.connections.a[c]
    last = a + model.laws.head[model.connections.item[c], 0]
    has_force, has_moment = False, False
    for m in range(a, last):
        has_force, has_moment = has_force or model.markers.force[m] >= 0, has_moment or model.markers.moment[m] >= 0
    whole = -1
    for k in range(last - a):
        m = last - 1 - k
        if model.markers.body[m] < 0:
            return -1, has_moment
        takes_force, takes_moment = model.markers.force[m] >= 0, model.markers.moment[m] >= 0
        if takes_force == has_force and takes_moment == has_moment:
            whole = m
    return whole if last - a > 1 else -1, has_moment


@inner
def put_ways(model, step, c, balances):
    """Write the directions of the correcting wrenches of element c, along the motions of its markers."""
    i, a = model.connections.item[c], model.connections.a[c]
    last, square = a + model.laws.head[i, 0], model.laws.length[i] ** 2
    for m in range(a, last):
        for k in range(6):
            step.way[m, k] = 0.0
    whole, has_moment = marker_of_whole(model, c)
    if not balances or whole < 0:
        for m in range(a, last):
            if model.markers.force[m] >= 0:
                put(step.way[m], 0, vector(step.dx[m]))
            if model.markers.moment[m] >= 0:
                put(step.way[m], 3, scaled(square, vector(step.turn[m])))
        return
    if not has_moment:
        for m in range(a, last):
            for k in range(a, m):
                d = sub(vector(step.r_law[m]), vector(step.r_law[k]))
                is_apart = dot(d, d) > LEAST**2 * square  # two coincident points have no line
                if is_apart and model.markers.force[m] >= 0 and model.markers.force[k] >= 0:
                    change = dot(d, sub(vector(step.dx[m]), vector(step.dx[k]))) / dot(d, d)
                    put_sum(step.way[k], 0, scaled(-change, d))
                    put_sum(step.way[m], 0, scaled(change, d))
        return
    turn = vector(step.turn[whole])
    for m in range(a, last):
        if m == whole:
            continue
        d = sub(vector(step.r_law[m]), vector(step.r_law[whole]))
        F, M = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        if model.markers.force[m] >= 0:
            F = sub(sub(vector(step.dx[m]), vector(step.dx[whole])), cross(turn, d))
        if model.markers.moment[m] >= 0:
            M = scaled(square, sub(vector(step.turn[m]), turn))
        put(step.way[m], 0, F)
        put(step.way[m], 3, M)
        put_sum(step.way[whole], 0, scaled(-1.0, F))
        put_sum(step.way[whole], 3, scaled(-1.0, add(M, cross(d, F))))


@inner
def work_along(step, wrench, m):
    """Return the work of a wrench on marker m over the step."""
    return dot(wrench, vector(step.dx[m])) + dot(wrench[3:], vector(step.turn[m]))


@inner
def correct_wrenches(model, work, discrete, step, c):
    """Add to the wrenches of element c the correction that makes their work exact."""
    i, a = model.connections.item[c], model.connections.a[c]
    slope = 0.0
    for p in range(7):
        if p != 3:
            U, _ = potential_at(model, work, discrete, step, c, ALONG, (p - 3) * WAY)
            slope += FIRST[p] * U / WAY
    _, in_middle = potential_at(model, work, discrete, step, c, ALONG, 0.0)
    U_0, at_begin = potential_at(model, work, discrete, step, c, BEGIN, 0.0)
    U_1, at_end = potential_at(model, work, discrete, step, c, END, 0.0)
    put_ways(model, step, c, in_middle and at_begin and at_end)
    size = (LEAST * model.laws.length[i]) ** 2
    for m in range(a, a + model.laws.head[i, 0]):
        size += work_along(step, step.way[m], m)
    factor = (slope - (U_1 - U_0)) / size
    for m in range(a, a + model.laws.head[i, 0]):
        for k in range(6):
            step.wrench[m, k] += factor * step.way[m, k]


@inner
def add_axes_moment(model, discrete, step, m, M):
    """Add a moment on a marker, conjugate to the marker's rotation."""
    i = model.markers.body[m]
    if i < 0 or step.is_still or not discrete.turns[m]:
        add_moment(model, step, m, M)
        return
    E = scaled_matrix(0.5, matrix_sum(matrix(step.A_0[m]), matrix(step.A_f[m])))
    turn = vector(step.turn[m])
    square = dot(turn, turn)
    # (tr S - S)/2 with S = u uᵀ + c² (1 - u uᵀ): c² along u, (1 + c²)/2 across, c² = 1/(1 + |turn|²/4)
    cosine = 1.0 / (1.0 + 0.25 * square)
    inside = scaled(2.0 / (1.0 + cosine), M)
    if square > 0.0:
        along = dot(M, turn) / square
        inside = add(inside, scaled(along * (1.0 / cosine - 2.0 / (1.0 + cosine)), turn))
    put_sum(step.T[0, m], 0, M)
    for k in range(3):
        G = scaled(0.5, cross(inside, (E[0][k], E[1][k], E[2][k])))
        eps = (step.E_mean[m, 0, k], step.E_mean[m, 1, k], step.E_mean[m, 2, k])
        put_sum(step.m[0, m], 0, cross(eps, turned_back(step.R_m[i], G)))


@inner
def note(model, work, c):
    """Record an output that ends the run, and non-finite results for a finite motion."""
    note_stops(model, work, model.connections.item[c])
    note_what_is_no_number(model, work, c)


@inner
def element_load(model, work, discrete, step, c):
    """Add the loads of element c; return supplied and dissipated work."""
    i, a = model.connections.item[c], model.connections.a[c]
    head, laws = model.laws.head[i], model.laws
    found = law_results(head, work.laws.outputs)
    begin_motion(model, discrete, step, c)
    put_inputs(model, work, discrete, step, c, step.t_force, ALONG, 0.0, 0.0 if step.is_still else 0.5)
    law_call(model, work, i, work.laws.outputs)
    note(model, work, c)
    for m in range(head[0]):
        for k in range(6):
            step.wrench[a + m, k] = found.wrench[m, k]
    if not step.is_still and has_potential(model, c):
        correct_wrenches(model, work, discrete, step, c)
    on_bodies = 0.0
    for m in range(a, a + head[0]):
        F, M = vector(step.wrench[m]), vector(step.wrench[m, 3:])
        if model.markers.force[m] >= 0:
            add_force(step, m, F)
            on_bodies += dot(F, vector(step.dx[m]))
        if model.markers.moment[m] >= 0:
            add_axes_moment(model, discrete, step, m, M)
            on_bodies += dot(M, vector(step.turn[m]))
    given = step.h * found.outputs[laws.given[i]] if laws.given[i] >= 0 else 0.0
    lost = step.h * found.outputs[laws.lost[i]] if laws.lost[i] >= 0 else 0.0
    if laws.energy[i] < 0:
        if laws.given[i] < 0:
            given = on_bodies + lost
        elif laws.lost[i] < 0:
            lost = given - on_bodies
    return given, lost


@inner
def element_residual(model, work, discrete, step, c):
    """Write the residuals of states and multipliers of element c; none while velocities are being closed.

    Constraints of positions are satisfied at the end of the step, all other equations in its middle.
    """
    i, h = model.connections.item[c], step.h
    head = model.laws.head[i]
    n_u = step.load.shape[0]
    state0 = n_u + step.f.shape[0] + model.laws.state0[i]
    if step.is_closing:
        for s in range(head[2]):
            step.residual[state0 + s] = step.z[state0 + s]
        return
    if head[2] + head[3] == 0:
        return
    found, row, first = law_results(head, work.laws.trial), first_row_of_multipliers(model, c), n_u + discrete.first[c]
    begin_in_middle(model, discrete, step, c)
    put_inputs(model, work, discrete, step, c, 0.5 * (step.t_0 + step.end.state.time), ALONG, 0.0, 0.5)
    law_call(model, work, i, work.laws.trial)
    for s in range(head[2]):
        step.residual[state0 + s] = step.z[state0 + s] - h * found.rates[s]
    holds_position = False
    for j in range(head[3]):
        holds = model.rows.holds[row + j]
        holds_position = holds_position or holds == POSITION
        if holds != POSITION:
            step.residual[first + j] = (h if holds == VELOCITY else 1.0) * found.equations[j]
    if not holds_position:
        return
    put_inputs(model, work, discrete, step, c, step.end.state.time, END, 0.0, 1.0)
    law_call(model, work, i, work.laws.trial)
    for j in range(head[3]):
        if model.rows.holds[row + j] == POSITION:
            step.residual[first + j] = found.equations[j]


@inner
def begin_in_middle(model, discrete, step, c):
    """Write the marker motion of element c at mid-step, from the motion between start and end of the step."""
    a = model.connections.a[c]
    for m in range(a, a + model.laws.head[model.connections.item[c], 0]):
        end = vector(step.end.markers.r[m])
        put(step.d_law[m], 0, sub(end, vector(step.x_0[m])))
        put_middle(step, m, way_turned(product(matrix(step.end.markers.A[m]), transposed(matrix(step.A_0[m])))), end)
