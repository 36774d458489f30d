"""A fully driven system at one instant: positions, velocities and accelerations that joints and drives determine.

The unknowns are the motions of the body frames; the rates of modal coordinates are zero (q' = q'' = 0). G is the
derivative of the constraint rows by these unknowns, M the mass matrix, and P, V as in joints/rows/kinds.py:

    (1) positions       G dx = -g                     Newton, until g = 0
    (2) velocities      G u = -dg/dt
    (3) accelerations   G u_dot = -d(G)/dt u - ...
    (4) wrenches        M u_dot - Jᵀ w = f

Each is solved as one system with M, which has a unique solution if the drives leave no motion free. Elastic bodies
either keep their assembled shape, or deform quasi-statically: their modes balance joints, loads and the inertia of the
rigid motion,

    (5) K* q + inertia(q, u, u_dot) = Psiᵀ w + loads

which Newton's method solves with the complete tangent, and with (1)-(4) solved again for every q.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.presentation import presented
from floatframe.engine.compiling.system import CompiledSystem
from floatframe.engine.initial_conditions.constraint_words import open_joints
from floatframe.engine.initial_conditions.initial import has_normal_friction
from floatframe.engine.initial_conditions.newton_equations import (
    balanced_scales,
    displaced,
    in_ground_axes,
    linearized,
    set_iterate,
    solve,
)
from floatframe.engine.kernels.work import Work, vectors_of_end
from floatframe.errors import ConvergenceError
from floatframe.model.joints.rows import is_held
from floatframe.model.state import State

__all__ = ["ELASTICITY", "Elasticity", "Instant", "frozen_bodies", "quasi_static_bodies", "rigid_columns"]

CLOSED = 1e-12  #: largest constraint error, relative to the size of the system
#: constraint error, relative to the size of the system, that is accepted if rounding prevents a smaller one
ACCEPTED = 1e-9
MOST_ITERATIONS = 30
#: change of a position in an iteration, in rad or relative to the size of the system, above which the method fails
FAR = 1e3
SETTLED = 1e-11  #: last change of q, relative to the size of q, at convergence
LEAST_SHAPE = 1e-14  #: deformation, relative to the size of the system, that counts as zero if all loads vanish


@presented
@dataclass(frozen=True, eq=False)
class Instant:
    """Motion of all bodies at one time."""

    t: float
    state: State
    u_dot: Array  #: accelerations, (n_u,)
    w: Array  #: wrenches of the connections on their markers A, ground axes, (n_w,)
    G: Array  #: derivatives of the constraint rows by motions of the body frames, (n_held, 6 n_b)
    n_iterations: int = 0


Elasticity = Callable[[CompiledSystem, Work, State, float], Instant]  #: function (compiled, work, guess, t) -> Instant


def rigid_scale(compiled: CompiledSystem) -> Array:
    """Return reference lengths for translations and 1 for rotations, (6 n_b,), which give all unknowns one unit."""
    return np.tile(np.repeat([compiled.length, 1.0], 3), len(compiled.body_names))


def rigid_columns(compiled: CompiledSystem) -> np.ndarray:
    """Return whether each unknown belongs to a body frame, (n_u,) bool; the other unknowns are modes."""
    model = compiled.model
    rigid = np.zeros(int(model.bodies.u0[-1]), dtype=bool)
    for u0 in model.bodies.u0[:-1]:
        rigid[u0 : u0 + 6] = True
    return rigid


def frozen_bodies(compiled: CompiledSystem, work: Work, state: State, t: float) -> Instant:
    """Return the motion for constant modal coordinates, by steps (1)-(4).

    Parameters
    ----------
    compiled
        The compiled system.
    work
        Its working arrays, which are overwritten.
    state
        State near the solution, from which Newton's method begins.
    t
        Time [s].
    """
    from floatframe.engine.kernels.entry import rates_of_constraints

    model, rigid = compiled.model, rigid_columns(compiled)
    work.state.time[...] = t
    state, equations, n = closed(compiled, work, state, rigid, t)
    # the velocity of a row at rest is the rate of its drive
    state = State(state.r, state.p, state.q, np.zeros_like(state.u))
    set_iterate(work, state)
    rate, _ = rates_of_constraints(model, work)
    holds = is_held(model.rows.kind)
    y, _ = equations.solved(np.zeros(int(rigid.sum())), np.where(holds, -rate, 0.0))
    u = np.zeros_like(state.u)
    u[rigid] = y
    state = State(state.r, state.p, state.q, in_ground_axes(model, state, u))
    # accelerations and wrenches; friction due to the normal force is not linear in them
    w = np.zeros(len(work.state.w))
    for _ in range(MOST_ITERATIONS):
        set_iterate(work, state, w=w)
        equations = rigid_equations(compiled, work)
        residual = work.bodies.residual.copy()
        _, bias = rates_of_constraints(model, work)
        y, change = equations.solved(-residual[rigid], np.where(holds, -bias, -work.connections.g))
        w = w + change
        if not has_normal_friction(model) or np.abs(change).max() <= 1e-11 * np.abs(w).max():
            break
    u_dot = np.zeros_like(state.u)
    u_dot[rigid] = y
    return Instant(t, state, in_ground_axes(model, state, u_dot), w, equations.G[holds], n)


def quasi_static_bodies(compiled: CompiledSystem, work: Work, state: State, t: float) -> Instant:
    """Return the motion in which modes balance their loads at every instant, by steps (1)-(5).

    Parameters
    ----------
    compiled
        The compiled system.
    work
        Its working arrays, which are overwritten.
    state
        State near the solution, from which Newton's method begins.
    t
        Time [s].
    """
    model, rigid = compiled.model, rigid_columns(compiled)
    now = frozen_bodies(compiled, work, state, t)
    if rigid.all():
        return now
    n, size = now.n_iterations, 0.0
    none = LEAST_SHAPE * compiled.length * float(np.sqrt(model.body_types.mass[model.bodies.kind].sum()))
    for _ in range(MOST_ITERATIONS):
        set_iterate(work, now.state, now.u_dot, now.w)
        parts = linearized(model, work, 0.0, 0.0, 1.0)
        y, _ = solve(parts.H, parts, -work.bodies.residual.copy(), -work.connections.g.copy())
        moved = displaced(model, now.state, in_ground_axes(model, now.state, y))
        q = moved.q
        now = frozen_bodies(compiled, work, State(moved.r, moved.p, q, now.state.u), t)
        n += 1 + now.n_iterations
        change, size = float(np.linalg.norm(y[~rigid])), float(np.linalg.norm(q))
        if change <= SETTLED * size or size <= none:
            return replace(now, n_iterations=n)
    raise ConvergenceError(
        f"the deformation at t = {t:g} did not converge in {MOST_ITERATIONS} iterations (last change {change:.2g} of "
        f"{size:.2g}): the loads are too large for these bodies, or buckle them; use frozen_bodies, or integrate",
        t=t,
        h=0.0,
        residual=change,
    )


ELASTICITY: dict[str, Elasticity] = {"frozen": frozen_bodies, "quasi-static": quasi_static_bodies}


@dataclass(frozen=True, eq=False)
class RigidEquations:
    """Equations of the body frames as dense matrices: M y - Jᵀ w = forces, G y + V w = rows."""

    M: Array  #: mass matrix, (6 n_b, 6 n_b)
    J: Array  #: transposed map from wrenches to forces, (n_w, 6 n_b)
    G: Array  #: derivatives of rows by motions, (n_w, 6 n_b)
    V: Array  #: derivatives of rows by wrenches, (n_w, n_w)

    def solved(self, forces: Array, rows: Array) -> tuple[Array, Array]:
        """Return the solution y and w."""
        of_columns, of_rows = balanced_scales(np.diag(self.M), abs(self.J), abs(self.G), abs(self.V))
        matrix = of_rows[:, None] * np.block([[self.M, -self.J.T], [self.G, self.V]]) * of_columns
        solution = of_columns * np.linalg.solve(matrix, of_rows * np.concatenate([forces, rows]))
        return solution[: len(forces)], solution[len(forces) :]


def rigid_equations(compiled: CompiledSystem, work: Work) -> RigidEquations:
    """Evaluate the iterate in `work`, and return the equations of the body frames."""
    from floatframe.engine.kernels.entry import evaluate_and_linearize

    model = compiled.model
    evaluate_and_linearize(model, work, 1.0, 0.0, 0.0)
    n_w, n_u = len(work.state.w), 6 * len(model.bodies.kind)
    M, J, G, V = np.zeros((n_u, n_u)), np.zeros((n_w, n_u)), np.zeros((n_w, n_u)), np.zeros((n_w, n_w))
    for i in range(len(model.bodies.kind)):
        n = 6 + int(model.bodies.n_q[i])
        M[6 * i : 6 * i + 6, 6 * i : 6 * i + 6] = work.solver.H[model.bodies.h0[i] : model.bodies.h0[i + 1]].reshape(
            n, n
        )[:6, :6]
    for m in model.bodies.ends:
        i, c, o = int(model.markers.body[m]), int(model.markers.connection[m]), int(model.markers.x0[m])
        n, size, w0 = 6 + int(model.bodies.n_q[i]), int(model.connections.size[c]), int(model.connections.w0[c])
        R = work.state.R[i]
        column = vectors_of_end(work.solver.J_column, 2, o, n)[:, :, :6]
        row = vectors_of_end(work.solver.J_row, 4, o, n)[:, :, :6]
        u = slice(6 * i, 6 * i + 6)
        carried = model.markers.sign[m] * (R @ column)
        for part, place in ((0, int(model.markers.force[m])), (1, int(model.markers.moment[m]))):
            if place >= 0:
                J[w0 + place : w0 + place + 3, u] += carried[part]
        G[w0 : w0 + size, u] += work.connections.P[m, :size] @ (R @ row).reshape(12, 6)
    for c, size in enumerate(model.connections.size):
        w = slice(int(model.connections.w0[c]), int(model.connections.w0[c]) + int(size))
        V[w, w] = work.connections.V[c, :size, :size]
    return RigidEquations(M, J, G, V)


def closed(
    compiled: CompiledSystem, work: Work, state: State, rigid: np.ndarray, t: float
) -> tuple[State, RigidEquations, int]:
    """Return the state that satisfies joints and drives by step (1), its equations, and the number of iterations."""
    model = compiled.model
    holds = is_held(model.rows.kind)
    scale = compiled.gap_sizes
    error = np.zeros(len(work.state.w))
    best = np.inf
    for n in range(MOST_ITERATIONS):
        set_iterate(work, state)
        equations = rigid_equations(compiled, work)
        error = np.where(holds, work.connections.g, 0.0)
        size = float(np.abs(error / scale).max(initial=0.0))
        if size <= CLOSED or (size <= ACCEPTED and size > 0.3 * best):
            return state, equations, n
        best = min(best, size)
        try:
            y, _ = equations.solved(np.zeros(int(rigid.sum())), -error)
        except np.linalg.LinAlgError:
            break
        if not np.isfinite(y).all() or np.abs(y / rigid_scale(compiled)).max() > FAR:
            break
        x = np.zeros(len(rigid))
        x[rigid] = y
        state = displaced(model, state, in_ground_axes(model, state, x))
    raise ConvergenceError(
        f"the drives cannot be followed at t = {t:g}: {open_joints(compiled, error) or 'a joint opens'}; a drive leads "
        "beyond the reach of the mechanism, or through a singular position: limit its motion, or drive "
        "another coordinate",
        t=t,
        h=0.0,
        residual=float(np.abs(error / scale).max(initial=0.0)),
    )
