"""Time loop of the generalized-alpha method in relative coordinates.

The memory between steps is absolute (`kernels.memory.Memory`), except for the algorithmic accelerations, which are
those of the unknowns; `Tree.slot` has their indices. Each step first computes the joint motion from the body motion.

Described in `floatframe.integrators.relative`.
"""

import math

from floatframe.engine.kernels.body import modal_term
from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.connections.connection import write_velocity_gaps
from floatframe.engine.kernels.connections.user_force import resize_states
from floatframe.engine.kernels.generalized_alpha import (
    DIVERGED,
    DONE,
    INACCURATE,
    MOST_TURN,
    OFF_AXIS,
    SINGULAR,
    SLOW,
    TURNED,
    UNRESOLVED,
    add_reactions,
    correction_of_states,
    error_factor,
    is_enough,
    is_resized,
    is_too_long,
    keep_iterate,
    load_memory,
    load_state,
    mean_square,
    newton_weights,
    next_of_unknown,
    ratio_of_steps,
    roundoff_floor,
    settle_row,
    time_loop,
    wanted_correction,
    write_row,
)
from floatframe.engine.kernels.model import STIFFNESS
from floatframe.engine.kernels.rotation import quaternion_of
from floatframe.engine.kernels.step_start import hold_states
from floatframe.engine.kernels.vector import (
    add,
    copy,
    cross,
    dot,
    matrix,
    norm,
    put,
    put_matrix,
    put_sum,
    scaled,
    sub,
    turned,
    vector,
)
from floatframe.engine.tree.kernels.accelerations import accelerate
from floatframe.engine.tree.kernels.evaluation import evaluate_placed, evaluate_tree
from floatframe.engine.tree.kernels.kept_factors import factorize_poses, keep_bodies, solve_kept
from floatframe.engine.tree.kernels.kinematics import joint_motion, move_joints, place_bodies
from floatframe.engine.tree.kernels.predictor import learn, predict
from floatframe.engine.tree.kernels.projection import put_reactions
from floatframe.engine.tree.kernels.spins import (
    change_spin,
    first_rotation,
    put_spin_acceleration,
    spin_jump,
    turning_by_columns,
)
from floatframe.engine.tree.kernels.tangent import write_tangent
from floatframe.engine.tree.kernels.tree_factors import factorize_tree, solve_newton, solve_wrenches
from floatframe.engine.tree.kernels.weights import sizes_of_step, squared_size, weigh

__all__ = ["advance_tree", "correct", "renew", "write_tree_row"]

MANY = 4  # number of iterations of a step after which the next one starts with new factors
EXACT_STEPS = 4  # number of steps with exact matrices after the reused ones have failed
FAR_SPIN = 0.2  # rotation [rad] in a step of a body with separate spin, above which steps use exact matrices
MOST_PATIENCE = 31  # number of steps with their own factors before older factors are tried again


@inner
def begin(model, work, tree, joints, memory):
    """Set the iterate from the memory; compute the joint motion at the start of a step if it is unknown."""
    load_state(work.state, memory)
    if joints.is_known == 0:
        joint_motion(model, work, tree, joints)
        start_here(tree, joints)
    joints.x[:] = 0.0
    joints.spins[:] = 0


@inner
def start_here(tree, joints):
    """Copy the present joint motion to the beginning of the step."""
    for i in range(tree.parent.shape[0]):
        put(joints.d_start[i], 0, vector(joints.d[i]))
        put_matrix(joints.Q_start[i], matrix(joints.Q[i]))
    copy(joints.rate, joints.rate_start)
    copy(joints.acceleration, joints.acceleration_start)
    joints.is_known = 1


@inner
def resize(model, work, tree, joints, tangent, memory, t, h):
    """Convert algorithmic accelerations to a step of size h that ends at t; iterate and joints match the memory."""
    ratio = ratio_of_steps(model, memory, h)
    if ratio == 0.0:
        begin_anew(model, work, tree, joints, tangent, memory, t - h)
    for s in range(tree.slot.shape[0]):
        k = tree.slot[s]
        now = memory.u_dot[k] if tree.mode[s] >= 0 else joints.acceleration_start[tree.column[s]]
        memory.a[k] = now + ratio * (memory.a[k] - now)
    resize_states(model.states.row, memory, ratio)
    memory.h = h


@inner
def begin_anew(model, work, tree, joints, tangent, memory, t):
    """Restart with the accelerations that the equations of motion give at the state in the memory, if they exist."""
    work.state.time = t
    hold_states(model, work, memory)
    if accelerate(model, work, tree, joints, tangent):
        copy(joints.acceleration, joints.acceleration_start)
        copy(work.state.u_dot, memory.u_dot)
    begin(model, work, tree, joints, memory)


@inner
def renew(model, work, tree, joints, tangent, weights):
    """Renew the factors of the Newton matrix; return whether it is regular.

    The factors are exact if wrenches are kept or `tangent.exactly` requires it, otherwise those of
    `kernels.kept_factors`.
    """
    _, c_d, c_k = weights
    weigh(model, work, tree, joints, tangent)
    if tangent.V.shape[0] > 0 or tangent.exactly > 0:
        tangent.is_exact, tangent.is_kept = 1, 0
        write_tangent(model, work, tree, joints, tangent, weights)
        return factorize_tree(model, work, tree, tangent, c_d, c_k)
    tangent.is_exact = 0
    if tangent.is_kept == 0:
        keep_bodies(model, work, tree, weights)
        tangent.is_kept = 1
    if factorize_poses(model, work, tree, joints, tangent, c_d, c_k):
        return True
    tangent.exactly = EXACT_STEPS
    tangent.is_exact, tangent.is_kept = 1, 0
    write_tangent(model, work, tree, joints, tangent, weights)
    return factorize_tree(model, work, tree, tangent, c_d, c_k)


@inner
def correct(model, work, tree, joints, tangent, c_k):
    """Write the corrections for the residual of the iterate, with the factors from `renew`."""
    if tangent.is_exact != 0:
        solve_newton(work, tree, joints, tangent, c_k)
    else:
        solve_kept(model, tree, joints, tangent, c_k)


@inner
def spins_far(tree, joints):
    """Whether a body spins too far in the step for factors without gyroscopic terms."""
    for i in range(joints.spins.shape[0]):
        if joints.spins[i] != 0:
            if abs(dot(vector(tree.spin_axis[i]), vector(joints.x[first_rotation(tree, i) :]))) > FAR_SPIN:
                return True
    return False


@inner
def turns_too_far(work, tree, joints, length):
    """Return the first body in a loop, or -1, whose joint rotates it by more than `MOST_TURN` in the step.

    Rotations of any size are correct if they are prescribed, or if the marker at which the loop leaves the body is on
    the axis of rotation.
    """
    for e in range(tree.loop_body.shape[0]):
        i = tree.loop_body[e]
        theta = (0.0, 0.0, 0.0)
        for k in range(tree.column0[i], tree.column0[i + 1]):
            if tree.unknown[k] >= 0:
                theta = add(theta, scaled(joints.x[k], vector(joints.a[k])))
        turn = norm(theta)
        if turn > MOST_TURN:
            origin = vector(work.state.r[i]) if tree.far[i] < 0 else vector(work.markers.r[tree.far[i]])
            arm = sub(vector(work.markers.r[tree.loop_marker[e]]), origin)
            if norm(cross(theta, arm)) > OFF_AXIS * length * turn:
                put(work.state.theta[i], 0, theta)
                return i
    return -1


@inner
def hold_velocities(model, work, tree, joints, tangent, by_rate, by_acceleration, c_k):
    """Add the rate correction that closes position constraints in velocity; return its squared norm.

    Like `kernels.generalized_alpha.hold_velocities`, for the unknowns s_dot and the constraints of kept joints and
    couplers.
    """
    step, mu = tangent.step, work.solver.mu
    step[:] = 0.0
    tangent.mu[:] = 0.0
    for e in range(tree.held.shape[0]):
        c = tree.held[e]
        write_velocity_gaps(model, work, c, 1.0 / by_rate, mu)
        for k in range(model.connections.w0[c], model.connections.w0[c + 1]):
            tangent.mu[tree.kept_row[k]] = mu[k]
    solve_wrenches(tangent)
    turn_at_once(tree, joints, step)
    total = squared_size(model, work, tree, tangent)
    change_joints(work, tree, joints, step, 0.0, by_rate, by_acceleration)
    for i in range(tree.parent.shape[0]):
        t, n, m0, end = model.bodies.kind[i], model.bodies.n_q[i], tree.m0[i], tree.s0[i + 1]
        modal_term(model.body_types, t, n, STIFFNESS, -1.0, step[m0:end], joints.residual[m0:end])
    for k in range(tree.kept_row.shape[0]):
        mu[k] = tangent.mu[tree.kept_row[k]] if tree.kept_row[k] >= 0 else 0.0
    add_reactions(model, work, c_k)
    return total


@inner
def turn_at_once(tree, joints, step):
    """Convert changes x of columns fixed in B to a rotation vector of B, as rates are defined."""
    for i in range(tree.parent.shape[0]):
        change, is_turned = (0.0, 0.0, 0.0), False
        for k in range(tree.column0[i], tree.column0[i + 1]):
            if tree.side[k] != 0 and tree.unknown[k] >= 0:
                change, is_turned = add(change, scaled(step[tree.unknown[k]], vector(tree.alpha[k]))), True
        if is_turned:
            turn = turned(turning_by_columns(tree, joints, i), change)
            for k in range(tree.column0[i], tree.column0[i + 1]):
                if tree.side[k] != 0 and tree.unknown[k] >= 0:
                    step[tree.unknown[k]] = dot(vector(tree.alpha[k]), turn)


@inner
def change_joints(work, tree, joints, step, by_x, by_rate, by_acceleration):
    """Add multiples of a correction to joint increments, and to rates and accelerations of all unknowns."""
    for i in range(tree.parent.shape[0]):
        end = tree.column0[i + 1]
        if joints.spins[i] != 0:
            end = first_rotation(tree, i)
            change_spin(tree, joints, step, i, by_x, by_rate, by_acceleration)
        for k in range(tree.column0[i], end):
            s = tree.unknown[k]
            if s >= 0:
                joints.x[k] += by_x * step[s]
                joints.rate[k] += by_rate * step[s]
                joints.acceleration[k] += by_acceleration * step[s]
        for s in range(tree.m0[i], tree.s0[i + 1]):
            work.state.u[tree.slot[s]] += by_rate * step[s]
            work.state.u_dot[tree.slot[s]] += by_acceleration * step[s]


@inner
def update(model, work, tree, joints, tangent, by_rate, by_acceleration, c_k):
    """Add the correction to the iterate; return its squared norm."""
    total, step, state = squared_size(model, work, tree, tangent), tangent.step, work.state
    for s in range(tree.slot.shape[0]):
        if tree.mode[s] >= 0:
            state.q[tree.mode[s]] += step[s]
    change_joints(work, tree, joints, step, 1.0, by_rate, by_acceleration)
    for k in range(tree.kept_row.shape[0]):
        work.solver.mu[k] = tangent.mu[tree.kept_row[k]] if tree.kept_row[k] >= 0 else 0.0
        state.w[k] += work.solver.mu[k] / c_k
    move_joints(tree, joints)
    place_bodies(model, work, tree, joints)
    return total


@inner
def local_error(model, work, tree, joints, tangent, memory, order, h):
    """Return the estimated error of a converged step's increment, as in the absolute formulation.

    Accelerations of bodies are affine in those of the unknowns. Therefore the changes of the unknowns' accelerations in
    the step are added to these for a moment, which gives the changes for the bodies.
    """
    alpha_m, alpha_f, u_dot = order.alpha_m, order.alpha_f, work.state.u_dot
    for i in range(tree.parent.shape[0]):
        copy(u_dot[model.bodies.u0[i] : model.bodies.u0[i] + 6], tangent.X[i])
    for s in range(tree.slot.shape[0]):
        now, before = accelerations(work, tree, joints, memory, s)
        a = memory.a[tree.slot[s]]
        jump = next_of_unknown(a, before, now, alpha_m, alpha_f) - a
        tangent.step[s] = now
        put_acceleration(work, tree, joints, s, now + jump)
    for i in range(tree.parent.shape[0]):
        if joints.spins[i] != 0:
            k = first_rotation(tree, i)
            now = vector(tangent.step[tree.unknown[k] :])
            put(joints.acceleration, k, now)
            put_sum(joints.acceleration, k, spin_jump(tree, joints, memory, i, alpha_m, alpha_f))
    place_bodies(model, work, tree, joints)
    largest = 0.0
    for i in range(tree.parent.shape[0]):
        u0, n = model.bodies.u0[i], model.bodies.n_q[i]
        change = work.bodies.velocity[: 6 + n]
        for k in range(6):
            change[k] = u_dot[u0 + k] - tangent.X[i, k]
        for k in range(n):
            change[6 + k] = u_dot[u0 + 6 + k] - tangent.step[tree.m0[i] + k]
        largest = max(largest, mean_square(model, work, i, change))
    for s in range(tree.slot.shape[0]):
        put_acceleration(work, tree, joints, s, tangent.step[s])
    place_bodies(model, work, tree, joints)
    return error_factor(order, h) * math.sqrt(largest)


@inner
def put_acceleration(work, tree, joints, s, value):
    """Write the acceleration of an unknown."""
    if tree.column[s] >= 0:
        joints.acceleration[tree.column[s]] = value
    else:
        work.state.u_dot[tree.slot[s]] = value


@inner
def accelerations(work, tree, joints, memory, s):
    """Return an unknown's acceleration at the iterate and at the beginning of the step."""
    k = tree.column[s]
    if k >= 0:
        return joints.acceleration[k], joints.acceleration_start[k]
    return work.state.u_dot[tree.slot[s]], memory.u_dot[tree.slot[s]]


@inner
def one_step(model, work, memory, tree, joints, tangent, order, h):
    """Advance the memory by one step, unless the estimated error is larger than allowed.

    Return (status, body that rotates too far, last correction divided by the allowed one, error or -1 if it is not
    estimated).

    Factors of an earlier step are used as long as corrections shrink fast with them. Otherwise the step restarts with
    its own factors. The more often this happens, the more of the following steps use their own factors from the
    beginning (as for long chains, whose mass matrix changes much with their shape). If the step still does not
    converge, it restarts again with exact factors in every iteration, because an iterate that approximate factors have
    led far away does not return.
    """
    weights = newton_weights(order, h)
    c_m, c_d, c_k = weights
    work.counted.no_number = 0
    work.counted.stopped = 0
    last, last_of_states, excess, wanted, allowed = math.inf, math.inf, math.inf, 0.0, 0.0
    solver, iteration = work.solver, 0
    if solver.c_m != c_m or solver.c_d != c_d or solver.c_k != c_k:
        work.solver.is_due = 1
        tangent.patience, tangent.left, tangent.is_kept, tangent.exactly = 0, 0, 0, 0
        tangent.n_known = 0
    elif tangent.left > 0:
        work.solver.is_due = 1
        tangent.left -= 1
    if tangent.exactly > 0:
        tangent.exactly -= 1
    is_last_try = False
    predict(model, work, tree, joints, tangent, memory, order, h)
    holds = order.stabilized != 0 and tree.held.shape[0] > 0
    if holds:  # the correction of velocities needs new factors
        work.solver.is_due = 1
    if spins_far(tree, joints):
        tangent.exactly = max(tangent.exactly, 1)
        work.solver.is_due = 1
    # iterations at which factors were renewed, or the step was restarted
    is_old, made, begun = work.solver.is_due == 0, -1, 0
    factorisations = work.counted.factorisations
    is_open = tangent.V.shape[0] == 0  # no kept wrenches, which the norm does not include
    has_states = model.states.row.shape[0] + model.laws.equation.shape[0] > 0
    while iteration < order.max_iterations:
        evaluate_placed(model, work, tree, joints, c_k)
        if iteration == 0 and order.stabilized != 0:
            body = turns_too_far(work, tree, joints, order.length)
            if body >= 0:
                return TURNED, body, excess, -1.0
        if work.solver.is_due == 1:
            made = iteration
            work.counted.factorisations += 1
            work.solver.is_due = 0
            solver.c_m, solver.c_d, solver.c_k = c_m, c_d, c_k
            if not renew(model, work, tree, joints, tangent, weights):
                work.solver.is_due = 1
                return SINGULAR, -1, excess, -1.0
        of_rates = 0.0
        if holds:
            of_rates = hold_velocities(model, work, tree, joints, tangent, c_d / c_k, c_m / c_k, c_k)
        correct(model, work, tree, joints, tangent, c_k)
        if iteration == 0:
            size, size_x = sizes_of_step(work, memory, h)
            wanted = wanted_correction(model, order, c_k, size, size_x)
            allowed = wanted + roundoff_floor(model, work.state.r, order.length)
        norm = math.sqrt(of_rates + update(model, work, tree, joints, tangent, c_d / c_k, c_m / c_k, c_k))
        memory.n_iterations += 1
        if is_old and work.counted.factorisations > factorisations:
            is_old = False
        is_lost = is_old and not norm <= max(SLOW * last, allowed)
        if is_lost:
            is_old = False
            tangent.patience = min(2 * tangent.patience + 1, MOST_PATIENCE)
            tangent.left = tangent.patience
        elif (
            tangent.is_exact == 0
            and not norm <= last
            and (begun < made < iteration or iteration < begun + 2 or not math.isfinite(norm))
        ):
            is_lost, tangent.exactly, tangent.n_known = True, EXACT_STEPS, 0
        if is_lost:
            work.solver.is_due = 1
            predict(model, work, tree, joints, tangent, memory, order, h)
            last, last_of_states = math.inf, math.inf
            iteration += 1
            begun = iteration
            continue
        if not math.isfinite(norm) and is_last_try:
            work.solver.is_due = 1
            return DIVERGED, -1, math.inf, -1.0
        excess = norm / allowed if allowed > 0.0 else math.inf
        of_states = 0.0
        if has_states:
            of_states = correction_of_states(model, work, c_k) / order.tolerance
            if not math.isfinite(of_states) and is_last_try:
                work.solver.is_due = 1
                return DIVERGED, -1, math.inf, -1.0
        is_small = is_enough(norm, last, wanted, allowed) if is_open else norm <= allowed
        is_small = is_small or (norm <= 1e3 * allowed and norm > 0.5 * last and iteration > 2)
        if is_small and (of_states <= 1.0 or (of_states <= 1e3 and of_states > 0.5 * last_of_states and iteration > 2)):
            if iteration >= MANY:
                work.solver.is_due = 1
            error = -1.0
            if is_too_long(model, work, h):
                return UNRESOLVED, -1, excess, error
            if order.most_error > 0.0:
                error = local_error(model, work, tree, joints, tangent, memory, order, h)
                if not error <= order.most_error:
                    return INACCURATE, -1, excess, error
            if iteration == 0 and not is_open:  # reactions are those of kept wrenches before their correction
                evaluate_placed(model, work, tree, joints, c_k)
            accept(model, work, memory, tree, joints, order, h)
            return DONE, -1, excess, error
        if norm > SLOW * last and not is_small and (tangent.is_exact != 0 or made < iteration):
            work.solver.is_due = 1
            if tangent.is_exact == 0:
                tangent.is_kept = 0
                if begun < made < iteration:  # even factors of an iterate near the solution are not accurate enough
                    tangent.exactly = EXACT_STEPS
        if of_states > max(1.0, SLOW * last_of_states) or iteration >= MANY:
            work.solver.is_due = 1
        last, last_of_states = norm, of_states
        excess = max(excess, of_states)
        iteration += 1
        if not is_last_try and (iteration == order.max_iterations or not math.isfinite(norm + of_states)):
            is_last_try, is_old, tangent.exactly, tangent.n_known = True, False, EXACT_STEPS, 0
            predict(model, work, tree, joints, tangent, memory, order, h)
            last, last_of_states, iteration, begun, made = math.inf, math.inf, 0, 0, -1
        if is_last_try:
            work.solver.is_due = 1
    work.solver.is_due = 1
    return DIVERGED, -1, excess, -1.0


@inner
def accept(model, work, memory, tree, joints, order, h):
    """(3): write the iterate and the new algorithmic accelerations into the memory."""
    alpha_m, alpha_f = order.alpha_m, order.alpha_f
    put_reactions(model, work, tree, joints)
    for i in range(tree.parent.shape[0]):
        s0, end = tree.s0[i], tree.m0[i]
        if joints.spins[i] != 0:
            end = tree.unknown[first_rotation(tree, i)]
            put_spin_acceleration(tree, joints, memory, i, alpha_m, alpha_f)
        for s in range(s0, tree.s0[i + 1]):
            if s < end or s >= tree.m0[i]:
                now, before = accelerations(work, tree, joints, memory, s)
                slot = tree.slot[s]
                memory.a[slot] = next_of_unknown(memory.a[slot], before, now, alpha_m, alpha_f)
    for i in range(model.bodies.kind.shape[0]):
        put_euler_parameters(work.state.R[i], memory.p[i])
    keep_iterate(model, work, memory, h)
    start_here(tree, joints)


@inner
def put_euler_parameters(R, p):
    """Write the Euler parameters of a rotation matrix, with the sign closer to the present values."""
    w, x = quaternion_of(matrix(R))
    along = w * p[0] + dot(x, p[1:])
    scale = (1.0 if along >= 0.0 else -1.0) / math.sqrt(w * w + dot(x, x))
    p[0] = scale * w
    put(p, 1, scaled(scale, x))


@inner
def write_tree_row(model, work, memory, tree, joints, t, rows):
    """Write the next result row, with reactions of the tree joints computed at the state in the memory."""
    work.state.time = t
    begin(model, work, tree, joints, memory)
    evaluate_tree(model, work, tree, joints, 1.0)
    put_reactions(model, work, tree, joints)
    copy(work.state.w, memory.w)
    write_row(model, work, memory, t, rows)


@inner
def try_tree_step(model, work, memory, others, order, t, h):
    """Advance the memory by a step of size h to t, see `kernels.generalized_alpha.time_loop`."""
    tree, joints, tangent = others
    begin(model, work, tree, joints, memory)
    if is_resized(model, work, memory, order, h):
        resize(model, work, tree, joints, tangent, memory, t, h)
        tangent.n_known = 0
    work.state.time = t
    status, body, excess, error = one_step(model, work, memory, tree, joints, tangent, order, memory.h)
    if status == DONE:
        learn(tree, tangent, memory)
    return status, body, excess, error


@inner
def write_next_row(model, work, memory, others, t, rows):
    """Write the next result row.

    In loops the gaps have roundoff errors, like those of all joints in absolute coordinates.
    """
    tree, joints, tangent = others
    write_tree_row(model, work, memory, tree, joints, t, rows)
    if tree.kept.shape[0] > 0:
        settle_row(model, work, memory, rows)
    if work.solver.is_due == 1:
        tangent.is_kept = 0  # this overwrites its factors of the bodies
    return DONE


advance_tree = time_loop(load_memory, try_tree_step, write_next_row)
