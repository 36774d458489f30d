"""Start of a step for force elements with memory, and accelerations where a motion starts again."""

import math

from floatframe.engine.kernels.body import NewtonWeights
from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.connections.connection import constraint_rates
from floatframe.engine.kernels.connections.coordinate import predict_coordinate
from floatframe.engine.kernels.connections.user_force import begin_states
from floatframe.engine.kernels.evaluation import evaluate, linearize
from floatframe.engine.kernels.schur import add_motion, correction, factorize_system
from floatframe.engine.kernels.vector import copy
from floatframe.model.joints.rows.kinds import NOTHING

__all__ = ["accelerate", "begin_step", "hold_states", "solve_accelerations"]

SAME = 1e-10  # relative change of reactions below which they have converged
MOST_ITERATIONS = 30


@inner
def begin_step(model, work, memory, h, alpha_f):
    """Set known values from the last unknowns, advance angles and coordinates by their rates, prepare the states."""
    copy(memory.w, work.state.w_start)
    copy(memory.w, work.state.w)
    for k in range(memory.angle.shape[0]):
        work.state.angle[k] = memory.angle[k] + h * memory.angle_rate[k]
    for p in range(model.coordinates.a.shape[0]):
        predict_coordinate(model.coordinates, work.state, p, h)
    begin_states(model.states.row, work.states, memory, h, alpha_f)


@inner
def hold_states(model, work, memory):
    """Set the states of force elements from the memory, and their rates from their laws."""
    copy(memory.w, work.state.w_start)
    work.states.rho = 1.0
    for s in range(model.states.row.shape[0]):
        work.states.base[s] = memory.w[model.states.row[s]]
        work.states.kappa[s], work.states.rate_base[s] = 0.0, 0.0


@inner
def accelerate(model, work, memory):
    """Write the accelerations that the equations of motion give at the state in the memory into the memory.

    If they do not exist, the memory is unchanged.
    """
    hold_states(model, work, memory)
    work.state.u_dot[:] = 0.0
    work.solver.is_due, work.solver.c_k = 1, 0.0
    if solve_accelerations(model, work, False):
        memory.u_dot[:] = 0.0
        add_motion(model, work, memory.u_dot)


@inner
def solve_accelerations(model, work, is_linear):
    """Solve M u_dot - Jᵀ w = f, G u_dot = -d(G)/dt u for an iterate with u_dot = 0; return whether a solution exists.

    Wrenches are added to those of the iterate, and y becomes u_dot in body axes. If forces depend on reactions (not
    is_linear), the solution is found by iteration.
    """
    state, g, y, total = work.state, work.connections.g, work.solver.y, 0.0
    for _ in range(MOST_ITERATIONS):
        evaluate(model, work, 1.0)
        constraint_rates(model, work)
        for k in range(g.shape[0]):
            if model.rows.holds[k] != NOTHING:
                g[k] = work.connections.bias[k]
        linearize(model, work, NewtonWeights(1.0, 0.0, 0.0))
        if not factorize_system(model, work):
            return False
        correction(model, work, 1.0, False)
        largest, change = 0.0, 0.0
        for k in range(g.shape[0]):
            state.w[k] += work.solver.mu[k]
            largest, change = max(largest, abs(state.w[k])), max(change, abs(work.solver.mu[k]))
        if is_linear or change <= SAME * largest:
            break
    for k in range(y.shape[0]):
        total += y[k]
    return math.isfinite(total)
