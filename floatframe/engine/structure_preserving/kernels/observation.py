"""Accelerations and reactions at the end of a step from the equations of motion, as in `initial_conditions.initial`.

(2) W du - Jᵀ w = 0,       G du = -G u              velocities that fulfil the joints, W = M + s K
(3) M u_dot - Jᵀ w = f,    G u_dot = -d(G)/dt u     accelerations and reactions for these velocities
"""

from floatframe.engine.kernels.body import NewtonWeights, newton_block
from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.connections.connection import constraint_rates
from floatframe.engine.kernels.dense import matrix_at
from floatframe.engine.kernels.evaluation import evaluate, linearize
from floatframe.engine.kernels.generalized_alpha import load_state, write_row
from floatframe.engine.kernels.schur import add_motion, correction, factorize_system
from floatframe.engine.kernels.step_start import hold_states, solve_accelerations
from floatframe.engine.kernels.vector import copy
from floatframe.engine.structure_preserving.kernels.memory import keep

__all__ = ["observe"]


@inner
def close_velocities(model, work, discrete):
    """Change the velocities by (2), so that they fulfil the joints; return whether the matrix is regular."""
    g, is_open = work.connections.g, False
    evaluate(model, work, 1.0)
    constraint_rates(model, work)
    for k in range(g.shape[0]):
        g[k] = work.connections.rate[k]
        is_open = is_open or g[k] != 0.0
    if not is_open:
        return True
    linearize(model, work, NewtonWeights(1.0, 0.0, 0.0))
    for i in range(model.bodies.kind.shape[0]):
        n, H = model.bodies.n_q[i], newton_block(model, work, i)
        weighted = matrix_at(discrete.weighted, discrete.weighted0[i], n, n)
        for k in range(n):
            for j in range(n):
                H[6 + k, 6 + j] += weighted[k, j]
    if not factorize_system(model, work):
        return False
    work.bodies.residual[:] = 0.0
    correction(model, work, 1.0, False)
    add_motion(model, work, work.state.u)
    return True


@inner
def begin(model, work, memory, t):
    """Set the state from the memory, with zero accelerations and unknown reactions; states are held constant."""
    state = work.state
    load_state(state, memory)
    state.time = t
    state.u_dot[:] = 0.0
    state.w[:] = 0.0
    hold_states(model, work, memory)
    for s in range(model.states.row.shape[0]):
        state.w[model.states.row[s]] = memory.w[model.states.row[s]]
    for e in range(model.laws.equation.shape[0]):
        state.w[model.laws.equation[e]] = memory.w[model.laws.equation[e]]
    for p in range(model.coordinates.row.shape[0]):
        state.w[model.coordinates.row[p]] = memory.w[model.coordinates.row[p]]


@inner
def observe(model, work, discrete, step, memory, t, rows):
    """Write the next result row with accelerations and reactions, and store both in the memory.

    Return whether they exist.

    Reactions on which friction depends are found by iteration. The values that connections remember are not changed, so
    that outputs do not influence the motion.
    """
    begin(model, work, memory, t)
    if memory.w.shape[0] > 0 and not close_velocities(model, work, discrete):
        return False
    if not solve_accelerations(model, work, discrete.is_linear):
        return False
    memory.u_dot[:] = 0.0
    add_motion(model, work, memory.u_dot)
    for j in range(discrete.remembered.shape[0]):
        step.known[discrete.remembered[j]] = memory.w[discrete.remembered[j]]
    copy(work.state.w, memory.w)
    write_row(model, work, memory, t, rows)
    keep(discrete, step, memory)
    return True
