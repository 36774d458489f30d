"""Start of a step for force elements with memory, and accelerations where a motion starts again."""

import math

from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.connections.connection import constraint_rates
from floatframe.engine.kernels.connections.coordinate import predict_coordinate
from floatframe.engine.kernels.connections.user_force import begin_states
from floatframe.engine.kernels.evaluation import evaluate
from floatframe.engine.kernels.schur import assemble, correction, factorize_bodies, factorize_connections
from floatframe.engine.kernels.vector import put, turned
from floatframe.model.joints.rows.kinds import NOTHING

__all__ = ["accelerate", "begin_step", "hold_states"]

SAME = 1e-10  # relative change of reactions below which they have converged
MOST_ITERATIONS = 10


@inner
def begin_step(model, work, memory, h, alpha_f):
    """Set known values from the last unknowns, advance angles and coordinates by their rates, prepare the states."""
    for k in range(memory.w.shape[0]):
        work.state.w_start[k] = memory.w[k]
        work.state.w[k] = memory.w[k]
    for k in range(memory.angle.shape[0]):
        work.state.angle[k] = memory.angle[k] + h * memory.angle_rate[k]
    for p in range(model.coordinates.a.shape[0]):
        predict_coordinate(model.coordinates, work.state, p, h)
    begin_states(model.states.row, work.states, memory, h, alpha_f)


@inner
def hold_states(model, work, memory):
    """Set the states of force elements from the memory, and their rates from their laws."""
    for k in range(memory.w.shape[0]):
        work.state.w_start[k] = memory.w[k]
    work.states.rho = 1.0
    for s in range(model.states.row.shape[0]):
        work.states.base[s] = memory.w[model.states.row[s]]
        work.states.kappa[s], work.states.rate_base[s] = 0.0, 0.0


@inner
def accelerate(model, work, memory):
    """Write the accelerations that the equations of motion give at the state in the memory into the memory.

    Solve M u_dot - Jᵀ w = f,  G u_dot = -d(G)/dt u, by iteration if forces depend on reactions. If no accelerations
    exist, the memory is unchanged.
    """
    hold_states(model, work, memory)
    state, g, y = work.state, work.connections.g, work.solver.y
    for k in range(state.u_dot.shape[0]):
        state.u_dot[k] = 0.0
    work.solver.is_due, work.solver.c_k = 1, 0.0
    for _ in range(MOST_ITERATIONS):
        evaluate(model, work, 1.0)
        constraint_rates(model, work)
        for k in range(g.shape[0]):
            if model.rows.holds[k] != NOTHING:
                g[k] = work.connections.bias[k]
        if factorize_bodies(model, work, 1.0, 0.0, 0.0) >= 0:
            return
        assemble(model, work, 0.0)
        if factorize_connections(model.elimination, model.connections, work.solver) >= 0:
            return
        correction(model, work, 1.0, False)
        largest, change = 0.0, 0.0
        for k in range(g.shape[0]):
            state.w[k] += work.solver.mu[k]
            largest, change = max(largest, abs(state.w[k])), max(change, abs(work.solver.mu[k]))
        if change <= SAME * largest:
            break
    total = 0.0
    for k in range(y.shape[0]):
        total += y[k]
    if not math.isfinite(total):
        return
    for i in range(model.bodies.kind.shape[0]):
        n, u0 = model.bodies.n_q[i], model.bodies.u0[i]
        put(memory.u_dot, u0, turned(state.R[i], y[u0:]))
        for k in range(u0 + 3, u0 + 6 + n):
            memory.u_dot[k] = y[k]
