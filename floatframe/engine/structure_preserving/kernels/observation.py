"""Accelerations and reactions at the end of a step from the equations of motion, as in `initial_conditions.initial`.

(2) W du - Jᵀ w = 0,       G du = -G u              velocities that fulfil the joints, W = M + s K
(3) M u_dot - Jᵀ w = f,    G u_dot = -d(G)/dt u     accelerations and reactions for these velocities
"""

import math

from floatframe.engine.kernels.body import newton_block
from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.connections.connection import constraint_rates
from floatframe.engine.kernels.evaluation import evaluate, linearize
from floatframe.engine.kernels.generalized_alpha import load_state, write_row
from floatframe.engine.kernels.schur import assemble, correction, factorize_connections, factorize_tangents
from floatframe.engine.kernels.vector import put, put_sum, turned, vector
from floatframe.engine.structure_preserving.kernels.memory import keep
from floatframe.model.joints.rows.kinds import NOTHING

__all__ = ["observe"]

SAME = 1e-10  # relative change of reactions below which they have converged
MOST_ITERATIONS = 30


@inner
def factorize(model, work, discrete, is_weighted):
    """Factorise the matrices of (2) if is_weighted, else those of (3); return whether they are regular."""
    linearize(model, work, 1.0, 0.0, 0.0)
    if is_weighted:
        for i in range(model.bodies.kind.shape[0]):
            n, first = model.bodies.n_q[i], discrete.weighted0[i]
            H = newton_block(model, work, i)
            for k in range(n):
                for j in range(n):
                    H[6 + k, 6 + j] += discrete.weighted[first + k * n + j]
    if factorize_tangents(model, work) >= 0:
        return False
    assemble(model, work, 0.0)
    return factorize_connections(model.elimination, model.connections, work.solver) < 0


@inner
def put_in_ground_axes(model, work, out, is_sum):
    """Write or add the body correction, with translations rotated from body axes to ground axes."""
    for i in range(model.bodies.kind.shape[0]):
        n, u0 = model.bodies.n_q[i], model.bodies.u0[i]
        dx = turned(work.state.R[i], vector(work.solver.y[u0:]))
        if is_sum:
            put_sum(out, u0, dx)
        else:
            put(out, u0, dx)
        for k in range(u0 + 3, u0 + 6 + n):
            out[k] = work.solver.y[k] + (out[k] if is_sum else 0.0)


@inner
def begin(model, work, memory, t):
    """Set the state from the memory, with zero accelerations and unknown reactions."""
    load_state(work.state, memory)
    work.state.time = t
    for k in range(work.state.u_dot.shape[0]):
        work.state.u_dot[k] = 0.0
    for k in range(work.state.w.shape[0]):
        work.state.w[k] = 0.0
    for k in range(work.state.w.shape[0]):
        work.state.w_start[k] = memory.w[k]
    work.states.rho = 1.0
    for s in range(model.states.row.shape[0]):  # hold the states constant; their laws give the rates
        z = memory.w[model.states.row[s]]
        work.state.w[model.states.row[s]], work.states.base[s] = z, z
        work.states.kappa[s], work.states.rate_base[s] = 0.0, 0.0
    for e in range(model.laws.equation.shape[0]):
        work.state.w[model.laws.equation[e]] = memory.w[model.laws.equation[e]]
    for p in range(model.coordinates.row.shape[0]):
        work.state.w[model.coordinates.row[p]] = memory.w[model.coordinates.row[p]]


@inner
def observe(model, work, discrete, step, memory, t, rows):
    """Write the next result row with accelerations and reactions, and store both in the memory.

    Return whether they exist.

    Reactions on which friction depends are found by iteration. The values that connections remember are not changed, so
    that outputs do not influence the motion.
    """
    begin(model, work, memory, t)
    g = work.connections.g
    is_open = False
    if g.shape[0] > 0:
        evaluate(model, work, 1.0)
        constraint_rates(model, work)
        for k in range(g.shape[0]):
            g[k] = work.connections.rate[k]
            is_open = is_open or g[k] != 0.0
    if is_open:
        if not factorize(model, work, discrete, True):
            return False
        for k in range(work.bodies.residual.shape[0]):
            work.bodies.residual[k] = 0.0
        for k in range(g.shape[0]):
            g[k] = work.connections.rate[k]
        correction(model, work, 1.0, False)
        put_in_ground_axes(model, work, work.state.u, True)
    for _ in range(MOST_ITERATIONS):
        evaluate(model, work, 1.0)
        constraint_rates(model, work)
        if not factorize(model, work, discrete, False):
            return False
        largest, change = 0.0, 0.0
        for k in range(g.shape[0]):
            if model.rows.holds[k] != NOTHING:
                g[k] = work.connections.bias[k]
        correction(model, work, 1.0, False)
        for k in range(g.shape[0]):
            work.state.w[k] += work.solver.mu[k]
            largest, change = max(largest, abs(work.state.w[k])), max(change, abs(work.solver.mu[k]))
        if discrete.is_linear or change <= SAME * largest:
            break
    put_in_ground_axes(model, work, memory.u_dot, False)
    total = 0.0
    for k in range(memory.u_dot.shape[0]):
        total += memory.u_dot[k]
    if not math.isfinite(total):
        return False
    for j in range(discrete.remembered.shape[0]):
        step.known[discrete.remembered[j]] = memory.w[discrete.remembered[j]]
    for k in range(g.shape[0]):
        memory.w[k] = work.state.w[k]
    write_row(model, work, memory, t, rows)
    keep(discrete, step, memory)
    return True
