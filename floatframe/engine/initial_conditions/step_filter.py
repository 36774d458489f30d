"""Initial accelerations without the components that a step of the given size cannot resolve.

At a start, only the accelerations u_dot of the equations of motion are known. If a mode, a spring or a damper is much
faster than the step, they would move its bodies much too far in the first step. The matrix of a Newton step separates
fast motions from slow ones:

    (1) z = Z y:  (M + s gamma h D + s beta h² K) z - Jᵀ mu = M y,   G z = G y
    (2) u_dot becomes (2 Z - Z²) u_dot,   a = u_dot + (alpha_m - alpha_f) h Z d(u_dot)/dt

for all unknowns alike: modes, bodies on springs, rates of joints. With G z = G y the accelerations still satisfy the
joints. Because 2 Z - Z² = 1 - (1 - Z)², motions that the step resolves change only to second order in h. Motions that
it does not resolve are removed: h² a remains comparable to the displacement, while h² u_dot grows with (omega h)².

s = gamma - 1/2, at most 1, is the numerical damping of the method. With this s no restart makes a mode grow, for any
omega h, rho_inf and number of restarts. With s = 1, a mode that the method hardly damps can grow, by 2.5 % per restart
for rho_inf = 0.98. Methods without numerical damping need no filter: the trapezoidal rule has a = u_dot in every step,
and for rho_inf = 1 the motion of a linear system does not depend on a
(`tests/floatframe/engine/initial_conditions/test_step_filter.py`).

The velocities are changed by

    (3) (M + gamma h D + beta h² K) du - Jᵀ mu = 0,   G du = -g(after)/h

for the rows of positions whose rates the steps do not constrain (g is set to zero in all other rows). `after` is the
end of the first step with accelerations that are filtered with s = 1, so that this step closes the joints without a
kick. The change is O(h²).

If the steps integrate the spin w of a body about its axis e separately, the filter and the rates are those in axes that
do not spin: the part w omega × e of u_dot is not filtered, and its contribution is part of D.
"""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.system import CompiledSystem
from floatframe.engine.initial_conditions.initial import ConsistentState, acceleration_rates, start_unknowns, work_from
from floatframe.engine.initial_conditions.newton_equations import (
    NewtonFactors,
    in_body_axes,
    in_ground_axes,
    linearized,
    set_iterate,
    with_mass_for_all,
)
from floatframe.engine.kernels.model import Model
from floatframe.engine.kernels.work import Work
from floatframe.model.joints.rows import is_held
from floatframe.model.rotations import cross
from floatframe.model.state import State

__all__ = ["Beginning", "Spin", "StepFilter", "beginning_of", "closing_velocities", "spin_of", "step_filter"]


@dataclass(frozen=True, eq=False)
class StepFilter:
    """The filter Z of the module docstring at one state, with the factors of its matrix."""

    compiled: CompiledSystem
    state: State
    mass: tuple[Array, ...]  #: mass matrix of each body
    G: sp.csr_array  #: derivatives of rows by accelerations, (n_w, n_u)
    factors: NewtonFactors  #: factors of the matrix in (1)

    def __call__(self, y: Array) -> Array:
        """Return Z y, (n_u,), for accelerations or their rates y, with translations in ground axes."""
        return self.solved(y)[0]

    def solved(self, y: Array) -> tuple[Array, Array]:
        """Return Z y, and the multipliers mu, (n_w,)."""
        model = self.compiled.model
        own = in_body_axes(model, self.state, y)
        ends = zip(self.mass, model.bodies.u0[:-1], model.bodies.u0[1:], strict=True)
        z, mu = self.factors.solve(np.concatenate([M @ own[u0:u1] for M, u0, u1 in ends]), self.G @ own)
        return in_ground_axes(model, self.state, z), mu

    def twice(self, y: Array) -> Array:
        """Return (2 Z - Z²) y, which differs from y only to second order in h for motions that the step resolves."""
        z = self(y)
        return z + self(y - z)

    def closing(self, gap: Array) -> Array:
        """Return the velocity correction du of (3), (n_u,), for rates g(after)/h, (n_w,), zero in all other rows."""
        model = self.compiled.model
        return in_ground_axes(model, self.state, self.factors.solve(np.zeros(self.factors.n_u), -gap)[0])


def step_filter(
    compiled: CompiledSystem,
    consistent: ConsistentState,
    t: float,
    *,
    c_d: float,
    c_k: float,
    spin: "Spin | None" = None,
    work: Work,
) -> StepFilter:
    """Return the filter with matrix M + c_d D + c_k K at time t, at a state with its accelerations and wrenches.

    spin: bodies whose D is taken in axes that do not spin with them. work: arrays from `work_from`; overwritten.

    K includes the change of forces that rotate with the bodies, except forces of modes that the step does not resolve.
    A first filter, without any forces, finds which forces remain.
    """
    model, state = compiled.model, consistent.state
    work.state.time[...] = t
    set_iterate(work, state, w=consistent.w)
    inertia = linearized(model, work, 1.0, 0.0, 0.0)
    M = with_mass_for_all(model, inertia.H)
    held = is_held(model.rows.kind)

    def by(u_dot: Array, w: Array) -> StepFilter:
        """Return the filter with its matrix evaluated at other accelerations and wrenches."""
        set_iterate(work, state, u_dot, np.where(is_wrench(model), w, consistent.w))
        if spin is not None:
            work.state.spins[:] = spin.bodies
        step = linearized(model, work, 1.0, c_d, c_k)
        rows = replace(step, G=chosen(held, inertia.G, step.G))
        return StepFilter(compiled, state, M, inertia.G, NewtonFactors(with_mass_for_all(model, step.H), rows))

    y, w = consistent.u_dot, consistent.w
    if len(w):
        y, change = by(np.zeros_like(y), np.zeros_like(w)).solved(y)
        w = w + np.where(is_wrench(model), change, 0.0)
    return by(y, w)


def chosen(is_first: NDArray[np.bool_], first: sp.csr_array, second: sp.csr_array) -> sp.csr_array:
    """Return a matrix with some rows from the first and the other rows from the second."""
    both = sp.csr_array(sp.vstack([first, second]))
    rows = np.arange(len(is_first))
    return both[np.where(is_first, rows, len(rows) + rows)]


def is_wrench(model: Model) -> NDArray[np.bool_]:
    """Return, for each connection unknown, whether it is a force, moment or multiplier rather than a state, (n_w,)."""
    result = np.ones(int(model.connections.w0[-1]), dtype=bool)
    for k in range(3):
        result[model.states.row + k] = False
    for k in range(2):
        result[model.coordinates.row + k] = False
    return result


@dataclass(frozen=True, eq=False)
class Spin:
    """Axisymmetric bodies whose spin is integrated separately, see `kernels.generalized_alpha`."""

    bodies: NDArray[np.int64]  #: 1 for each body whose spin is integrated separately, (n_b,)
    turn: Array  #: part w omega × e of u_dot, due to the rotation of the symmetry axis e at spin rate w, (n_u,)
    #: difference between the rates of the remainder, in axes that do not spin, and those of u_dot, (n_u,)
    further: Array


def spin_of(compiled: CompiledSystem, consistent: ConsistentState, may: NDArray[np.bool_] | None = None) -> Spin:
    """Return the bodies whose spin the next step integrates separately; may, (n_b,): candidates, None for all."""
    from floatframe.engine.kernels.generalized_alpha import STEADY

    model, u, u_dot = compiled.model, consistent.state.u, consistent.u_dot
    bodies, turn, further = np.zeros(len(model.bodies.kind), dtype=np.int64), np.zeros_like(u), np.zeros_like(u)
    axes = model.body_types.axis[model.bodies.kind]
    for i in np.flatnonzero(axes.any(axis=1)):
        e = axes[i]
        part = slice(model.bodies.u0[i] + 3, model.bodies.u0[i] + 6)
        omega, alpha = u[part], u_dot[part]
        by_turn = (e @ omega) * cross(omega, e)
        rest = alpha - by_turn
        if (may is None or may[i]) and by_turn.any() and np.linalg.norm(alpha) >= STEADY * np.linalg.norm(rest):
            bodies[i], turn[part] = 1, by_turn
            rate_of_turn = (e @ alpha) * cross(omega, e) + (e @ omega) * cross(alpha, e)
            further[part] = (e @ omega) * cross(e, rest) - rate_of_turn
    return Spin(bodies, turn, further)


@dataclass(frozen=True, eq=False)
class Beginning:
    """Initial accelerations and their rates, filtered with the same matrix."""

    u_dot: Array  #: (2 Z - Z²) u_dot, (n_u,)
    rates: Array  #: Z d(u_dot)/dt along the motion, (n_u,); for spinning bodies in axes that do not spin


def beginning_of(
    compiled: CompiledSystem,
    consistent: ConsistentState,
    t: float,
    h: float,
    z: StepFilter | None,
    work: Work,
    *,
    spin: Spin | None = None,
) -> Beginning:
    """Return initial accelerations and rates at t for step size h; z None: unfiltered, from the equations of motion.

    work: arrays from `work_from`; overwritten. spin: bodies whose accelerations are filtered without the part due to
    the rotation of their axes.
    """
    turn = np.zeros_like(consistent.u_dot) if spin is None else spin.turn
    u_dot = consistent.u_dot if z is None else turn + z.twice(consistent.u_dot - turn)
    rates = acceleration_rates(compiled, ConsistentState(consistent.state, u_dot, consistent.w), t, h, work)
    if spin is not None:
        rates = rates + spin.further
    return Beginning(u_dot, rates if z is None else z(rates))


def closing_velocities(z: StepFilter, after: State, w: Array, t: float, h: float, rows: NDArray[np.bool_]) -> Array:
    """Return the velocity correction du of (3), (n_u,), for some rows, (n_w,), in a step of size h; z: with s = 1."""
    from floatframe.engine.kernels.entry import evaluate_and_linearize

    model = z.compiled.model
    work, unknowns = work_from(model, w), start_unknowns(model, w)
    if len(model.coordinates.row):  # angles of couplers and user forces are taken nearest to the predicted angles
        row = model.coordinates.row
        work.state.time[...] = t
        set_iterate(work, z.state, w=unknowns)
        evaluate_and_linearize(model, work, 1.0, 0.0, 0.0)
        g = work.connections.g
        unknowns[row] -= g[row]
        unknowns[row] += h * (unknowns[row + 1] - g[row + 1])
    work.state.time[...] = t + h
    set_iterate(work, after, w=unknowns)
    evaluate_and_linearize(model, work, 1.0, 0.0, 0.0)
    return z.closing(np.where(rows, work.connections.g / h, 0.0))
