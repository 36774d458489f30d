"""SUNDIALS IDA on the index-reduced equations: a method of another kind, for cross-checks.

Evaluated in `floatframe.engine.kernels.evaluation`.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.system import CompiledSystem, compiled_system
from floatframe.engine.initial_conditions.gaps import gaps_at, has_gaps
from floatframe.engine.initial_conditions.initial import (
    assembled,
    consistent_motion,
    solve_accelerations,
    with_compatible_velocities,
)
from floatframe.engine.kernels.memory import WORK_GIVEN, WORK_TAKEN, Memory, Rows, memory_at, new_rows
from floatframe.engine.kernels.model import COUPLER, USER_FORCE
from floatframe.engine.kernels.work import Work, new_work
from floatframe.errors import FloatframeError, ModelError
from floatframe.integrators.integrator import (
    Failure,
    FollowedRotations,
    joined_rows,
    observed,
    observed_unless_stopped,
    one_step_of,
    started_anew,
    turned_on,
    with_angles,
)
from floatframe.integrators.passed_contacts import Stretch, stretches_of_passed_contact
from floatframe.integrators.remembered_contacts import require_no_remembered_contacts
from floatframe.model.rotations import euler_parameter_rates
from floatframe.model.state import State
from floatframe.model.system import System

__all__ = ["Ida"]

MOST_STEPS = 100_000  #: between two outputs


@dataclass(frozen=True)
class Ida:
    """Backward differentiation of orders one to five with variable steps: SUNDIALS IDA [1]_, through scikit-sundae.

    Joints enter by their second derivatives: accelerations and reactions follow from the state by one linear system
    (index one), y' = (v, p * omega / 2, q_dot, u_dot(t, y)). At the end of each batch of steps, and in every output,
    the state is put back on the joints with the least motion, positions first, then velocities. It is for checks of
    the other methods: slow, and its energy falls or rises with the tolerances. Work and dissipation in the results
    are summed by the trapezoidal rule over the outputs, and `stops` of elements looked at there.

    Needs the extra `ida`: pip install "floatframe[ida]".

    Parameters
    ----------
    rtol
        Relative tolerance of a step.
    atol
        Absolute tolerance of a step, in the units of the system.

    References
    ----------
    .. [1] Hindmarsh et al. (2005), ACM Transactions on Mathematical Software 31, 363-396.
    """

    rtol: float = 1e-8
    atol: float = 1e-10

    def __post_init__(self) -> None:
        for name in ("rtol", "atol"):
            if not 0.0 < getattr(self, name) < 1.0:
                raise ModelError(f"Ida: {name}: expected a number between 0 and 1, got {getattr(self, name)}")

    def start(self, system: System, t: float, state: State | None = None, before: Memory | None = None) -> Memory:
        """Return the memory at the beginning, from a consistent state."""
        solver_class()
        compiled = compiled_system(system)
        for c, name in enumerate(compiled.connection_names):
            if compiled.model.connections.law[c] in (COUPLER, USER_FORCE):
                raise ModelError(f"Ida: {name!r} has a memory of its own, which this scheme does not know; use another")
        for each in compiled.laws:
            if each.law.states or each.law.multipliers:
                raise ModelError(
                    f"Ida: element {each.element.name!r} has states or multipliers of its own, which this scheme does "
                    "not know; use GeneralizedAlpha"
                )
        require_no_remembered_contacts(compiled, "Ida")
        made = consistent_motion(system, state, t=t, angle=None if before is None else before.angle)
        memory = memory_at(made.state, made.u_dot, made.w, np.zeros(0))
        return with_angles(system, t, memory, before, state)

    def after_jump(self, system: System, t: float, memory: Memory, work: Work) -> tuple[Memory, Rows]:
        """Return the memory after a jump of forces at t, and the results there."""
        return started_anew(self, system, t, memory, work)

    def step(self, system: System, t: float, h: float, memory: Memory) -> Memory:
        """Return the memory a time h later; `ConvergenceError` if it fails."""
        return one_step_of(self, system, t, h, memory)

    def observe(self, system: System, t: float, memory: Memory, work: Work) -> tuple[Memory, Rows]:
        """Return the memory with the power at its state, and the results there."""
        work.state.time[...] = t
        return observed(system, t, memory, work)

    def advance(
        self, system: System, memory: Memory, work: Work, *, t0: float, h: float, first: int, n_steps: int, every: int
    ) -> tuple[Memory, Rows, int, Failure | None]:
        """Advance by n_steps output times, the first of them number `first` from t0; see `integrator.Integrator`."""
        compiled = compiled_system(system)
        own = new_work(compiled.model)
        t: Array = t0 + h * np.arange(first, first + n_steps + 1, dtype=float)
        made = Motion(compiled, own)
        made.rotations = FollowedRotations(compiled.model, own, float(t[0]), memory)
        solution = self.solved_past_contacts if has_gaps(compiled) else self.solved
        reached, message = solution(made, t, flattened(memory.state))
        rows, n_good, failure, has_stopped = [new_rows(compiled.model, 0)], 0, None, False
        made.rotations = FollowedRotations(compiled.model, own, float(t[0]), memory)
        for k, (at, y) in enumerate(reached, start=first + 1):
            if not np.isfinite(y).all() or abs(at - t[k - first]) > 1e-9 * h:  # it may end before its failure
                break
            own.state.time[...] = t[k - first]
            own.counted.no_number[...] = 0  # of a trial beyond
            state = assembled(compiled, own, state_of(compiled, y))
            state = with_compatible_velocities(compiled, own, state)
            u_dot, w = made.accelerations(t[k - first], state)
            after = memory.changed(state=state, u_dot=u_dot, w=w, h=h, n_steps=memory.n_steps + 1)
            after = turned_on(system, after, h)
            after, row, failure = observed_unless_stopped(system, float(t[k - first]), after, work)
            has_stopped = failure is not None
            if has_stopped:
                break
            memory = after.changed(work=memory.work + 0.5 * h * (memory.power + after.power))
            row.diagnostics[0, [WORK_GIVEN, WORK_TAKEN]] = memory.work
            if k % every == 0:
                rows.append(row)
            n_good += 1
        if n_good < n_steps and not has_stopped:
            failure = Failure(f"IDA: {made.problem or message}", np.inf)
        memory = memory.changed(n_iterations=memory.n_iterations + made.n_evaluations)
        return memory, joined_rows(rows), n_good, failure

    def solved(self, made: "Motion", t: Array, y_0: Array) -> tuple[list[tuple[float, Array]], str]:
        """Return times and y at all times but the first, as far as the solver gets, and its message."""
        solver = self.solver(made)
        # with two times, every step is returned
        asked = t if len(t) > 2 else np.array([t[0], 0.5 * (t[0] + t[1]), t[1]])
        solution = solver.solve(asked, y_0, made.rates(float(t[0]), y_0))
        reached = zip(np.atleast_1d(solution.t), np.atleast_2d(solution.y), strict=True)
        return list(reached)[len(asked) - len(t) + 1 :], solution.message

    def solved_past_contacts(self, made: "Motion", t: Array, y_0: Array) -> tuple[list[tuple[float, Array]], str]:
        """Return the same for a system with contacts, step by step, so that none of them is missed."""
        compiled, work = made.compiled, new_work(made.compiled.model)

        def gaps(at: float, y: Array) -> Array:
            return gaps_at(compiled, work, at, state_of(compiled, y), np.zeros(len(work.state.w)))

        reached: list[tuple[float, Array]] = []
        begin, y, rates, stretches = float(t[0]), y_0, made.rates(float(t[0]), y_0), [Stretch(t[-1])]
        while len(reached) < len(t) - 1:
            until, most = stretches.pop(0) if stretches else Stretch(t[-1])
            until = min(until, t[-1])
            solver = self.solver(made, max_step=most if np.isfinite(most) else 0.0)
            solver.init_step(begin, y, rates)
            while begin < until:
                result = solver.step(until, method="onestep", tstop=until)
                if not result.success:
                    return reached, result.message
                end = float(result.t)
                if end <= begin:  # after outputs within a step, its end is returned once more
                    continue
                both = np.array([y, result.y]), np.array([rates, result.yp])
                found = stretches_of_passed_contact(gaps, begin, end, *both)
                if found:
                    stretches = found
                    break
                for time in t[1 + len(reached) :][t[1 + len(reached) :] <= end]:
                    reached.append((float(time), np.array(solver.step(time, method="normal").y)))
                begin, y, rates = end, result.y, result.yp
        return reached, ""

    def solver(self, made: "Motion", **options: float) -> Any:
        """Return a solver of the residual of a motion."""
        return solver_class()(
            made.residual, rtol=self.rtol, atol=self.atol, max_num_steps=MOST_STEPS, linsolver="dense", **options
        )


def solver_class():
    """Return the class of the solver; `ModelError` naming the extra if it is not installed."""
    try:
        from sksundae.ida import IDA
    except ImportError as error:
        raise ModelError(
            'Ida: needs SUNDIALS through scikit-sundae, which is not installed; pip install "floatframe[ida]"'
        ) from error
    return IDA


def flattened(state: State) -> Array:
    """Return (r, p, q, u) as one vector."""
    return np.concatenate([state.r.ravel(), state.p.ravel(), state.q, state.u])


def state_of(compiled: CompiledSystem, y: Array) -> State:
    """Return the state of a vector, with normalised Euler parameters."""
    n_b, n_q = len(compiled.model.bodies.kind), int(compiled.model.bodies.q0[-1])
    r, p, q, u = np.split(np.array(y), [3 * n_b, 7 * n_b, 7 * n_b + n_q])
    p = p.reshape(n_b, 4)
    return State(r.reshape(n_b, 3), p / np.linalg.norm(p, axis=1, keepdims=True), q, u)


class Motion:
    """The rates of a system, with a count; errors are stored, because they cannot pass through the solver."""

    rotations: FollowedRotations  #: of bushings

    def __init__(self, compiled: CompiledSystem, work: Work) -> None:
        self.compiled, self.work = compiled, work
        self.n_evaluations, self.problem = 0, ""

    def accelerations(self, t: float, state: State) -> tuple[Array, Array]:
        """Return accelerations and wrenches at a state."""
        found = solve_accelerations(self.compiled, self.work, state)
        return solve_accelerations(self.compiled, self.work, state) if self.rotations.has_changed(t) else found

    def rates(self, t: float, y: Array) -> Array:
        """Return y'."""
        model = self.compiled.model
        state = state_of(self.compiled, y)
        self.work.state.time[...] = t
        u_dot, _ = self.accelerations(t, state)
        self.n_evaluations += 1
        starts = model.bodies.u0[:-1]
        r_dot = [state.u[k : k + 3] for k in starts]
        p_dot = [euler_parameter_rates(p, state.u[k + 3 : k + 6]) for p, k in zip(state.p, starts, strict=True)]
        q_dot = [state.u[model.bodies.u0[i] + 6 : model.bodies.u0[i + 1]] for i in range(len(starts))]
        return np.concatenate([*r_dot, *p_dot, *q_dot, u_dot])

    def residual(self, t: float, y: Array, y_dot: Array, result: Array) -> None:
        """Write y' minus the rates at y."""
        try:
            result[:] = y_dot - self.rates(t, y)
        except (FloatframeError, RuntimeError, ValueError) as error:
            self.problem = self.problem or str(error)
            result[:] = np.nan
