"""SciPy's ODE solvers for the independent coordinates of joints and modes.

Evaluated in `floatframe.engine.tree.kernels.accelerations`.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.linalg import lu_factor, lu_solve

from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.records import checked_fields
from fe_models.foundation.words import nearest
from floatframe.engine.compiling.callbacks import raise_errors_of
from floatframe.engine.compiling.system import CompiledSystem, compiled_system
from floatframe.engine.initial_conditions.gaps import gaps_at, has_gaps
from floatframe.engine.initial_conditions.initial import has_normal_friction
from floatframe.engine.initial_conditions.newton_equations import set_iterate
from floatframe.engine.kernels.memory import Memory, Rows
from floatframe.engine.kernels.work import Work, new_work
from floatframe.engine.structure_preserving.bodies import central_bodies
from floatframe.engine.tree.kernels.tree import new_joint_work, new_tangent_work
from floatframe.engine.tree.topology import SystemTree, tree_of
from floatframe.errors import ModelError
from floatframe.integrators.integrator import (
    Failure,
    FollowedRotations,
    Integrator,
    joined_rows,
    observed_outputs,
    one_by_one,
)
from floatframe.integrators.passed_contacts import Stretch, stretches_of_passed_contact
from floatframe.integrators.remembered_contacts import require_no_remembered_contacts
from floatframe.model.joints.rows import is_held, is_held_length, is_held_position
from floatframe.model.rotations import euler_parameters, right_jacobian
from floatframe.model.state import State
from floatframe.model.system import System

__all__ = ["METHODS", "Partition", "RelativeOde", "partition_of"]


METHODS = ("BDF", "Radau", "LSODA", "DOP853", "RK45")  #: SciPy methods that may be chosen
TURN = 2.0  #: length of a rotation vector [rad] above which it is restarted from zero
CLOSED = 1e-13  #: tolerance for lengths and angles when loops are closed in each evaluation
MOST = 20  #: largest number of iterations
COUNTED = 0.1  #: absolute tolerance of coordinates that only count the turns of an angle
SETTLED = 1e-12  #: tolerance for the last change of reactions and other implicit unknowns, relative to the largest


@dataclass(frozen=True)
@checked_fields(ModelError)
class RelativeOde(Integrator):
    """SciPy's `solve_ivp` on the ordinary differential equation of the independent coordinates (docs/relative.md §7).

    (1) pivoted LU chooses the dependent coordinates, which close the loops, and chooses again when they become
        unsuitable
    (2) each evaluation closes the loops exactly: positions by Newton's method, rates by a linear system
    (3) accelerations and reactions follow from the recursive equations

    Constraints therefore hold to roundoff at any tolerance. The solver chooses steps and orders; `h` of `integrate` is
    the interval of outputs. Rotations are measured from the beginning of a batch of steps; the reference is renewed
    after two radians. Work and dissipation are summed by the trapezoidal rule over the outputs, and `stops` of elements
    are checked at the outputs only. States of elements and user forces are unknowns of the solver, like coordinates and
    rates. Multipliers of elements, and friction that depends on the force in its joint, are found with the reactions by
    Newton's method. Elements whose law depends on accelerations need `RelativeGeneralizedAlpha`.

    Parameters
    ----------
    method
        "BDF", "Radau" or "LSODA" for stiff systems; "DOP853", "RK45" for others.
    rtol
        Relative tolerance of a step.
    atol
        Absolute tolerance of a step, in the units of the system.
    """

    method: str = "BDF"
    rtol: float = 1e-8
    atol: float = 1e-10

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise ModelError(f"RelativeOde: method {self.method!r}{nearest(self.method, METHODS)}")
        for name in ("rtol", "atol"):
            if not 0.0 < getattr(self, name) < 1.0:
                raise ModelError(f"RelativeOde: {name}: expected a number between 0 and 1, got {getattr(self, name)}")

    def start(self, system: System, t: float, state: State | None = None, before: Memory | None = None) -> Memory:
        """Return the memory at the start, for a consistent state near the given one."""
        compiled = compiled_system(system)
        for each in compiled.laws:
            if each.law.accelerations:
                raise ModelError(
                    f"RelativeOde: element {each.element.name!r} depends on accelerations, which this scheme does not "
                    "support; use GeneralizedAlpha"
                )
        require_no_remembered_contacts(compiled, "RelativeOde")
        return super().start(system, t, state, before).changed(a=np.zeros(0))

    def advance(
        self, system: System, memory: Memory, work: Work, *, t0: float, h: float, first: int, n_steps: int, every: int
    ) -> tuple[Memory, Rows, int, Failure | None]:
        """Advance by n_steps output times, beginning with step `first` counted from t0; see `integrator.Integrator`."""
        times: Array = t0 + h * np.arange(first, first + n_steps + 1, dtype=float)
        motion = Motion(system, memory, float(times[0]))
        memory, rows, n_good, failure, has_stopped = observed_outputs(
            motion.outputs(self, times), self.method, system, memory, work, h=h, first=first, every=every
        )
        memory = memory.changed(n_iterations=memory.n_iterations + motion.n_evaluations)
        if failure is not None and n_steps > 1 and not has_stopped and compiled_system(system).stop_words:
            begun = first + n_good  # an element may stop the run before the failure: go on output by output to find it
            memory, more_rows, more, failure = one_by_one(
                self, system, memory, work, t0=t0, h=h, first=begun, n_steps=n_steps - n_good, every=every
            )
            rows, n_good = [*rows, *more_rows], n_good + more
        return memory, joined_rows(rows), n_good, failure


class Motion:
    """Right side of y' for a system, y = (independent x, independent rates, states, counted coordinates)."""

    def __init__(self, system: System, memory: Memory, t: float) -> None:
        state, w = memory.state, memory.w
        self.compiled: CompiledSystem = compiled_system(system)
        self.parts: SystemTree = tree_of(system)
        self.model, self.tree = self.compiled.model, self.parts.tree
        self.work, self.joints = new_work(self.model), new_joint_work(self.model, self.tree)
        self.tangent = new_tangent_work(self.model, self.tree)
        self.is_mode = self.tree.mode >= 0
        kept = self.tree.kept_row >= 0
        kinds = self.model.rows.kind[kept]
        self.held, self.closed = np.flatnonzero(is_held(kinds)), np.flatnonzero(is_held_position(kinds))
        self.rows = np.flatnonzero(kept)
        self.names = [self.compiled.owners[k] for k in self.rows]
        self.row_size = np.where(is_held_length(kinds), self.compiled.length, 1.0)
        self.groups = groups_of(self.parts)
        self.n_evaluations = 0
        self.p = state.p
        states = self.model.states
        self.n_states, self.own = len(states.row), np.concatenate([states.row, self.model.coordinates.row])
        #: states and counted coordinates, and all connection unknowns, of the last evaluation
        self.z, self.w = w[self.own].copy(), w.copy()
        self.z_size = np.concatenate([states.size, np.full(len(self.own) - self.n_states, np.inf)])
        self.work.states.kappa[:], self.work.states.rho[...] = 0.0, 1.0
        own_equations = any(each.law.multipliers for each in self.compiled.laws)
        self.rotations = FollowedRotations(self.model, self.work, t, memory)
        self.is_linear = not (self.n_states or has_normal_friction(self.model) or own_equations)
        self.begin(state, t)

    def begin(self, state: State, t: float) -> None:
        """Set the increments to zero at a state, and choose the independent coordinates there."""
        from floatframe.engine.tree.kernels.entry import motion_of_joints

        set_iterate(self.work, state)
        motion_of_joints(self.model, self.work, self.tree, self.joints)
        self.joints.d_start[:], self.joints.Q_start[:] = self.joints.d, self.joints.Q
        self.t_start, self.q_start = t, state.q.copy()
        self.x = np.zeros(len(self.tree.slot))
        self.rates = self.values(state.u, self.joints.rate)
        self.constrain(t, self.x, self.rates, by_increments=False)
        C, sizes = self.tangent.C, np.where(self.is_mode, 1e-3, self.sizes())
        self.of_places = partition_of(C[self.closed], tuple(self.names[k] for k in self.closed), sizes)
        self.of_rates = partition_of(C[self.held], tuple(self.names[k] for k in self.held), sizes)

    def sizes(self) -> Array:
        """Typical sizes of coordinates: the system length, or one radian."""
        units = np.array([self.compiled.length if each.unit == "m" else 1.0 for each in self.parts.columns] or [1.0])
        return np.where(self.is_mode, 1.0, units[np.maximum(self.tree.column, 0)])

    def values(self, of_bodies: Array, of_columns: Array) -> Array:
        """Return the values of all unknowns, (n_s,)."""
        columns = np.append(of_columns, 0.0)[self.tree.column]
        return np.where(self.is_mode, of_bodies[self.tree.slot], columns)

    def put(self, t: float, x: Array, rates: Array) -> None:
        """Write increments and rates; prescribed coordinates follow their functions."""
        tree, joints, state = self.tree, self.joints, self.work.state
        state.time[...] = t
        state.w[:] = 0.0
        state.w[self.own] = self.z  # counted angles take the values nearest to z
        self.work.states.base[:] = self.z[: self.n_states]
        joints.x[tree.column[~self.is_mode]] = x[~self.is_mode]
        joints.rate[tree.column[~self.is_mode]] = rates[~self.is_mode]
        joints.acceleration[:] = 0.0
        for k, motion in enumerate(self.parts.motions):
            if motion is not None:
                joints.x[k] = tree.factor[k] * (motion(t) - motion(self.t_start))
                joints.rate[k], joints.acceleration[k] = (tree.factor[k] * motion(t, order) for order in (1, 2))
        modes = self.is_mode
        state.q[tree.mode[modes]] = self.q_start[tree.mode[modes]] + x[modes]
        state.u[tree.slot[modes]] = rates[modes]
        state.u_dot[tree.slot[modes]] = 0.0

    def constrain(self, t: float, x: Array, rates: Array, *, by_increments: bool) -> None:
        """Write the constraints, their rates and their Jacobian C."""
        from floatframe.engine.tree.kernels.entry import constraints

        self.put(t, x, rates)
        constraints(self.model, self.work, self.tree, self.joints, self.tangent, by_increments=by_increments)
        raise_errors_of(self.compiled.callbacks)

    def closed_at(self, t: float, y: Array) -> tuple[Array, Array]:
        """(2): return increments and rates of all unknowns for given independent ones."""
        places, speeds = self.of_places, self.of_rates
        n, m = len(places.independent), len(y) - len(self.own)
        x, rates, self.z = self.x.copy(), np.zeros_like(self.x), y[m:].copy()
        x[places.independent], rates[speeds.independent] = y[:n], y[n:m]
        for _ in range(MOST if len(places.dependent) else 0):
            self.constrain(t, x, rates, by_increments=True)
            g = self.work.connections.g[self.rows[self.closed]]
            if np.abs(g / self.row_size[self.closed]).max() <= CLOSED:
                break
            step = places.solved(self.tangent.C[self.closed], -g)
            x[places.dependent] += step
            if np.abs(step).max() <= CLOSED:
                break
        else:
            if len(places.dependent):
                raise ModelError(
                    f"the loops of {', '.join(dict.fromkeys(self.names[k] for k in self.closed))} cannot be closed at "
                    f"t = {t:.9g}; look for a singular position or a drive out of reach"
                )
        if len(speeds.dependent):
            self.constrain(t, x, rates, by_increments=False)
            rates[speeds.dependent] = speeds.solved(
                self.tangent.C[self.held], -self.work.connections.rate[self.rows[self.held]]
            )
        self.x = x
        return x, rates

    def derivative(self, t: float, y: Array) -> Array:
        """Return the rate y' of y."""
        x, rates = self.closed_at(t, y)
        accelerations = self.accelerations(t, x, rates)
        x_dot = rates.copy()
        for columns in self.groups:
            x_dot[columns] = np.linalg.solve(right_jacobian(x[columns]), rates[columns])
        z_dot = self.work.state.w[self.own + 1]
        return np.concatenate([x_dot[self.of_places.independent], accelerations[self.of_rates.independent], z_dot])

    def accelerations(self, t: float, x: Array, rates: Array) -> Array:
        """(3): return accelerations of all unknowns; write the motion of bodies and the wrenches."""
        from floatframe.engine.tree.kernels.entry import accelerations

        self.n_evaluations += 1
        self.put(t, x, rates)
        if not self.is_linear:
            self.work.state.w[self.rows] = self.w[self.rows]
            self.work.state.w[self.own] = self.z
        for _ in range(1 if self.is_linear else MOST):
            if not accelerations(self.model, self.work, self.tree, self.joints, self.tangent):
                # if a mode has no mass, this raises an error with its name
                central_bodies(self.model, self.compiled.body_names, "RelativeOde")
                raise ModelError(
                    f"the equations of motion are singular at t = {t:.9g}: a mode or a coordinate without mass, or "
                    "constraints that depend on each other; use GeneralizedAlpha for modes without mass"
                )
            raise_errors_of(self.compiled.callbacks)
            found = self.tangent.step.copy()
            change = np.abs(self.tangent.mu).max(initial=0.0)
            if change <= SETTLED * np.abs(self.work.state.w[self.rows]).max(initial=0.0):
                break
            if not self.is_linear:  # evaluate again at the positions of x, with the new wrenches
                w = self.work.state.w.copy()
                self.put(t, x, rates)
                self.work.state.w[self.rows] = w[self.rows]
        else:
            if not self.is_linear:
                raise ModelError(
                    f"reactions, friction and multipliers of elements did not converge at t = {t:.9g}: their equations "
                    "have no solution near by, or several; use GeneralizedAlpha"
                )
        if self.rotations.has_changed(t):
            return self.accelerations(t, x, rates)
        self.w = self.work.state.w.copy()
        return found

    def outputs(self, method: RelativeOde, times: Array) -> Iterator[tuple[float, State, Array, Array]]:
        """Yield time, state, u_dot and w at all times except the first."""
        from scipy.integrate import solve_ivp

        k, stretches = 1, [Stretch(times[-1])]
        is_watched, other = has_gaps(self.compiled), new_work(self.model)
        while k < len(times):
            end, most = stretches.pop(0) if stretches else Stretch(times[-1])
            end = min(end, times[-1])
            own = self.x[self.of_places.independent], self.rates[self.of_rates.independent]
            y, n_own = np.concatenate([*own, self.z]), len(own[0]) + len(own[1])
            atol = np.minimum(method.atol * np.concatenate([np.ones(n_own), self.z_size]), COUNTED)
            begun = self.t_start, self.rotations.angle.copy(), self.rotations.rate.copy()
            solution = solve_ivp(
                self.derivative, (self.t_start, end), y, method=method.method, rtol=method.rtol, atol=atol,
                t_eval=times[k:][times[k:] <= end], events=self.events(), max_step=most, dense_output=is_watched,
            )  # fmt: skip
            t, y_at, found = self.before_contact(solution, other) if is_watched else (end, y, [])
            self.rotations.begin(*begun)
            for at, y_then in zip(solution.t, np.transpose(solution.y), strict=True) if len(solution.t) else ():
                if at > t:
                    break
                yield (float(at), *self.state_at(float(at), y_then))
                k += 1
            if found:
                stretches = found
            elif solution.status < 0:
                raise ModelError(solution.message)
            elif solution.status == 1:  # rotations are large, or the choice of coordinates has become unsuitable
                t = float(max(events[-1] for events in solution.t_events if len(events)))
                y_at = next(found[-1] for found in solution.y_events if len(found))
                stretches = [Stretch(end, most), *stretches]
            if k < len(times):
                state, _, _ = self.state_at(t, y_at)
                self.begin(state, t)

    def before_contact(self, solution: Any, work: Work) -> tuple[float, Array, list[Stretch]]:
        """Return time and y at the start of the first step that misses a contact, and the next parts of the motion.

        If no step misses a contact, return time and y at the end, and no parts.
        """

        def gaps(t: float, y: Array) -> Array:
            state, _, w = self.state_at(t, y)
            return gaps_at(self.compiled, work, t, state, w)

        for a, b in pairwise(solution.sol.ts):
            y = solution.sol(np.array([a, b])).T
            rates = np.array([self.derivative(a, y[0]), self.derivative(b, y[1])])
            found = stretches_of_passed_contact(gaps, float(a), float(b), y, rates)
            if found:
                return float(a), y[0], found
        end = float(solution.sol.ts[-1])
        return end, solution.sol(end), []

    def events(self) -> Sequence[Callable[[float, Array], float]]:
        """Return functions of (t, y) that end a part of the motion when they cross zero."""

        def far(t: float, y: Array) -> float:
            x, _ = self.closed_at(t, y)
            return max(float(np.linalg.norm(x[columns])) for columns in self.groups) - TURN

        def worn(t: float, y: Array) -> float:
            x, rates = self.closed_at(t, y)
            self.constrain(t, x, rates, by_increments=False)
            return 1.0 if self.of_rates.is_worn(self.tangent.C[self.held]) else -1.0

        chosen = ([far] if self.groups else []) + ([worn] if len(self.held) else [])
        for each in chosen:
            each.terminal, each.direction = True, 1.0  # type: ignore[attr-defined]
        return chosen

    def state_at(self, t: float, y: Array) -> tuple[State, Array, Array]:
        """Return state, accelerations and wrenches, including tree reactions, for a solution y."""
        from floatframe.engine.tree.kernels.entry import projected

        x, rates = self.closed_at(t, y)
        self.accelerations(t, x, rates)
        projected(self.model, self.work, self.tree, self.joints)
        state = self.work.state
        p = euler_parameters(state.R)
        p *= np.where((p * self.p).sum(axis=1) < 0.0, -1.0, 1.0)[:, None]  # the sign that makes p continuous
        self.p = p
        return State(state.r, p, state.q, state.u), state.u_dot.copy(), state.w.copy()


def groups_of(parts: SystemTree) -> list[Array]:
    """Return the three unknowns of each rotation group."""
    tree = parts.tree
    groups = []
    for i in range(len(tree.parent)):
        turning = [
            int(tree.unknown[k])
            for k in range(tree.column0[i], tree.column0[i + 1])
            if tree.side[k] and tree.alpha[k].any()
        ]
        if len(turning) == 3:
            groups.append(np.array(turning))
    return groups


# independent coordinates of closed loops: partitioning by pivoted LU, exact solution of the constraints ---------------
# C is the derivative of the constraints by the coordinates, with columns scaled by typical sizes of the coordinates. LU
# with pivoting over the columns of C finds the dependent coordinates, as many as there are constraints; the others are
# independent. The partition is kept while the solution is well conditioned, and is then computed again, see
# docs/relative.md §7.


RANK = 1e-9  #: ratio to the largest pivot below which a pivot counts as zero
WORSE = 1e3  #: growth of the solution above which a new partition is chosen


@dataclass(frozen=True, eq=False)
class Partition:
    """The partition into dependent and independent coordinates."""

    dependent: IntArray  #: indices of the dependent coordinates, (n_c,)
    independent: IntArray  #: indices of the independent coordinates, (n - n_c,)
    #: largest derivative of a dependent by an independent coordinate at the time of partition, at least 1
    growth: float

    def solved(self, C: Array, right: Array) -> Array:
        """Return the solution y of C_d y = right for the dependent coordinates."""
        return np.asarray(lu_solve(lu_factor(C[:, self.dependent]), right)) if len(self.dependent) else np.zeros(0)

    def is_worn(self, C: Array) -> bool:
        """Whether dependent coordinates now depend much more strongly on the others than at the time of partition."""
        return bool(len(self.dependent)) and growth(C, self.dependent, self.independent) > WORSE * self.growth


def growth(C: Array, dependent: IntArray, independent: IntArray) -> float:
    """Return the largest entry of C_d⁻¹ C_i, at least 1; infinite if C_d is singular."""
    if not len(dependent) or not len(independent):
        return 1.0
    try:
        return max(1.0, float(np.abs(np.linalg.solve(C[:, dependent], C[:, independent])).max()))
    except np.linalg.LinAlgError:
        return np.inf


def partition_of(C: Array, names: tuple[str, ...], sizes: Array) -> Partition:
    """Return the partition of coordinates for the constraint Jacobian C, (n_c, n).

    Parameters
    ----------
    C
        Derivative of the constraints by the coordinates.
    names
        Names of the constraints, for messages.
    sizes
        Typical sizes of the coordinates, which scale the columns of C, (n,).

    Raises
    ------
    ModelError
        If constraints depend on each other: in a singular position, or always.
    """
    n_c, n = C.shape
    if n_c > n:
        raise ModelError(f"{', '.join(dict.fromkeys(names))}: {n_c} constraints, but only {n} coordinates to constrain")
    left = (C * sizes).copy()
    size = np.abs(left).max(axis=1, initial=0.0, keepdims=True)
    if n_c and not size.all():
        raise ModelError(f"joint {names[int(np.argmin(size))]!r} holds what cannot move")
    left = left / size if n_c else left
    dependent: list[int] = []
    for k in range(n_c):  # eliminate row by row, with the largest of all remaining entries as pivot
        rest = np.abs(left[k:])
        row, column = divmod(int(np.argmax(rest)), n)
        if rest[row, column] <= RANK:
            named = ", ".join(repr(name) for name in dict.fromkeys(names))
            raise ModelError(
                f"{n_c - k} of {n_c} constraints of {named} repeat others here: a singular position, or constraints "
                "that are redundant; begin in another position, or replace a joint by one with fewer constraints"
            )
        left[[k, k + row]] = left[[k + row, k]]
        dependent.append(column)
        factors = left[k + 1 :, column] / left[k, column]
        left[k + 1 :] -= np.outer(factors, left[k])
    free = np.setdiff1d(np.arange(n), dependent)
    chosen = np.array(sorted(dependent), dtype=np.int64)
    return Partition(chosen, free, growth(C, chosen, free))
