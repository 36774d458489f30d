"""Time loop of the generalized-alpha method on R³ × SO(3) × Rⁿ.

Described in `floatframe.integrators.generalized_alpha`.
"""

import math

from floatframe.engine.kernels.body import NewtonWeights, body_mass_product, modal_number, modal_term
from floatframe.engine.kernels.compiler.compilation import inner, small
from floatframe.engine.kernels.connections.gap import next_step, step_before_contact, take_ends
from floatframe.engine.kernels.connections.user_force import resize_states
from floatframe.engine.kernels.diagnostics import diagnose, power
from floatframe.engine.kernels.evaluation import evaluate
from floatframe.engine.kernels.joints.row_formulas import held_value
from floatframe.engine.kernels.memory import GIVEN, TAKEN, WORK_GIVEN, WORK_TAKEN
from floatframe.engine.kernels.model import JOINT, MASS, STIFFNESS
from floatframe.engine.kernels.rotation import (
    after_spin,
    changed_spin,
    exp_matrix,
    matrix_of_euler_parameters,
    rotate_euler_parameters,
    split_spin,
    turn_of_axis,
    turned_about,
    turned_by_spin,
)
from floatframe.engine.kernels.schur import (
    close_connections,
    close_velocities,
    factorize_bodies,
    move_bodies,
    renew_connections,
    renew_turning,
    settle_accelerations,
    share_reactions,
    velocity_gaps,
)
from floatframe.engine.kernels.step_start import accelerate, begin_step
from floatframe.engine.kernels.time_function import time_function
from floatframe.engine.kernels.turns import count_turns
from floatframe.engine.kernels.vector import (
    add,
    copy,
    cross,
    dot,
    norm,
    product,
    put,
    put_matrix,
    put_sum,
    scaled,
    sub,
    turned,
    turned_back,
    vector,
)
from floatframe.model.joints.rows.kinds import NOTHING

__all__ = [
    "DIVERGED",
    "DONE",
    "INACCURATE",
    "NO_ACCELERATION",
    "SINGULAR",
    "SINGULAR_BODY",
    "SINGULAR_CONNECTION",
    "STOPPED",
    "TURNED",
    "UNRESOLVED",
    "add_reactions",
    "advance",
    "error_factor",
    "is_resized",
    "is_too_long",
    "keep_iterate",
    "load_memory",
    "load_state",
    "mean_square",
    "newton_weights",
    "next_acceleration",
    "next_of_unknown",
    "ratio_of_steps",
    "shares",
    "takes_spin",
    "time_loop",
    "write_row",
]

DONE, DIVERGED, SINGULAR_BODY, SINGULAR_CONNECTION, INACCURATE, STOPPED = 0, 1, 2, 3, 4, 5
SINGULAR = 6  # status: the Newton matrix is singular, in a formulation with one matrix
UNRESOLVED = 7  # status: a step is too long for a contact
TURNED = 8  # status: a body rotates too far in a step
NO_ACCELERATION = 9  # status: a step of a scheme without accelerations is done, but none exist at its end
#: largest rotation [rad] in a step of a body with joints off its rotation axis; above 1.15 joints can add energy
MOST_TURN = 1.0
# distance of a joint from the axis of rotation, relative to the size of the system, above which it counts as off-axis
OFF_AXIS = 1e-3
SLOW = 0.2  # ratio of successive corrections above which the factors are renewed
# weight of the displacement increment, compared with the displacement due to accelerations, in the norm
OF_MOTION = 1e-5
FAST = 0.1  # contraction rate below which a step may end by the predicted next correction
SAFE = 0.5  # fraction of the tolerance that this predicted correction must not exceed
OF_ROUNDOFF = 0.1  # fraction of the roundoff that is added to the tolerance for this purpose
AGED = 5e-4  # allowed change of velocities due to outdated factors, relative to the first correction
ROUNDOFF = 2e-15  # relative roundoff of a position
NOISE = 1e-7  # accelerations due to roundoff of positions, relative to those of the motion, that may appear in results
SAFETY = 0.9  # safety factor on the step that would just meet the allowed error
# largest reduction and growth of a step; smallest growth for which the size is changed
LEAST, MOST, WORTH = 0.2, 2.0, 1.2
# ratio of an angular acceleration to the same without the rotation of the axis, below which the rotation is steady
STEADY = 0.1
FEW = 5  # number of iterations up to which a step may be followed by one that begins with its factors of connections
SAME_TIME = 1e-3  # difference of times, relative to the step, below which they count as equal
SAME = 1e-12  # relative difference below which step sizes count as equal


@inner
def put_weights(model, work, c_k):
    """Write the weights of the norm of corrections: mass, inertia, and M + c_k K of the modes."""
    types = model.body_types
    for i in range(model.bodies.kind.shape[0]):
        t, u0, n = model.bodies.kind[i], model.bodies.u0[i], model.bodies.n_q[i]
        for k in range(3):
            work.solver.weight[u0 + k] = types.mass[t]
            work.solver.weight[u0 + 3 + k] = types.J0[t, k, k]
        for k in range(n):
            M, K = modal_number(types, t, n, MASS, k), modal_number(types, t, n, STIFFNESS, k)
            work.solver.weight[u0 + 6 + k] = M + c_k * K


@inner
def load_state(state, memory):
    """Copy the memory of the integrator into the iterate, with zero rotation since the beginning of the step."""
    copy(memory.r.reshape(memory.r.size), state.r.reshape(memory.r.size))
    copy(memory.q, state.q)
    copy(memory.u, state.u)
    copy(memory.u_dot, state.u_dot)
    copy(memory.w, state.w)
    copy(memory.angle, state.angle)
    for i in range(memory.p.shape[0]):
        state.spins[i] = 0
        for k in range(3):
            state.theta[i, k] = 0.0
    for i in range(memory.p.shape[0]):
        put_matrix(state.R[i], matrix_of_euler_parameters(memory.p[i]))


@inner
def turn_body(model, state, memory, i):
    """Write R of body i: its value at the beginning of the step, rotated by theta; a spin is a separate rotation."""
    R_start, theta = matrix_of_euler_parameters(memory.p[i]), vector(state.theta[i])
    if state.spins[i] == 0:
        put_matrix(state.R[i], product(R_start, exp_matrix(theta)))
        return
    put_matrix(state.R[i], product(R_start, turned_by_spin(spin_axis(model, i), theta)))


@small
def spin_axis(model, i):
    """Return the symmetry axis of the inertia of body i, body axes; zero if there is none."""
    return vector(model.body_types.axis[model.bodies.kind[i]])


@small
def takes_spin(turn, alpha):
    """Whether a step integrates a spin separately: alpha is not much smaller without the rotation of the axis."""
    rest = sub(alpha, turn)
    return dot(turn, turn) > 0.0 and dot(alpha, alpha) >= STEADY * STEADY * dot(rest, rest)


@inner
def begin_spin(model, work, memory, i):
    """Choose whether the step integrates the spin of body i separately; return the reduction of its accelerations.

    It does so if w omega × e, the angular acceleration due to the rotation of the symmetry axis e, is not zero, and the
    angular acceleration is not much smaller than the rest without this part (see `takes_spin`).
    """
    u0, zero = model.bodies.u0[i] + 3, (0.0, 0.0, 0.0)
    turn = turn_of_axis(spin_axis(model, i), vector(memory.u[u0:]))
    work.state.spins[i] = 0
    if takes_spin(turn, vector(memory.u_dot[u0:])):
        work.state.spins[i] = 1
        return turn
    return zero


@inner
def take_to_body(model, state, i):
    """Convert omega and alpha of body i from axes that do not spin to its own axes, and add w omega × e to alpha.

    The axes that do not spin are the axes at the beginning of the step rotated by exp(across).
    """
    e, u0 = spin_axis(model, i), model.bodies.u0[i] + 3
    along = dot(e, vector(state.theta[i]))
    omega, alpha = after_spin(e, along, vector(state.u[u0:]), vector(state.u_dot[u0:]))
    put(state.u, u0, omega)
    put(state.u_dot, u0, alpha)


@inner
def take_age(solver, n_iterations, are_laws_new):
    """Count a step with the present factors, and request new ones if it needed more iterations than the mean.

    The mean includes the cost of the factors. Further steps with them would raise it, while new factors keep it. After
    a step with old derivatives of laws these come first, and they do if it needed more iterations than the last step
    with new ones.
    """
    solver.n_steps += 1
    solver.n_spent += n_iterations
    is_slow = n_iterations * solver.n_steps > solver.n_spent
    if are_laws_new:
        solver.n_of_new_laws = n_iterations
        if is_slow:
            solver.is_due = 1
    elif is_slow or n_iterations > solver.n_of_new_laws:
        solver.is_law_due = 1


@inner
def predict(model, work, memory, h, order):
    """(1): predict with a_new = a; return the squared norms of acceleration and increment."""
    begin_step(model, work, memory, h, order.alpha_f)
    size, size_x = 0.0, 0.0
    for i in range(model.bodies.kind.shape[0]):
        n, u0, q0 = model.bodies.n_q[i], model.bodies.u0[i], model.bodies.q0[i]
        turn = (0.0, 0.0, 0.0)
        work.state.spins[i] = 0
        if order.stabilized != 0:
            turn = begin_spin(model, work, memory, i)
        for j in range(6 + n):
            k = u0 + j
            less = turn[j - 3] if 3 <= j < 6 else 0.0
            a, u = memory.a[k] - less, memory.u[k]
            x = h * (u + 0.5 * h * a)
            work.state.u[k] = u + h * a
            work.state.u_dot[k] = (a - order.alpha_f * (memory.u_dot[k] - less)) / (1 - order.alpha_f)
            size += work.solver.weight[k] * work.state.u_dot[k] ** 2
            size_x += work.solver.weight[k] * x * x
            if j < 3:
                work.state.r[i, j] = memory.r[i, j] + x
            elif j < 6:
                work.state.theta[i, j - 3] = x
            else:
                work.state.q[q0 + j - 6] = memory.q[q0 + j - 6] + x
        if work.state.spins[i] != 0:
            take_to_body(model, work.state, i)
        turn_body(model, work.state, memory, i)
    return size, size_x


@inner
def update(model, work, memory, by_rate, by_acceleration, c_k, is_held):
    """Add the correction (y, mu) to the iterate, and y_rate to constrained velocities; return its squared norm."""
    total = 0.0
    for i in range(model.bodies.kind.shape[0]):
        n, u0, q0 = model.bodies.n_q[i], model.bodies.u0[i], model.bodies.q0[i]
        y = work.solver.y[u0 : u0 + 6 + n]
        for k in range(6 + n):
            total += work.solver.weight[u0 + k] * y[k] * y[k]
        put_sum(work.state.r[i], 0, turned(work.state.R[i], y))
        for k in range(n):
            work.state.q[q0 + k] += y[6 + k]
        by_theta = vector(y[3:])
        if is_held:
            for k in range(6 + n):
                y[k] += work.solver.y_rate[u0 + k]
        change_rates(model, work, i, by_theta, by_rate, by_acceleration)
        turn_body(model, work.state, memory, i)
    for k in range(work.solver.mu.shape[0]):
        work.state.w[k] += work.solver.mu[k] / c_k
    return total


@inner
def change_rates(model, work, i, by_theta, by_rate, by_acceleration):
    """Add by_rate y to the velocities of body i, by_acceleration y to its accelerations, and by_theta to theta.

    For a body whose spin is integrated separately, omega and alpha - w omega × e change by y in axes that do not spin
    with it, where y is the change of theta or, if theta stays, of a velocity.
    """
    n, u0, state = model.bodies.n_q[i], model.bodies.u0[i], work.state
    y = work.solver.y[u0 : u0 + 6 + n]
    dx = turned(state.R[i], y)
    put_sum(state.u, u0, scaled(by_rate, dx))
    put_sum(state.u_dot, u0, scaled(by_acceleration, dx))
    for k in range(6, 6 + n):
        state.u[u0 + k] += by_rate * y[k]
        state.u_dot[u0 + k] += by_acceleration * y[k]
    omega, turning = vector(state.u[u0 + 3 :]), vector(y[3:])
    if state.spins[i] == 0:
        put_sum(state.theta[i], 0, by_theta)
        put_sum(state.u, u0 + 3, scaled(by_rate, turning))
        put_sum(state.u_dot, u0 + 3, scaled(by_acceleration, turning))
        return
    by_omega, by_alpha = scaled(by_rate, turning), scaled(by_acceleration, turning)
    theta, alpha = vector(state.theta[i]), vector(state.u_dot[u0 + 3 :])
    theta, omega, alpha = changed_spin(spin_axis(model, i), theta, omega, alpha, by_theta, by_omega, by_alpha)
    put(state.theta[i], 0, theta)
    put(state.u, u0 + 3, omega)
    put(state.u_dot, u0 + 3, alpha)


@inner
def turns_too_far(model, work, length):
    """Return the first body, or -1, that rotates by more than `MOST_TURN` with a joint off its rotation axis.

    A spin that is integrated separately does not count. If all joints lie on the rotation axis through the frame
    origin, this origin does not move on a circle, and a rotation of any size is correct.
    """
    for i in range(model.bodies.kind.shape[0]):
        theta = vector(work.state.theta[i])
        if work.state.spins[i] != 0:
            _, theta = split_spin(spin_axis(model, i), theta)
        if dot(theta, theta) <= MOST_TURN * MOST_TURN:
            continue
        turn = norm(theta)
        for e in range(model.bodies.end0[i], model.bodies.end0[i + 1]):
            m = model.bodies.ends[e]
            if model.connections.law[model.markers.connection[m]] == JOINT:
                if norm(cross(theta, vector(work.markers.rho[m]))) > OFF_AXIS * length * turn:
                    return i
    return -1


@inner
def hold_velocities(model, work, c_k):
    """Write the velocity correction y_rate for the gaps in mu, used by `update`; return its squared norm.

    Accelerations change with the velocities, and reactions with the accelerations; this function changes the reactions.
    Positions do not change, but the factors include forces that depend on positions (modal stiffness, forces that
    rotate relative to the body). Their contribution is therefore subtracted from the residuals.
    """
    close_velocities(model, work)
    total, by_turn, y = 0.0, work.bodies.by_turn, work.solver.y
    for i in range(model.bodies.kind.shape[0]):
        n, u0 = model.bodies.n_q[i], model.bodies.u0[i]
        residual = work.bodies.residual[u0 : u0 + 6 + n]
        turning = turned(work.bodies.T_right[i], y[u0 + 3 :])
        for k in range(6 + n):
            work.solver.y_rate[u0 + k] = y[u0 + k]
            total += work.solver.weight[u0 + k] * y[u0 + k] * y[u0 + k]
            residual[k] -= dot(vector(by_turn[u0 + k]), turning)
        modal_term(model.body_types, model.bodies.kind[i], n, STIFFNESS, -1.0, y[u0 + 6 : u0 + 6 + n], residual[6:])
    add_reactions(model, work, c_k)
    return total


@inner
def largest(x):
    """Return the largest absolute value."""
    most = 0.0
    for k in range(x.shape[0]):
        most = max(most, abs(x[k]))
    return most


@inner
def expect_late_gaps(solver):
    """Add to the velocity gaps in mu the gaps that the first iteration will probably leave; return the largest.

    The rates of constraints change with the positions. The gap left is predicted to change as in the step before.
    """
    most = 0.0
    for k in range(solver.mu.shape[0]):
        if solver.has_late_gaps == 0:
            solver.late_gap[k], solver.late_gap_change[k] = 0.0, 0.0
        solver.mu[k] += solver.late_gap[k] + solver.late_gap_change[k]
        most = max(most, abs(solver.mu[k]))
    return most


@inner
def keep_late_gaps(solver):
    """Store the velocity gaps that the first iteration left open and their change; return the largest gap in mu."""
    most = 0.0
    for k in range(solver.mu.shape[0]):
        most = max(most, abs(solver.mu[k]))
        gap = solver.late_gap[k] + solver.late_gap_change[k] + solver.mu[k]
        solver.late_gap_change[k] = gap - solver.late_gap[k] if solver.has_late_gaps != 0 else 0.0
        solver.late_gap[k] = gap
    solver.has_late_gaps = 1
    return most


@inner
def are_aged(solver, second, first, of_rates):
    """Whether outdated factors H change the result of a step, from the ratio of its second to its first correction.

    Velocities are corrected by H⁻¹ Gᵀ nu, with the norm `of_rates`. No residual removes the error that outdated factors
    cause there. Relative to `of_rates` it is estimated as the ratio of the second to the first correction, minus twice
    this ratio with new factors.
    """
    if not first > 0.0:
        return False
    if solver.contraction < 0.0:
        solver.contraction = second / first
    return (second / first - 2.0 * solver.contraction) * of_rates > AGED * first


@inner
def add_reactions(model, work, c_k):
    """Add the wrenches of the velocity correction to the reactions of joints and other constraints.

    The wrenches of force elements do not change, because positions do not. All components of the wrench of a joint
    change, except the parts along its soft rows, because the rates of these differ by roundoff from the rates of the
    constraints that they repeat.
    """
    for c in range(model.connections.size.shape[0]):
        w0, end = model.connections.w0[c], model.connections.w0[c + 1]
        a, b = model.connections.a[c], model.connections.b[c]
        is_joint, mu = model.connections.law[c] == JOINT, work.solver.mu[w0:end]
        for k in range(w0, end):
            if is_joint and model.rows.soft[k] > 0.0:
                _, n, _, m_b = held_value(model.rows.kind[k], model, work, k, a, b)
                part = model.rows.part[k]
                along = (dot(n, vector(mu)) + dot(m_b, vector(mu[part:]))) / (dot(n, n) + dot(m_b, m_b))
                put_sum(mu, 0, scaled(-along, n))
                put_sum(mu, part, scaled(-along, m_b))
        for k in range(w0, end):
            if is_joint or (model.rows.holds[k] != NOTHING and model.rows.soft[k] == 0.0):
                work.state.w[k] += work.solver.mu[k] / c_k


@small
def will_be_small(correction, last, left):
    """Whether the next correction is at most `left` by the ratio of the last two; last is infinite if none is known."""
    return last < math.inf and correction <= FAST * last and correction * correction <= last * left


@inner
def is_enough(norm, last, wanted, allowed):
    """Whether a correction is small enough, or the next one will be by the ratio of the last two.

    allowed: the wanted size plus roundoff. The limit for a correction that is omitted contains less roundoff, because
    the errors left by omitted corrections have the same sign in all steps.
    """
    return norm <= allowed or will_be_small(norm, last, SAFE * (wanted + OF_ROUNDOFF * (allowed - wanted)))


@inner
def are_states_enough(change, last, iteration):
    """Whether a correction of states, divided by the tolerance, is small enough, will be, or does not fall any more.

    States follow the bodies by one iteration, so that the ratio of their first two corrections predicts nothing.
    """
    if iteration <= 1:
        return change <= 1.0
    is_stuck = change <= 1e3 and change > 0.5 * last and iteration > 2
    return change <= 1.0 or will_be_small(change, last, SAFE) or is_stuck


@inner
def correction_of_states(model, work, c_k):
    """Return the largest correction of a state or of a multiplier without constraint, relative to its size.

    The size is the largest of the typical size, the present value and, for a state, its change in a step.
    """
    largest = 0.0
    for s in range(model.states.row.shape[0]):
        k = model.states.row[s]
        size = max(model.states.size[s], abs(work.state.w[k]), abs(work.states.kappa[s] * work.state.w[k + 1]))
        change = abs(work.solver.mu[k] / c_k) / size
        if not math.isfinite(change):
            return math.inf
        largest = max(largest, change)
    for j in range(model.laws.equation.shape[0]):
        k = model.laws.equation[j]
        change = abs(work.solver.mu[k] / c_k) / max(model.laws.equation_size[j], abs(work.state.w[k]))
        if not math.isfinite(change):
            return math.inf
        largest = max(largest, change)
    return largest


@inner
def total_mass(model):
    """Return the mass of all bodies."""
    mass = 0.0
    for i in range(model.bodies.kind.shape[0]):
        mass += model.body_types.mass[model.bodies.kind[i]]
    return mass


@inner
def wanted_correction(model, order, c_k, size, size_x):
    """Return the norm of the last correction that the tolerance asks for.

    size, size_x: squared norms of the accelerations without gravity and of the displacement in a step.
    """
    size += total_mass(model) * dot(model.gravity, model.gravity)
    return order.tolerance * (c_k * math.sqrt(size) + OF_MOTION * math.sqrt(size_x))


@inner
def roundoff_floor(model, r, length):
    """Return the norm of roundoff errors of the positions r of the bodies."""
    total = 0.0
    for i in range(model.bodies.kind.shape[0]):
        size = length
        for k in range(3):
            size += abs(r[i, k])
        total += model.body_types.mass[model.bodies.kind[i]] * size * size
    return math.sqrt(total * ROUNDOFF * ROUNDOFF)


@inner
def local_error(model, work, memory, order, h):
    """Return the estimated error of the increment in a converged step, the largest of all bodies."""
    alpha_m, alpha_f = order.alpha_m, order.alpha_f
    largest = 0.0
    for i in range(model.bodies.kind.shape[0]):
        u0, n = model.bodies.u0[i], model.bodies.n_q[i]
        jump = work.bodies.velocity[: 6 + n]
        for k in range(6 + n):
            a = memory.a[u0 + k]
            jump[k] = next_of_unknown(a, memory.u_dot[u0 + k], work.state.u_dot[u0 + k], alpha_m, alpha_f) - a
        if work.state.spins[i] != 0:
            e = spin_axis(model, i)
            begin, turning = angular_accelerations(model, work, memory, i, alpha_m, alpha_f)
            put(jump, 3, turned_about(e, -dot(e, vector(work.state.theta[i])), sub(turning, begin)))
        largest = max(largest, mean_square(model, work, i, jump))
    return error_factor(order, h) * math.sqrt(largest)


@inner
def error_factor(order, h):
    """Return the ratio of a step's increment error to the change of its algorithmic acceleration."""
    return abs(0.5 * order.gamma - order.beta - 1.0 / 12.0) * h * h  # 1/6 - (1/2 - gamma)/2 - beta


@inner
def mean_square(model, work, i, jump):
    """Return jumpᵀ M jump of body i divided by mass and squared size, a mean over the points of the body.

    Each body is measured alone, so that a heavy or distant body does not hide the error of another. jump, (6 + n_q,),
    whose translation is in ground axes, is overwritten by its components in body axes.
    """
    n, moved = model.bodies.n_q[i], work.bodies.momentum[: 6 + model.bodies.n_q[i]]
    put(jump, 0, turned_back(work.state.R[i], jump))
    body_mass_product(model, work, i, jump, moved)
    total = 0.0
    for k in range(6 + n):
        total += jump[k] * moved[k]
    return total / (model.body_types.mass[model.bodies.kind[i]] * model.bodies.size[i] ** 2)


@inner
def newton_weights(order, h):
    """Return the derivatives of u_dot, u and x by the algorithmic acceleration a."""
    return NewtonWeights((1 - order.alpha_m) / (1 - order.alpha_f), order.gamma * h, order.beta * h * h)


@small
def has_states(model):
    """Whether force elements or laws have unknowns of their own."""
    return model.states.row.shape[0] + model.laws.equation.shape[0] > 0


@inner
def keeps_connections(model, work, h):
    """Whether a step of size h begins with the factors of the connections of the step before.

    With states they are renewed at the second iterate in any case, which suffices after a step that converged fast.
    """
    return (
        has_states(model) and work.solver.is_due == 0 and abs(work.state.time - h - work.solver.t_end) <= SAME_TIME * h
    )


@small
def has_costly_laws(model):
    """Whether old derivatives of laws are used for further steps."""
    for i in range(model.laws.is_costly.shape[0]):
        if model.laws.is_costly[i] == 1:
            return True
    return False


@inner
def one_step(model, work, memory, order, h):
    """Advance the memory by one step, unless the estimated error is larger than allowed.

    Return (status, index of the singular body or connection, last correction divided by the allowed one, error or -1 if
    it is not estimated).
    """
    weights = newton_weights(order, h)
    c_m, c_d, c_k = weights
    size, size_x = predict(model, work, memory, h, order)
    wanted = wanted_correction(model, order, c_k, size, size_x)
    allowed = wanted + roundoff_floor(model, work.state.r, order.length)
    solver = work.solver
    if solver.c_m != c_m or solver.c_d != c_d or solver.c_k != c_k:
        work.solver.is_due, work.solver.has_late_gaps = 1, 0
    work.counted.no_number = 0
    work.counted.stopped = 0
    last, last_of_states = math.inf, math.inf
    excess = math.inf
    holds = order.stabilized != 0 and solver.mu.shape[0] > 0
    mass = total_mass(model)
    least_gap = SAFE * wanted / math.sqrt(mass) if mass > 0.0 else 0.0  # all bodies are within the limit
    is_new, is_aged, first_of_rates = not keeps_connections(model, work, h), False, 0.0
    is_law_due = solver.is_law_due == 1 or is_new
    are_laws_new = not has_costly_laws(model)
    for iteration in range(order.max_iterations):
        evaluate(model, work, c_k)
        if iteration == 0 and order.stabilized != 0:
            body = turns_too_far(model, work, order.length)
            if body >= 0:
                return TURNED, body, excess, -1.0
        if work.solver.is_due == 1:
            body = factorize_bodies(model, work, weights)
            if body >= 0:
                return SINGULAR_BODY, body, excess, -1.0
            solver.c_m, solver.c_d, solver.c_k = c_m, c_d, c_k
            work.solver.is_due, solver.n_steps, solver.n_spent, solver.contraction = 0, 0, solver.price, -1.0
            is_new, is_law_due = True, True
        elif iteration == 0:
            body = renew_turning(model, work, weights)
            if body >= 0:
                work.solver.is_due = 1
                return SINGULAR_BODY, body, excess, -1.0
        connection = -1
        if is_new and solver.mu.shape[0] > 0:
            are_all_new = is_law_due or iteration > 1
            connection = renew_connections(model, work, c_k, are_all_new)
            if are_all_new:
                solver.is_law_due, are_laws_new = 0, True
        if connection >= 0:
            work.solver.is_due = 1
            return SINGULAR_CONNECTION, connection, excess, -1.0
        of_rates, is_held = 0.0, False
        if holds:
            velocity_gaps(model, work, c_d / c_k)
            if iteration == 0:
                gap = expect_late_gaps(work.solver)
            elif iteration == 1:
                gap = keep_late_gaps(work.solver)
            else:
                gap = largest(work.solver.mu)
            is_held = gap > least_gap
        if is_held:
            of_rates = hold_velocities(model, work, c_k)
        move_bodies(model, work, c_k)
        if is_held:
            for i in range(model.bodies.kind.shape[0]):
                put_sum(solver.y, model.bodies.u0[i] + 3, scaled(-1.0, vector(solver.surplus[i])))
        if solver.mu.shape[0] > 0:
            close_connections(model, work)
        of_positions = update(model, work, memory, c_d / c_k, c_m / c_k, c_k, is_held)
        norm = math.sqrt(of_rates + of_positions)
        if iteration == 0:
            first_of_rates = math.sqrt(of_rates)
        elif iteration == 1:
            is_aged = are_aged(work.solver, math.sqrt(of_positions), last, first_of_rates)
        memory.n_iterations += 1
        if not math.isfinite(norm):
            work.solver.is_due, work.solver.has_late_gaps = 1, 0
            return DIVERGED, -1, math.inf, -1.0
        excess = norm / allowed if allowed > 0.0 else math.inf
        is_new = False
        of_states = 0.0
        if has_states(model):  # states follow the bodies by one iteration
            of_states = correction_of_states(model, work, c_k) / order.tolerance
            if not math.isfinite(of_states):
                work.solver.is_due, work.solver.has_late_gaps = 1, 0
                return DIVERGED, -1, math.inf, -1.0
            if iteration == 0:
                last, last_of_states = norm, of_states
                is_new = of_states > 1.0
                continue
            is_new = of_states > max(1.0, SLOW * last_of_states)
        is_stuck = norm <= 1e3 * allowed and norm > 0.5 * last and iteration > 2
        is_small = is_enough(norm, last, wanted, allowed) or is_stuck
        if is_small and are_states_enough(of_states, last_of_states, iteration):
            take_age(work.solver, iteration + 1, are_laws_new)
            if is_aged and are_laws_new:
                work.solver.is_due = 1
            elif is_aged:
                work.solver.is_law_due = 1
            error = -1.0
            if is_too_long(model, work, h):
                return UNRESOLVED, -1, excess, error
            if order.most_error > 0.0:
                error = local_error(model, work, memory, order, h)
                if not error <= order.most_error:
                    return INACCURATE, -1, excess, error
            accept(model, work, memory, order, h)
            solver.t_end = work.state.time if iteration < FEW else -math.inf
            return DONE, -1, excess, error
        if norm > SLOW * last and not is_small:
            if are_laws_new:
                work.solver.is_due = 1
            else:
                is_new, is_law_due = True, True
        last, last_of_states = norm, of_states
        excess = max(excess, of_states)
    work.solver.is_due, work.solver.has_late_gaps = 1, 0
    return DIVERGED, -1, excess, -1.0


@inner
def is_too_long(model, work, h):
    """Whether a converged step of size h is too long for a contact, see `connections.gap`."""
    if model.gaps.connection.shape[0] == 0:
        return False
    take_ends(model, work)
    return next_step(model, work, work.state.time, h) < h


@inner
def accept(model, work, memory, order, h):
    """(3): write the iterate and the new algorithmic acceleration into the memory."""
    alpha_m, alpha_f = order.alpha_m, order.alpha_f
    for i in range(model.bodies.kind.shape[0]):
        u0 = model.bodies.u0[i]
        _, turning = angular_accelerations(model, work, memory, i, alpha_m, alpha_f)
        for k in range(u0, u0 + 6 + model.bodies.n_q[i]):
            memory.a[k] = next_of_unknown(memory.a[k], memory.u_dot[k], work.state.u_dot[k], alpha_m, alpha_f)
        p, theta = memory.p[i], vector(work.state.theta[i])
        if work.state.spins[i] != 0:
            e = spin_axis(model, i)
            along, across = split_spin(e, theta)
            now = turn_of_axis(e, vector(work.state.u[u0 + 3 :]))
            put(memory.a, u0 + 3, add(turned_about(e, -along, turning), now))
            p[0], p[1], p[2], p[3] = rotate_euler_parameters(p, across)
            theta = scaled(along, e)
        p[0], p[1], p[2], p[3] = rotate_euler_parameters(p, theta)
    keep_iterate(model, work, memory, h)


@inner
def angular_accelerations(model, work, memory, i, alpha_m, alpha_f):
    """Return the algorithmic angular acceleration of body i before and after the step, in axes that do not spin."""
    u0 = model.bodies.u0[i] + 3
    a, before, now = vector(memory.a[u0:]), vector(memory.u_dot[u0:]), vector(work.state.u_dot[u0:])
    if work.state.spins[i] != 0:
        e = spin_axis(model, i)
        turn, along = turn_of_axis(e, vector(memory.u[u0:])), dot(e, vector(work.state.theta[i]))
        a, before = sub(a, turn), sub(before, turn)
        now = turned_about(e, along, sub(now, turn_of_axis(e, vector(work.state.u[u0:]))))
    return a, next_acceleration(a, before, now, alpha_m, alpha_f)


@small
def next_of_unknown(a, before, now, alpha_m, alpha_f):
    """Return the algorithmic acceleration of an unknown after a step by (3)."""
    return ((1 - alpha_f) * now + alpha_f * before - alpha_m * a) / (1 - alpha_m)


@inner
def next_acceleration(a, before, now, alpha_m, alpha_f):
    """Return the algorithmic acceleration after a step by (3), for vectors in the same axes."""
    mean = add(scaled(1 - alpha_f, now), scaled(alpha_f, before))
    return scaled(1 / (1 - alpha_m), sub(mean, scaled(alpha_m, a)))


@inner
def keep_iterate(model, work, memory, h):
    """Write the iterate, except rotations, into the memory; count turns and add the work of a step of size h."""
    copy(work.state.r.reshape(memory.r.size), memory.r.reshape(memory.r.size))
    copy(work.state.q, memory.q)
    copy(work.state.u, memory.u)
    copy(work.state.u_dot, memory.u_dot)
    copy(work.state.w, memory.w)
    count_turns(model, work, memory, h)
    loads, dissipated = power(model, work)
    memory.work[GIVEN] += 0.5 * h * (memory.power[GIVEN] + loads)
    memory.work[TAKEN] += 0.5 * h * (memory.power[TAKEN] + dissipated)
    memory.power[GIVEN] = loads
    memory.power[TAKEN] = dissipated


@inner
def write_row(model, work, memory, t, rows):
    """Evaluate the state in the memory and write the next result row."""
    k = work.counted.rows
    work.state.time = t
    work.counted.rows += 1
    load_state(work.state, memory)
    evaluate(model, work, 1.0)
    rows.t[k] = t
    copy(memory.r.reshape(memory.r.size), rows.r[k].reshape(memory.r.size))
    copy(memory.p.reshape(memory.p.size), rows.p[k].reshape(memory.p.size))
    copy(memory.q, rows.q[k])
    copy(memory.u, rows.u[k])
    copy(memory.u_dot, rows.u_dot[k])
    copy(memory.w, rows.w[k])
    copy(memory.angle, rows.angle[k])
    diagnose(model, work, rows.diagnostics[k], rows.drift[k])
    rows.diagnostics[k, WORK_GIVEN] = memory.work[GIVEN]
    rows.diagnostics[k, WORK_TAKEN] = memory.work[TAKEN]
    for j in range(model.loads.marker.shape[0]):
        copy(work.markers.wrench[model.loads.marker[j]], rows.load[k, j])
    for j in range(model.body_loads.body.shape[0]):
        rows.load_case[k, j], _, _ = time_function(model.functions, model.body_loads.factor[j], t)
    if shares(model):
        work.solver.is_due = 1  # this overwrites the factors of the step
        if share_reactions(model, work, memory.h * memory.h):
            copy(work.state.w, rows.w[k])


@inner
def settle_row(model, work, memory, rows):
    """Compute accelerations and reactions of the last row from its positions and velocities.

    This is done for steps so short that these are noise otherwise: the reactions of a step close joint gaps, whose
    roundoff divided by h² is significant relative to the accelerations. Roundoff of velocities is not.
    """
    k = work.counted.rows - 1
    if not is_noise(model, work, memory.h):
        return
    load_state(work.state, memory)
    for s in range(model.states.row.shape[0]):
        work.states.base[s], work.states.rate_base[s] = memory.w[model.states.row[s]], 0.0
        work.states.kappa[s] = 0.0
    work.states.rho = 1.0
    copy(memory.w, work.state.w_start)
    evaluate(model, work, 1.0)
    work.solver.is_due = 1  # this overwrites the factors of the step
    if settle_accelerations(model, work, memory.h * memory.h):
        copy(work.state.u_dot, rows.u_dot[k])
        if not shares(model) or share_reactions(model, work, memory.h * memory.h):
            copy(work.state.w, rows.w[k])


@inner
def is_noise(model, work, h):
    """Whether roundoff of positions, divided by h², is significant relative to the accelerations."""
    is_held, noise, size = False, 0.0, math.sqrt(dot(model.gravity, model.gravity))
    for k in range(model.rows.holds.shape[0]):
        is_held = is_held or model.rows.holds[k] != NOTHING
    for i in range(model.bodies.kind.shape[0]):
        r, u, u_dot = work.state.r[i], work.state.u[model.bodies.u0[i] :], work.state.u_dot[model.bodies.u0[i] :]
        length, omega = model.bodies.size[i], vector(u[3:])
        noise = max(noise, length + abs(r[0]) + abs(r[1]) + abs(r[2]))
        turning = length * (dot(omega, omega) + math.sqrt(dot(u_dot[3:], u_dot[3:])))
        size = max(size, turning, math.sqrt(dot(u_dot, u_dot)))
    return is_held and ROUNDOFF * noise > NOISE * size * h * h


@inner
def shares(model):
    """Whether redundant constraints share their reactions."""
    for k in range(model.rows.soft.shape[0]):
        if model.rows.soft[k] > 0.0:
            return True
    return False


@inner
def ratio_of_steps(model, memory, h):
    """Return the ratio of h to the previous step size, by which the difference of `a` and u_dot is multiplied.

    It is zero if steps grow in a system with contacts. Then the difference is due to the contact and, in the directions
    of joints, to the scheme, and would grow with the step. So u_dot and a start again from the equations of motion.
    """
    if model.gaps.connection.shape[0] > 0 and h > memory.h:
        return 0.0
    return h / memory.h


@inner
def resize(model, work, memory, t, h):
    """Convert the algorithmic accelerations to those of a step of size h that ends at t.

    Their difference from u_dot is of first order in h. If they can start again from the equations of motion, the
    iterate must be the state in the memory.
    """
    ratio = ratio_of_steps(model, memory, h)
    if ratio == 0.0:
        work.state.time = t - h
        accelerate(model, work, memory)
    for k in range(memory.a.shape[0]):
        memory.a[k] = memory.u_dot[k] + ratio * (memory.a[k] - memory.u_dot[k])
    resize_states(model.states.row, memory, ratio)
    memory.h = h


@inner
def step_after(h, error, most_error, has_failed):
    """Return the next step size after an accepted step of size h; local errors grow with its cube."""
    if most_error <= 0.0:
        return h if has_failed else MOST * h
    fitting = MOST * h if error <= 0.0 else SAFETY * h * (most_error / error) ** (1.0 / 3.0)
    if fitting >= h and (has_failed or fitting < WORTH * h):
        return h
    return min(max(fitting, LEAST * h), MOST * h)


@inner
def keep_row(source, target, k):
    """Copy numbers into row k of an array."""
    for j in range(source.shape[0]):
        target[k, j] = source[j]


@inner
def keep_past(past, memory, a, h):
    """Store the memory after a step of size h with accelerations a, if there is space left."""
    k, target = past.n, past.memory
    if k >= target.h.shape[0]:
        return
    for i in range(memory.r.shape[0]):
        keep_row(memory.r[i], target.r[k], i)
        keep_row(memory.p[i], target.p[k], i)
    keep_row(memory.q, target.q, k)
    keep_row(memory.u, target.u, k)
    keep_row(memory.u_dot, target.u_dot, k)
    keep_row(a, target.a, k)
    keep_row(memory.w, target.w, k)
    keep_row(memory.work, target.work, k)
    keep_row(memory.power, target.power, k)
    keep_row(memory.angle, target.angle, k)
    keep_row(memory.angle_rate, target.angle_rate, k)
    target.h[k], target.h_next[k] = h, memory.h_next
    target.n_steps[k], target.n_rejected[k] = memory.n_steps, memory.n_rejected
    target.n_iterations[k] = memory.n_iterations
    past.n = k + 1


def time_loop(load, try_step, write):
    """Return the compiled loop over the steps of a formulation.

    Parameters
    ----------
    load
        (model, work, memory, others): write the iterate at the state in the memory, for gaps.
    try_step
        (model, work, memory, others, order, t, h): advance the memory to t by a step of size h, unless it fails or its
        error is too large; return (status, index of the singular body or connection, last correction divided by the
        allowed one, error).
    write
        (model, work, memory, others, t, rows): write the next row of the results, and return DONE or the status that
        states why there is none. others: further records of the formulation.
    """

    @inner
    def advance(model, work, memory, rows, others, order):
        """Advance by n_steps of size h, beginning with step `first` counted from t0; write a row every `every` steps.

        The order is an `entry.Order`. If h_min is positive, each of these steps is divided into equal parts of at most
        the wanted size. A part that fails, or whose error is above `most_error` (if positive), is repeated with a
        smaller size, down to h_min; later parts grow again. Contacts may require shorter parts.

        Return (status, steps done, rows written, index of the singular body or connection, last correction divided by
        the allowed one).
        """
        h, first, h_min, most_error = order.h, order.first, order.h_min, order.most_error
        put_weights(model, work, order.beta * memory.h**2)
        work.counted.rows = 0
        work.gaps.step = math.inf
        excess, has_gaps = 0.0, model.gaps.connection.shape[0] > 0
        for k in range(order.n_steps):
            end = order.t0 + (first + k + 1) * h
            left = h
            has_failed = False
            while left > 0.0:
                n_parts = 1.0
                if h_min > 0.0:
                    n_parts = max(1.0, math.ceil(left / memory.h_next * (1.0 - 1e-9)))
                part = left / n_parts
                if has_gaps:
                    load(model, work, memory, others)
                    shorter = max(step_before_contact(model, work, end - left, part), h_min)
                    if shorter < part:
                        part, n_parts = shorter, 2.0
                status, index, excess, error = try_step(model, work, memory, others, order, end - (left - part), part)
                if status == DONE:
                    memory.n_steps += 1
                    if work.counted.stopped > 0:
                        return STOPPED, k, work.counted.rows, work.counted.stopped - 1, excess
                    left = left - part if n_parts > 1.0 else 0.0
                    if h_min > 0.0:
                        wanted = step_after(part, error, most_error, has_failed)
                        if has_gaps and most_error <= 0.0 and work.gaps.n_closed == 0:
                            wanted = h  # an approaching contact is detected
                        memory.h_next = min(wanted, h, work.gaps.step)
                    has_failed = False
                    continue
                if h_min <= 0.0 or part <= h_min:
                    return status, k, work.counted.rows, index, excess
                memory.n_rejected += 1
                shorter = 0.5 * part
                if status == INACCURATE:
                    shorter = min(max(SAFETY * (most_error / error) ** (1.0 / 3.0), LEAST), SAFETY) * part
                elif status == UNRESOLVED:
                    shorter = work.gaps.step
                memory.h_next = max(shorter, h_min)
                has_failed = True
            if (first + k + 1) % order.every == 0:
                status = write(model, work, memory, others, end, rows)
                if status != DONE:
                    return status, k, work.counted.rows, work.counted.stopped - 1, excess
            keep_past(work.past, memory, memory.a, memory.h)
        return DONE, order.n_steps, work.counted.rows, -1, excess

    return advance


@inner
def is_resized(model, work, memory, order, h):
    """Whether the step size h differs from the previous one; the weights of the norm are updated to h."""
    if abs(h - memory.h) <= SAME * h:
        return False
    put_weights(model, work, order.beta * h * h)
    return True


@inner
def try_absolute_step(model, work, memory, others, order, t, h):
    """Advance the memory by a step of size h to t, see `time_loop`."""
    if is_resized(model, work, memory, order, h):
        resize(model, work, memory, t, h)
    work.state.time = t
    is_old, found = keeps_connections(model, work, h), one_step(model, work, memory, order, memory.h)
    if found[0] == DIVERGED and is_old:  # all factors are renewed now
        found = one_step(model, work, memory, order, memory.h)
    return found


@inner
def write_absolute_row(model, work, memory, others, t, rows):
    """Write the next row of the results."""
    write_row(model, work, memory, t, rows)
    settle_row(model, work, memory, rows)
    return DONE


@inner
def load_memory(model, work, memory, others):
    """Write the state in the memory into the iterate."""
    load_state(work.state, memory)


advance = time_loop(load_memory, try_absolute_step, write_absolute_row)
