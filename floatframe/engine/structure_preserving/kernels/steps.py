"""Steps of the conserving and variational schemes in a compiled time loop.

Described in `floatframe.integrators.energy_momentum`, `floatframe.integrators.variational`.
"""

from floatframe.engine.kernels.compiler.compilation import entry, inner
from floatframe.engine.kernels.compiler.structure import converter
from floatframe.engine.kernels.connections.contact import contact_gap
from floatframe.engine.kernels.connections.gap import next_step
from floatframe.engine.kernels.diagnostics import quadratic
from floatframe.engine.kernels.entry import CompiledEntry, Order
from floatframe.engine.kernels.generalized_alpha import (
    DONE,
    NO_ACCELERATION,
    STOPPED,
    UNRESOLVED,
    load_state,
    time_loop,
)
from floatframe.engine.kernels.memory import GIVEN, TAKEN, Memory, Rows
from floatframe.engine.kernels.model import DAMPING, Model
from floatframe.engine.kernels.turns import count_turns
from floatframe.engine.kernels.vector import (
    add,
    copy,
    cross,
    dot,
    matrix,
    put,
    scaled,
    sub,
    turned,
    turned_back,
    vector,
)
from floatframe.engine.kernels.work import Work
from floatframe.engine.structure_preserving.kernels.bodies import (
    begin_bodies,
    end_rates,
    interval,
    keep_bodies,
    move_bodies,
)
from floatframe.engine.structure_preserving.kernels.connections.public_elements import element_gap
from floatframe.engine.structure_preserving.kernels.deformed_lines import begin_lines
from floatframe.engine.structure_preserving.kernels.held_rows import row_change
from floatframe.engine.structure_preserving.kernels.markers import begin_markers, marker_loads
from floatframe.engine.structure_preserving.kernels.memory import expect_angles, keep, recall, remember
from floatframe.engine.structure_preserving.kernels.newton import (
    add_loads,
    move,
    solve,
)
from floatframe.engine.structure_preserving.kernels.observation import observe
from floatframe.engine.structure_preserving.kernels.records import CONSERVING, Discrete, StepWork

__all__ = ["advance", "discrete_kernels"]


# steps ----------------------------------------------------------------------------------------------------------------


# factor per step by which the stored size of a multiplier without constraint falls while the multiplier is small
FADING = 0.9


@inner
def guess(model, step):
    """Write Newton's initial guess of increments and multipliers, with constant accelerations."""
    h, n_u = step.h, step.load.shape[0]
    for k in range(n_u):
        step.z[k] = h * (step.w_0[k] + 0.5 * h * step.acceleration[k])
    for i in range(model.bodies.kind.shape[0]):
        u0, R = model.bodies.u0[i], matrix(step.R_0[i])
        v = scaled(h, turned_back(R, vector(step.w_0[u0:])))
        put(step.z, u0, add(v, scaled(0.5 * h * h, vector(step.acceleration[u0:]))))
    for j in range(step.f.shape[0]):
        step.z[n_u + j] = 0.5 * h * h * step.f_kept[j]
    for s in range(model.states.row.shape[0]):
        step.z[n_u + step.f.shape[0] + s] = h * step.known[model.states.row[s] + 1]


@inner
def learn(model, discrete, step):
    """Store the velocity change over the step for the next guess, v in body axes, and the multiplier sizes."""
    for i in range(model.bodies.kind.shape[0]):
        u0, n, R = model.bodies.u0[i], model.bodies.n_q[i], matrix(step.R_0[i])
        dv = turned_back(R, sub(vector(step.w_1[u0:]), vector(step.w_0[u0:])))
        put(step.acceleration, u0, scaled(1.0 / step.h, dv))
        for k in range(u0 + 3, u0 + 6 + n):
            step.acceleration[k] = (step.w_1[k] - step.w_0[k]) / step.h
    copy(step.f, step.f_kept)
    for e in range(discrete.equation.shape[0]):
        j = discrete.equation[e]
        step.f_size[j] = max(FADING * step.f_size[j], abs(step.f[j]))


@inner
def work_of_dampers(model, work, step):
    """Return the work dissipated by modal damping."""
    total = 0.0
    for i in range(model.bodies.kind.shape[0]):
        total += quadratic(model, work, i, DAMPING, step.dq[model.bodies.q0[i] : model.bodies.q0[i + 1]])
    return total / step.h


@inner
def add_drives(model, discrete, step):
    """Add the work of prescribed motions, computed from their multipliers, to the supplied work."""
    for c in range(model.connections.size.shape[0]):
        for j in range(discrete.first[c], discrete.first[c + 1]):
            if discrete.is_driven[j]:
                step.given += step.f[j] * row_change(model, discrete, step, c, discrete.row[j])


@inner
def begin(model, discrete, step, memory):
    """Write the known quantities at the start of the step."""
    recall(memory, step)
    expect_angles(memory, step)
    begin_bodies(model, step, memory)
    begin_markers(model, discrete, step)
    begin_lines(model, step)


@inner
def solve_both_ways(model, work, discrete, step, order, stage):
    """Solve for the unknowns with the stored factors; if that fails, with new factors in each iteration."""
    guess(model, step)
    status = solve(model, work, discrete, step, order, stage, False)
    if status != DONE:
        guess(model, step)
        status = solve(model, work, discrete, step, order, stage, True)
    return status


@inner
def conserving_step(model, work, discrete, step, memory, order):
    """Advance the memory by one conserving or decaying step; return the status."""
    step.t_force, step.is_still, step.is_closing = 0.5 * (step.t_0 + step.end.state.time), 0, 0
    begin(model, discrete, step, memory)
    status = solve_both_ways(model, work, discrete, step, order, 0)
    if status != DONE:
        return status
    take_multipliers(step)
    move(model, discrete, step)
    if is_too_long(model, work, discrete, step):
        return UNRESOLVED
    step.given, step.taken = 0.0, 0.0
    work.counted.stopped = 0
    if discrete.is_loaded:
        add_loads(model, work, discrete, step)
        add_drives(model, discrete, step)
    for i in range(model.bodies.kind.shape[0]):
        end_rates(model, discrete, step, i)
    memory.work[GIVEN] += step.given
    memory.work[TAKEN] += step.taken + work_of_dampers(model, work, step)
    learn(model, discrete, step)
    remember(model, discrete, step)
    keep(discrete, step, memory)
    move_bodies(model, step)
    keep_bodies(model, step, memory)
    return status


@inner
def take_multipliers(step):
    """Copy the multipliers from the vector of unknowns."""
    n_u = step.load.shape[0]
    for j in range(step.f.shape[0]):
        step.f[j] = 2.0 * step.z[n_u + j] / (step.h * step.h)


@inner
def variational_step(model, work, discrete, step, memory, order):
    """Advance the memory by one variational step; return the status."""
    step.t_force, step.is_still, step.is_closing = step.t_0, 1, 0
    h = step.h
    begin(model, discrete, step, memory)
    status = solve_both_ways(model, work, discrete, step, order, 0)
    if status != DONE:
        return status
    take_multipliers(step)
    move(model, discrete, step)
    if is_too_long(model, work, discrete, step):
        return UNRESOLVED
    work.counted.stopped = 0
    add_loads(model, work, discrete, step)
    add_drives(model, discrete, step)
    dampers = work_of_dampers(model, work, step)
    given, taken = step.given, step.taken
    copy(step.f, step.kept)  # the initial guess of the next step
    remember(model, discrete, step)
    for i in range(model.bodies.kind.shape[0]):
        interval(model, discrete, step, i)
        copy(step.force[: model.bodies.n_q[i]], step.elastic[model.bodies.u0[i] + 6 :])
    move_bodies(model, step)
    step.t_force = step.end.state.time
    expect_angles(memory, step)
    step.is_closing = 1
    begin_markers(model, discrete, step)
    begin_lines(model, step)
    move(model, discrete, step)
    add_loads(model, work, discrete, step)
    for m in range(model.markers.body.shape[0]):
        marker_loads(model, discrete, step, m)
    given, taken = given + step.given, taken + step.taken
    step.f[:] = 0.0
    for c in range(model.connections.size.shape[0]):
        for j in range(discrete.first[c], discrete.first[c + 1]):
            if discrete.is_driven[j]:
                step.change[j] = row_change(model, discrete, step, c, discrete.row[j])
    for i in range(model.bodies.kind.shape[0]):
        u0, n, R = model.bodies.u0[i], model.bodies.n_q[i], matrix(step.R_0[i])
        m, theta, Pi = model.body_types.mass[model.bodies.kind[i]], vector(step.z[u0 + 3 :]), vector(step.P_1[u0 + 3 :])
        force, torque = vector(step.load[u0:]), turned_back(R, vector(step.load[u0 + 3 :]))
        put(step.P_0, u0, add(scaled(m / h, vector(step.d[i])), scaled(0.5 * h, force)))
        turning = add(sub(Pi, scaled(0.5, cross(theta, Pi))), scaled(0.25 * dot(theta, Pi), theta))
        put(step.P_0, u0 + 3, add(turning, scaled(0.5 * h, torque)))
        for k in range(u0 + 6, u0 + 6 + n):
            step.P_0[k] = step.P_1[k] + 0.5 * h * (step.elastic[k] + step.load[k])
    step.is_closing = 2
    status = solve(model, work, discrete, step, order, 1, False)
    if status != DONE:
        step.z[:] = 0.0
        status = solve(model, work, discrete, step, order, 1, True)
        if status != DONE:
            return status
    take_multipliers(step)
    for j in range(step.f.shape[0]):
        if discrete.is_driven[j]:
            given += step.f[j] * step.change[j]
    for i in range(model.bodies.kind.shape[0]):
        u0, n, R = model.bodies.u0[i], model.bodies.n_q[i], matrix(step.R_0[i])
        put(step.w_1, u0, scaled(1.0 / h, turned(R, vector(step.z[u0:]))))
        for k in range(u0 + 3, u0 + 6 + n):
            step.w_1[k] = step.z[k] / h
    memory.work[GIVEN] += 0.5 * given
    memory.work[TAKEN] += 0.5 * taken + dampers
    learn(model, discrete, step)
    copy(step.kept, step.f_kept)
    keep(discrete, step, memory)
    keep_bodies(model, step, memory)
    return status


@inner
def is_too_long(model, work, discrete, step):
    """Whether the step that was just solved is too long for a contact; see `kernels.connections.gap`."""
    if model.gaps.connection.shape[0] == 0:
        return False
    for g in range(model.gaps.connection.shape[0]):
        if model.gaps.output[g] < 0:
            work.gaps.end[g] = contact_gap(model, step.end.markers.r, step.end.markers.A, model.gaps.connection[g])
        else:
            work.gaps.end[g] = element_gap(model, work, discrete, step, g)
    return next_step(model, work, step.t_0, step.h) < step.h


@inner
def begin_iterate(model, work, memory, others):
    """Set the iterate from the state in the memory, with the mean accelerations of the previous step.

    The accelerations in the memory are not used: they belong to the last output, and outputs must not change a motion.
    """
    _, step = others
    load_state(work.state, memory)
    for i in range(model.bodies.kind.shape[0]):
        t, n, u0 = model.bodies.kind[i], model.bodies.n_q[i], model.bodies.u0[i]
        s, omega = scaled(1.0 / model.body_types.mass[t], vector(model.body_types.S[t])), vector(memory.u[u0 + 3 :])
        of_center = add(cross(vector(step.acceleration[u0 + 3 :]), s), cross(omega, cross(omega, s)))
        put(work.state.u_dot, u0, turned(work.state.R[i], sub(vector(step.acceleration[u0:]), of_center)))
        for k in range(u0 + 3, u0 + 6 + n):
            work.state.u_dot[k] = step.acceleration[k]


@inner
def take_size(step, h):
    """Set the step size."""
    if step.h != h:
        step.h = h
        step.is_due[0], step.is_due[1] = 1, 1


@inner
def try_discrete_step(model, work, memory, others, order, t, h):
    """Advance the memory by a step of size h to t, see `kernels.generalized_alpha.time_loop`."""
    discrete, step = others
    work.counted.no_number = 0
    step.t_0, step.end.state.time = t - h, t
    take_size(step, h)
    if discrete.scheme == CONSERVING:
        status = conserving_step(model, work, discrete, step, memory, order)
    else:
        status = variational_step(model, work, discrete, step, memory, order)
    memory.n_iterations += step.n_iterations
    step.n_iterations = 0
    if status == DONE:
        count_angles(model, work, memory, h)
        copy(step.f_kept, memory.a)
        memory.h = order.h
    return status, -1, step.excess, -1.0


@inner
def write_discrete_row(model, work, memory, others, t, rows):
    """Write the next row of the results.

    A step is good only if its output can be computed. After NO_ACCELERATION the memory is therefore one step beyond the
    last good step. The row at the end of a step that ends the run is written too.
    """
    discrete, step = others
    if not observe(model, work, discrete, step, memory, t, rows):
        return NO_ACCELERATION
    if work.counted.stopped > 0:
        work.counted.rows -= 1
        return STOPPED
    return DONE


@inner
def count_angles(model, work, memory, h):
    """Continue the count of full turns."""
    if memory.angle.shape[0] == 0:
        return
    load_state(work.state, memory)
    count_turns(model, work, memory, h)


advance = time_loop(begin_iterate, try_discrete_step, write_discrete_row)

# the compiled entry of the conserving and variational schemes; compiled when one of them is first used ----------------


as_model, as_work, as_memory = converter(Model()), converter(Work()), converter(Memory())
as_rows, as_order = converter(Rows()), converter(Order())
as_discrete, as_step = converter(Discrete()), converter(StepWork())


@entry
def run(model_table, work_table, discrete_table, step_table, memory_table, rows_table, order_table):
    """Carry out a request; the arguments are the tables of the records."""
    model, work, discrete = as_model(model_table), as_work(work_table), as_discrete(discrete_table)
    step, memory = as_step(step_table), as_memory(memory_table)
    return advance(model, work, memory, as_rows(rows_table), (discrete, step), as_order(order_table))


discrete_kernels = CompiledEntry(run, n_records=4)
